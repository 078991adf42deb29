"""A column of stamps, whatever it counts, as the device's own nanoseconds."""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...schemas.errors import InputError
from .arrow import BILLIONTHS
from .guesses import Guess, time_unit
from .table import Table
from .units import NANOSECONDS

Ints = NDArray[np.int64]

MAX_NS: Final = 1 << 62
EXACT_BELOW: Final = 2.0**53
DIGITS: Final = 15
"""Significant digits of a number that a spreadsheet saves."""
MOST_FALLS: Final = 0.2
"""A column that falls more often than this is no clock."""


def at_rate(table: Table, rate_hz: float) -> Ints:
    """Stamps (n,) by the number of the sample; a damaged line was one too."""
    lost = np.searchsorted(table.damaged, table.line)
    number = np.arange(len(table)) + lost - (lost[0] if len(lost) else 0)
    return np.asarray(np.rint(number * (1e9 / rate_hz)).astype(np.int64))


def device_ns(column: NDArray[Any], unit: str, source: str) -> tuple[Ints, NDArray[np.bool_], str, Guess | None]:
    """Nanoseconds (n,) of a column in ``unit`` ("": guessed), which rows have any, the unit, and the guess."""
    if column.dtype == object:
        values, valid = dates(column)
        return _checked(values, valid, source), valid, "date", None
    plain = column.astype(np.int64) * 1e-9 if column.dtype == BILLIONTHS else column
    guess = None if unit else time_unit(plain)
    unit = guess.value if guess is not None else unit
    size = NANOSECONDS[unit]
    if column.dtype == BILLIONTHS:
        whole, part = np.divmod(column.astype(np.int64), 10**9)
        values, valid = whole * size + (part * size) // 10**9, np.ones(len(column), np.bool_)
    else:
        values, valid = _scaled(column, size)
    return _checked(values, valid, source), valid, unit, guess


def _scaled(column: NDArray[Any], size: int) -> tuple[Ints, NDArray[np.bool_]]:
    if column.dtype.kind == "i" and -MAX_NS // size < int(column.min()) and int(column.max()) < MAX_NS // size:
        return column.astype(np.int64, copy=False) * size, np.ones(len(column), np.bool_)
    if column.dtype.kind == "i":
        valid = np.abs(column) < MAX_NS // size
        return np.where(valid, column, 0).astype(np.int64) * size, valid
    valid = np.isfinite(column) & (np.abs(column) < MAX_NS / size)
    values = np.where(valid, column, 0.0)
    if size == 1 or float(np.abs(values).max(initial=0.0)) >= EXACT_BELOW:
        return _whole(values) * size, valid
    return np.rint(values * size).astype(np.int64), valid


def _whole(values: NDArray[np.float64]) -> Ints:
    """Whole numbers that doubles hold to `DIGITS` digits only."""
    largest = float(np.abs(values).max(initial=1.0))
    unit = 10 ** max(0, int(np.floor(np.log10(max(largest, 1.0)))) + 1 - DIGITS)
    return np.asarray(np.rint(values / unit).astype(np.int64) * unit)


def _checked(values: Ints, valid: NDArray[np.bool_], source: str) -> Ints:
    steps = np.diff(values[valid])
    if len(steps) > 4 and float(np.mean(steps < 0)) > MOST_FALLS:
        falls = int(np.count_nonzero(steps < 0))
        raise InputError(
            f"{source}: the column taken for the time falls {falls:,} times in {len(values):,} lines and is no clock; "
            "name the columns with --columns, or give --rate HZ"
        )
    return values


def dates(column: NDArray[Any]) -> tuple[Ints, NDArray[np.bool_]]:
    """UTC nanoseconds of ISO 8601 dates, or of times of the day (then since midnight)."""
    import pandas as pd

    texts = pd.Series([value.decode("utf-8", "replace").strip() for value in column.tolist()], dtype="str")
    of_day = texts.str.match(r"^\d{1,2}:\d{2}:\d{2}")
    texts = texts.where(~of_day, "1970-01-01T" + texts.str.zfill(8).str.replace(",", "."))
    stamps = pd.to_datetime(texts, format="ISO8601", utc=True, errors="coerce").dt.as_unit("ns")
    valid = stamps.notna().to_numpy(dtype=np.bool_)
    return np.where(valid, stamps.astype("int64").to_numpy(), 0), valid
