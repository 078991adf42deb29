"""The table as text, JSON and Parquet, and the channels of errors."""

import json

import numpy as np
import pyarrow.parquet as pq
import pytest

from attlog.analysis import COMPONENTS, ErrorTable, attitude_error, error_columns
from attlog.geometry.frames import orientation_from_rpy_ned, turn_heading
from attlog.schemas import Attitude, StorageError

STAMPS = np.arange(40, dtype=np.int64) * 50_000_000


def attitude(name, topic, yaw_deg=0.0, **metadata):
    t = STAMPS * 1e-9
    rpy = np.stack([0.3 * np.sin(t), 0.2 * np.cos(t), t], axis=-1)
    orientation = turn_heading(orientation_from_rpy_ned(rpy), np.radians(yaw_deg))
    return Attitude(STAMPS, orientation, name, topic, metadata)


@pytest.fixture
def truth():
    return attitude("reference", "/reference/attitude")


@pytest.fixture
def table(truth):
    ecf = attitude("ecf", "/estimate/ecf/attitude", 2.0)
    ecf6 = attitude("ecf6", "/estimate/ecf6/attitude", 30.0, north="arbitrary")
    errors = [attitude_error(ecf, truth, exclude=[(0, 200_000_000)]), attitude_error(ecf6, truth)]
    return ErrorTable.from_errors(errors, "flight.mcap")


def test_text_says_what_against_what_and_what_was_removed(table):
    text = table.to_text()
    assert text.splitlines()[0] == "flight.mcap: error against /reference/attitude, degrees"
    assert text.splitlines()[1].split() == ["estimate", *COMPONENTS, "samples"]
    assert text.splitlines()[2].split() == ["ecf", "RMSE", "2.00", "0.00", "2.00", "0.00", "0.00", "2.00", "36"]
    assert "ecf: 4 of 40 samples do not count: 4 excluded" in text
    assert "ecf6: removed a constant yaw of 30.00 deg, since its heading counts from an arbitrary north" in text
    assert max(map(len, text.splitlines())) <= 120


def test_against_another_estimate_it_is_a_difference():
    att = attitude("att", "/onboard/att/attitude")
    error = attitude_error(attitude("ecf", "/estimate/ecf/attitude", 1.0), att, alignment="full")
    text = ErrorTable.from_errors({"ecf": error}).to_text()
    assert text.startswith("difference from att (/onboard/att/attitude), degrees")
    assert "error" not in text
    assert "removed constant rotations of" in text


def test_vehicle_prefix_keeps_the_truth_the_truth():
    truth = attitude("reference", "/vehicle51/reference/attitude")
    table = ErrorTable.from_errors([attitude_error(attitude("ecf", "/vehicle51/estimate/ecf/attitude"), truth)])
    assert table["ecf"].quantity == "error"


def test_no_samples_print_as_dashes_and_null(truth):
    late = Attitude(STAMPS + 10**12, truth.orientation, "late", "/estimate/late/attitude")
    table = ErrorTable.from_errors([attitude_error(late, truth)])
    assert " - " in table.to_text()
    assert "40 of 40 samples do not count: 40 without reference" in table.to_text()
    assert json.loads(table.to_json())[0]["statistics"]["roll"]["rmse"] is None


def test_json_holds_every_number(table):
    rows = json.loads(table.to_json())
    assert [row["name"] for row in rows] == ["ecf", "ecf6"]
    assert rows[0]["statistics"]["heading"]["mean"] == pytest.approx(2.0)
    assert rows[0]["counts"]["excluded"] == 4
    assert rows[0]["quantity"] == "error"
    assert rows[1]["alignment"] == {"alignment": "yaw", "removed_heading_deg": "30"}


def test_parquet_one_record_per_component_with_provenance(table, tmp_path, truth):
    path = tmp_path / "errors.parquet"
    table.to_parquet(path, provenance={"attlog_version": "0.1.0"})
    read = pq.read_table(path)
    assert read.num_rows == 2 * len(COMPONENTS)
    assert read.schema.metadata[b"attlog.attlog_version"] == b"0.1.0"
    assert read.schema.metadata[b"attlog.unit"] == b"deg"
    record = read.to_pylist()[COMPONENTS.index("yaw")]
    assert record["component"] == "yaw"
    assert record["rmse"] == pytest.approx(2.0)
    assert record["reference_sha256"] == truth.sha256
    assert record["counted"] == 36


def test_parquet_is_not_overwritten_unless_told(table, tmp_path):
    path = tmp_path / "errors.parquet"
    path.write_bytes(b"mine")
    with pytest.raises(StorageError, match="--force"):
        table.to_parquet(path)
    assert path.read_bytes() == b"mine"
    table.to_parquet(path, force=True)
    assert pq.read_table(path).num_rows == 12
    with pytest.raises(StorageError, match="cannot be written"):
        table.to_parquet(tmp_path / "nowhere" / "errors.parquet")
    assert [each.name for each in tmp_path.iterdir()] == ["errors.parquet"]


def test_tables_join(table):
    both = ErrorTable.joined([table, table])
    assert both.names == ("ecf", "ecf6", "ecf", "ecf6")
    assert both.to_text().count("flight.mcap") == 1


def test_error_channel_tells_its_origin(truth):
    ecf6 = attitude("ecf6", "/estimate/ecf6/attitude", 30.0, north="arbitrary")
    columns = error_columns(attitude_error(ecf6, truth, exclude=[(0, 100_000_000)]))
    assert columns.channel.topic == "/error/ecf6/attitude"
    assert columns.channel.type.name == "attlog_msgs/msg/AttitudeError"
    assert columns.channel.metadata == {
        "estimate": "/estimate/ecf6/attitude",
        "reference": "/reference/attitude",
        "reference_sha256": truth.sha256,
        "north": "arbitrary",
        "alignment": "yaw",
        "removed_heading_deg": "30",
        "excluded_ns": "0:100000000",
    }
    np.testing.assert_array_equal(columns.time_ns, STAMPS)
    np.testing.assert_array_equal(columns["counted"], STAMPS >= 100_000_000)
    np.testing.assert_allclose(columns["total_deg"], 0, atol=1e-6)
    onboard = error_columns(attitude_error(ecf6, truth), name="onboard_att", prefix="/vehicle3")
    assert onboard.channel.topic == "/vehicle3/error/onboard_att/attitude"
