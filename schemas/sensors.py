"""Sensor profiles: what a raw count means."""

from collections.abc import Mapping
from dataclasses import dataclass

from .errors import UsageError


@dataclass(frozen=True)
class SensorProfile:
    """Scales of a raw IMU; ``mag_axes`` names, for each body axis, the signed magnetometer axis along it."""

    name: str
    accel_lsb_per_g: float
    gyro_lsb_per_dps: float
    mag_ut_per_lsb: float
    mag_axes: tuple[str, str, str] = ("x", "y", "z")


PROFILES: Mapping[str, SensorProfile] = {
    # InvenSense MPU-9250 register map 1.6 at +-2 g and +-250 deg/s; the AK8963's x and y are swapped and z points down.
    "mpu9250": SensorProfile("mpu9250", 16384.0, 131.0, 0.15, ("y", "x", "-z")),
}


def profile(name: str) -> SensorProfile:
    """The profile called ``name``; UsageError lists those that exist."""
    try:
        return PROFILES[name]
    except KeyError:
        raise UsageError(f"no sensor profile {name!r}; there are: {', '.join(sorted(PROFILES))}") from None
