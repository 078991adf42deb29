"""Units as loggers spell them, and what one of each is in SI."""

import re
from collections.abc import Mapping
from enum import StrEnum
from math import pi
from typing import Final


class Quantity(StrEnum):
    """What a column holds."""

    TIME = "time"
    ACCEL = "accel"
    GYRO = "gyro"
    MAG = "mag"
    QUATERNION = "quaternion"
    EULER = "angle"
    OTHER = "other"


G: Final = 9.80665
"""m/s^2."""
RAW: Final = "raw"
"""Counts of the sensor's own converter."""

NANOSECONDS: Final[Mapping[str, int]] = {"s": 10**9, "ms": 10**6, "us": 10**3, "ns": 1}

SCALES: Final[Mapping[Quantity, Mapping[str, float]]] = {
    Quantity.TIME: {unit: float(ns) for unit, ns in NANOSECONDS.items()},
    Quantity.ACCEL: {"m/s^2": 1.0, "g": G, "mg": G / 1000.0},
    Quantity.GYRO: {"rad/s": 1.0, "deg/s": pi / 180.0, "mrad/s": 1e-3, "mdeg/s": pi / 180e3, "rpm": pi / 30.0},
    Quantity.MAG: {"T": 1.0, "mT": 1e-3, "uT": 1e-6, "nT": 1e-9, "G": 1e-4, "mG": 1e-7, "a.u.": 50e-6},
    Quantity.EULER: {"rad": 1.0, "deg": pi / 180.0},
    Quantity.QUATERNION: {"": 1.0},
    Quantity.OTHER: {},
}
"""Quantity -> unit -> its size in nanoseconds, m/s^2, rad/s, tesla, rad. An a.u. is the earth's field, said to be
50 uT."""

_SPELLINGS: Final[Mapping[Quantity, Mapping[str, str]]] = {
    Quantity.TIME: {
        "s": "s sec secs second seconds",
        "ms": "ms msec msecs millisecond milliseconds millis",
        "us": "us usec usecs microsecond microseconds micros",
        "ns": "ns nsec nsecs nanosecond nanoseconds nanos",
    },
    Quantity.ACCEL: {
        "m/s^2": "m/s^2 m/s2 m/s/s ms-2 ms^-2 m/(s^2) m/(sec^2) m/sec^2 mps2 mpss ms2 mss meters/second^2",
        "g": "g gs gn gravity",
        "mg": "mg milli-g millig",
    },
    Quantity.GYRO: {
        "rad/s": "rad/s rads-1 rads^-1 rad/sec rads/s rads radps rps radians/second",
        "deg/s": "deg/s dps degs degps degs-1 degs^-1 deg/sec degree/s degrees/s degrees/second °/s",
        "mrad/s": "mrad/s mrads mradps",
        "mdeg/s": "mdeg/s mdps",
        "rpm": "rpm",
    },
    Quantity.MAG: {
        "T": "tesla teslas",
        "mT": "mt millitesla",
        "uT": "ut microtesla utesla",
        "nT": "nt nanotesla",
        "G": "g ga gs gauss",
        "mG": "mg mga mgauss milligauss",
        "a.u.": "au normalized normalised localflux",
    },
    Quantity.EULER: {"deg": "deg degs degree degrees °", "rad": "rad rads radian radians"},
}
_RAW: Final = frozenset({"raw", "lsb", "lsbs", "count", "counts", "adc"})
_CANONICAL: Final = {
    quantity: {spelling: unit for unit, spellings in units.items() for spelling in spellings.split()}
    for quantity, units in _SPELLINGS.items()
}


def canonical(spelled: str, quantity: Quantity) -> str | None:
    """``M/S²`` -> ``m/s^2``, ``counts`` -> ``raw``; None where it is no unit of the quantity."""
    plain = re.sub(r"[\s·*_.]", "", spelled.replace("²", "^2").replace("⁻¹", "^-1").replace("⁻²", "^-2"))
    plain = plain.replace("µ", "u").replace("μ", "u")
    if plain == "T" and quantity is Quantity.MAG:
        return "T"
    plain = plain.lower()
    if plain in _RAW:
        return RAW
    return _CANONICAL.get(quantity, {}).get(plain)


def scale(quantity: Quantity, unit: str) -> float:
    """One ``unit`` in SI (time: in nanoseconds); KeyError for a unit that `canonical` never gives."""
    return SCALES[quantity][unit]
