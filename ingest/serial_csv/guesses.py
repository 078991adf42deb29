"""What the numbers themselves say about units and columns, where nobody else does; and what each guess rests on."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from .units import SCALES, G, Quantity

Floats = NDArray[np.float64]

_COUNTER: Final = re.compile(r"(?i)packet|count|index|sample|frame|seq|loop|iter|row|line|number|\bn[or]?\b|\bid\b|#")
ROWS: Final = 200_000
"""Guesses look at no more than this many rows."""
BLOCK_S: Final = 0.1
USUAL_RATE_HZ: Final = 100.0
MIN_CORRELATION: Final = 0.5
OUTLIER: Final = 10.0
EARTH_T: Final = 50e-6
"""Field strength that a magnetometer without a known unit is taken to have."""

EPOCH: Final[Mapping[str, float]] = {"s": 1e9, "ms": 1e12, "us": 1e15, "ns": 1e18}
"""Seconds since 1970 are above the first from 2001 on, and below the next for ever."""
FIELD_T: Final = (15e-6, 95e-6)
GRAVITY: Final = (0.75 * G, 1.25 * G)


@dataclass(frozen=True)
class Guess:
    """``what`` was taken to be ``value``, ``because``; topic says for which channel."""

    what: str
    value: str
    because: str

    @property
    def text(self) -> str:
        """In words."""
        return f"{self.what}: guessed {self.value}, because {self.because}"


def time_unit(ticks: NDArray[Any]) -> Guess:
    """The unit of a clock (n,), from its size or its rate."""
    what = "unit of the time"
    values = ticks[np.isfinite(ticks)].astype(np.float64)
    if len(values) == 0:
        return Guess(what, "s", "it has no values")
    middle = float(np.median(values))
    for unit, above in EPOCH.items():
        if above <= middle < 1000.0 * above and (unit != "s" or middle < 1e10):
            return Guess(what, unit, f"{middle:.10g} counts {unit} from 1970 to our days")
    rising = np.diff(values)
    rising = rising[rising > 0]
    if len(rising) == 0:
        return Guess(what, "s", "it does not rise")
    step = float(np.median(rising))
    whole = bool(np.all(values == np.rint(values)))
    units = [unit for unit in SCALES[Quantity.TIME] if not (whole and unit == "s" and step < 1000.0 and step > 1.0)]
    rates = {unit: 1e9 / (step * SCALES[Quantity.TIME][unit]) for unit in units}
    unit = min(rates, key=lambda name: abs(np.log(rates[name] / USUAL_RATE_HZ)))
    return Guess(what, unit, f"its usual step of {step:.6g} then means {rates[unit]:.4g} Hz")


def accel_unit(accel: Floats) -> Guess | None:
    """The unit of an accelerometer (n, 3): that in which its usual norm is near gravity; None where none is."""
    norm = _usual_norm(accel)
    fits = {unit: norm * scale for unit, scale in SCALES[Quantity.ACCEL].items()}
    fits = {unit: size for unit, size in fits.items() if 0.5 * G < size < 2.0 * G}
    if not fits:
        return None
    unit = min(fits, key=lambda name: abs(np.log(fits[name] / G)))
    return Guess(
        "unit of the accelerometer", unit, f"its usual norm of {norm:.4g} is then {fits[unit] / G:.2f} of gravity"
    )


def gyro_unit(time_s: Floats, accel: Floats, gyro: Floats, accel_unit: str) -> Guess:
    """The unit of a gyroscope (n, 3): that in which gravity turns in the body (``accel``, any unit) as it says."""
    what = "unit of the gyroscope"
    ratio, correlation = turning(time_s, accel, gyro)
    units = {unit: SCALES[Quantity.GYRO][unit] for unit in ("rad/s", "deg/s", "mrad/s", "mdeg/s")}
    if correlation > MIN_CORRELATION:
        unit = min(units, key=lambda name: abs(np.log(ratio / units[name])))
        if abs(np.log(ratio / units[unit])) < 0.7:
            return Guess(
                what,
                unit,
                f"the accelerometer turns at {ratio:.3g} rad/s per unit of it (correlation {correlation:.2f})",
            )
    largest = float(np.nanmax(np.abs(gyro), initial=0.0))
    if largest > 40.0:
        return Guess(what, "deg/s", f"it reaches {largest:.4g}, more than any gyroscope measures in rad/s")
    unit = "deg/s" if accel_unit == "g" else "rad/s"
    return Guess(what, unit, f"loggers that write {accel_unit} write {unit} (there is too little motion to tell)")


def mag_unit(mag: Floats) -> Guess:
    """The unit of a magnetometer (n, 3): that in which its usual norm is the earth's."""
    what = "unit of the magnetometer"
    norm = _usual_norm(mag)
    fits = {unit: norm * scale for unit, scale in SCALES[Quantity.MAG].items()}
    fits = {unit: size for unit, size in fits.items() if FIELD_T[0] < size < FIELD_T[1] and unit not in ("mT", "a.u.")}
    if not fits:
        return Guess(what, f"{EARTH_T / norm:.6g} T", f"its usual norm of {norm:.4g} fits no unit: taken as 50 uT")
    unit = min(fits, key=lambda name: abs(np.log(fits[name] / EARTH_T)))
    return Guess(what, unit, f"its usual norm of {norm:.4g} is then {fits[unit] * 1e6:.1f} uT")


def angle_unit(angles: Floats) -> Guess:
    """The unit of Euler angles (n, 3)."""
    largest = float(np.nanmax(np.abs(angles), initial=0.0))
    unit = "deg" if largest > 2.0 * np.pi + 0.01 else "rad"
    return Guess("unit of the angles", unit, f"they reach {largest:.4g}")


def turning(time_s: Floats, accel: Floats, gyro: Floats) -> tuple[float, float]:
    """How fast ``accel`` turns per unit of ``gyro``, rad/s, by least squares on da/dt = -w x a, and the correlation.

    Means over `BLOCK_S` take out most of the noise; (0, 0) where there is nothing to go by.
    """
    n = min(len(time_s), ROWS)
    span = float(time_s[n - 1] - time_s[0]) if n else 0.0
    size = max(1, round(BLOCK_S * n / span)) if span > 0 else 0
    if size == 0 or n < 20 * size:
        return 0.0, 0.0
    time, a, w = (_block_means(values[:n], size) for values in (time_s[:, np.newaxis], accel, gyro))
    a = a / _usual_norm(a)
    change = np.diff(a, axis=0)
    expected = -np.cross(0.5 * (w[1:] + w[:-1]), 0.5 * (a[1:] + a[:-1])) * np.diff(time, axis=0)
    good = _usual(change) & _usual(expected)
    change, expected = change[good], expected[good]
    power, both = float(np.sum(expected * expected)), float(np.sum(change * expected))
    if not (power > 0.0 and np.any(change)):
        return 0.0, 0.0
    return both / power, both / float(np.sqrt(power) * np.linalg.norm(change))


def _usual(vectors: Floats) -> NDArray[np.bool_]:
    """Rows (n,) that are finite and no longer than `OUTLIER` times what nine in ten are."""
    length = np.linalg.norm(vectors, axis=1)
    finite = np.isfinite(length)
    return np.asarray(finite & (length <= OUTLIER * np.quantile(length[finite], 0.9))) if np.any(finite) else finite


def _block_means(values: Floats, size: int) -> Floats:
    whole = len(values) // size * size
    return np.asarray(values[:whole].reshape(-1, size, values.shape[1]).mean(axis=1))


def _usual_norm(vectors: Floats) -> float:
    norms = np.linalg.norm(vectors[:ROWS], axis=1)
    norms = norms[np.isfinite(norms) & (norms > 0)]
    return float(np.median(norms)) if len(norms) else float("nan")


@dataclass(frozen=True)
class Arrangement:
    """Where columns stand in a table without names: first column of each triple, and of the time."""

    time: int | None
    accel: int
    gyro: int
    mag: int | None
    because: str


def arrangement(columns: Sequence[Floats]) -> Arrangement | None:
    """Which columns (n,) are clock, accelerometer, gyroscope and magnetometer; None where that cannot be told.

    The clock rises, and is the first; the accelerometer is the triple whose usual norm is gravity's in some unit; the
    gyroscope is that of the other triples which turns it; what is left of a third triple is the magnetometer.
    """
    time = 0 if columns and _rises(columns[0]) else None
    first = 0 if time is None else 1
    starts = _triples(len(columns) - first, first)
    if len(starts) < 2:
        return None
    triples = {start: np.stack(columns[start : start + 3], axis=1) for start in starts}
    accel = min(
        (start for start in starts if _is_gravity(triples[start])), key=lambda s: _spread(triples[s]), default=None
    )
    if accel is None:
        return None
    clock = columns[0] if time == 0 else np.arange(len(columns[0])) / USUAL_RATE_HZ
    clock = (clock - clock[0]) * (SCALES[Quantity.TIME][time_unit(columns[0]).value] * 1e-9 if time == 0 else 1.0)
    fit = {start: turning(clock, triples[accel], triples[start])[1] for start in starts if start != accel}
    gyro = max(fit, key=lambda start: fit[start])
    if fit[gyro] < MIN_CORRELATION:
        gyro = next(start for start in starts if start != accel)
    mag = next((start for start in starts if start not in (accel, gyro)), None)
    norm = _usual_norm(triples[accel])
    because = f"column {accel + 1} begins a triple of norm {norm:.4g}, and column {gyro + 1} one that turns it"
    return Arrangement(time, accel, gyro, mag, because)


def time_column(names: Sequence[str], columns: Sequence[NDArray[Any]]) -> tuple[int, Guess] | None:
    """The first column, where it rises as a clock does, and neither is named nor steps as a counter."""
    if not columns or columns[0].dtype == object or _COUNTER.search(names[0]):
        return None
    values = columns[0].astype(np.float64)
    if not _rises(values) or bool(np.all(np.diff(values[:ROWS]) == 1.0)):
        return None
    return 0, Guess("time", f"column 1 ({names[0]})", "it is the first, and rises")


def _rises(column: Floats) -> bool:
    steps = np.diff(column[:ROWS])
    return len(steps) > 1 and bool(np.mean(steps > 0) > 0.5) and bool(np.mean(steps >= 0) > 0.95)


def _triples(count: int, first: int) -> list[int]:
    """First columns of the triples: one after the other, or with the temperature between the first and the second."""
    usual = {6: (0, 3), 7: (0, 4), 8: (0, 3), 9: (0, 3, 6), 10: (0, 3, 6)}
    return [first + start for start in usual.get(count, (0, 3, 6) if count > 10 else ())]


def _is_gravity(triple: Floats) -> bool:
    norm = _usual_norm(triple)
    return any(GRAVITY[0] < norm * scale < GRAVITY[1] for scale in SCALES[Quantity.ACCEL].values())


def _spread(triple: Floats) -> float:
    norms = np.linalg.norm(triple[:ROWS], axis=1)
    low, middle, high = np.percentile(norms[np.isfinite(norms)], (10, 50, 90))
    return float((high - low) / middle)
