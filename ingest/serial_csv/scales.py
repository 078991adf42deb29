"""What one of each sensor's numbers is in SI: as given, by the sensor's profile, else guessed."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...geometry.frames import flu_from_frd
from ...schemas.errors import InputError
from ...schemas.sensors import SensorProfile
from . import guesses
from .guesses import EARTH_T, Guess
from .layout import Group
from .units import RAW, G, Quantity, scale

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Scale:
    """SI value of one, the unit as text, and for a raw magnetometer the axes along the body's."""

    factor: float
    unit: str
    axes: tuple[str, str, str] = ("x", "y", "z")
    guess: Guess | None = None


def vectors(columns: Sequence[NDArray[Any]], group: Group) -> Floats:
    """The group's columns as one array (n, k), a copy, each column contiguous."""
    return np.stack([columns[column] for column in group.columns], dtype=np.float64, casting="unsafe").T


def in_body(values: Floats, known: Scale, axes: str) -> Floats:
    """Vectors (n, 3) as printed, in SI and in the body FLU; ``axes`` are the sensor's."""
    if known.axes != ("x", "y", "z"):
        signs = np.array([-1.0 if axis.startswith("-") else 1.0 for axis in known.axes])
        values = values[:, ["xyz".index(axis[-1]) for axis in known.axes]] * signs
    values *= known.factor
    return flu_from_frd(values) if axes == "frd" else values


def raw(quantity: Quantity, sensor: SensorProfile) -> Scale:
    """The scale of a sensor that prints its converter's counts."""
    factors = {
        Quantity.ACCEL: G / sensor.accel_lsb_per_g,
        Quantity.GYRO: np.pi / 180.0 / sensor.gyro_lsb_per_dps,
        Quantity.MAG: sensor.mag_ut_per_lsb * 1e-6,
    }
    axes = sensor.mag_axes if quantity is Quantity.MAG else ("x", "y", "z")
    return Scale(float(factors[quantity]), f"counts of {sensor.name}", axes)


def known(group: Group, sensor: SensorProfile | None, source: str) -> Scale | None:
    """The scale where the unit is given or a sensor profile tells it; InputError for counts without a profile."""
    if sensor is not None and group.unit in ("", RAW):
        return raw(group.quantity, sensor)
    if group.unit == RAW:
        raise InputError(f"{source}: the {group.quantity} columns hold raw counts; say whose, as in --sensor mpu9250")
    return Scale(scale(group.quantity, group.unit), group.unit) if group.unit else None


def guessed(group: Group, values: Floats, time_s: Floats, accel: tuple[Floats, str] | None, source: str) -> Scale:
    """The scale by what the values look like; InputError where they fit no unit."""
    guess = _guess(group.quantity, values, time_s, accel)
    if guess is None:
        norm = float(np.nanmedian(np.linalg.norm(values, axis=1)))
        raise InputError(
            f"{source}: the accelerometer's usual norm of {norm:.5g} is gravity in no unit: raw counts? Give --sensor "
            "mpu9250 (or another profile), or the unit in the column's name, as in --columns t_us,ax_g,…"
        )
    if guess.value.endswith(" T"):
        return Scale(
            float(guess.value.split()[0]), f"unknown, its usual norm taken as {EARTH_T * 1e6:g} uT", guess=guess
        )
    return Scale(scale(group.quantity, guess.value), guess.value, guess=guess)


def _guess(quantity: Quantity, values: Floats, time_s: Floats, accel: tuple[Floats, str] | None) -> Guess | None:
    if quantity is Quantity.ACCEL:
        return guesses.accel_unit(values)
    if quantity is Quantity.MAG:
        return guesses.mag_unit(values)
    if quantity is Quantity.EULER:
        return guesses.angle_unit(values)
    around, unit = accel if accel is not None else (np.zeros_like(values), "m/s^2")
    return guesses.gyro_unit(time_s, around, values, unit)
