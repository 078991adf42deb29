"""`export` against the official MCAP reader, scipy and numpy."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from scipy.spatial.transform import Rotation, Slerp

import attlog
from attlog import storage
from attlog.ingest.simulation import SimulatedRun, simulate
from attlog.ingest.simulation.columns import run_columns
from attlog.schemas import Channel, Columns, StorageError, UsageError
from attlog.schemas.messages import LOG


@pytest.fixture(scope="module")
def flown() -> SimulatedRun:
    return simulate("flight", 2)


@pytest.fixture(scope="module")
def log_path(flown: SimulatedRun, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A simulated log with notes, and a gap in the IMU from the 500th to the 600th sample."""
    path = tmp_path_factory.mktemp("log") / "flight.mcap"
    columns = list(run_columns(flown))
    keep = np.ones(len(columns[0]), dtype=bool)
    keep[500:600] = False
    columns[0] = columns[0].select(keep)
    data = np.zeros(3, [("level", "u1"), ("msg", "S9")])
    data["msg"] = [b"rest", "flug ü".encode(), b""]
    data["level"] = [10, 20, 30]
    stamps = flown.imu.time_ns[[10, 1000, 3000]]
    columns.append(Columns(Channel("/annotations", LOG), stamps, data))
    storage.write(path, columns, metadata={"source": {"name": "flight 2", "sha256": "ab"}})
    return path


def _leaves(value: Any, name: str = "") -> dict[str, Any]:
    if hasattr(value, "__slots__"):
        found = {}
        for slot in value.__slots__:
            found |= _leaves(getattr(value, slot), f"{name}.{slot}" if name else slot)
        return found
    if isinstance(value, list | tuple | np.ndarray):
        return {f"{name}[{number}]": item for number, item in enumerate(value)}
    return {name: value}


def _official(path: Path) -> dict[str, pd.DataFrame]:
    rows: dict[str, list[dict[str, Any]]] = {}
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            rows.setdefault(channel.topic, []).append({"time_ns": message.log_time, **_leaves(decoded)})
    return {topic: pd.DataFrame(values) for topic, values in rows.items()}


@pytest.mark.parametrize("format", ["parquet", "csv"])
def test_the_files_hold_what_the_official_reader_reads(format: str, log_path: Path, tmp_path: Path) -> None:
    done = attlog.export(log_path, tmp_path / "out", format=format)
    expected = _official(log_path)
    assert {file.topic for file in done.files} == set(expected)
    for file in done.files:
        if format == "parquet":
            frame = pq.read_table(file.path).to_pandas()
        else:
            frame = pd.read_csv(file.path, keep_default_na=False, na_values=["nan"])
            frame.columns = [name.split(" [")[0] for name in frame.columns]
        wanted = expected[file.topic]
        assert list(frame.columns) == list(wanted.columns)
        for name in wanted.columns:
            assert np.array_equal(
                frame[name].to_numpy(), wanted[name].to_numpy(), equal_nan=wanted[name].dtype.kind == "f"
            ), name


def test_units_and_provenance_are_in_the_schema(log_path: Path, tmp_path: Path) -> None:
    attlog.export(log_path, tmp_path, topics=["/imu*"])
    (path,) = tmp_path.glob("*.parquet")
    schema = pq.read_schema(path)
    assert schema.field("angular_velocity.z").metadata[b"unit"] == b"rad/s"
    about = {key: value.decode() for key, value in (schema.metadata or {}).items()}
    assert about[b"attlog.type"] == "sensor_msgs/msg/Imu"
    assert json.loads(about[b"attlog.source"])["name"] == "flight 2"
    assert json.loads(about[b"attlog.channel"])["source"] == "simulation"
    assert about[b"attlog.software"].startswith("attlog ")


def test_the_header_of_a_csv_names_units(log_path: Path, tmp_path: Path) -> None:
    attlog.export(log_path, tmp_path, format="csv", topics=["/mag0/field"])
    header = (tmp_path / "mag0.field.csv").read_text().splitlines()[0]
    assert '"magnetic_field.x [T]"' in header


def test_a_span_of_time(log_path: Path, tmp_path: Path, flown: SimulatedRun) -> None:
    attlog.export(log_path, tmp_path, topics=["/reference/*"], start=10.0, end=20.0)
    stamps = pq.read_table(tmp_path / "reference.attitude.parquet")["time_ns"].to_numpy()
    first = int(flown.imu.time_ns[0])
    known = flown.reference.time_ns
    assert stamps.tolist() == known[(known >= first + 10 * 10**9) & (known < first + 20 * 10**9)].tolist()


def test_resampling_against_scipy_and_numpy(log_path: Path, tmp_path: Path, flown: SimulatedRun) -> None:
    attlog.export(log_path, tmp_path, resample="/mag0/field", start=1.0, end=80.0)
    tables = {path.stem: pq.read_table(path) for path in tmp_path.glob("*.parquet")}
    stamps = tables["mag0.field"]["time_ns"].to_numpy()
    assert all((table["time_ns"].to_numpy() == stamps).all() for table in tables.values())
    onboard = tables["onboard.attitude.attitude"]
    turned = np.stack([onboard[f"orientation.{axis}"].to_numpy() for axis in "xyzw"], axis=-1)
    exact = Slerp(flown.onboard.time_ns.astype(float), Rotation.from_quat(flown.onboard.orientation))
    apart = Rotation.from_quat(turned).inv() * exact(stamps.astype(float))
    assert apart.magnitude().max() < 1e-6  # scipy's stamps are doubles: 256 ns
    imu = tables["imu0.data_raw"].to_pandas()
    kept = np.r_[0:500, 600 : len(flown.imu.time_ns)]
    times = flown.imu.time_ns[kept]
    gap = (stamps > flown.imu.time_ns[499]) & (stamps < flown.imu.time_ns[600])
    assert imu["angular_velocity.x"].isna().to_numpy().tolist() == gap.tolist()
    assert imu["header.frame_id"].isna().to_numpy().tolist() == gap.tolist()
    straight = np.interp(stamps - times[0], times - times[0], flown.imu.angular_velocity[kept, 0])
    assert np.abs(imu["angular_velocity.x"].to_numpy()[~gap] - straight[~gap]).max() < 1e-12
    yaw = onboard["rpy_ned_deg[2]"].to_numpy()
    ned = Rotation.from_quat(turned).as_matrix()
    assert np.abs(yaw - np.degrees(np.arctan2(ned[:, 0, 0], ned[:, 1, 0]))).max() < 1e-9


def test_resampling_onto_itself_changes_nothing(log_path: Path, tmp_path: Path) -> None:
    attlog.export(log_path, tmp_path / "a", topics=["/imu0/*"])
    attlog.export(log_path, tmp_path / "b", topics=["/imu0/*"], resample="/imu0/data_raw")
    one, two = (pq.read_table(tmp_path / name / "imu0.data_raw.parquet") for name in "ab")
    assert one.equals(two)


def test_nothing_is_overwritten_unasked_nor_left_half(log_path: Path, tmp_path: Path) -> None:
    attlog.export(log_path, tmp_path, topics=["/mag0/*"])
    before = (tmp_path / "mag0.field.parquet").read_bytes()
    with pytest.raises(StorageError, match="--force"):
        attlog.export(log_path, tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mag0.field.parquet"]
    attlog.export(log_path, tmp_path, topics=["/mag0/*"], end=10.0, force=True)
    assert (tmp_path / "mag0.field.parquet").read_bytes() != before
    with pytest.raises(UsageError, match="no topic matches"):
        attlog.export(log_path, tmp_path / "new", topics=["/none*"])
    assert not (tmp_path / "new").exists()


def test_several_logs_have_a_folder_each(log_path: Path, tmp_path: Path) -> None:
    for name in ("a.mcap", "b.mcap"):
        (tmp_path / name).write_bytes(log_path.read_bytes())
    done = attlog.for_each(attlog.export, [tmp_path], topics=["/mag0/*"], output=tmp_path / "out", jobs=1)
    assert done.exit_code == 0
    assert sorted(path.relative_to(tmp_path).as_posix() for path in tmp_path.glob("out/*/*")) == [
        "out/a/mag0.field.parquet",
        "out/b/mag0.field.parquet",
    ]
    beside = attlog.export(tmp_path / "a.mcap", topics=["/mag0/*"])
    assert Path(beside.files[0].path) == tmp_path / "a" / "mag0.field.parquet"


def test_topics_that_would_share_a_file_do_not(tmp_path: Path) -> None:
    data = np.zeros(1, [("msg", "S1")])
    columns = [Columns(Channel(topic, LOG), np.array([1]), data) for topic in ("/a/b", "/A.b", "/..", "/a b")]
    storage.write(tmp_path / "log.mcap", columns)
    done = attlog.export(tmp_path / "log.mcap", tmp_path / "out")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "A.b.parquet",
        "a.b_2.parquet",
        "a_b.parquet",
        "channel.parquet",
    ]
    assert len({file.path for file in done.files}) == 4


@pytest.mark.parametrize("name", ["rosbag2_cdr_test.mcap", "bagel_part_0.mcap", "foxglove_json_logs.mcap"])
def test_files_of_other_writers(name: str, logs: Path, tmp_path: Path) -> None:
    for format in ("parquet", "csv"):
        done = attlog.export(logs / name, tmp_path / format, format=format)
        assert sum(file.rows for file in done.files) == sum(
            info.count for info in storage.open(logs / name).topics.values()
        )
