"""What a FMT record says: the columns of one type of record, and how they are stored."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

STORED: Final[Mapping[str, str]] = {
    "a": "(32,)<i2",
    "b": "i1",
    "B": "u1",
    "h": "<i2",
    "H": "<u2",
    "i": "<i4",
    "I": "<u4",
    "f": "<f4",
    "d": "<f8",
    "g": "<f2",
    "n": "S4",
    "N": "S16",
    "Z": "S64",
    "c": "<i2",
    "C": "<u2",
    "e": "<i4",
    "E": "<u4",
    "L": "<i4",
    "M": "u1",
    "q": "<i8",
    "Q": "<u8",
}
"""Format character -> numpy type of the stored value (AP_Logger, LogStructure.h)."""

MULTIPLIER: Final[Mapping[str, float]] = {"c": 0.01, "C": 0.01, "e": 0.01, "E": 0.01, "L": 1e-7}
"""Format characters that imply a scale: stored integer times this is the value."""

TEXT: Final = frozenset("nNZ")
FMT_TYPE: Final = 0x80
HEADER_BYTES: Final = 3
"""0xA3 0x95 type."""


@dataclass(frozen=True)
class Format:
    """A type of record: its name and, for each column, name, format character, unit and multiplier to that unit.

    ``instance`` is the column with the unit ``#``, which tells one sensor from another.
    """

    name: str
    characters: str
    columns: tuple[str, ...]
    units: tuple[str, ...] = ()
    multipliers: tuple[float | None, ...] = ()
    instance: str | None = None

    @classmethod
    def of(cls, name: str, characters: str, columns: Sequence[str]) -> "Format":
        """From a FMT record: column names made one per character and distinct, multipliers those of the characters."""
        names = distinct([*columns[: len(characters)], *(f"F{i}" for i in range(len(columns), len(characters)))])
        multipliers = tuple(MULTIPLIER.get(character) for character in characters)
        return cls(name, characters, names, ("",) * len(names), multipliers)

    @cached_property
    def dtype(self) -> "np.dtype[np.void]":
        """The record after its header, packed."""
        return np.dtype([(name, STORED[c]) for name, c in zip(self.columns, self.characters, strict=True)])

    def multiplier(self, column: str) -> float:
        """From the stored value to the value in its unit; 1 where the log gives none."""
        found = self.multipliers[self.columns.index(column)]
        return 1.0 if found is None else found

    def has(self, *columns: str) -> bool:
        """Whether all of ``columns`` exist."""
        return all(column in self.columns for column in columns)

    def with_units(self, units: Sequence[str], multipliers: Sequence[float | None], instance: str | None) -> "Format":
        """The same with what its FMTU record says; a format character's own multiplier stands."""
        own = (MULTIPLIER.get(character) for character in self.characters)
        both = tuple(mine if mine is not None else theirs for mine, theirs in zip(own, multipliers, strict=True))
        return replace(self, units=tuple(units), multipliers=both, instance=instance)


def distinct(names: Sequence[str]) -> tuple[str, ...]:
    """The names, empty and repeated ones told apart by a number."""
    result: list[str] = []
    for position, name in enumerate(names):
        unique = name or f"F{position}"
        while unique in result:
            unique += "_2"
        result.append(unique)
    return tuple(result)


def text(value: bytes) -> str:
    """A stored string: up to its first NUL, UTF-8, else ISO 8859-1 as pymavlink does."""
    plain = value.split(b"\0", 1)[0]
    try:
        return plain.decode()
    except UnicodeDecodeError:
        return plain.decode("latin-1")


FMT: Final = Format.of("FMT", "BBnNZ", ("Type", "Length", "Name", "Format", "Columns"))
