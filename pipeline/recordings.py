"""A log's columns as recordings, one for each vehicle."""

import re
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from ..schemas import records
from ..schemas.columns import Columns
from ..schemas.recording import Attitude, Fix, Imu, Magnetometer, Recording, Segment
from ..schemas.unified import quaternions, vectors

_TOPIC = re.compile(
    r"^(?P<prefix>(?:/vehicle\d+)?)/(?:"
    r"imu(?P<imu>\d+)/data_raw|mag(?P<mag>\d+)/field|gnss(?P<gnss>\d+)/fix|(?P<reference>reference)/attitude"
    r"|onboard/(?P<onboard>[^/]+)/attitude|estimate/(?P<estimate>[^/]+)/attitude)$"
)

Metadata = Mapping[str, Mapping[str, str]]


def is_recorded(topic: str) -> bool:
    """Whether a recording holds the topic."""
    return _TOPIC.match(topic) is not None


def recordings(columns: Iterable[Columns], metadata: Metadata) -> dict[str, Recording]:
    """Prefix ("" for the main vehicle, "/vehicle51") -> recording, of the channels that `is_recorded` takes."""
    parts: dict[str, dict[str, dict[Any, Any]]] = {}
    for channel in columns:
        match = _TOPIC.match(channel.channel.topic)
        if match is None or len(channel) == 0:
            continue
        kind = str(match.lastgroup)
        key: Any = int(match[kind]) if kind in ("imu", "mag", "gnss") else match[kind]
        parts.setdefault(match["prefix"], {}).setdefault(kind, {})[key] = _READ[kind](_sorted(channel), str(key))
    return {prefix: _recording(prefix, found, metadata) for prefix, found in sorted(parts.items())}


def _recording(prefix: str, found: Mapping[str, Mapping[Any, Any]], metadata: Metadata) -> Recording:
    vehicle = prefix.removeprefix("/vehicle")
    return Recording(
        imu=found.get("imu", {}),
        mag=found.get("mag", {}),
        gnss=found.get("gnss", {}),
        reference=found.get("reference", {}).get("reference"),
        onboard=found.get("onboard", {}),
        estimates=found.get("estimate", {}),
        segments=_segments(vehicle, metadata),
        prefix=prefix,
        metadata=metadata,
    )


def _segments(vehicle: str, metadata: Metadata) -> tuple[Segment, ...]:
    everyone = records.parse_segments(metadata.get(records.SEGMENTS, {}))
    main = metadata.get(records.VEHICLE, {}).get("sysid", "")
    return tuple(s for s in everyone if s.vehicle in ((vehicle,) if vehicle else ("", main)))


def _sorted(columns: Columns) -> Columns:
    if len(columns) < 2 or bool(np.all(columns.time_ns[1:] >= columns.time_ns[:-1])):
        return columns
    return columns.select(np.argsort(columns.time_ns, kind="stable"))


def _imu(columns: Columns, _: str) -> Imu:
    rate, force = vectors(columns.data, "angular_velocity"), vectors(columns.data, "linear_acceleration")
    return Imu(columns.time_ns, rate, force, columns.channel.topic, columns.channel.metadata)


def _mag(columns: Columns, _: str) -> Magnetometer:
    field = vectors(columns.data, "magnetic_field")
    return Magnetometer(columns.time_ns, field, columns.channel.topic, columns.channel.metadata)


def _fix(columns: Columns, _: str) -> Fix:
    fixed = columns.select(columns.data["status"]["status"] >= 0)
    latitude, longitude, altitude = (
        np.asarray(fixed.data[name], dtype=np.float64) for name in ("latitude", "longitude", "altitude")
    )
    return Fix(fixed.time_ns, latitude, longitude, altitude, columns.channel.topic, columns.channel.metadata)


def _attitude(columns: Columns, name: str) -> Attitude:
    orientation = quaternions(columns.data, "orientation")
    return Attitude(columns.time_ns, orientation, name, columns.channel.topic, columns.channel.metadata)


_READ = {
    "imu": _imu,
    "mag": _mag,
    "gnss": _fix,
    "reference": _attitude,
    "onboard": _attitude,
    "estimate": _attitude,
}
