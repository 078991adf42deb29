"""Columns: lengths agree, fields answer to both names, unified constructors keep what they are given."""

import numpy as np
import pytest

from attlog.schemas import Channel, Columns, messages
from attlog.schemas.passthrough import SourceField, generated_type
from attlog.schemas.unified import attitude_columns, fix_columns, imu_columns, nested, quaternions, vectors

STAMPS = np.arange(4, dtype=np.int64)


def test_a_field_answers_to_both_names() -> None:
    message = generated_type("dataflash_msgs", "IMU", [SourceField("TimeUS", "uint64"), SourceField("GyrX", "float32")])
    data = np.zeros(4, [("timeus", "u8"), ("gyrx", "f4")])
    data["gyrx"] = [1, 2, 3, 4]
    columns = Columns(Channel("/dataflash/IMU/0", message), STAMPS, data)
    assert columns["GyrX"].tolist() == columns["gyrx"].tolist() == [1, 2, 3, 4]
    with pytest.raises(KeyError, match="timeus, gyrx"):
        columns["GyrZ"]


def test_stamps_and_messages_agree() -> None:
    with pytest.raises(ValueError, match="stamps"):
        Columns(Channel("/x", messages.IMU), STAMPS, np.zeros(3, [("a", "f8")]))


def test_vectors_and_quaternions_come_back() -> None:
    rng = np.random.default_rng(0)
    rate, force = rng.normal(size=(2, 4, 3))
    turn = rng.normal(size=(4, 4))
    imu = imu_columns("/imu0/data_raw", STAMPS, rate, force, source="RAW_IMU")
    assert np.array_equal(vectors(imu.data, "angular_velocity"), rate)
    assert np.array_equal(vectors(imu.data, "linear_acceleration"), force)
    assert imu["orientation_covariance"][:, 0].tolist() == [-1.0] * 4
    attitude = attitude_columns("/onboard/a/attitude", STAMPS, turn, child_frame_id="onboard_a", source="A")
    assert np.array_equal(quaternions(attitude.data), turn)
    assert attitude.channel.texts == {"header.frame_id": "world", "child_frame_id": "onboard_a"}


def test_nested_takes_columns_of_any_memory_order() -> None:
    values = np.asfortranarray(np.arange(12.0).reshape(4, 3))
    assert nested(messages.IMU, "angular_velocity", values)["y"].tolist() == [1.0, 4.0, 7.0, 10.0]


@pytest.mark.parametrize(("topic", "frame"), [("/gnss1/fix", "gnss1"), ("/vehicle7/gnss0/fix", "gnss0")])
def test_a_fix_knows_its_frame(topic: str, frame: str) -> None:
    columns = fix_columns(topic, STAMPS, [1] * 4, [2] * 4, [3] * 4, [0, 0, -1, 0], source="GPS")
    assert columns.channel.texts["header.frame_id"] == frame
    assert columns["status"]["status"].tolist() == [0, 0, -1, 0]
