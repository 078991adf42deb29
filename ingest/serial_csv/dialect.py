"""How a file writes its table: what parts the fields, which mark stands before decimals, where the names are."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from .names import meaning
from .text import Bytes, decoded, is_labelled, labels
from .units import Quantity

SAMPLE_BYTES: Final = 262144
MAX_SAMPLE_LINES: Final = 2000
FEW_LINES: Final = 60
"""These are looked at first, and alone where they have a header and data."""
MIN_FIELDS: Final = 4
MIN_LINES: Final = 3
"""Of data, in a file without known names; with them, one is enough."""
LEAST_DATA: Final = 0.25
"""Of the sample's bytes, in lines of data."""
MOST_NULS: Final = 0.1
"""A file with a larger part of NUL bytes is no text."""
COMMENT_MARKS: Final = (b"#", b"//", b"%", b";")

_NUMBER: Final = rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?(?:nan|inf|ovf|null|none|n/a)"
NUMBER: Final = re.compile(rb"\s*(?:" + _NUMBER + rb")?\s*", re.IGNORECASE)
NUMBER_WITH_COMMA: Final = re.compile(rb"\s*(?:" + _NUMBER.replace(rb"\.", b",") + rb")?\s*", re.IGNORECASE)
_WORD: Final = re.compile(r"[A-Za-z]")
_WORDY: Final = re.compile(rb"[A-Za-df-z]")


@dataclass(frozen=True)
class Dialect:
    """``fields`` is how many a line of data has; ``names`` are the header's, empty where there is none.

    ``header_lines`` are the numbers of the lines in the sample that name columns or units; ``is_text`` marks the
    columns whose values are no numbers; ``labelled`` where each value is written ``label:value``.
    """

    delimiter: bytes
    decimal: bytes
    fields: int
    names: tuple[str, ...]
    header_lines: tuple[int, ...]
    is_text: tuple[bool, ...]
    labelled: bool = False

    @property
    def blanks(self) -> bool:
        """Whether runs of blanks part the fields."""
        return self.delimiter == b" "

    def number(self, field: bytes) -> bool:
        """Whether a field is a number, or empty."""
        return (NUMBER_WITH_COMMA if self.decimal == b"," else NUMBER).fullmatch(field) is not None

    def split(self, line: bytes) -> list[bytes]:
        """A line's fields."""
        return line.split() if self.blanks else line.rstrip(b"\r").split(self.delimiter)


_WAYS: Final = ((b",", b"."), (b";", b"."), (b";", b","), (b"\t", b"."), (b"\t", b","), (b" ", b"."), (b" ", b","))


def sniff(head: Bytes) -> Dialect | None:
    """The dialect of a file that begins with ``head``; None where it is no table of numbers."""
    plain = decoded(head[:SAMPLE_BYTES])
    if np.count_nonzero(plain == 0) > MOST_NULS * len(plain):
        return None
    lines = plain.tobytes().split(b"\n")[: MAX_SAMPLE_LINES + 1]
    lines = lines[:-1] if len(lines) > 2 else lines
    few = _best(lines[:FEW_LINES])
    return few if few is not None and few.names else _best(lines)


def _best(lines: Sequence[bytes]) -> Dialect | None:
    found = [dialect for way in _WAYS if (dialect := _measured(lines, *way)) is not None]
    best = max(found, key=lambda scored: scored[0], default=None)
    return None if best is None else best[1]


def _measured(lines: Sequence[bytes], delimiter: bytes, decimal: bytes) -> tuple[tuple[int, int], Dialect] | None:
    """The dialect with these marks, and how well it fits: lines of data, numbers in them."""
    if not any(delimiter in line for line in lines):
        return None
    bare = Dialect(delimiter, decimal, 0, (), (), ())
    if 2 * sum(is_labelled(line, delimiter) for line in lines) > sum(bool(line.strip()) for line in lines):
        return _labelled(lines, bare)
    rows = [bare.split(line) for line in lines]
    chosen = [number for number, row in enumerate(rows) if _is_data(row, bare)]
    data, size = [rows[number] for number in chosen], sum(len(lines[number]) for number in chosen)
    if not data or size < LEAST_DATA * sum(map(len, lines)):
        return None
    width = Counter(map(len, data)).most_common(1)[0][0]
    data = [row for row in data if len(row) == width]
    names, header = _header(lines, bare, width)
    if len(data) < MIN_LINES and not any(meaning(name).quantity is not Quantity.OTHER for name in names):
        return None
    numbers = sum(bare.number(field) and bool(field.strip()) for row in data for field in row)
    texts = tuple(_mostly_text([row[column] for row in data], bare) for column in range(width))
    return (numbers, len(data)), Dialect(delimiter, decimal, width, names, header, texts)


def _labelled(lines: Sequence[bytes], bare: Dialect) -> tuple[tuple[int, int], Dialect] | None:
    data = [line for line in lines if is_labelled(line, bare.delimiter)]
    names = Counter(tuple(labels(line, bare.delimiter)) for line in data).most_common(1)[0][0]
    if len(data) < MIN_LINES or len(names) < MIN_FIELDS - 1:
        return None
    width = Counter(len(bare.split(line)) for line in data).most_common(1)[0][0]
    dialect = Dialect(bare.delimiter, bare.decimal, width, names, (), (False,) * width, labelled=True)
    return (len(data) * len(names), len(data)), dialect


def _is_data(row: Sequence[bytes], bare: Dialect) -> bool:
    """A line of data: enough fields, most of them numbers, and not all empty."""
    filled = [field for field in row if field.strip()]
    numbers = sum(bare.number(field) for field in filled)
    return len(row) >= MIN_FIELDS and numbers >= MIN_FIELDS - 1 and 2 * numbers > len(filled)


def _mostly_text(values: Sequence[bytes], bare: Dialect) -> bool:
    return 2 * sum(bare.number(value) for value in values) <= len(values)


def _header(lines: Sequence[bytes], bare: Dialect, width: int) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """The names of the columns and the numbers of the lines that give them: of the lines that may be a header that with
    most known names, the first of equals. (A reset in the midst of a line runs half a sample into the header.)"""
    found: list[tuple[int, tuple[str, ...], tuple[int, ...]]] = []
    for number, line in enumerate(lines):
        cells = _cells(line, bare) if _WORDY.search(line) else []
        if not _names_columns(cells, width):
            continue
        below = _cells(lines[number + 1], bare) if number + 1 < len(lines) else []
        two = _is_names_or_units(below, bare, width)
        names = _joined(cells, below, width) if two else _fitted(cells, width)
        known = sum(meaning(name).quantity is not Quantity.OTHER for name in names)
        found.append((known, names, (number, number + 1) if two else (number,)))
    best = max(found, key=lambda candidate: candidate[0], default=(0, (), ()))
    return best[1], best[2]


def _cells(line: bytes, bare: Dialect) -> list[str]:
    """A header's cells, its comment mark taken away."""
    plain = line.decode("utf-8", "replace").strip("\r\n")
    plain = re.sub(r"^\s*(#|//|%)\s*", "", plain)
    delimiter = bare.delimiter.decode()
    if bare.blanks:
        return plain.replace(",", " ").split()
    return [cell.strip().strip('"').strip() for cell in plain.split(delimiter)]


def _names_columns(cells: Sequence[str], width: int) -> bool:
    """Whether cells are names of ``width`` columns: as many, words, and at least one of them known."""
    named = [cell for cell in cells if cell]
    if not width - 1 <= len(cells) <= width + 1 or len(named) * 4 < width:
        return False
    words = sum(_WORD.search(cell) is not None and not NUMBER.fullmatch(cell.encode()) for cell in named)
    grouped = len(named) < len(cells)
    known = sum(meaning(cell).quantity is not Quantity.OTHER for cell in named)
    return 2 * words > len(named) and (known > 0 or grouped or words == len(named))


def _is_names_or_units(cells: Sequence[str], bare: Dialect, width: int) -> bool:
    """Whether the line below a header goes on with it: axes under groups, or units under names."""
    numbers = sum(bool(cell) and bare.number(cell.encode()) for cell in cells)
    return width - 1 <= len(cells) <= width + 1 and numbers == 0 and any(cells)


def _joined(above: Sequence[str], below: Sequence[str], width: int) -> tuple[str, ...]:
    """Two lines of a header as one: ``IMU Gyroscope`` over ``X``, or ``Gyro X`` over ``deg/s``."""
    groups, below = list(_fitted(above, width)), _fitted(below, width)
    if "" in groups:
        for column in range(1, width):
            groups[column] = groups[column] or groups[column - 1]
        return tuple(f"{group} {name}".strip() for group, name in zip(groups, below, strict=True))
    return tuple(f"{name} ({unit})" if unit else name for name, unit in zip(groups, below, strict=True))


def _fitted(cells: Sequence[str], width: int) -> tuple[str, ...]:
    return (*cells[:width], *("" for _ in range(width - len(cells))))
