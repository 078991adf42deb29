"""A ULog's bytes to its messages: header, flags, sections, subscriptions, and one structured array per topic."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...schemas import InputError
from ...schemas.columns import Table
from . import ENCRYPTED_MAGIC, MAGIC
from .formats import Definition, Fields, definition, parse
from .kernels import (
    ADD,
    BAD_BYTES,
    DAMAGED,
    ENDED,
    FLAGS,
    FULL,
    HEADER,
    NO_SUBSCRIPTION,
    NUMBER,
    SEEN,
    TORN,
    UNKNOWN_LETTER,
    WRONG_SIZE,
    grouped,
    resume,
    walk,
)

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]

HEADER_BYTES: Final = 16
FLAG_BYTES: Final = 8
APPENDED: Final = 1
"""Bit of the first incompatible flag: more sections follow at the offsets that the flags name."""
BYTES_A_MESSAGE: Final = 24
"""A log's messages are longer on the average; else the walk asks for more room."""
FILL: Final = (0x00, 0xFF)
"""What the end of a file that was never closed holds."""

REASONS: Final = {
    BAD_BYTES: "runs of bad bytes",
    TORN: "torn last message",
    UNKNOWN_LETTER: "messages of unknown kind",
    NO_SUBSCRIPTION: "data without subscription",
    WRONG_SIZE: "data of wrong size",
}


@dataclass(frozen=True)
class Head:
    """The file's header and flags; ``first`` is where the messages begin."""

    version: int
    start_us: int
    compatible: bytes
    appended: tuple[int, ...]
    first: int


class Subscribed(NamedTuple):
    """A topic's instance."""

    name: str
    multi_id: int
    definition: Definition


@dataclass(eq=False)
class Scan:
    """What the walk finds: place and slot of every message, who is subscribed in which slot, what is skipped."""

    raw: Bytes
    formats: dict[str, Fields] = field(default_factory=dict)
    subscribed: dict[Subscribed, int] = field(default_factory=dict)
    topics: NDArray[np.int32] = field(default_factory=lambda: np.zeros((0x10000, 3), np.int32))
    places: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    slots: NDArray[np.int32] = field(default_factory=lambda: np.empty(0, np.int32))
    count: int = 0
    skipped: int = 0
    reasons: Counter[str] = field(default_factory=Counter)

    def section(self, start: int, stop: int) -> None:
        """Read the messages from ``start`` to ``stop``."""
        at = start
        while at < stop:
            at, self.count, why = walk(self.raw, at, stop, self.topics, self.places, self.slots, self.count)
            if why == SEEN:
                self._define(int(self.places[self.count - 1]), at)
            elif why == FULL:
                self._grow()
            elif why == DAMAGED:
                at = self._skip(at, stop)
            elif why == ENDED:
                return

    def _grow(self) -> None:
        more = self.count // 2 + len(self.raw) // BYTES_A_MESSAGE + 1024
        self.places = np.concatenate([self.places[: self.count], np.empty(more, np.int64)])
        self.slots = np.concatenate([self.slots[: self.count], np.empty(more, np.int32)])

    def _skip(self, at: int, stop: int) -> int:
        end, reason = resume(self.raw, at, stop, self.topics)
        tail = self.raw[at:end]
        if end == len(self.raw) and tail[0] in FILL and bool(np.all(tail == tail[0])):
            return int(end)
        self.skipped += end - at
        self.reasons[REASONS[reason]] += 1
        return int(end)

    def _define(self, place: int, end: int) -> None:
        payload = self.raw[place + HEADER : end].tobytes()
        if self.raw[place + 2] != ADD:
            found = parse(payload.decode("utf-8", "ignore"))
            if found is None:
                self.reasons["unreadable definitions"] += 1
            else:
                self.formats[found[0]] = found[1]
            return
        number = int.from_bytes(payload[1:3], "little")
        self._subscribe(payload[0], number, payload[3:].decode("utf-8", "ignore"))

    def _subscribe(self, multi_id: int, number: int, name: str) -> None:
        found = definition(name, self.formats)
        if found is None:
            self.topics[number] = 0
            self.reasons["subscriptions without a format"] += 1
            return
        size = NUMBER + found.row.itemsize
        slot = self.subscribed.setdefault(Subscribed(name, multi_id, found), len(self.subscribed))
        self.topics[number] = size, size + found.padding, slot

    def rows(self) -> Iterator[tuple[Subscribed, Table, Ints]]:
        """Every subscribed instance that has data, its messages as stored, and their numbers."""
        order, starts = grouped(self.slots[: self.count], len(self.subscribed))
        for subscribed, slot in self.subscribed.items():
            chosen = order[starts[slot + 1] : starts[slot + 2]]
            if len(chosen):
                row = subscribed.definition.row
                yield subscribed, gathered(self.raw, self.places[chosen] + (HEADER + NUMBER), row), chosen

    def others(self) -> Ints:
        """Numbers of the messages that are not data."""
        return np.flatnonzero(self.slots[: self.count] < 0)


def plain(data: Bytes) -> Bytes:
    """A read-only array over the same bytes: the one type that the kernels are compiled for."""
    view = np.ascontiguousarray(np.asarray(data, dtype=np.uint8)).view(np.ndarray)
    view.flags.writeable = False
    return view


def gathered(raw: Bytes, places: Ints, row: "np.dtype[np.void]") -> Table:
    """The rows that begin at ``places`` (n,)."""
    size = row.itemsize
    every = np.ndarray((len(raw) - size + 1,), np.dtype(f"V{size}"), buffer=raw.data, strides=(1,))
    return every[places].view(row)


def head(raw: Bytes, name: str) -> Head:
    """The header and the flags behind it; InputError where they forbid reading."""
    start = raw[:HEADER_BYTES].tobytes()
    if start.startswith(ENCRYPTED_MAGIC):
        raise InputError(f"{name}: is an encrypted ULog (ULogEnc); decrypt it with PX4's tools and the log's key first")
    if not start.startswith(MAGIC):
        raise InputError(f"{name}: is no ULog file (begins with {start[:8]!r})")
    if len(start) < HEADER_BYTES:
        raise InputError(f"{name}: a ULog of {len(raw)} bytes ends within its header; was it copied completely?")
    version, start_us = start[7], min(int.from_bytes(start[8:], "little"), 2**63 - 1)
    flagged = len(raw) >= HEADER_BYTES + HEADER + 5 * FLAG_BYTES and raw[HEADER_BYTES + 2] == FLAGS
    if not flagged:
        return Head(version, start_us, bytes(FLAG_BYTES), (), HEADER_BYTES)
    payload = raw[HEADER_BYTES + HEADER : HEADER_BYTES + HEADER + 5 * FLAG_BYTES].tobytes()
    compatible, incompatible = payload[:FLAG_BYTES], payload[FLAG_BYTES : 2 * FLAG_BYTES]
    if incompatible[0] & ~APPENDED or any(incompatible[1:]):
        raise InputError(
            f"{name}: its incompatible flags are {incompatible.hex(' ')} (byte 35 of the file): "
            "it was written in a way that only newer tools can read, or its header is damaged"
        )
    offsets = np.frombuffer(payload[2 * FLAG_BYTES :], "<u8").tolist() if incompatible[0] & APPENDED else []
    return Head(version, start_us, compatible, _sections(offsets, len(raw)), HEADER_BYTES)


def _sections(offsets: list[int], size: int) -> tuple[int, ...]:
    """Where appended sections begin: the offsets that lie in the file and rise."""
    result: list[int] = []
    for offset in offsets:
        if max([HEADER_BYTES, *result]) < offset < size:
            result.append(offset)
    return tuple(result)


def scan(raw: Bytes, begin: Head) -> Scan:
    """All messages of all sections."""
    result = Scan(raw)
    edges = [begin.first, *begin.appended, len(raw)]
    for start, stop in pairwise(edges):
        result.section(start, stop)
    return result
