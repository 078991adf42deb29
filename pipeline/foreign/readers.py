"""Other people's channels as a recording's sensors and attitudes. ROS is ENU and FLU already (REP 103)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...geometry.quaternions import normalize
from ...schemas.columns import Columns, Time
from ...schemas.recording import Attitude, Fix, Floats, Imu, Magnetometer
from .clocks import Stamped
from .kinds import Kind, Shape
from .values import at, components, frame, parent, stamps, transforms

NOT_LEVEL_NORTH = "arbitrary"
TRUE_NORTH_FRAMES = frozenset({"earth", "enu", "utm", "world_enu", "map_enu", "odom_enu", "local_enu"})
"""Frames whose names say that x is east; any other may be turned about the vertical (REP 105)."""


@dataclass(frozen=True, eq=False)
class Turned:
    """An attitude before its clock is settled: which frame turns in which."""

    stamped: Stamped
    orientation: Floats
    parent: str
    child: str
    fused: bool
    """Whether a sensor driver's own fusion made it, whose heading counts from the north (REP 145)."""

    @property
    def valid(self) -> bool:
        """False where nothing but zeros, NaN or the identity that messages are made with is there."""
        finite = np.isfinite(normalize(self.orientation)).all(axis=1)
        return bool(finite.any() and (self.orientation[finite] != (0.0, 0.0, 0.0, 1.0)).any())


def stamped(columns: Columns) -> Stamped:
    """The channel's times."""
    return Stamped(columns.time_ns, stamps(columns.data))


def turned(columns: Columns, shape: Shape) -> dict[str, Turned]:
    """Child frame -> attitude; the attitudes of a channel that is no transform tree have one, which may be unnamed.

    KeyError where a field is missing. An Imu whose orientation_covariance begins with -1 has none.
    """
    if shape.kind is Kind.TRANSFORMS:
        found = transforms(columns, shape.orientation).pairs
        return {
            child: Turned(Stamped(log_ns, header_ns), orientation, above, child, False)
            for (above, child), (log_ns, header_ns, orientation) in found.items()
        }
    data = columns.data
    orientation = components(at(data, shape.orientation), "xyzw")
    if shape.kind is Kind.IMU:
        orientation = np.where(_known(columns)[:, np.newaxis], orientation, np.nan)
    above, child = parent(data), frame(data, (shape.child,))
    return {child: Turned(stamped(columns), orientation, above, child, shape.kind is Kind.IMU)}


def _known(columns: Columns) -> "np.ndarray[tuple[int], np.dtype[np.bool_]]":
    given = "orientation_covariance" in (columns.data.dtype.names or ())
    values = columns.data["orientation_covariance"] if given else None
    if values is None or values.ndim != 2 or values.shape[1] == 0:
        return np.ones(len(columns), dtype=np.bool_)
    return np.asarray(values[:, 0] != -1.0)


def imu(columns: Columns, time_ns: Time, about: Mapping[str, str]) -> Imu:
    """An IMU; KeyError where a field is missing."""
    rate = components(at(columns.data, ("angular_velocity",)), "xyz")
    force = components(at(columns.data, ("linear_acceleration",)), "xyz")
    order = np.argsort(time_ns, kind="stable")
    metadata = {**columns.channel.metadata, "frame": parent(columns.data), **about}
    return Imu(time_ns[order], rate[order], force[order], columns.channel.topic, metadata)


def magnetometer(columns: Columns, time_ns: Time, about: Mapping[str, str]) -> Magnetometer:
    """A magnetometer; KeyError where a field is missing."""
    field = components(at(columns.data, ("magnetic_field",)), "xyz")
    order = np.argsort(time_ns, kind="stable")
    metadata = {**columns.channel.metadata, "frame": parent(columns.data), **about}
    return Magnetometer(time_ns[order], field[order], columns.channel.topic, metadata)


def fix(columns: Columns, time_ns: Time, about: Mapping[str, str]) -> Fix:
    """Satellite fixes; KeyError where a field is missing."""
    data = columns.data
    place = np.stack([np.asarray(at(data, (n,)), np.float64) for n in ("latitude", "longitude", "altitude")], axis=-1)
    fixed = np.isfinite(place[:, :2]).all(axis=1)
    if "status" in (data.dtype.names or ()):
        fixed = fixed & (at(data, ("status", "status")) >= 0)
    order = np.argsort(time_ns, kind="stable")
    order = order[np.asarray(fixed)[order]]
    latitude, longitude, altitude = place[order].T
    return Fix(time_ns[order], latitude, longitude, altitude, columns.channel.topic, {**about})


def attitude(found: Turned, time_ns: Time, name: str, topic: str, about: Mapping[str, str]) -> Attitude:
    """An attitude, its frames in the metadata. A pose's heading counts from wherever its frame does: ``arbitrary``."""
    metadata = {"frame": found.parent, "child_frame": found.child, **about}
    if not found.fused and found.parent.lower() not in TRUE_NORTH_FRAMES:
        metadata["north"] = NOT_LEVEL_NORTH
    order = np.argsort(time_ns, kind="stable")
    return Attitude(time_ns[order], normalize(found.orientation)[order], name, topic, metadata)
