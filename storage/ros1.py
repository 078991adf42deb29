"""ROS 1 definitions as ROS 2's parser takes them: time and duration are primitives there."""

import re

from ..schemas.definition import SEPARATOR, MessageType

_TIME = re.compile(r"^(\s*)(time|duration)(\[\d*\])?(\s)", re.MULTILINE)
_HEADER = re.compile(r"^(\s*)Header(\[\d*\])?(\s)", re.MULTILINE)
_TYPES = {"time": "ros1/Time", "duration": "ros1/Duration"}
_DEFINED = "".join(
    f"\n{SEPARATOR}\nMSG: ros1/{name}\n{kind} sec\n{kind} nanosec\n"
    for name, kind in (("Time", "uint32"), ("Duration", "int32"))
)


def parse_ros1(name: str, text: str) -> MessageType:
    """A message type from ros1msg text with its dependencies; InputError names the line that is no definition."""
    text = _TIME.sub(lambda m: f"{m[1]}{_TYPES[m[2]]}{m[3] or ''}{m[4]}", text)
    text = _HEADER.sub(r"\1std_msgs/Header\2\3", text)
    return MessageType.parse(name, text + _DEFINED)
