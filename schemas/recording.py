"""A log in memory, as estimators and analysis see it: body FLU, world ENU, SI units, integer nanoseconds."""

import dataclasses
import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .columns import Time

Floats = NDArray[np.float64]


def content_sha256(time_ns: Time, *values: Floats) -> str:
    """Digest of a channel's stamps and then its values, as little-endian bytes, whatever file they came from."""
    digest = hashlib.sha256(np.ascontiguousarray(time_ns, dtype="<i8").data)
    for array in values:
        digest.update(np.ascontiguousarray(array, dtype="<f8").data)
    return digest.hexdigest()


@dataclass(frozen=True, eq=False)
class Imu:
    """Samples of one IMU: ``angular_velocity`` (n, 3) rad/s and ``specific_force`` (n, 3) m/s^2, in the body FLU."""

    time_ns: Time
    angular_velocity: Floats
    specific_force: Floats
    topic: str = ""
    metadata: Mapping[str, str] = dataclasses.field(default_factory=dict)

    @cached_property
    def sha256(self) -> str:
        """`content_sha256` of the samples."""
        return content_sha256(self.time_ns, self.angular_velocity, self.specific_force)


@dataclass(frozen=True, eq=False)
class Magnetometer:
    """Samples of one magnetometer: ``field`` (n, 3) in tesla, body FLU."""

    time_ns: Time
    field: Floats
    topic: str = ""
    metadata: Mapping[str, str] = dataclasses.field(default_factory=dict)

    @cached_property
    def sha256(self) -> str:
        """`content_sha256` of the samples."""
        return content_sha256(self.time_ns, self.field)


@dataclass(frozen=True, eq=False)
class Fix:
    """Satellite fixes: degrees, degrees, metres, each (n,)."""

    time_ns: Time
    latitude_deg: Floats
    longitude_deg: Floats
    altitude_m: Floats
    topic: str = ""
    metadata: Mapping[str, str] = dataclasses.field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Attitude:
    """Attitudes: unit quaternions (n, 4) x y z w that turn body FLU into world ENU."""

    time_ns: Time
    orientation: Floats
    name: str
    topic: str = ""
    metadata: Mapping[str, str] = dataclasses.field(default_factory=dict)

    @cached_property
    def sha256(self) -> str:
        """`content_sha256` of the samples."""
        return content_sha256(self.time_ns, self.orientation)


@dataclass(frozen=True)
class Segment:
    """A stretch of one clock without reboot or step: first and last sample's time, and what began it."""

    vehicle: str
    index: int
    start_ns: int
    end_ns: int
    boot_offset_ns: int
    reason: str


@dataclass(frozen=True)
class Declination:
    """Angle from true to magnetic north, degrees, east positive, and where the figure comes from."""

    degrees: float
    source: str


@dataclass(frozen=True, eq=False)
class Recording:
    """One vehicle's sensors and attitudes; ``prefix`` is "" or "/vehicle51", as its topics begin."""

    imu: Mapping[int, Imu] = dataclasses.field(default_factory=dict)
    mag: Mapping[int, Magnetometer] = dataclasses.field(default_factory=dict)
    gnss: Mapping[int, Fix] = dataclasses.field(default_factory=dict)
    reference: Attitude | None = None
    onboard: Mapping[str, Attitude] = dataclasses.field(default_factory=dict)
    estimates: Mapping[str, Attitude] = dataclasses.field(default_factory=dict)
    segments: tuple[Segment, ...] = ()
    declination: Declination | None = None
    prefix: str = ""
    metadata: Mapping[str, Mapping[str, str]] = dataclasses.field(default_factory=dict)
