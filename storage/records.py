"""MCAP records: opcodes, packing, and a cursor that unpacks them without trusting a length.

Source: the MCAP format specification, mcap.dev/spec. All integers are little-endian.
"""

import struct
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path

import numpy as np

from ..schemas.errors import InputError

MAGIC = b"\x89MCAP0\r\n"
RECORD_HEAD = 9
"""Bytes before a record's content: opcode and length."""
MESSAGE_HEAD = 31
"""Bytes of a Message record before its payload, opcode and length included."""
FOOTER_SIZE = RECORD_HEAD + 20
INDEX_ENTRY = np.dtype([("time", "<u8"), ("offset", "<u8")])


class Op(IntEnum):
    """The kinds of record."""

    HEADER = 0x01
    FOOTER = 0x02
    SCHEMA = 0x03
    CHANNEL = 0x04
    MESSAGE = 0x05
    CHUNK = 0x06
    MESSAGE_INDEX = 0x07
    CHUNK_INDEX = 0x08
    ATTACHMENT = 0x09
    ATTACHMENT_INDEX = 0x0A
    STATISTICS = 0x0B
    METADATA = 0x0C
    METADATA_INDEX = 0x0D
    SUMMARY_OFFSET = 0x0E
    DATA_END = 0x0F


@dataclass(frozen=True)
class SchemaRecord:
    """A message definition, shared by channels."""

    id: int
    name: str
    encoding: str
    data: bytes

    def pack(self) -> bytes:
        return record(
            Op.SCHEMA, struct.pack("<H", self.id) + text(self.name) + text(self.encoding) + prefixed(self.data)
        )


@dataclass(frozen=True)
class ChannelRecord:
    """A topic with its encoding; ``schema_id`` 0 is none."""

    id: int
    schema_id: int
    topic: str
    encoding: str
    metadata: Mapping[str, str]

    def pack(self) -> bytes:
        head = struct.pack("<HH", self.id, self.schema_id)
        return record(Op.CHANNEL, head + text(self.topic) + text(self.encoding) + text_map(self.metadata))


@dataclass(frozen=True)
class ChunkIndex:
    """Where a chunk lies and what it holds; ``message_indexes`` is channel id -> file offset."""

    start_ns: int
    end_ns: int
    offset: int
    length: int
    message_indexes: Mapping[int, int]
    message_index_length: int
    compression: str
    compressed_size: int
    size: int

    def pack(self) -> bytes:
        head = struct.pack("<QQQQ", self.start_ns, self.end_ns, self.offset, self.length)
        offsets = b"".join(struct.pack("<HQ", *item) for item in self.message_indexes.items())
        tail = struct.pack("<QQ", self.compressed_size, self.size)
        middle = prefixed(offsets) + struct.pack("<Q", self.message_index_length)
        return record(Op.CHUNK_INDEX, head + middle + text(self.compression) + tail)


@dataclass(frozen=True)
class AttachmentIndex:
    """Where an attachment lies."""

    offset: int
    length: int
    log_time: int
    create_time: int
    size: int
    name: str
    media_type: str

    def pack(self) -> bytes:
        head = struct.pack("<QQQQQ", self.offset, self.length, self.log_time, self.create_time, self.size)
        return record(Op.ATTACHMENT_INDEX, head + text(self.name) + text(self.media_type))


@dataclass(frozen=True)
class MetadataIndex:
    """Where a metadata record lies."""

    offset: int
    length: int
    name: str

    def pack(self) -> bytes:
        return record(Op.METADATA_INDEX, struct.pack("<QQ", self.offset, self.length) + text(self.name))


@dataclass(frozen=True)
class Statistics:
    """What a file holds, in numbers; ``counts`` is channel id -> messages."""

    messages: int = 0
    schemas: int = 0
    channels: int = 0
    attachments: int = 0
    metadata: int = 0
    chunks: int = 0
    start_ns: int = 0
    end_ns: int = 0
    counts: Mapping[int, int] = field(default_factory=dict)

    def pack(self) -> bytes:
        numbers = (self.messages, self.schemas, self.channels, self.attachments, self.metadata, self.chunks)
        head = struct.pack("<QHIIIIQQ", *numbers, self.start_ns, self.end_ns)
        return record(
            Op.STATISTICS, head + prefixed(b"".join(struct.pack("<HQ", *item) for item in self.counts.items()))
        )


@dataclass(frozen=True)
class Attachment:
    """A file inside the file."""

    name: str
    data: bytes
    media_type: str = "application/octet-stream"
    log_time: int = 0
    create_time: int = 0


def record(op: int, content: bytes) -> bytes:
    """Opcode, length, content."""
    return struct.pack("<BQ", op, len(content)) + content


def prefixed(data: bytes) -> bytes:
    """Bytes after their 32-bit length."""
    return struct.pack("<I", len(data)) + data


def text(value: str) -> bytes:
    """A string as MCAP stores it."""
    return prefixed(value.encode())


def text_map(entries: Mapping[str, str]) -> bytes:
    """A map of strings as MCAP stores it."""
    return prefixed(b"".join(text(key) + text(value) for key, value in entries.items()))


def metadata_record(name: str, entries: Mapping[str, str]) -> bytes:
    """A Metadata record."""
    return record(Op.METADATA, text(name) + text_map(entries))


def damaged(path: Path, offset: int, what: str) -> InputError:
    """The one error for a file that is not as the format says."""
    return InputError(
        f"{path}: byte {offset}: {what}; the file is damaged: `attlog recover {path}` saves what is sound"
    )


class Cursor:
    """Reads fields one after the other from ``data``, which lies at byte ``origin`` of the file ``path``."""

    def __init__(self, data: bytes | memoryview, path: Path, origin: int) -> None:
        self.data = memoryview(data)
        self.path = path
        self.origin = origin
        self.at = 0

    def take(self, count: int) -> memoryview:
        """The next ``count`` bytes; InputError if there are not so many."""
        if count > len(self.data) - self.at:
            what = f"a field of {count} bytes in a record that has {len(self.data) - self.at} left"
            raise damaged(self.path, self.origin + self.at, what)
        self.at += count
        return self.data[self.at - count : self.at]

    def numbers(self, form: str) -> tuple[int, ...]:
        """Integers, as `struct` spells them."""
        return struct.unpack("<" + form, self.take(struct.calcsize("<" + form)))

    def block(self) -> memoryview:
        """Bytes after their 32-bit length."""
        return self.take(self.numbers("I")[0])

    def text(self) -> str:
        """A string."""
        start = self.at
        try:
            return str(self.block(), "utf-8")
        except UnicodeDecodeError as error:
            raise damaged(self.path, self.origin + start, "a text that is not UTF-8") from error

    def text_map(self) -> dict[str, str]:
        """A map of strings."""
        start = self.origin + self.at + 4
        inner = Cursor(self.block(), self.path, start)
        entries = {}
        while inner.at < len(inner.data):
            key = inner.text()
            entries[key] = inner.text()
        return entries

    def number_map(self) -> dict[int, int]:
        """A map of 16-bit to 64-bit numbers."""
        start = self.at
        block = self.block()
        if len(block) % 10:
            raise damaged(self.path, self.origin + start, f"a map of {len(block)} bytes, not a multiple of 10")
        return dict(struct.iter_unpack("<HQ", block))

    def head(self) -> tuple[int, int]:
        """A record's opcode and length; InputError if the record does not fit."""
        start = self.at
        op, length = self.numbers("BQ")
        if length > len(self.data) - self.at:
            what = f"a record (opcode {op}) of {length} bytes where {len(self.data) - self.at} are left"
            raise damaged(self.path, self.origin + start, what)
        return op, length

    def records(self) -> Iterable[tuple[int, "Cursor"]]:
        """The records that follow, each as its opcode and a cursor over its content."""
        while self.at < len(self.data):
            op, length = self.head()
            start = self.origin + self.at
            yield op, Cursor(self.take(length), self.path, start)


def read_schema(c: Cursor) -> SchemaRecord:
    (number,) = c.numbers("H")
    return SchemaRecord(number, c.text(), c.text(), bytes(c.block()))


def read_channel(c: Cursor) -> ChannelRecord:
    number, schema = c.numbers("HH")
    return ChannelRecord(number, schema, c.text(), c.text(), c.text_map())


def read_chunk_index(c: Cursor) -> ChunkIndex:
    start, end, offset, length = c.numbers("QQQQ")
    indexes = c.number_map()
    (index_length,) = c.numbers("Q")
    compression = c.text()
    return ChunkIndex(start, end, offset, length, indexes, index_length, compression, *c.numbers("QQ"))


def read_attachment_index(c: Cursor) -> AttachmentIndex:
    offset, length, log_time, create_time, size = c.numbers("QQQQQ")
    return AttachmentIndex(offset, length, log_time, create_time, size, c.text(), c.text())


def read_metadata_index(c: Cursor) -> MetadataIndex:
    offset, length = c.numbers("QQ")
    return MetadataIndex(offset, length, c.text())


def read_statistics(c: Cursor) -> Statistics:
    messages, schemas, channels, attachments, metadata, chunks, start, end = c.numbers("QHIIIIQQ")
    return Statistics(messages, schemas, channels, attachments, metadata, chunks, start, end, c.number_map())
