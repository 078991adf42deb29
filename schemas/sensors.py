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
    """The profile called ``name``, or scales as in ``accel=16384,gyro=131,mag=0.15`` (LSB/g, LSB/(deg/s), uT/LSB)."""
    if "=" in name:
        return _scales(name)
    try:
        return PROFILES[name]
    except KeyError:
        known = ", ".join(sorted(PROFILES))
        raise UsageError(f"no sensor profile {name!r}; there are: {known}; or give {_EXAMPLE}") from None


_EXAMPLE = "scales, as accel=16384,gyro=131,mag=0.15 (LSB/g, LSB/(deg/s), uT/LSB)"


def _scales(spelled: str) -> SensorProfile:
    try:
        given = {key.strip(): float(value) for key, _, value in (part.partition("=") for part in spelled.split(","))}
        if set(given) - {"accel", "gyro", "mag"} or not {"accel", "gyro"} <= set(given):
            raise ValueError
        if not all(0 < value < float("inf") for value in given.values()):
            raise ValueError
    except ValueError:
        raise UsageError(f"{spelled!r} are no scales of a sensor; write {_EXAMPLE}") from None
    return SensorProfile(spelled, given["accel"], given["gyro"], given.get("mag", float("nan")))
