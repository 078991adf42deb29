"""Chunks back to bytes, and where in them each channel's messages are."""

import struct
from collections.abc import Container, Iterator
from dataclasses import dataclass

import numpy as np

from ..schemas.errors import InputError
from .compression import LARGEST_RATIO, codecs
from .crc import crc32
from .input_file import InputFile
from .ragged import Bytes, Places, window
from .records import (
    MESSAGE_HEAD,
    RECORD_HEAD,
    ChunkIndex,
    Cursor,
    Op,
    damaged,
    read_channel,
    read_schema,
)

I8 = np.dtype("<i8")
_INDEX_HEAD = struct.Struct("<BQHI")
U2 = np.dtype("<u2")


@dataclass(frozen=True, eq=False)
class Records:
    """Uncompressed records, which came from byte ``offset`` of the file; valid until the next chunk is loaded."""

    data: Bytes
    offset: int


@dataclass(frozen=True, eq=False)
class Messages:
    """Where one channel's messages begin in some records, and their log times."""

    at: Places
    time_ns: Places

    def between(self, start_ns: int | None, end_ns: int | None) -> "Messages":
        """Those from ``start_ns`` on and before ``end_ns``."""
        if start_ns is None and end_ns is None:
            return self
        keep = np.ones(len(self.at), np.bool_)
        if start_ns is not None:
            keep &= self.time_ns >= start_ns
        if end_ns is not None:
            keep &= self.time_ns < end_ns
        return Messages(self.at[keep], self.time_ns[keep])


class ChunkReader:
    """Loads chunks of one file."""

    def __init__(self, file: InputFile, crc: bool) -> None:
        self.file = file
        self.crc = crc
        self.codecs = codecs()

    def load(self, chunk: ChunkIndex, indexed: bool = True) -> tuple[Records, memoryview]:
        """The chunk's records, and the bytes of the message indexes behind it (none unless ``indexed``)."""
        length = chunk.length + (chunk.message_index_length if indexed else 0)
        raw = self.file.view(chunk.offset, length)
        cursor = Cursor(raw[: chunk.length], self.file.path, chunk.offset)
        op, content = cursor.head()
        if op != Op.CHUNK or content != chunk.length - RECORD_HEAD:
            raise damaged(self.file.path, chunk.offset, f"no chunk of {chunk.length} bytes here (opcode {op})")
        _, _, size, checksum = cursor.numbers("QQQI")
        compression = cursor.text()
        packed = cursor.take(cursor.numbers("Q")[0])
        data = self.unpack(packed, size, compression, chunk.offset)
        if self.crc and checksum and crc32(data) != checksum:
            raise damaged(self.file.path, chunk.offset, "the chunk's CRC is wrong")
        return Records(np.frombuffer(data, np.uint8), chunk.offset), raw[chunk.length :]

    def unpack(self, packed: memoryview, size: int, compression: str, offset: int) -> bytes | memoryview:
        codec = self.codecs.get(compression)
        if codec is None:
            raise InputError(
                f"{self.file.path}: byte {offset}: a chunk compressed with {compression!r}, which attlog cannot unpack "
                f"(it knows {', '.join(name or 'none' for name in self.codecs)}); compress the file again with zstd"
            )
        try:
            if size > (len(packed) + 64) * LARGEST_RATIO[compression] + 64 or (not compression and size != len(packed)):
                raise ValueError(f"{len(packed)} bytes cannot be {size} unpacked")
            data = codec.decompress(packed, size)
            if len(data) != size:
                raise ValueError(f"{len(data)} bytes came out, not {size}")
        except (ValueError, MemoryError) as error:
            raise damaged(
                self.file.path, offset, f"a chunk that does not unpack ({error or 'out of memory'})"
            ) from error
        return data

    def indexed(
        self, chunk: ChunkIndex, indexes: memoryview, wanted: Container[int] | None = None
    ) -> dict[int, Messages]:
        """Wanted channel id -> messages, from the message indexes behind the chunk; InputError where unsound."""
        origin = chunk.offset + chunk.length
        found: dict[int, Messages] = {}
        for number, place in chunk.message_indexes.items():
            if wanted is not None and number not in wanted:
                continue
            at = place - origin
            whole = 0 <= at <= len(indexes) - _INDEX_HEAD.size
            op, length, channel, size = _INDEX_HEAD.unpack_from(indexes, at) if whole else (0, 0, 0, 0)
            sound = op == Op.MESSAGE_INDEX and channel == number and size == length - 6 and size % 16 == 0
            if not sound or size > len(indexes) - at - _INDEX_HEAD.size:
                raise damaged(self.file.path, place, f"no sound message index of channel {number} here")
            entries = np.frombuffer(indexes, I8, size // 8, at + _INDEX_HEAD.size).reshape(-1, 2).T.copy()
            found[number] = Messages(entries[1], entries[0])
        return found

    def scanned(self, records: Records) -> dict[int, Messages]:
        """Channel id -> messages, from the records themselves."""
        at = np.array([at for op, at, _ in walk(self.file, records) if op == Op.MESSAGE], np.int64)
        if len(at) == 0:
            return {}
        if int(at[-1]) + MESSAGE_HEAD > len(records.data):
            raise damaged(
                self.file.path, records.offset, f"the last message, at {int(at[-1])} in its chunk, is too short"
            )
        channels = window(records.data, U2)[at + RECORD_HEAD]
        times = window(records.data, I8)[at + 15]
        return {int(c): Messages(at[channels == c], times[channels == c]) for c in np.unique(channels)}


def walk(file: InputFile, records: Records) -> Iterator[tuple[int, int, int]]:
    """Opcode, place and length of each record (its nine leading bytes included)."""
    data = records.data.data
    at, end = 0, len(data)
    while at < end:
        op = data[at]
        length = RECORD_HEAD + int.from_bytes(data[at + 1 : at + RECORD_HEAD], "little")
        if length > end - at or end - at < RECORD_HEAD:
            what = f"at {at} in the chunk, a record (opcode {op}) of {length} bytes where {end - at} are left"
            raise damaged(file.path, records.offset, what)
        yield op, at, length
        at += length


def definitions(file: InputFile, records: Records) -> Iterator[object]:
    """The schemas and channels among the records."""
    for op, at, length in walk(file, records):
        if op in (Op.SCHEMA, Op.CHANNEL):
            content = records.data.data[at + RECORD_HEAD : at + length]
            cursor = Cursor(content, file.path, records.offset)
            yield read_schema(cursor) if op == Op.SCHEMA else read_channel(cursor)


def times(chunk: ChunkIndex, start_ns: int | None, end_ns: int | None) -> bool:
    """Whether the chunk may hold messages from ``start_ns`` on and before ``end_ns``."""
    return (start_ns is None or chunk.end_ns >= start_ns) and (end_ns is None or chunk.start_ns < end_ns)
