"""Arrays in body FLU, world ENU and SI to the columns of attlog's own channels, and back."""

from collections.abc import Mapping
from typing import cast

import numpy as np
from numpy.lib import recfunctions
from numpy.typing import ArrayLike, NDArray

from ..geometry.frames import rpy_ned_deg
from .columns import Channel, Columns, Table, Time
from .definition import MessageType
from .estimate import Estimate
from .fields import Fields
from .messages import ATTITUDE, ATTITUDE_ESTIMATE, IMU, MAGNETIC_FIELD, NAV_SAT_FIX
from .recording import Floats

BODY = "base_link"
_IMU_FIELDS = ("orientation_covariance", "angular_velocity", "linear_acceleration")
_IMU_DATA = np.dtype([(name, IMU.dtype()[name]) for name in _IMU_FIELDS])
_CACHED_BYTES = 1 << 21
WORLD = "world"


def vectors(data: Table, name: str) -> Floats:
    """The field ``name`` of a nested type of doubles (Vector3: x y z) as one array (n, 3), a copy."""
    return _unnested(data, name)


def quaternions(data: Table, name: str = "orientation") -> Floats:
    """The Quaternion field ``name`` as one array (n, 4), x y z w, a copy."""
    return _unnested(data, name)


def _unnested(data: Table, name: str) -> Floats:
    return np.ascontiguousarray(recfunctions.structured_to_unstructured(data[name], dtype=np.float64))


def nested(message: MessageType, name: str, values: ArrayLike) -> Table:
    """The inverse: an array (n, k) of doubles as the nested struct of the field ``name``, without a copy."""
    dtype = message.dtype()[name]
    return np.ascontiguousarray(values, dtype=np.float64).view(dtype)[..., 0]


def table(message: MessageType, columns: Mapping[str, ArrayLike], lengths: Mapping[str, int] | None = None) -> Table:
    """A structured array of the named fields; (n, k) doubles fill a nested message or an array field."""
    whole = message.dtype(lengths)
    dtype = np.dtype([(name, whole[name]) for name in columns])
    filled = {n: nested(message, n, values) if dtype[n].names else np.asarray(values) for n, values in columns.items()}
    count = len(next(iter(filled.values())))
    result = np.empty(count, dtype)
    step = max(1, _CACHED_BYTES // max(1, dtype.itemsize))
    for start in range(0, count, step):  # rows are wide: all fields of a few, while those are in the cache
        rows = result[start : start + step]
        for name, values in filled.items():
            rows[name] = values[start : start + step]
    return result


def imu_columns(
    topic: str,
    time_ns: Time,
    angular_velocity: ArrayLike,
    specific_force: ArrayLike,
    *,
    source: str,
    metadata: Mapping[str, str] | None = None,
    frame_id: str = BODY,
) -> Columns:
    """sensor_msgs/msg/Imu from (n, 3) rad/s and (n, 3) m/s^2, body FLU; ``source`` names the message it came from."""
    values = np.zeros((len(time_ns), 15))
    values[:, 0] = -1.0
    values[:, 9:12] = angular_velocity
    values[:, 12:] = specific_force
    data = values.view(_IMU_DATA)[:, 0]
    return Columns(_channel(topic, IMU, source, metadata, frame_id), time_ns, data)


def mag_columns(
    topic: str,
    time_ns: Time,
    field: ArrayLike,
    *,
    source: str,
    metadata: Mapping[str, str] | None = None,
    frame_id: str = BODY,
) -> Columns:
    """sensor_msgs/msg/MagneticField from (n, 3) tesla, body FLU."""
    data = table(MAGNETIC_FIELD, {"magnetic_field": field})
    return Columns(_channel(topic, MAGNETIC_FIELD, source, metadata, frame_id), time_ns, data)


def fix_columns(
    topic: str,
    time_ns: Time,
    latitude_deg: ArrayLike,
    longitude_deg: ArrayLike,
    altitude_m: ArrayLike,
    status: ArrayLike,
    *,
    source: str,
    metadata: Mapping[str, str] | None = None,
) -> Columns:
    """sensor_msgs/msg/NavSatFix from (n,) each; ``status`` as NavSatStatus counts it (-1 no fix, 0 fix)."""
    quality = np.zeros(len(time_ns), NAV_SAT_FIX.dtype()["status"])
    quality["status"] = status
    quality["service"] = 1
    data = np.zeros(
        len(time_ns), [(n, NAV_SAT_FIX.dtype()[n]) for n in ("status", "latitude", "longitude", "altitude")]
    )
    data["status"], data["latitude"], data["longitude"], data["altitude"] = (
        quality,
        latitude_deg,
        longitude_deg,
        altitude_m,
    )
    frame = topic.strip("/").rsplit("/", 1)[0].rsplit("/", 1)[-1]
    return Columns(_channel(topic, NAV_SAT_FIX, source, metadata, frame), time_ns, data)


def attitude_columns(
    topic: str,
    time_ns: Time,
    orientation: ArrayLike,
    *,
    child_frame_id: str,
    source: str,
    metadata: Mapping[str, str] | None = None,
) -> Columns:
    """attlog_msgs/msg/Attitude from quaternions (n, 4) x y z w, body FLU to ENU; roll, pitch, yaw are derived."""
    data = table(ATTITUDE, {"orientation": orientation, "rpy_ned_deg": rpy_ned_deg(orientation)})
    channel = _channel(topic, ATTITUDE, source, metadata, WORLD, {"child_frame_id": child_frame_id})
    return Columns(channel, time_ns, data)


def estimate_columns(estimate: Estimate, *, prefix: str = "", metadata: Mapping[str, str] | None = None) -> Columns:
    """attlog_msgs/msg/AttitudeEstimate on ``{prefix}/estimate/{name}/attitude``; its metadata say what made it."""
    fields: dict[str, NDArray[np.generic]] = {
        "orientation": estimate.orientation,
        "rpy_ned_deg": rpy_ned_deg(estimate.orientation),
    }
    for field in ATTITUDE_ESTIMATE.fields:
        if hasattr(estimate, field.name):
            fields[field.name] = getattr(estimate, field.name)
    for name, values in fields.items():
        if isinstance(ATTITUDE_ESTIMATE[name].type, MessageType):
            fields[name] = nested(ATTITUDE_ESTIMATE, name, values)
    data = cast("Table", Fields(fields))
    about = {
        "estimator": estimate.estimator,
        "north": str(estimate.north),
        "declination_deg": f"{estimate.declination_deg:g}",
        "inputs": " ".join(estimate.inputs),
        "state": " ".join(estimate.state_names),
        "innovation": " ".join(estimate.innovation_names),
        **{f"parameter.{name}": str(value) for name, value in estimate.parameters.items()},
        **(metadata or {}),
    }
    child = f"{prefix.strip('/')}/estimate_{estimate.name}".lstrip("/")
    topic = f"{prefix}/estimate/{estimate.name}/attitude"
    channel = Channel(topic, ATTITUDE_ESTIMATE, about, {"header.frame_id": WORLD, "child_frame_id": child})
    return Columns(channel, estimate.time_ns, data)


def _channel(
    topic: str,
    message: MessageType,
    source: str,
    metadata: Mapping[str, str] | None,
    frame_id: str,
    texts: Mapping[str, str] | None = None,
) -> Channel:
    return Channel(
        topic, message, {"source": source, **(metadata or {})}, {"header.frame_id": frame_id, **(texts or {})}
    )
