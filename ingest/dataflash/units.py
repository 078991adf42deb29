"""Units, multipliers and instance columns: the UNIT, MULT and FMTU records applied to the formats."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from ...schemas.columns import Table
from .formats import Format, text

INSTANCE: Final = "#"
UNKNOWN: Final = "UNKNOWN"
COLUMNS: Final = {"UNIT": ("Id", "Label"), "MULT": ("Id", "Mult"), "FMTU": ("FmtType", "UnitIds", "MultIds")}
"""The types of record that describe others, and the columns they must have."""


@dataclass(frozen=True)
class Dictionary:
    """Unit and multiplier characters with their meaning, and the characters of each type by its number."""

    labels: Mapping[int, str]
    factors: Mapping[int, float]
    types: Mapping[int, tuple[str, str]]

    @classmethod
    def of(cls, tables: Mapping[str, Iterable[Table]]) -> "Dictionary":
        """From the UNIT, MULT and FMTU records; where something is said twice, the last counts."""
        unit, mult, fmtu = (_rows(tables.get(name, ()), columns) for name, columns in COLUMNS.items())
        labels = {int(character): text(label) for character, label in unit}
        # Multipliers are single precision made double: seven digits are what is meant. 0 is "none".
        factors = {int(character): float(f"{float(factor):.7g}") for character, factor in mult}
        return cls(
            {character: label for character, label in labels.items() if label != UNKNOWN},
            {character: factor for character, factor in factors.items() if factor != 0.0},
            {int(number): (text(unit_ids), text(factor_ids)) for number, unit_ids, factor_ids in fmtu},
        )

    def applied(self, form: Format, number: int) -> Format:
        """The format of type ``number`` with its units, multipliers and instance column."""
        if number not in self.types:
            return form
        count = len(form.columns)
        unit_ids, factor_ids = (characters.ljust(count, "-")[:count] for characters in self.types[number])
        place = unit_ids.find(INSTANCE)
        instance = form.columns[place] if place >= 0 and form.characters[place] != "a" else None
        named = ["" if character == INSTANCE else self.labels.get(ord(character), "") for character in unit_ids]
        return form.with_units(named, [self.factors.get(ord(character)) for character in factor_ids], instance)


def _rows(tables: Iterable[Table], columns: tuple[str, ...]) -> Iterator[tuple[Any, ...]]:
    for table in tables:
        if set(columns) <= set(table.dtype.names or ()):
            yield from zip(*(table[column].tolist() for column in columns), strict=True)
