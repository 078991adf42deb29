"""Where the sound records of a damaged file lie. No length is trusted; what is no record is passed over."""

import struct
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Final

import numpy as np

from ..schemas.errors import InputError
from .compression import LARGEST_RATIO
from .ragged import Bytes
from .records import MAGIC, MESSAGE_HEAD, RECORD_HEAD, Cursor, Op, read_channel, read_schema

HEAD: Final = struct.Struct("<BQ")
PRIVATE: Final = 0x80
WINDOW: Final = 1 << 20
LARGEST: Final = 1 << 40
"""No record is larger; a length beyond it is damage."""


class What(Enum):
    """What a stretch of the file is."""

    RECORD = "record"
    TORN = "torn"
    """A record that goes beyond the end of the file."""
    GARBAGE = "garbage"


@dataclass(frozen=True)
class Stretch:
    """Bytes ``start`` to ``end`` of the file; ``op`` of a record."""

    what: What
    start: int
    end: int
    op: int = 0


def stretches(data: Bytes, path: Path) -> Iterator[Stretch]:
    """The whole file, stretch by stretch, behind the opening magic (which may be damaged) up to the closing one."""
    scan = _Scan(data, path)
    at, size = min(len(MAGIC), len(data)), len(data)
    if size >= 2 * len(MAGIC) and data[-len(MAGIC) :].tobytes() == MAGIC:
        size -= len(MAGIC)
    while at < size:
        end = scan.end_of(at)
        if at < end <= size and scan.fits(at, end, size):
            yield Stretch(What.RECORD, at, end, int(data[at]))
            at = end
            continue
        if end > size and data[at] in (Op.CHUNK, Op.MESSAGE_INDEX):  # their lengths agree with what is in them
            yield Stretch(What.TORN, at, size, int(data[at]))
            return
        following = scan.next_after(at, size)
        torn = following == size and (end > size or size - at < RECORD_HEAD)
        yield Stretch(What.TORN if torn else What.GARBAGE, at, following, int(data[at]))
        at = following


class _Scan:
    """Judges places."""

    def __init__(self, data: Bytes, path: Path) -> None:
        self.data = data
        self.path = path

    def end_of(self, at: int) -> int:
        """Where the record at ``at`` ends (beyond the file where it is torn), ``at`` itself where there is none."""
        if at + RECORD_HEAD > len(self.data):
            return at
        op, length = HEAD.unpack_from(self.data.data, at)
        if (op not in _CHECKS and op < PRIVATE) or length > LARGEST:
            return at
        if op >= PRIVATE and self._head_is_right(at):  # a chunk whose opcode is damaged
            return at
        end: int = at + RECORD_HEAD + length
        content = self.data[at + RECORD_HEAD : end]
        whole = len(content) == length
        check = _CHECKS.get(op)
        try:
            sound = check is None or check(Cursor(content.data, self.path, at), length, whole)
        except (InputError, struct.error):
            sound = not whole and op == Op.CHUNK and length < LARGEST
        return end if sound else at

    def fits(self, at: int, end: int, size: int) -> bool:
        """Whether a record that carries no mark of its own length is followed by another one."""
        return self.data[at] != Op.MESSAGE or end == size or self.end_of(end) > end

    def next_after(self, at: int, size: int) -> int:
        """The next place where a record credibly begins, or the end of the file."""
        for start in range(at + 1, size, WINDOW):
            stop = min(start + WINDOW, size - RECORD_HEAD)
            if stop <= start:
                break
            for place in self._candidates(start, stop):
                if self._credible(place, size):
                    return place
        return size

    def _candidates(self, start: int, stop: int) -> list[int]:
        data = self.data
        first = data[start:stop]
        likely = (first >= 1) & (first <= max(_CHECKS))
        for byte in range(5, RECORD_HEAD):
            likely &= data[start + byte : stop + byte] == 0
        found: list[int] = (np.flatnonzero(likely) + start).tolist()
        return found

    def _credible(self, at: int, size: int) -> bool:
        """Whether a record is here, and behind it another one or the file's end."""
        end = self.end_of(at)
        if not at < end <= size:
            return end > size and self.data[at] == Op.CHUNK and self._head_is_right(at)
        if self.data[at] == Op.CHUNK:
            return True
        return end == size or self.end_of(end) > end

    def _head_is_right(self, at: int) -> bool:
        content = self.data[at + RECORD_HEAD : at + RECORD_HEAD + 64]
        (length,) = struct.unpack_from("<Q", self.data.data, at + 1)
        try:
            return _chunk(Cursor(content.data, self.path, at), length, False)
        except (InputError, struct.error):
            return False


def _chunk(content: Cursor, length: int, _whole: bool) -> bool:
    """The sizes that a chunk's head states agree with each other."""
    _, _, size, _ = content.numbers("QQQI")
    compression = content.text()
    (packed,) = content.numbers("Q")
    ratio = LARGEST_RATIO.get(compression, 1 << 16)
    return bool(content.at + packed == length and size <= (packed + 64) * ratio + 64)


def _exactly(number: int) -> Callable[[Cursor, int, bool], bool]:
    return lambda _content, length, _whole: length == number


def _message(_content: Cursor, length: int, _whole: bool) -> bool:
    return length >= MESSAGE_HEAD - RECORD_HEAD


def _message_index(content: Cursor, length: int, _whole: bool) -> bool:
    _, size = content.numbers("HI")
    return size == length - 6 and size % 16 == 0


def _texts(count: int) -> Callable[[Cursor, int, bool], bool]:
    def check(content: Cursor, length: int, whole: bool) -> bool:
        for _ in range(count if whole else 0):
            content.text()
        return not whole or content.at == length

    return check


def _parsed(read: Callable[[Cursor], object]) -> Callable[[Cursor, int, bool], bool]:
    def check(content: Cursor, length: int, whole: bool) -> bool:
        return not whole or (read(content) is not None and content.at == length)

    return check


def _attachment(content: Cursor, length: int, whole: bool) -> bool:
    content.numbers("QQ")
    content.text()
    content.text()
    (size,) = content.numbers("Q")
    return bool(not whole or content.at + size + 4 == length)


def _metadata(content: Cursor, length: int, whole: bool) -> bool:
    if whole:
        content.text()
        content.text_map()
    return not whole or content.at == length


_CHECKS: Final[Mapping[int, Callable[[Cursor, int, bool], bool]]] = {
    Op.HEADER: _texts(2),
    Op.FOOTER: _exactly(20),
    Op.SCHEMA: _parsed(read_schema),
    Op.CHANNEL: _parsed(read_channel),
    Op.MESSAGE: _message,
    Op.CHUNK: _chunk,
    Op.MESSAGE_INDEX: _message_index,
    Op.CHUNK_INDEX: lambda content, length, whole: length >= 64,
    Op.ATTACHMENT: _attachment,
    Op.ATTACHMENT_INDEX: lambda content, length, whole: length >= 48,
    Op.STATISTICS: lambda content, length, whole: length >= 46,
    Op.METADATA: _metadata,
    Op.METADATA_INDEX: lambda content, length, whole: length >= 20,
    Op.SUMMARY_OFFSET: _exactly(17),
    Op.DATA_END: _exactly(4),
}
