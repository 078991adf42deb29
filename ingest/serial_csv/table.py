"""The lines of data as columns of numbers, and every other line counted with its reason."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from . import arrow
from .dialect import SAMPLE_BYTES, Dialect
from .lines import COMMENT, DAMAGED, DATA, HEADER, NOT_A_NUMBER, REASONS, TEXT, Odd, classified, reason_of
from .text import Bytes, Text, count, largest

Ints = NDArray[np.int64]

MOST_ODD: Final = 0.2
"""With a larger part of odd lines, all lines are told apart first."""


@dataclass(frozen=True, eq=False)
class Table:
    """``columns`` are (n,) each: float64 (NaN where empty), int64 or billionths for an exact clock, object for text.

    ``line`` (n,) is the number of each row's line, of ``lines`` in all; ``odd`` are the lines that are no rows, in
    order. ``row_bytes`` is the length of a line of data, on average.
    """

    columns: tuple[NDArray[Any], ...]
    line: Ints
    lines: int
    odd: tuple[Odd, ...]
    row_bytes: float

    def __len__(self) -> int:
        return len(self.line)

    @property
    def damaged(self) -> Ints:
        """Numbers of the lines that were samples once."""
        return np.array([line.number for line in self.odd if line.reason in DAMAGED], np.int64)

    @property
    def said(self) -> list[Odd]:
        """What the device or a person wrote between the numbers."""
        return [line for line in self.odd if line.reason in (COMMENT, TEXT)]

    @property
    def dropped(self) -> Mapping[str, int]:
        """How many lines are no rows, by reason."""
        return dict(Counter(line.reason for line in self.odd))

    def dropped_bytes(self, harmless: frozenset[str]) -> int:
        """How long the lines are that are no rows, but for the harmless reasons."""
        return sum(len(line.text) + 1 for line in self.odd if line.reason not in harmless)


def parse(text: Text, dialect: Dialect, exact: int | None) -> Table:
    """All columns of the file; column ``exact`` keeps all its digits."""
    return _quick(text, dialect, exact) or _careful(text, dialect, exact)


def _quick(text: Text, dialect: Dialect, exact: int | None) -> Table | None:
    """The whole file at once, and only the lines that Arrow skips one by one; None where a line needs a closer look."""
    before = _before_data(text.data, dialect)
    if before is None or largest(text.data) > 0x7E:
        return None
    data = text.data[sum(len(line.text) + 1 for line in before) :]
    lines = count(data, ord("\n"))
    table, skipped = _attempt(data, dialect, exact)
    if table is None and (muted := _muted(data, before, dialect.delimiter)) is not None:
        table, skipped = _attempt(muted, dialect, exact)
    if table is None:
        return None
    empty = arrow.empty_rows(table)
    if len(table) + len(skipped) != lines or len(skipped) > MOST_ODD * lines:
        return None
    line = np.delete(np.arange(lines), skipped) if skipped else np.arange(lines)
    if empty is not None:
        skipped += line[empty].tolist()
        table, line = table.filter(pa.array(~empty)), line[~empty]
    odd = _odd(text, [number + len(before) for number in sorted(skipped)], dialect)
    if any(one.reason == DATA for one in odd):
        return None
    row_bytes = (len(data) - sum(len(one.text) + 1 for one in odd)) / max(len(line), 1)
    return Table(arrow.arrays(table), line + len(before), lines + len(before), (*before, *odd), row_bytes)


def _attempt(data: Bytes, dialect: Dialect, exact: int | None) -> tuple[pa.Table | None, list[int]]:
    """The table, or None where a value is no number, and the numbers of the lines that were skipped."""
    skipped: list[int] = []
    try:
        return arrow.numbers(data, dialect, exact, skipped), skipped
    except pa.ArrowInvalid:
        return None, skipped


def _muted(data: Bytes, before: list[Odd], delimiter: bytes) -> Bytes | None:
    """The same bytes, but where a header stands again it has one field: a device that resets prints it again. None
    where it does not."""
    plain = whole = data.tobytes()
    for header in (line.text for line in before if line.reason == HEADER):
        plain = plain.replace(b"\n" + header + b"\n", b"\n" + header.replace(delimiter, b"~") + b"\n")
    return None if plain is whole or plain == whole else np.frombuffer(plain, np.uint8)


def _before_data(data: Bytes, dialect: Dialect) -> list[Odd] | None:
    """The lines up to the header's last; None where one of them may be data."""
    count_before = max(dialect.header_lines, default=-1) + 1
    head = data[:SAMPLE_BYTES].tobytes().split(b"\n")[:count_before]
    odd = [
        Odd(number, HEADER if number in dialect.header_lines else reason_of(line, dialect), line)
        for number, line in enumerate(head)
    ]
    return None if any(line.reason == DATA for line in odd) else odd


def _odd(text: Text, numbers: list[int], dialect: Dialect) -> list[Odd]:
    """The lines of these numbers, each with its reason."""
    if not numbers:
        return []
    headers = {text.line(number).strip() for number in dialect.header_lines}
    lines = ((number, text.line(number)) for number in numbers)
    return [Odd(n, HEADER if line.strip() in headers else reason_of(line, dialect), line) for n, line in lines]


def _careful(text: Text, dialect: Dialect, exact: int | None) -> Table:
    """Any file: its lines are told apart first, and whatever then is no number costs its line."""
    codes = classified(text, dialect)
    line = np.flatnonzero(codes == 0)
    columns: tuple[NDArray[Any], ...] = tuple(np.zeros(0) for _ in range(dialect.fields))
    if len(line):
        columns, good = arrow.checked(text.only(codes == 0), dialect, exact)
        codes[line[~good]] = REASONS.index(NOT_A_NUMBER)
        line = line[good]
    odd = tuple(Odd(n, REASONS[codes[n]], text.line(n)) for n in np.flatnonzero(codes).tolist())
    row_bytes = (len(text.data) - sum(len(one.text) + 1 for one in odd)) / max(len(line), 1)
    return Table(columns, line, len(text), odd, row_bytes)
