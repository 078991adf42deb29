"""Columns as numpy, Arrow and pandas."""

import json
import subprocess
import sys

import numpy as np
import pytest

from attlog.schemas import Channel, Columns, Field, MessageType
from attlog.schemas.messages import LOG, NAV_SAT_FIX, TF_MESSAGE
from attlog.schemas.passthrough import SourceField, generated_type
from attlog.schemas.unified import attitude_columns, imu_columns
from attlog.schemas.units import unit_of


def _imu() -> Columns:
    values = np.arange(30.0).reshape(10, 3)
    return imu_columns("/imu0/data_raw", np.arange(10) * 10**7, values, -values, source="test")


def test_nested_fields_are_dotted() -> None:
    imu = _imu()
    frame = imu.to_pandas()
    assert frame.index.name == "time_ns"
    assert frame["angular_velocity.y"].tolist() == imu.data["angular_velocity"]["y"].tolist()
    assert frame["orientation_covariance[0]"].tolist() == [-1.0] * 10
    assert frame.attrs["units"]["linear_acceleration.z"] == "m/s^2"
    table = imu.to_arrow()
    assert table.schema.field("angular_velocity.x").metadata == {b"unit": b"rad/s"}
    assert json.loads(table.schema.metadata[b"attlog.channel"]) == {"source": "test"}
    assert table.schema.metadata[b"attlog.topic"] == b"/imu0/data_raw"
    plain = imu.to_numpy()
    assert (plain["linear_acceleration.x"] == imu.data["linear_acceleration"]["x"]).all()
    assert (plain["time_ns"] == imu.time_ns).all()


def test_texts_are_text_and_long_arrays_are_lists() -> None:
    kind = MessageType("a_msgs/msg/A", (Field("name", "string"), Field("blob", "uint8", 0), Field("few", "int16", 2)))
    data = np.zeros(2, kind.dtype({"name": 4, "blob": 100}))
    data["name"] = ["ä".encode(), b""]
    data["few"] = [[1, 2], [3, 4]]
    data["blob"] = 7
    table = Columns(Channel("/a", kind), np.arange(2), data).to_arrow()
    assert table["name"].to_pylist() == ["ä", ""]
    assert table["blob"].to_pylist() == [[7] * 100] * 2
    assert table["few[1]"].to_pylist() == [2, 4]


def test_sequences_of_different_lengths_are_lists_and_of_messages_json() -> None:
    kind = MessageType("a_msgs/msg/A", (Field("values", "float64", 0), Field("parts", TF_MESSAGE, 0)))
    data = np.zeros(2, [("values", object), ("parts", object)])
    data["values"] = [np.array([1.0]), np.array([2.0, 3.0])]
    part = np.zeros(1, [("x", "f8"), ("name", "S3")])
    part["name"] = b"abc"
    data["parts"] = [part, part[:0]]
    columns = Columns(Channel("/a", kind), np.arange(2), data)
    assert columns.to_arrow()["values"].to_pylist() == [[1.0], [2.0, 3.0]]
    assert columns.to_arrow()["parts"].to_pylist() == ['[{"x": 0.0, "name": "abc"}]', "[]"]
    assert columns.to_pandas()["values"].tolist() == [[1.0], [2.0, 3.0]]


def test_big_endian_and_strided_columns_become_native() -> None:
    data = np.zeros(5, [("level", ">u4"), ("line", "<u4")])
    data["level"] = np.arange(5)
    table = Columns(Channel("/l", LOG), np.arange(5), data).to_arrow()
    assert table["level"].to_pylist() == [0, 1, 2, 3, 4]


@pytest.mark.parametrize(
    ("message", "field", "unit"),
    [
        (NAV_SAT_FIX, "latitude", "deg"),
        (generated_type("m", "GPS", [SourceField("Lat", "int32", unit="deg", multiplier=1e-7)]), "lat", "1e-07 deg"),
        (generated_type("m", "GPS", [SourceField("TimeUS", "uint64", unit="us")]), "timeus", "us"),
        (generated_type("m", "GPS", [SourceField("Status", "uint8")]), "status", ""),
        (generated_type("m", "V", [SourceField("M", "uint8", description="s of the thing")]), "m", ""),
    ],
)
def test_units(message: MessageType, field: str, unit: str) -> None:
    assert unit_of(message, message[field]) == unit


def test_units_of_attitudes() -> None:
    turn = np.tile([0.0, 0.0, 0.0, 1.0], (2, 1))
    columns = attitude_columns("/r", np.arange(2), turn, child_frame_id="c", source="s")
    assert columns.to_arrow().schema.field("rpy_ned_deg[2]").metadata == {b"unit": b"deg"}
    assert columns.to_arrow().schema.field("orientation.x").metadata is None


def test_columns_do_without_pandas_and_arrow_until_asked() -> None:
    code = "import sys, attlog.schemas, attlog.storage; sys.exit(bool({'pandas', 'pyarrow'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
