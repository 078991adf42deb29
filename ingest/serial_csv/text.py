"""A file's bytes as clean lines: one encoding, one line end, single blanks, no labels; and no line more or less."""

import codecs
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]

NEWLINE: Final = 10
RETURN: Final = 13
TAB: Final = 9
BLANK: Final = 32
PART_BYTES: Final = 1 << 18
LABEL: Final = re.compile(rb"^[ \t]*([A-Za-z_][\w .]*?)[ \t]*[:=][ \t]*[-+.\d]")
MONITOR_STAMP: Final = re.compile(rb"^\d\d:\d\d:\d\d\.\d{3} -> ", re.MULTILINE)
"""What Arduino's serial monitor puts before each line."""


@dataclass(frozen=True, eq=False)
class Text:
    """Bytes (n,) that end with a newline; line k is ``data[starts[k]:ends[k]]``, without its line end."""

    data: Bytes

    @cached_property
    def ends(self) -> Ints:
        """Where each line ends: its newline."""
        return np.flatnonzero(self.data == NEWLINE)

    @cached_property
    def starts(self) -> Ints:
        """Where each line begins."""
        return np.concatenate([np.zeros(min(1, len(self.ends)), np.int64), self.ends[:-1] + 1])

    def __len__(self) -> int:
        return len(self.ends)

    def line(self, number: int) -> bytes:
        """One line, without its newline."""
        return self.data[self.starts[number] : self.ends[number]].tobytes()

    def only(self, kept: NDArray[np.bool_]) -> Bytes:
        """The bytes of the lines (n,) that are kept."""
        turns = np.flatnonzero(np.diff(np.concatenate([[False], kept, [False]])))
        runs = (self.data[self.starts[a] : self.ends[b - 1] + 1] for a, b in turns.reshape(-1, 2).tolist())
        return np.concatenate([*runs, self.data[:0]])


def count(data: Bytes, byte: int) -> int:
    """How often a byte occurs."""
    return sum(int(np.count_nonzero(part == byte)) for part in _parts(data))


def holds(data: Bytes, byte: int) -> bool:
    """Whether a byte occurs."""
    return any(bool(np.any(part == byte)) for part in _parts(data))


def largest(data: Bytes) -> int:
    """The largest byte."""
    return max((int(part.max()) for part in _parts(data)), default=0)


def _parts(data: Bytes) -> Iterator[Bytes]:
    """The bytes in pieces that fit into a processor's cache."""
    return (data[start : start + PART_BYTES] for start in range(0, len(data), PART_BYTES))


def decoded(data: Bytes) -> Bytes:
    """UTF-8 without byte order mark, whatever the encoding was, with newlines as line ends and one at the end."""
    head = data[:4].tobytes()
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        data = np.frombuffer(data.tobytes().decode("utf-16", "replace").encode(), np.uint8)
    elif head.startswith(codecs.BOM_UTF8):
        data = data[3:]
    if len(data) and RETURN in data[:4096] and NEWLINE not in data[:4096]:
        data = np.where(data == RETURN, np.uint8(NEWLINE), data)
    if len(data) == 0 or data[-1] != NEWLINE:
        data = np.append(data, np.uint8(NEWLINE))
    return data


def single_blanks(data: Bytes) -> Bytes:
    """Runs of blanks and tabs as one blank each, and none at either end of a line."""
    blank = (data == BLANK) | (data == TAB)
    if not np.any(blank):
        return data
    edge = (data == NEWLINE) | (data == RETURN)
    before = np.concatenate([[True], (blank | edge)[:-1]])
    clean = np.where(blank, np.uint8(BLANK), data)[~(blank & before)]
    trailing = (clean == BLANK) & np.isin(np.append(clean[1:], NEWLINE), (NEWLINE, RETURN))
    return np.asarray(clean[~trailing])


def is_labelled(line: bytes, delimiter: bytes) -> bool:
    """Whether every field is ``label:value`` (or ``label=value``), as Arduino's serial plotter takes them."""
    fields = [field for field in line.split(delimiter) if field.strip()]
    return len(fields) > 1 and all(LABEL.match(field) for field in fields)


def labels(line: bytes, delimiter: bytes) -> list[str]:
    """The labels of such a line."""
    matches = (LABEL.match(field) for field in line.split(delimiter) if field.strip())
    return [match[1].decode("utf-8", "replace") for match in matches if match]


def without_labels(data: Bytes, names: list[str]) -> Bytes:
    """The same lines with the values alone."""
    spelled = b"|".join(re.escape(name.encode()) for name in sorted(names, key=len, reverse=True))
    return np.frombuffer(re.sub(rb"\b(?:" + spelled + rb")[ \t]*[:=][ \t]*", b"", data.tobytes()), np.uint8)


def without_quotes(data: Bytes) -> Bytes:
    """The lines without quotes, where most lines of the head have some."""
    lines = data[:8192].tobytes().split(b"\n")
    if 2 * sum(b'"' in line for line in lines) <= len(lines):
        return data
    return np.frombuffer(data.tobytes().translate(None, b'"'), np.uint8)


def without_monitor_stamps(data: Bytes) -> Bytes:
    """The lines without what the serial monitor put before them, where it put it before most lines of the head."""
    head = data[:8192].tobytes()
    if 2 * len(MONITOR_STAMP.findall(head)) < head.count(b"\n") or not MONITOR_STAMP.search(head):
        return data
    return np.frombuffer(MONITOR_STAMP.sub(b"", data.tobytes()), np.uint8)
