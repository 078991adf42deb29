"""Message definitions: text, parse, dtype; names that ROS 2 accepts."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from attlog.schemas import Field, InputError, MessageType, messages
from attlog.schemas.passthrough import SourceField, generated_type, ros_field_names, ros_type_name, source_names

ALL = [value for value in vars(messages).values() if isinstance(value, MessageType)]
ROS_FIELD = re.compile(r"^[a-z](?:_?[a-z0-9])*$")


@pytest.mark.parametrize("message", ALL, ids=lambda message: message.name)
def test_text_reads_back_to_the_same_type(message: MessageType) -> None:
    assert MessageType.parse(message.name, message.text) == message


@pytest.mark.parametrize("message", ALL, ids=lambda message: message.name)
def test_rosbags_reads_the_text(message: MessageType) -> None:
    sections = message.text.split("=" * 80 + "\n")
    types = get_types_from_msg(sections[0], message.name)
    for section in sections[1:]:
        head, _, body = section.partition("\n")
        package, name = head.removeprefix("MSG: ").split("/")
        types |= get_types_from_msg(body, f"{package}/msg/{name}")
    fields = types[message.name][1]
    assert [name for name, _ in fields] == [field.name for field in message.fields]


STANDARD = [m for m in ALL if not m.name.startswith("attlog_msgs")]


@pytest.mark.parametrize("message", STANDARD, ids=lambda message: message.name)
def test_standard_types_are_ros_humbles(message: MessageType) -> None:
    store = get_typestore(Stores.ROS2_HUMBLE)
    ours = [field.name for field in message.fields]
    assert ours == [name for name, _ in store.fielddefs[message.name][1]]


def test_dtype_of_an_imu_by_hand() -> None:
    dtype = messages.IMU.dtype({"header.frame_id": 9})
    assert dtype.itemsize == 4 + 4 + 9 + 32 + 72 + 24 + 72 + 24 + 72
    assert dtype["angular_velocity"].names == ("x", "y", "z")
    assert dtype["orientation_covariance"].shape == (9,)


def test_sequences_and_strings_take_their_lengths_by_path() -> None:
    dtype = messages.TF_MESSAGE.dtype({"transforms": 2, "transforms.child_frame_id": 5})
    assert dtype["transforms"].shape == (2,)
    assert dtype["transforms"].base["child_frame_id"] == np.dtype("S5")


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("float64", "not a field"),
        ("pkg/Other x\n", "missing"),
        ("pkg/A x\n" + "=" * 80 + "\nMSG: pkg/A\npkg/A y\n", "contains itself"),
        ("float64 x\n" + "=" * 80 + "\nfloat64 y\n", "MSG:"),
    ],
)
def test_a_wrong_text_is_one_clear_error(text: str, what: str) -> None:
    with pytest.raises(InputError, match=what):
        MessageType.parse("pkg/msg/Root", text)


def test_parses_what_other_writers_write() -> None:
    text = """
# a comment
uint8 KIND=1   # named
string NAME="a # b"
float64[<=5] bounded
string<=10 short "default"
int32[3] three [1, 2, 3]
Header header
Point[] points  # of this package
================
MSG: std_msgs/Header
time stamp
string frame_id
================
MSG: pkg/Point
float32 x
"""
    message = MessageType.parse("pkg/Root", text)
    assert message.name == "pkg/msg/Root"
    assert [(f.name, f.type_name, f.length) for f in message.fields] == [
        ("bounded", "float64", 0),
        ("short", "string", None),
        ("three", "int32", 3),
        ("header", "std_msgs/Header", None),
        ("points", "pkg/Point", 0),
    ]
    assert [(c.name, c.value) for c in message.constants] == [("KIND", "1"), ("NAME", '"a # b"')]


@given(st.lists(st.text(min_size=1, max_size=16), max_size=20))
def test_field_names_are_legal_and_distinct(names: list[str]) -> None:
    made = ros_field_names(names)
    assert len(set(made)) == len(made) == len(names)
    assert all(ROS_FIELD.match(name) for name in made)


def test_names_by_hand() -> None:
    names = ["TimeUS", "GyrX", "2d", "a__b", "a_b", "end_", "header"]
    assert ros_field_names(names) == ["timeus", "gyrx", "f2d", "a_b", "a_b_2", "end", "header_2"]
    assert [ros_type_name(name) for name in ("GPS_RAW_INT", "XKF1", "vehicle_imu", "IMU")] == [
        "GpsRawInt",
        "Xkf1",
        "VehicleImu",
        "Imu",
    ]


def test_a_generated_type_answers_to_both_names() -> None:
    fields = [SourceField("TimeUS", "uint64", unit="us"), SourceField("Lat", "int32", unit="deg", multiplier=1e-7)]
    message = generated_type("dataflash_msgs", "GPS", fields, [Field("received_us", "uint64")])
    assert message.name == "dataflash_msgs/msg/Gps"
    assert [field.name for field in message.fields] == ["header", "received_us", "timeus", "lat"]
    again = MessageType.parse(message.name, message.text)
    assert source_names(again) == {"TimeUS": "timeus", "Lat": "lat"}
    assert again["lat"].comment == "Lat [deg] x1e-07"
