"""A channel on another channel's clock."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..geometry.frames import rpy_ned_deg
from ..geometry.quaternions import normalize, slerp
from ..schemas.columns import Columns, Time
from ..schemas.definition import MessageType, short_name
from ..signals.interpolation import covered
from ..signals.resample import linear, linear_angle, nearest

QUATERNION = "geometry_msgs/Quaternion"
RPY = "rpy_ned_deg"
ANGLES = frozenset({"heading_deg", "roll_deg", "pitch_deg", "yaw_deg"})


def resampled(columns: Columns, at_ns: Time) -> tuple[Columns, NDArray[np.bool_]]:
    """The channel at ``at_ns`` (m,), and where it is known (m,): not beyond its ends, nor across gaps of more than 2.5
    median intervals.

    Floating-point numbers are interpolated linearly, quaternions along the great arc and ``rpy_ned_deg`` with them,
    angles of errors the short way round; whole numbers, texts, flags and stamps are the nearest sample's.
    """
    stamps, first = np.unique(columns.time_ns, return_index=True)
    data = columns.data[first]
    if len(stamps) == 0:
        return replace(columns, time_ns=at_ns, data=np.zeros(len(at_ns), columns.data.dtype)), np.zeros(
            len(at_ns), bool
        )
    if np.array_equal(stamps, at_ns):
        return replace(columns, time_ns=at_ns, data=data), np.ones(len(at_ns), dtype=np.bool_)
    result = data[nearest(stamps, at_ns)].copy()
    _interpolate(columns.channel.type, stamps, data, at_ns, result)
    return replace(columns, time_ns=at_ns, data=result), covered(stamps, at_ns)


def _interpolate(message: MessageType, stamps: Time, data: NDArray[Any], at_ns: Time, result: NDArray[Any]) -> None:
    names = data.dtype.names or ()
    for field in message.fields:
        if field.name not in names:
            continue
        values = data[field.name]
        if isinstance(field.type, MessageType):
            if values.dtype == object or values.ndim > 1:
                continue
            if _is_quaternion(field.type, values):
                _slerp(stamps, values, at_ns, result[field.name])
            else:
                _interpolate(field.type, stamps, values, at_ns, result[field.name])
        elif values.dtype.kind == "f":
            result[field.name] = _floats(field.name, stamps, values, at_ns)
    if RPY in names and "orientation" in names:
        turned = np.stack([result["orientation"][axis] for axis in "xyzw"], axis=-1)
        result[RPY] = rpy_ned_deg(turned)


def _is_quaternion(message: MessageType, values: NDArray[Any]) -> bool:
    """ROS's own, or the four numbers x y z w of JSON."""
    return short_name(message.name) == QUATERNION or set(values.dtype.names or ()) == set("xyzw")


def _floats(name: str, stamps: Time, values: NDArray[Any], at_ns: Time) -> NDArray[Any]:
    plain = np.asarray(values, dtype=np.float64)
    return linear_angle(stamps, plain, at_ns, 360.0) if name in ANGLES else linear(stamps, plain, at_ns)


def _slerp(stamps: Time, values: NDArray[Any], at_ns: Time, result: NDArray[Any]) -> None:
    turned = np.stack([np.asarray(values[axis], dtype=np.float64) for axis in "xyzw"], axis=-1)
    off = ~np.isin(at_ns, stamps)  # on a sample it is that sample's own, be it of unit norm or not
    between = slerp(stamps, normalize(turned), np.clip(at_ns[off], stamps[0], stamps[-1]))
    for number, axis in enumerate("xyzw"):
        result[axis][off] = between[:, number]
