"""One channel's messages, gathered chunk by chunk: as rows of one size as long as that holds, else as runs of bytes."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .chunks_in import Messages, Records
from .input_file import InputFile
from .ragged import Bytes, Places, joined, starts, void, window
from .records import MESSAGE_HEAD, RECORD_HEAD, Op, damaged

LEAD = 4
"""Rows begin so many bytes before a multiple of 8, so that the doubles of CDR are aligned in memory."""
LEAST_ROWS = 256
_HEAD = {"names": ["op", "length", "channel", "time"], "formats": ["u1", "<u8", "<u2", "<u8"], "offsets": [0, 1, 9, 15]}


@dataclass(frozen=True, eq=False)
class Payloads:
    """Messages of one channel: ``data[start[i]:start[i] + size[i]]``, log times, and the rows' spacing if regular."""

    data: Bytes
    start: Places
    size: Places
    time_ns: NDArray[np.int64]
    stride: int | None

    def __len__(self) -> int:
        return len(self.time_ns)


class Collector:
    """Gathers the messages of a channel; ``expected`` is how many there probably are."""

    def __init__(self, file: InputFile, channel_id: int, expected: int) -> None:
        self.file = file
        self.channel_id = channel_id
        self.expected = expected
        self.count = 0
        self._times: list[NDArray[np.int64]] = []
        self._size: int | None = None
        self._stride = 0
        self._buffer = np.zeros(0, np.uint8)
        self._pieces: list[tuple[Bytes, Places]] | None = None

    def add(self, records: Records, messages: Messages) -> None:
        """Take the messages out of some records; InputError where they are not what the index says."""
        if len(messages.at) == 0:
            return
        head = self._heads(records, messages)
        if self._pieces is None and not self._add_rows(records, messages, head):
            self._to_pieces()
        if self._pieces is not None:
            self._add_pieces(records, messages, head)
        self._times.append(messages.time_ns)
        self.count += len(messages.at)

    def _heads(self, records: Records, messages: Messages) -> Places:
        """The payloads' sizes, once everything else that the records say has been checked."""
        data, at = records.data, messages.at
        if int(at.min()) < 0 or int(at.max()) + MESSAGE_HEAD > len(data):
            self._wrong(records, "a message index points beyond its chunk")
        if self._pieces is None and self._size is not None and int(at.max()) + MESSAGE_HEAD + self._size <= len(data):
            return np.zeros(0, np.int64)  # `_add_rows` looks at the heads of the rows that it takes anyway
        heads = window(data, void(MESSAGE_HEAD))[at]
        return self._checked(records, messages, heads.view(_head_dtype(MESSAGE_HEAD)))

    def _checked(self, records: Records, messages: Messages, heads: NDArray[np.void]) -> Places:
        good = (heads["op"] == Op.MESSAGE) & (heads["channel"] == self.channel_id)
        if not (good & (heads["time"].view(np.int64) == messages.time_ns)).all():
            self._wrong(records, "a message index points at what is not its message")
        size = heads["length"].astype(np.int64) - (MESSAGE_HEAD - RECORD_HEAD)
        if (size < 0).any() or (size > len(records.data) - MESSAGE_HEAD - messages.at).any():
            self._wrong(records, "a message goes beyond the end of its chunk")
        if int(size.sum()) + len(size) * MESSAGE_HEAD > len(records.data):
            self._wrong(records, "a message index lists more messages than there are")
        return size

    def _wrong(self, records: Records, what: str) -> None:
        raise damaged(self.file.path, records.offset, f"{what} (channel {self.channel_id})")

    def _add_rows(self, records: Records, messages: Messages, size: Places) -> bool:
        """Take the messages as rows; False where they are not of the one size."""
        if self._size is None:
            if (size != size[0]).any():
                return False
            self._size = int(size[0])
            self._stride = -(-self._size // 8) * 8
        whole = MESSAGE_HEAD + self._size
        if int(messages.at.max()) + whole > len(records.data):
            return False
        rows = window(records.data, void(whole))[messages.at]
        heads = rows.view(_head_dtype(whole))
        if (heads["length"] != whole - RECORD_HEAD).any():
            return False
        self._checked(records, messages, heads)
        if self._size:
            self._reserve(len(rows))
            payload = {"names": ["x"], "formats": [void(self._size)], "offsets": [MESSAGE_HEAD], "itemsize": whole}
            self._rows(self.count, len(rows))[:] = rows.view(np.dtype(payload))["x"]  # type: ignore[call-overload]
        return True

    def _rows(self, first: int, count: int) -> NDArray[np.void]:
        assert self._size is not None
        offset = LEAD + first * self._stride
        return np.ndarray((count,), void(self._size), self._buffer, offset, (self._stride,))

    def _reserve(self, more: int) -> None:
        """Make room; the number of messages that the file states decides the first size, if memory has it."""
        needed = self.count + more
        if LEAD + needed * self._stride <= len(self._buffer):
            return
        roomy = max(needed * 3 // 2, LEAST_ROWS) if self.count else max(needed, self.expected)
        try:
            larger = np.empty(LEAD + roomy * self._stride, np.uint8)
        except MemoryError:
            larger = np.empty(LEAD + needed * self._stride, np.uint8)
        used = LEAD + self.count * self._stride if self.count else 0
        larger[:used] = self._buffer[:used]
        self._buffer = larger

    def _to_pieces(self) -> None:
        """Give the rows up: from now on the messages differ in size."""
        self._pieces = []
        if self.count and self._size is not None:
            start, size = self._places(), np.full(self.count, self._size, np.int64)
            self._pieces.append((joined(self._buffer, start, size), size))
        self._buffer = np.zeros(0, np.uint8)

    def _places(self) -> Places:
        return LEAD + np.arange(self.count, dtype=np.int64) * self._stride

    def _add_pieces(self, records: Records, messages: Messages, size: Places) -> None:
        assert self._pieces is not None
        if len(size) == 0:
            heads = window(records.data, void(MESSAGE_HEAD))[messages.at]
            size = self._checked(records, messages, heads.view(_head_dtype(MESSAGE_HEAD)))
        self._pieces.append((joined(records.data, messages.at + MESSAGE_HEAD, size), size))

    def payloads(self) -> Payloads:
        """All messages, in the order of their times (stable)."""
        nothing = np.zeros(0, np.int64)
        time_ns = np.concatenate(self._times) if self._times else nothing
        if self._pieces is None:
            size = np.full(self.count, self._size or 0, np.int64)
            found = Payloads(self._buffer, self._places(), size, time_ns, self._stride or None)
        else:
            size = np.concatenate([size for _, size in self._pieces]) if self._pieces else nothing
            data = np.concatenate([data for data, _ in self._pieces]) if self._pieces else np.zeros(0, np.uint8)
            found = Payloads(data, starts(size), size, time_ns, None)
        if (time_ns[1:] < time_ns[:-1]).any():
            order = np.argsort(time_ns, kind="stable")
            return _reordered(found, order)
        return found


def _reordered(found: Payloads, order: Places) -> Payloads:
    """The rows in another order: moved where they are regular, so that they stay so."""
    if found.stride is None:
        return Payloads(found.data, found.start[order], found.size[order], found.time_ns[order], None)
    size = int(found.size[0])
    rows = np.ndarray((len(order),), void(size), found.data, LEAD, (found.stride,))
    data = np.empty(LEAD + len(order) * found.stride, np.uint8)
    np.ndarray((len(order),), void(size), data, LEAD, (found.stride,))[:] = rows[order]
    return Payloads(data, found.start, found.size, found.time_ns[order], found.stride)


@lru_cache(maxsize=1024)
def _head_dtype(itemsize: int) -> "np.dtype[np.void]":
    return np.dtype({**_HEAD, "itemsize": itemsize})
