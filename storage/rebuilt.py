"""A new file from what was saved of another: chunks as they were, loose messages gathered into chunks."""

from typing import Final

import numpy as np

from .chunks_in import Messages, Records
from .chunks_out import ChunkWriter
from .compression import codecs
from .contents import Contents
from .crc import crc32
from .filter import without
from .input_file import InputFile
from .ragged import Bytes
from .records import INDEX_ENTRY
from .sink import Sink

LOOSE_CHUNK: Final = 1 << 20


class Rebuilt:
    """The new file: chunks copied or made, loose messages gathered into chunks."""

    def __init__(self, sink: Sink, contents: Contents) -> None:
        self.sink = sink
        self.contents = contents
        self.writer = ChunkWriter(sink, contents, "zstd", codecs()["zstd"])
        self._loose: list[bytes] = []
        self._index: dict[int, list[tuple[int, int]]] = {}
        self._size = 0

    def records(
        self,
        records: Records,
        found: dict[int, Messages],
        file: InputFile,
        packed: tuple[bytes, int, str] | None = None,
    ) -> None:
        """A chunk of these records: as it is ``packed`` already where every channel is known, else made anew."""
        unknown = found.keys() - self.contents.channels.keys()
        data, left = records.data, {n: m for n, m in found.items() if len(m.at)}
        if unknown:
            kept = without(file, records, found, unknown, ())
            data, left, packed = kept.data, kept.messages, None
        if not left:
            return
        for number, messages in left.items():
            self.contents.counts[number] = self.contents.counts.get(number, 0) + len(messages.at)
        span = min(int(m.time_ns.min()) for m in left.values()), max(int(m.time_ns.max()) for m in left.values())
        indexes = [(number, _entries(messages)) for number, messages in left.items()]
        if packed is None:
            self.writer.chunk(np.ascontiguousarray(data).data, indexes, *span)
        else:
            body, size, compression = packed
            self.writer.packed(body, size, crc32(data), compression, indexes, *span)

    def message(self, channel: int, time_ns: int, data: Bytes) -> None:
        """A message that is in no chunk."""
        self._index.setdefault(channel, []).append((time_ns, self._size))
        self._loose.append(data.tobytes())
        self._size += len(data)
        if self._size >= LOOSE_CHUNK:
            self.flush()

    def flush(self) -> None:
        """Write the chunk of loose messages."""
        if not self._loose:
            return
        times = [time_ns for entries in self._index.values() for time_ns, _ in entries]
        indexes = [(number, np.array(entries, INDEX_ENTRY).tobytes()) for number, entries in self._index.items()]
        for number, entries in self._index.items():
            self.contents.counts[number] = self.contents.counts.get(number, 0) + len(entries)
        self.writer.chunk(memoryview(b"".join(self._loose)), indexes, min(times), max(times))
        self._loose, self._index, self._size = [], {}, 0


def _entries(messages: Messages) -> bytes:
    entries = np.empty(len(messages.at), INDEX_ENTRY)
    entries["time"], entries["offset"] = messages.time_ns, messages.at
    return entries.tobytes()
