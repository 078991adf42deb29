"""One channel's messages, gathered chunk by chunk: as rows of one size as long as that holds, else as runs of bytes."""

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .chunks_in import Messages, Records
from .input_file import InputFile
from .ragged import Bytes, Places, joined, starts, void, window
from .records import MESSAGE_HEAD, RECORD_HEAD, Op, damaged

LEAD = 4
"""Rows begin so many bytes before a multiple of 8, so that the doubles of CDR are aligned in memory."""
LEAST_ROWS = 256
_HEAD = np.dtype(
    {
        "names": ["op", "length", "channel", "time"],
        "formats": ["u1", "<u8", "<u2", "<i8"],
        "offsets": [0, 1, 9, 15],
        "itemsize": MESSAGE_HEAD,
    }
)


Word = tuple[int, "np.dtype[Any]"]
Watch = Callable[[bytes], Sequence[Word]]


def _nothing(payload: bytes) -> Sequence[Word]:
    return ()


@dataclass(frozen=True, eq=False)
class Rows:
    """Messages of one size, ``stride`` bytes apart, the first at ``offset``; ``alike``: the watched words agree."""

    offset: int
    stride: int
    size: int
    alike: bool


class Payloads:
    """Messages of one channel: ``data[start[i]:start[i] + size[i]]``, log times, and the rows if they are regular."""

    def __init__(
        self, data: Bytes, time_ns: NDArray[np.int64], places: "tuple[Places, Places] | None", rows: Rows | None = None
    ) -> None:
        self.data = data
        self.time_ns = time_ns
        self.rows = rows
        self._places = places

    @cached_property
    def start(self) -> Places:
        """Where each message begins."""
        if self.rows is not None:
            return self.rows.offset + np.arange(len(self), dtype=np.int64) * self.rows.stride
        assert self._places is not None
        return self._places[0]

    @cached_property
    def size(self) -> Places:
        """The bytes of each message."""
        if self.rows is not None:
            return np.full(len(self), self.rows.size, np.int64)
        assert self._places is not None
        return self._places[1]

    def column(self, offset: int, dtype: "np.dtype[Any]") -> NDArray[Any]:
        """What lies ``offset`` bytes into each regular row, as a view."""
        assert self.rows is not None
        return np.ndarray((len(self),), dtype, self.data, self.rows.offset + offset, (self.rows.stride,))

    def __len__(self) -> int:
        return len(self.time_ns)


class Collector:
    """Gathers the messages of a channel; ``expected`` is how many there probably are.

    ``watch`` names, for the first payload, the words (offset, type) that tell whether others are laid out as it is:
    comparing them chunk by chunk is cheaper than when all rows have left the cache.
    """

    def __init__(self, file: InputFile, channel_id: int, expected: int, watch: Watch = _nothing) -> None:
        self.file = file
        self.channel_id = channel_id
        self.expected = expected
        self.count = 0
        self._times: list[NDArray[np.int64]] = []
        self._shape: _RowShape | None = None
        self._buffer = np.zeros(0, np.uint8)
        self._watch = watch
        self._words: list[tuple[str, int]] | None = None
        self._alike = True
        self._pieces: list[tuple[Bytes, Places]] | None = None

    def add(self, records: Records, messages: Messages) -> None:
        """Take the messages out of some records; InputError where they are not what the index says."""
        count = len(messages.at)
        if count == 0:
            return
        if not (self._pieces is None and self._shape is not None and self._add_rows(self._shape, records, messages)):
            self._add_any(records, messages)
        self._times.append(messages.time_ns)
        self.count += count

    def _add_rows(self, shape: "_RowShape", records: Records, messages: Messages) -> bool:
        """Take the messages as rows; False where anything about them is not as it should be."""
        at, data, whole = messages.at, records.data, shape.whole
        count = len(at)
        if count * whole > len(data) or int(at.min()) < 0 or int(at.max()) + whole > len(data):
            return False
        rows = window(data, shape.void)[at].view(shape.dtype)
        heads = (rows["front"] == shape.front).all() and (rows["back"] == shape.back).all()
        if not (heads and (rows["time"] == messages.time_ns).all()):
            return False
        if self._words is None:
            self._words = [(name, int(rows[name][0])) for name in shape.words]
        self._alike = self._alike and all(bool((rows[name] == value).all()) for name, value in self._words)
        self._reserve(count, shape.stride)
        offset = LEAD + self.count * shape.stride
        np.ndarray((count,), shape.payload, self._buffer, offset, (shape.stride,))[:] = rows["payload"]
        return True

    def _reserve(self, more: int, stride: int) -> None:
        """Make room; the number of messages that the file states decides the first size, if memory has it."""
        needed = self.count + more
        if LEAD + needed * stride <= len(self._buffer):
            return
        roomy = max(needed * 3 // 2, LEAST_ROWS) if self.count else max(needed, self.expected)
        try:
            larger = np.empty(LEAD + roomy * stride, np.uint8)
        except MemoryError:
            larger = np.empty(LEAD + needed * stride, np.uint8)
        used = LEAD + self.count * stride if self.count else 0
        larger[:used] = self._buffer[:used]
        self._buffer = larger

    def _add_any(self, records: Records, messages: Messages) -> None:
        """Take the messages whatever their sizes: the first ones as rows if they can be, else as runs of bytes."""
        size = self._sizes(records, messages)
        if self._shape is None and self._pieces is None and size[0] and (size == size[0]).all():
            first = int(messages.at[0]) + MESSAGE_HEAD
            words = self._watch(records.data[first : first + int(size[0])].tobytes())
            self._shape = _row_shape(int(size[0]), self.channel_id, words)
            if self._add_rows(self._shape, records, messages):
                return
        if self._pieces is None:
            self._pieces = []
            if self.count:
                self._pieces.append(self._rows_as_piece())
        self._pieces.append((joined(records.data, messages.at + MESSAGE_HEAD, size), size))

    def _rows_as_piece(self) -> tuple[Bytes, Places]:
        """The rows so far as runs of bytes; the rows are given up."""
        assert self._shape is not None
        start = LEAD + np.arange(self.count, dtype=np.int64) * self._shape.stride
        size = np.full(self.count, self._shape.whole - MESSAGE_HEAD, np.int64)
        piece = joined(self._buffer, start, size)
        self._buffer = np.zeros(0, np.uint8)
        return piece, size

    def _sizes(self, records: Records, messages: Messages) -> Places:
        """The payloads' sizes, once everything else that the records say has been checked."""
        data, at = records.data, messages.at
        if int(at.min()) < 0 or int(at.max()) + MESSAGE_HEAD > len(data):
            self._wrong(records, "a message index points beyond its chunk")
        heads = window(data, void(MESSAGE_HEAD))[at].view(_HEAD)
        good = (heads["op"] == Op.MESSAGE) & (heads["channel"] == self.channel_id)
        if not (good & (heads["time"] == messages.time_ns)).all():
            self._wrong(records, "a message index points at what is not its message")
        size = heads["length"].astype(np.int64) - (MESSAGE_HEAD - RECORD_HEAD)
        if (size < 0).any() or (size > len(data) - MESSAGE_HEAD - at).any():
            self._wrong(records, "a message goes beyond the end of its chunk")
        if int(size.sum()) + len(size) * MESSAGE_HEAD > len(data):
            self._wrong(records, "a message index lists more messages than there are")
        return size

    def _wrong(self, records: Records, what: str) -> None:
        raise damaged(self.file.path, records.offset, f"{what} (channel {self.channel_id})")

    def payloads(self) -> Payloads:
        """All messages, in the order of their times (stable)."""
        time_ns = np.concatenate(self._times) if self._times else np.zeros(0, np.int64)
        ordered = not (time_ns[1:] < time_ns[:-1]).any()
        order = slice(None) if ordered else np.argsort(time_ns, kind="stable")
        if self._pieces is None and self._shape is not None:
            shape = self._shape
            data = self._buffer if ordered else _sorted_rows(self._buffer, shape, order)
            return Payloads(
                data, time_ns[order], None, Rows(LEAD, shape.stride, shape.whole - MESSAGE_HEAD, self._alike)
            )
        pieces = self._pieces or [(np.zeros(0, np.uint8), np.zeros(0, np.int64))]
        size = np.concatenate([size for _, size in pieces])
        data = np.concatenate([data for data, _ in pieces])
        return Payloads(data, time_ns[order], (starts(size)[order], size[order]))


@dataclass(frozen=True, eq=False)
class _RowShape:
    """Message records of one size on one channel: the eight bytes from 0 and from 3 on say opcode, length, channel."""

    whole: int
    stride: int
    void: "np.dtype[np.void]"
    payload: "np.dtype[np.void]"
    dtype: "np.dtype[np.void]"
    front: int
    back: int
    words: tuple[str, ...]


def _row_shape(size: int, channel_id: int, words: Sequence[Word]) -> _RowShape:
    whole = MESSAGE_HEAD + size
    head = struct.pack("<BQH", Op.MESSAGE, whole - RECORD_HEAD, channel_id)
    names = tuple(f"word{offset}" for offset, _ in words)
    fields = {
        "names": ["front", "back", "time", "payload", *names],
        "formats": ["<u8", "<u8", "<i8", void(size), *[dtype for _, dtype in words]],
        "offsets": [0, 3, 15, MESSAGE_HEAD, *[MESSAGE_HEAD + offset for offset, _ in words]],
        "itemsize": whole,
    }
    front, back = int.from_bytes(head[:8], "little"), int.from_bytes(head[3:], "little")
    dtype: np.dtype[np.void] = np.dtype(fields)  # type: ignore[call-overload]
    return _RowShape(whole, -(-size // 8) * 8, void(whole), void(size), dtype, front, back, names)


def _sorted_rows(buffer: Bytes, shape: _RowShape, order: "Places | slice") -> Bytes:
    """The rows moved into another order, so that they stay regular."""
    count = (len(buffer) - LEAD) // shape.stride
    rows = np.ndarray((count,), shape.payload, buffer, LEAD, (shape.stride,))[order]
    data = np.empty(LEAD + len(rows) * shape.stride, np.uint8)
    np.ndarray((len(rows),), shape.payload, data, LEAD, (shape.stride,))[:] = rows
    return data
