"""Which column is what: as the user says, else as the header says, else as the numbers suggest."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...schemas.csv_options import CsvOptions
from ...schemas.errors import InputError, UsageError
from .dialect import Dialect
from .guesses import Guess, arrangement
from .names import OTHER, Meaning, meaning
from .units import Quantity, canonical

AXES: Final[Mapping[Quantity, tuple[str, ...]]] = {
    Quantity.ACCEL: ("x", "y", "z"),
    Quantity.GYRO: ("x", "y", "z"),
    Quantity.MAG: ("x", "y", "z"),
    Quantity.QUATERNION: ("w", "x", "y", "z"),
    Quantity.EULER: ("roll", "pitch", "yaw"),
}
PASSED: Final = frozenset({"-", "_", ""})
"""Names in --columns for a column that is only kept."""


@dataclass(frozen=True)
class Group:
    """The columns of one sensor or attitude, in the order of `AXES`: quantity, number from 0, and the unit given."""

    quantity: Quantity
    instance: int
    columns: tuple[int, ...]
    unit: str
    truth: bool = False


@dataclass(frozen=True)
class Layout:
    """``time`` is the column of the clock, ``time_unit`` "" where unknown; ``names`` are those of all columns."""

    names: tuple[str, ...]
    groups: tuple[Group, ...]
    time: int | None
    time_unit: str
    guesses: tuple[Guess, ...] = ()

    @property
    def others(self) -> list[int]:
        """The columns that are neither clock, sensor nor attitude."""
        taken = {column for group in self.groups for column in group.columns} | {self.time}
        return [column for column in range(len(self.names)) if column not in taken]

    def of(self, quantity: Quantity) -> list[Group]:
        """The groups of a quantity."""
        return [group for group in self.groups if group.quantity is quantity]


def named(dialect: Dialect, options: CsvOptions, source: str) -> Layout | None:
    """The layout by the names that the user or the header gives; None where there are none, or none is known."""
    if len(options.columns) > dialect.fields:
        raise UsageError(f"{source}: --columns names {len(options.columns)} columns, a line has {dialect.fields}")
    header = dialect.names or ("",) * dialect.fields
    said = tuple(options.names.get(name, name) for name in header)
    spelled = (*options.columns, *said[len(options.columns) :]) if options.columns else said
    meanings = [OTHER if name in PASSED else meaning(name) for name in spelled]
    if options.columns:
        _check_known(options.columns, meanings, source)
    own = tuple(name or f"column{number + 1}" for number, name in enumerate(_kept_names(header, spelled)))
    layout = _layout(own, meanings, options, dialect)
    return layout if layout.groups else None


def _kept_names(header: Sequence[str], spelled: Sequence[str]) -> list[str]:
    return [name if name and name not in PASSED else given for name, given in zip(spelled, header, strict=True)]


def _check_known(columns: Sequence[str], meanings: Sequence[Meaning], source: str) -> None:
    if not any(known.quantity in AXES for known in meanings):
        raise UsageError(
            f"{source}: --columns {','.join(columns)} names no sensor; names are such as t_us, ax_g, gx_dps, mx_uT, qw"
        )


def _layout(names: tuple[str, ...], meanings: Sequence[Meaning], options: CsvOptions, dialect: Dialect) -> Layout:
    clock = None if options.rate_hz is not None else _clock(meanings, dialect)
    unit = options.time_unit or ("" if clock is None else meanings[clock].unit)
    return Layout(names, tuple(_groups(meanings, options, dialect)), clock, unit)


def _clock(meanings: Sequence[Meaning], dialect: Dialect) -> int | None:
    """The column of the time: numbers with a unit before numbers without, and these before dates."""
    clocks = [column for column, known in enumerate(meanings) if known.quantity is Quantity.TIME]
    return min(clocks, key=lambda c: (dialect.is_text[c], not meanings[c].unit, c), default=None)


def _groups(meanings: Sequence[Meaning], options: CsvOptions, dialect: Dialect) -> list[Group]:
    """The sensors all of whose axes are there, numbered from 0 in the order of the numbers in their names."""
    found: dict[tuple[Quantity, bool, int], dict[str, int]] = {}
    for column, known in enumerate(meanings):
        if known.quantity in AXES and not dialect.is_text[column]:
            key = (known.quantity, known.truth, -1 if known.instance is None else known.instance)
            found.setdefault(key, {}).setdefault(known.axis, column)
    groups: list[Group] = []
    for quantity, truth, number in sorted(found):
        axes = found[quantity, truth, number]
        if any(axis not in axes for axis in AXES[quantity]):
            continue
        columns = tuple(axes[axis] for axis in AXES[quantity])
        unit = next((meanings[c].unit for c in columns if meanings[c].unit), "")
        unit = unit or _said(options.units, quantity)
        instance = sum(g.quantity is quantity and g.truth is truth for g in groups)
        groups.append(Group(quantity, instance, columns, unit, truth))
    return groups


def _said(units: Mapping[str, str], quantity: Quantity) -> str:
    spelled = units.get(str(quantity), "")
    if not spelled:
        return ""
    unit = canonical(spelled, quantity)
    if unit is None:
        raise UsageError(f"{spelled!r} is no unit of {quantity}; there are such as g, m/s^2, deg/s, rad/s, uT, G, deg")
    return unit


def guessed(columns: Sequence[NDArray[Any]], names: Sequence[str], options: CsvOptions, source: str) -> Layout:
    """The layout by what the numbers look like; InputError where that does not tell."""
    numeric = [number for number, column in enumerate(columns) if column.dtype != object]
    found = arrangement([columns[number].astype(np.float64) for number in numeric])
    if found is None:
        listed = f" (columns: {', '.join(names)})" if any(names) else ""
        raise InputError(
            f"{source}: nothing says which columns are the sensors{listed}; "
            "name them, as in --columns t_us,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps"
        )
    groups = [
        Group(quantity, 0, tuple(numeric[start : start + 3]), _said(options.units, quantity))
        for quantity, start in ((Quantity.ACCEL, found.accel), (Quantity.GYRO, found.gyro), (Quantity.MAG, found.mag))
        if start is not None
    ]
    order = "".join(f", {g.quantity} from column {g.columns[0] + 1}" for g in groups)
    clock = numeric[found.time] if found.time is not None and options.rate_hz is None else None
    what = Guess("columns", f"{'time first' if found.time == 0 else 'no time'}{order}", found.because)
    own = tuple(name or f"column{number + 1}" for number, name in enumerate(names or [""] * len(columns)))
    return Layout(own, tuple(groups), clock, options.time_unit or "", (what,))


def with_guess(layout: Layout, guess: Guess) -> Layout:
    """The layout with one more guess."""
    return replace(layout, guesses=(*layout.guesses, guess))
