"""Channels to chunks with their message indexes: slabs of several chunks are filled, then cut and compressed."""

import itertools
import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .compression import Codec
from .contents import Contents
from .crc import crc32
from .ragged import Bytes, Places
from .records import INDEX_ENTRY, ChannelRecord, ChunkIndex, Op, SchemaRecord, text
from .rows import Rows
from .schedule import Schedule
from .sink import Sink

SLAB_SIZE = 4 << 20
SLAB_PER_CHANNEL = 1 << 17
LARGEST_SLAB = 32 << 20


@dataclass(frozen=True)
class Outlet:
    """A channel on its way out: its records and its messages."""

    schema: SchemaRecord
    channel: ChannelRecord
    rows: Rows


class ChunkWriter:
    """Writes chunks to ``sink`` and notes them in ``contents``."""

    def __init__(self, sink: Sink, contents: Contents, compression: str, codec: Codec) -> None:
        self.sink = sink
        self.contents = contents
        self.compression = compression
        self.codec = codec

    def write(self, outlets: Sequence[Outlet], plan: Schedule) -> None:
        """All messages; each chunk begins with the schemas and channels that are used in it for the first time."""
        intros = _introductions(outlets, plan)
        for outlet in outlets:
            self.contents.schemas[outlet.schema.id] = outlet.schema
            self.contents.channels[outlet.channel.id] = outlet.channel
            if len(outlet.rows.time_ns):
                before = self.contents.counts.get(outlet.channel.id, 0)
                self.contents.counts[outlet.channel.id] = before + len(outlet.rows.time_ns)
        slab_size = min(LARGEST_SLAB, max(SLAB_SIZE, len(outlets) * SLAB_PER_CHANNEL))
        slab = np.zeros(0, np.uint8)
        first = 0
        while first < plan.chunks:
            last = max(first + 1, int(np.searchsorted(plan.edges, plan.edges[first] + slab_size, "right")) - 1)
            lead = np.cumsum([len(intros.get(k, b"")) for k in range(first, last)])
            size = int(plan.edges[last] - plan.edges[first] + lead[-1])
            if len(slab) < size:
                slab = np.zeros(size, np.uint8)
            self._slab(outlets, plan, first, last, slab, lead, intros)
            first = last

    def _slab(
        self,
        outlets: Sequence[Outlet],
        plan: Schedule,
        first: int,
        last: int,
        slab: Bytes,
        lead: Places,
        intros: dict[int, bytes],
    ) -> None:
        """Chunks ``first`` to ``last``; ``lead[k]`` introductory bytes lie before the messages of chunk k."""
        if any(not isinstance(outlet.rows.sizes, int) for outlet in outlets):
            slab[:] = 0
        begins = plan.edges[first : last + 1] - plan.edges[first]
        begins[1:] += lead
        packed: list[list[tuple[int, bytes]]] = [[] for _ in range(first, last)]
        spans = [[2**64 - 1, 0] for _ in range(first, last)]
        for outlet, places, bounds in zip(outlets, plan.places, plan.bounds, strict=True):
            low, high = int(bounds[first]), int(bounds[last])
            if low == high:
                continue
            inside = bounds[first : last + 1] - low
            per_chunk = np.diff(inside)
            at = places[low:high] - plan.edges[first]
            at += np.repeat(lead, per_chunk)
            outlet.rows.put(low, high, slab, at)
            index = np.empty(high - low, INDEX_ENTRY)
            index["time"] = outlet.rows.time_ns[low:high]
            index["offset"] = at - np.repeat(begins[:-1], per_chunk)
            _note(index, inside.tolist(), outlet.channel.id, packed, spans)
        whole = slab.data
        for number in range(last - first):
            begin, end = int(begins[number]), int(begins[number + 1])
            intro = intros.get(first + number, b"")
            slab[begin : begin + len(intro)] = np.frombuffer(intro, np.uint8)
            self.chunk(whole[begin:end], packed[number], spans[number][0], spans[number][1])

    def chunk(self, data: memoryview, indexes: list[tuple[int, bytes]], start_ns: int, end_ns: int) -> None:
        """One chunk from its uncompressed bytes and its message indexes (channel id, entries)."""
        self.packed(self.codec.compress(data), len(data), crc32(data), self.compression, indexes, start_ns, end_ns)

    def packed(
        self,
        body: bytes | memoryview,
        size: int,
        checksum: int,
        compression: str,
        indexes: list[tuple[int, bytes]],
        start_ns: int,
        end_ns: int,
    ) -> None:
        """One chunk that is compressed already, from ``size`` bytes."""
        head = struct.pack("<QQQI", start_ns, end_ns, size, checksum)
        head += text(compression) + struct.pack("<Q", len(body))
        offset = self.sink.position
        self.sink.write(struct.pack("<BQ", Op.CHUNK, len(head) + len(body)) + head)
        self.sink.write(body)
        after = self.sink.position
        offsets, parts, at = {}, [], after
        for channel, entries in indexes:
            offsets[channel] = at
            parts.append(struct.pack("<BQHI", Op.MESSAGE_INDEX, 6 + len(entries), channel, len(entries)) + entries)
            at += len(parts[-1])
        self.sink.write(b"".join(parts))
        self.contents.saw(start_ns, end_ns)
        self.contents.chunks.append(
            ChunkIndex(start_ns, end_ns, offset, after - offset, offsets, at - after, compression, len(body), size)
        )


def _note(
    index: "np.ndarray[tuple[int], np.dtype[np.void]]",
    cuts: list[int],
    channel: int,
    packed: list[list[tuple[int, bytes]]],
    spans: list[list[int]],
) -> None:
    times = index["time"]
    for number, (low, high) in enumerate(itertools.pairwise(cuts)):
        if low < high:
            packed[number].append((channel, index[low:high].tobytes()))
            span = spans[number]
            span[0] = min(span[0], int(times[low]))
            span[1] = max(span[1], int(times[high - 1]))


def _introductions(outlets: Sequence[Outlet], plan: Schedule) -> dict[int, bytes]:
    """Chunk number -> the schema and channel records that it must begin with."""
    known: set[int] = set()
    firsts: dict[int, list[Outlet]] = {}
    for outlet, bounds in zip(outlets, plan.bounds, strict=True):
        if len(outlet.rows.time_ns):
            firsts.setdefault(int(np.searchsorted(bounds, 0, "right")) - 1, []).append(outlet)
    intros = {}
    for number in sorted(firsts):
        parts = []
        for outlet in firsts[number]:
            if outlet.schema.id not in known:
                known.add(outlet.schema.id)
                parts.append(outlet.schema.pack())
            parts.append(outlet.channel.pack())
        intros[number] = b"".join(parts)
    return intros


def write_idle(sink: Sink, outlets: Sequence[Outlet]) -> None:
    """The records of channels without messages, outside of any chunk."""
    for outlet in outlets:
        if len(outlet.rows.time_ns) == 0:
            sink.write(outlet.schema.pack() + outlet.channel.pack())
