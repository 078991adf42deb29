"""Layouts against offsets that were worked out by hand, and against numpy's own view of the bytes."""

import struct

import numpy as np
import pytest

from attlog.schemas import Field, MessageType
from attlog.schemas.layout import CDR2_LE, CDR_BE, CDR_LE, ROS1, dotted, is_fixed, layout
from attlog.schemas.messages import ATTITUDE, HEADER, IMU, MAGNETIC_FIELD, NAV_SAT_FIX, TF_MESSAGE


def offsets(message: MessageType, lengths: dict[str, int] | None = None, wire=CDR_LE) -> dict[str, int]:
    laid = layout(message, wire, lengths)
    return {dotted(slot.path): slot.offset for slot in laid.slots if slot.count is None}


@pytest.mark.parametrize("frame", ["", "b", "base_link", "imu_link_long_name"])
def test_first_double_of_imu_follows_the_frame(frame: str) -> None:
    stored = len(frame) + 1
    found = offsets(IMU, {"header.frame_id": stored})
    first = -(-(12 + stored) // 8) * 8
    assert found["header.stamp.sec"] == 0
    assert found["header.stamp.nanosec"] == 4
    assert found["header.frame_id"] == 12
    assert found["orientation.x"] == first
    assert found["orientation_covariance"] == first + 32
    assert found["linear_acceleration.z"] == first + 32 + 72 + 24 + 72 + 16
    assert layout(IMU, CDR_LE, {"header.frame_id": stored}).size == first + 37 * 8


def test_fix_has_small_numbers_before_its_doubles() -> None:
    found = offsets(NAV_SAT_FIX, {"header.frame_id": 6})
    assert found["status.status"] == 18
    assert found["status.service"] == 20
    assert found["latitude"] == 24


def test_transforms_count_and_two_strings() -> None:
    lengths = {"transforms": 1, "transforms[0].header.frame_id": 6, "transforms[0].child_frame_id": 4}
    found = offsets(TF_MESSAGE, lengths)
    assert found["transforms[0].header.stamp.sec"] == 4
    assert found["transforms[0].header.frame_id"] == 16
    assert found["transforms[0].child_frame_id"] == 28
    assert found["transforms[0].transform.translation.x"] == 32


def test_elements_that_differ_in_spacing_have_no_common_dtype() -> None:
    inner = MessageType("t/msg/Inner", (Field("name", "string"), Field("value", "float64"), Field("flag", "uint8")))
    message = MessageType("t/msg/Outer", (Field("inner", inner, 2),))
    assert offsets(message, {"inner.name": 5})["inner[0].value"] == 16
    assert offsets(message, {"inner.name": 5})["inner[1].value"] == 40
    assert layout(message, CDR_LE, {"inner.name": 5}).dtype is None
    even = MessageType("t/msg/Even", (Field("value", "float64"), Field("flag", "uint8")))
    laid = layout(MessageType("t/msg/Outer2", (Field("inner", even, 3),)))
    assert laid.dtype is not None
    assert laid.size == 16 + 16 + 9


def test_plain_xcdr2_aligns_to_four_and_ros1_not_at_all() -> None:
    message = MessageType("t/msg/A", (Field("a", "uint8"), Field("b", "float64"), Field("c", "uint16")))
    assert offsets(message) == {"a": 0, "b": 8, "c": 16}
    assert offsets(message, wire=CDR2_LE) == {"a": 0, "b": 4, "c": 12}
    assert offsets(message, wire=ROS1) == {"a": 0, "b": 1, "c": 9}


def test_empty_sequence_of_doubles_is_not_aligned() -> None:
    message = MessageType("t/msg/B", (Field("a", "float64", 0), Field("b", "float64", 0), Field("c", "uint8")))
    assert offsets(message, {"a": 0, "b": 0})["c"] == 8
    assert offsets(message, {"a": 0, "b": 1})["c"] == 16


@pytest.mark.parametrize(("wire", "form"), [(CDR_LE, "<"), (CDR_BE, ">")])
def test_dtype_reads_bytes_of_either_order(wire, form: str) -> None:
    frame = b"abc\0"
    data = struct.pack(form + "iII4s", 7, 8, 4, frame) + struct.pack(form + "12d", *range(12))
    laid = layout(MAGNETIC_FIELD, wire, {"header.frame_id": 4})
    assert laid.size == len(data)
    assert laid.dtype is not None
    row = np.frombuffer(data, laid.dtype)[0]
    assert row["header"]["stamp"]["nanosec"] == 8
    assert row["header"]["frame_id"] == b"abc"
    assert row["magnetic_field"]["z"] == 2
    assert row["magnetic_field_covariance"].tolist() == list(range(3, 12))


def test_string_without_nul_reads_as_empty() -> None:
    message = MessageType("t/msg/C", (Field("text", "string"), Field("a", "uint32")))
    laid = layout(message, CDR_LE, {"text": 0})
    assert laid.dtype is not None
    row = np.frombuffer(struct.pack("<II", 0, 5), laid.dtype)[0]
    assert row["text"] == b""
    assert row["a"] == 5


def test_fixed_layouts_are_told_apart() -> None:
    assert is_fixed(MessageType("t/msg/D", (Field("a", "uint8", 4),)))
    assert not is_fixed(HEADER)
    assert not is_fixed(ATTITUDE)
    assert not is_fixed(MessageType("t/msg/E", (Field("a", "uint8", 0),)))
