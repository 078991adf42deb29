"""Columns as complete Message records, put where the writer wants them."""

import struct
from collections.abc import Iterator
from itertools import groupby
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..schemas.columns import Columns
from ..schemas.fields import Fields
from ..schemas.layout import CDR_LE, Layout, Path, Slot, dotted, layout
from . import encode
from .disassemble import disassemble, stamp_path, stamps
from .lengths import common_lengths
from .ragged import Bytes, Places, void, window
from .records import MESSAGE_HEAD, RECORD_HEAD, Op
from .steps import steps_of
from .tree import select

ENCAPSULATION = b"\x00\x01\x00\x00"
BODY = MESSAGE_HEAD + len(ENCAPSULATION)
"""Bytes of a record before the origin that alignment counts from."""
_HEAD = np.dtype(
    {
        "names": ["op", "length", "channel", "log", "publish", "encapsulation"],
        "formats": ["u1", "<u8", "<u2", "<u8", "<u8", "V4"],
        "offsets": [0, 1, 9, 15, 23, MESSAGE_HEAD],
        "itemsize": BODY,
    }
)


class Rows(Protocol):
    """The messages of one channel in time order; ``sizes`` are bytes per record, one for all or one each."""

    @property
    def time_ns(self) -> NDArray[np.int64]: ...
    @property
    def sizes(self) -> int | Places: ...

    def put(self, low: int, high: int, target: Bytes, at: Places) -> None:
        """Write the records ``low`` to ``high`` to ``target`` at the given places."""
        ...


def rows_of(columns: Columns, channel_id: int) -> Rows:
    """The fastest way for these columns."""
    ordered = _Ordered(columns)
    lengths = common_lengths(columns)
    if lengths is None:
        return VariableRows(ordered, channel_id)
    return FixedRows(ordered, channel_id, layout(columns.channel.type, CDR_LE, lengths))


class _Ordered:
    """Columns and the order that sorts them by time (None where they are sorted)."""

    def __init__(self, columns: Columns) -> None:
        time_ns = np.ascontiguousarray(columns.time_ns, np.int64)
        self.columns = columns
        self.order: Places | None = None
        if len(time_ns) and (time_ns[1:] < time_ns[:-1]).any():
            self.order = np.argsort(time_ns, kind="stable")
            time_ns = time_ns[self.order]
        self.time_ns = time_ns

    def rows(self, low: int, high: int) -> "slice | Places":
        return slice(low, high) if self.order is None else self.order[low:high]


class FixedRows:
    """Messages of one layout: a template whose varying columns are assigned, then scattered as rows of bytes."""

    def __init__(self, ordered: _Ordered, channel_id: int, laid: Layout) -> None:
        self._ordered = ordered
        self.time_ns = ordered.time_ns
        self.sizes = BODY + laid.size
        self._template = np.zeros(self.sizes, np.uint8)
        head = struct.pack("<BQHIQQ", Op.MESSAGE, self.sizes - RECORD_HEAD, channel_id, 0, 0, 0) + ENCAPSULATION
        self._template[:BODY] = np.frombuffer(head, np.uint8)
        self._moves: list[tuple[int, np.dtype[Any], NDArray[Any]]] = []
        self._stamps: list[int] = []
        self._plan(laid)
        self._scratch: NDArray[Any] = np.zeros(0, void(self.sizes))

    def _plan(self, laid: Layout) -> None:
        columns = self._ordered.columns
        names = columns.data.dtype.names or ()
        stamp = stamp_path(columns.channel.type)
        given = []
        for slot in laid.slots:
            if slot.count is not None:
                self._constant(slot, np.array([slot.count], slot.dtype).tobytes())
            elif slot.path[0] in names:
                if slot.dtype.itemsize and _has(columns.data, slot.path):
                    given.append(slot)
            elif stamp and slot.path[: len(stamp)] == stamp:
                self._stamps.append(BODY + slot.offset)
            elif slot.dtype.kind == "S":
                self._constant(slot, columns.channel.texts.get(dotted(slot.path, False), "").encode())
        for table, slots in self._tables(given):
            for first, size in _runs(table, slots):
                source, dtype = _source(table, first, size)
                self._moves.append((BODY + first.offset, dtype, source))

    def _tables(self, slots: list[Slot]) -> Iterator[tuple[NDArray[Any], list[Slot]]]:
        """Structured arrays with the slots that they fill; what is the same for all messages goes to the template."""
        data = self._ordered.columns.data
        if not isinstance(data, Fields):
            yield data, slots
            return
        for name, group in groupby(slots, key=lambda slot: slot.path[0]):
            if data[str(name)].strides[0] == 0 and len(data):
                for slot in group:
                    self._constant(slot, _pick(data[:1], slot.path).astype(slot.dtype.base).tobytes())
            else:
                yield data.alone(str(name)), list(group)

    def _constant(self, slot: Slot, value: bytes) -> None:
        at = BODY + slot.offset
        self._template[at : at + len(value)] = np.frombuffer(value, np.uint8)

    def put(self, low: int, high: int, target: Bytes, at: Places) -> None:
        count = high - low
        if len(self._scratch) < count:
            self._grow(count)
        time_ns = self.time_ns[low:high]
        self._log[:count] = time_ns
        self._publish[:count] = time_ns
        if self._stamps:
            for place, values in zip(self._stamp_targets, stamps(time_ns), strict=True):
                place[:count] = values
        which = self._ordered.rows(low, high)
        for place, (_, _, source) in zip(self._targets, self._moves, strict=True):
            place[:count] = source[which]
        window(target, self._scratch.dtype, True)[at] = self._scratch[:count]

    def _grow(self, count: int) -> None:
        self._scratch = np.empty(count, void(self.sizes))
        self._scratch[:] = self._template.view(void(self.sizes))[0]
        self._log = self._column(15, np.dtype("<u8"))
        self._publish = self._column(23, np.dtype("<u8"))
        kinds = (np.dtype("<i4"), np.dtype("<u4"))
        self._stamp_targets = [self._column(at, kind) for at, kind in zip(self._stamps, kinds, strict=False)]
        self._targets = [self._column(at, dtype) for at, dtype, _ in self._moves]

    def _column(self, offset: int, dtype: "np.dtype[Any]") -> NDArray[Any]:
        return _field_at(self._scratch, offset, dtype)


def _field_at(table: NDArray[Any], offset: int, dtype: "np.dtype[Any]") -> NDArray[Any]:
    single = {"names": ["x"], "formats": [dtype], "offsets": [offset], "itemsize": table.dtype.itemsize}
    column: NDArray[Any] = table.view(np.dtype(single))["x"]  # type: ignore[call-overload]
    return column


def _has(data: NDArray[Any], path: Path) -> bool:
    dtype: np.dtype[Any] = data.dtype
    for part in path:
        if isinstance(part, int):
            dtype = dtype.base
        elif part in (dtype.names or ()):
            dtype = dtype[part]
        else:
            return False
    return True


def _pick(data: NDArray[Any], path: Path) -> NDArray[Any]:
    for part in path:
        data = data[:, part] if isinstance(part, int) else data[part]
    return data


def _place(dtype: "np.dtype[Any]", path: Path) -> "tuple[int, np.dtype[Any]]":
    """Where a leaf lies in a structured element, and its type."""
    offset = 0
    for part in path:
        if isinstance(part, int):
            dtype = dtype.base
            offset += part * dtype.itemsize
        else:
            assert dtype.fields is not None
            dtype, inner = dtype.fields[part][:2]
            offset += inner
    return offset, dtype


def _runs(data: NDArray[Any], slots: list[Slot]) -> list[tuple[Slot, int]]:
    """Slots that lie side by side in the data as in the message and need no conversion become one move (size > 0)."""
    runs: list[tuple[Slot, int]] = []
    previous_end = (-1, -1)
    for slot in slots:
        offset, dtype = _place(data.dtype, slot.path)
        if data.dtype.hasobject or dtype != slot.dtype:
            runs.append((slot, 0))
            previous_end = (-1, -1)
            continue
        if previous_end == (offset, slot.offset):
            runs[-1] = (runs[-1][0], runs[-1][1] + dtype.itemsize)
        else:
            runs.append((slot, dtype.itemsize))
        previous_end = (offset + dtype.itemsize, slot.end)
    return runs


def _source(data: NDArray[Any], first: Slot, size: int) -> "tuple[NDArray[Any], np.dtype[Any]]":
    if not size:
        return _pick(data, first.path), first.dtype
    kind = void(size) if size > 8 else first.dtype if size == first.dtype.itemsize else void(size)
    return _field_at(data, _place(data.dtype, first.path)[0], kind), kind


class VariableRows:
    """Messages whose lengths differ: their places first, then every field at once."""

    def __init__(self, ordered: _Ordered, channel_id: int) -> None:
        columns = ordered.columns
        self.time_ns = ordered.time_ns
        self._channel_id = channel_id
        self._steps = steps_of(columns.channel.type)
        self._tree = disassemble(columns)
        self._ordered = ordered
        sizes = encode.sizes(self._steps, CDR_LE, self._tree, len(columns)) + BODY
        self.sizes = sizes if ordered.order is None else sizes[ordered.order]

    def put(self, low: int, high: int, target: Bytes, at: Places) -> None:
        head = np.zeros(high - low, _HEAD)
        head["op"], head["channel"] = Op.MESSAGE, self._channel_id
        head["length"] = self.sizes[low:high] - RECORD_HEAD
        head["log"] = head["publish"] = self.time_ns[low:high]
        head["encapsulation"] = np.frombuffer(ENCAPSULATION, "V4")
        window(target, void(BODY), True)[at] = head.view(void(BODY))
        which = self._ordered.rows(low, high)
        rows = np.arange(low, high, dtype=np.int64) if isinstance(which, slice) else which
        encode.encode(self._steps, CDR_LE, select(self._tree, rows), target, at + BODY)
