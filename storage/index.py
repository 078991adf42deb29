"""What a file holds and where: from its summary, and from a walk over whatever the summary does not account for."""

import struct
from dataclasses import dataclass, field

from ..schemas.errors import InputError
from .crc import crc32
from .input_file import InputFile
from .records import (
    FOOTER_SIZE,
    MAGIC,
    RECORD_HEAD,
    AttachmentIndex,
    ChannelRecord,
    ChunkIndex,
    Cursor,
    MetadataIndex,
    Op,
    SchemaRecord,
    Statistics,
    damaged,
    read_attachment_index,
    read_channel,
    read_chunk_index,
    read_metadata_index,
    read_schema,
    read_statistics,
)

SPAN_SIZE = 4 << 20
"""Messages outside chunks are read in pieces of about this size."""
DATA_END_SIZE = RECORD_HEAD + 4


@dataclass
class Index:
    """The contents of a file. ``spans`` are (offset, length) of records with messages outside any chunk."""

    profile: str = ""
    library: str = ""
    schemas: dict[int, SchemaRecord] = field(default_factory=dict)
    channels: dict[int, ChannelRecord] = field(default_factory=dict)
    statistics: Statistics | None = None
    chunks: list[ChunkIndex] = field(default_factory=list)
    spans: list[tuple[int, int]] = field(default_factory=list)
    attachments: list[AttachmentIndex] = field(default_factory=list)
    metadata: list[MetadataIndex] = field(default_factory=list)
    definitions: list[tuple[int, int, int, int]] = field(default_factory=list)
    """(offset, length, opcode, id) of schemas and channels outside any chunk."""
    others: list[tuple[int, int]] = field(default_factory=list)
    """(offset, length) of the Header and of records of kinds that the format leaves to others."""
    data_end: int = 0


def read_index(file: InputFile) -> Index:
    """The index of an MCAP file; InputError where it is none, is cut off, or contradicts itself."""
    _check_magic(file)
    footer = Cursor(file.read(file.size - len(MAGIC) - FOOTER_SIZE, FOOTER_SIZE), file.path, file.size - 37)
    op, length = footer.head()
    if (op, length) != (Op.FOOTER, 20):
        raise damaged(file.path, footer.origin, f"no Footer record before the closing magic (opcode {op})")
    summary_start, _, checksum = footer.numbers("QQI")
    index = Index()
    end = file.size - len(MAGIC) - FOOTER_SIZE
    if summary_start:
        _read_summary(file, index, summary_start, end, checksum)
    index.data_end = _data_end(file, summary_start or end)
    _walk(file, index)
    return index


def _check_magic(file: InputFile) -> None:
    if file.size == 0:
        raise InputError(f"{file.path}: the file is empty; make it again from its source")
    if file.read(0, min(file.size, len(MAGIC))) != MAGIC:
        raise InputError(f"{file.path}: not an MCAP file (it does not begin with MCAP's magic bytes)")
    least = 2 * len(MAGIC) + FOOTER_SIZE
    if file.size < least or file.read(file.size - len(MAGIC), len(MAGIC)) != MAGIC:
        raise InputError(
            f"{file.path}: byte {file.size}: the file ends without MCAP's closing magic, so it is truncated, or its "
            f"writer was stopped; save what is in it with: attlog recover {file.path}"
        )


def _read_summary(file: InputFile, index: Index, start: int, end: int, checksum: int) -> None:
    if not len(MAGIC) <= start <= end:
        raise damaged(file.path, end, f"the Footer puts the summary at byte {start}")
    data = file.read(start, end - start + FOOTER_SIZE - 4)
    if checksum and crc32(data) != checksum:
        raise damaged(file.path, start, "the summary's CRC is wrong")
    for op, content in Cursor(memoryview(data)[: end - start], file.path, start).records():
        if op == Op.SCHEMA:
            _add_schema(index, content)
        elif op == Op.CHANNEL:
            _add_channel(index, content)
        elif op == Op.STATISTICS:
            index.statistics = read_statistics(content)
        elif op == Op.CHUNK_INDEX:
            index.chunks.append(read_chunk_index(content))
        elif op == Op.ATTACHMENT_INDEX:
            index.attachments.append(read_attachment_index(content))
        elif op == Op.METADATA_INDEX:
            index.metadata.append(read_metadata_index(content))


def _add_schema(index: Index, content: Cursor) -> int:
    schema = read_schema(content)
    if schema.id == 0:
        raise damaged(content.path, content.origin, "a schema with the id 0")
    index.schemas[schema.id] = schema
    return schema.id


def _add_channel(index: Index, content: Cursor) -> int:
    channel = read_channel(content)
    index.channels[channel.id] = channel
    return channel.id


def _data_end(file: InputFile, limit: int) -> int:
    """Where DataEnd is: right before the summary (or the Footer)."""
    at = limit - DATA_END_SIZE
    if at < len(MAGIC) or file.read(at, RECORD_HEAD) != struct.pack("<BQ", Op.DATA_END, 4):
        raise damaged(file.path, max(0, at), "no DataEnd record where the data section should end")
    return at


def _walk(file: InputFile, index: Index) -> None:
    """Go over the data section, past the records that the summary places, and note all others."""
    known = {chunk.offset: chunk.length + chunk.message_index_length for chunk in index.chunks}
    known |= {item.offset: item.length for item in index.attachments}
    known |= {item.offset: item.length for item in index.metadata}
    _check_places(file, index, known)
    at = len(MAGIC)
    walker = _Walker(file, index)
    while at < index.data_end:
        if at in known:
            at += known[at]
            continue
        at = walker.record(at)
    walker.finish()
    if at != index.data_end:
        raise damaged(file.path, index.data_end, f"the record before the data section's end goes on to byte {at}")


def _check_places(file: InputFile, index: Index, known: dict[int, int]) -> None:
    end = len(MAGIC)
    for offset, length in sorted(known.items()):
        if offset < end or length < RECORD_HEAD or offset + length > index.data_end:
            raise damaged(file.path, offset, f"the summary puts {length} bytes here, over or beyond other records")
        end = offset + length


class _Walker:
    """Notes one record after the other."""

    def __init__(self, file: InputFile, index: Index) -> None:
        self.file = file
        self.index = index
        self.chunk: ChunkIndex | None = None
        self.span: list[int] = []

    def record(self, at: int) -> int:
        """Note the record at ``at``; where the next begins."""
        op, length = struct.unpack("<BQ", self.file.peek(at, RECORD_HEAD))
        end: int = at + RECORD_HEAD + length
        if end > self.index.data_end:
            what = f"a record (opcode {op}) of {length} bytes, which goes beyond the end of the data section"
            raise damaged(self.file.path, at, what)
        if op == Op.MESSAGE_INDEX and self.chunk is not None:
            self.message_index(at, end - at)
            return end
        self.flush_chunk()
        if op == Op.MESSAGE:
            self.message(at, end)
            return end
        self.flush_span()
        if op == Op.CHUNK:
            self.chunk = chunk_head(self.file, at, length)
        elif op in (Op.HEADER, Op.SCHEMA, Op.CHANNEL):
            content = Cursor(self.file.peek(at + RECORD_HEAD, length), self.file.path, at + RECORD_HEAD)
            self.definition(op, content, at, end - at)
        elif op == Op.ATTACHMENT:
            self.index.attachments.append(self.attachment(at, end - at))
        elif op == Op.METADATA:
            name = Cursor(self.file.peek(at + RECORD_HEAD, length), self.file.path, at + RECORD_HEAD).text()
            self.index.metadata.append(MetadataIndex(at, end - at, name))
        elif op != Op.MESSAGE_INDEX:
            self.index.others.append((at, end - at))
        return end

    def definition(self, op: int, content: Cursor, at: int, length: int) -> None:
        if op == Op.HEADER:
            self.index.profile, self.index.library = content.text(), content.text()
            self.index.others.append((at, length))
            return
        number = _add_schema(self.index, content) if op == Op.SCHEMA else _add_channel(self.index, content)
        self.index.definitions.append((at, length, op, number))

    def message(self, at: int, end: int) -> None:
        if self.span and self.span[1] == at and end - self.span[0] <= SPAN_SIZE:
            self.span[1] = end
        else:
            self.flush_span()
            self.span = [at, end]

    def message_index(self, at: int, length: int) -> None:
        assert self.chunk is not None
        (channel,) = struct.unpack("<H", self.file.peek(at + RECORD_HEAD, 2))
        offsets = {**self.chunk.message_indexes, channel: at}
        values = {**self.chunk.__dict__, "message_indexes": offsets}
        values["message_index_length"] += length
        self.chunk = ChunkIndex(**values)

    def attachment(self, at: int, length: int) -> AttachmentIndex:
        content = Cursor(self.file.read(at + RECORD_HEAD, length - RECORD_HEAD), self.file.path, at + RECORD_HEAD)
        log_time, create_time = content.numbers("QQ")
        name, media_type = content.text(), content.text()
        return AttachmentIndex(at, length, log_time, create_time, content.numbers("Q")[0], name, media_type)

    def flush_chunk(self) -> None:
        if self.chunk is not None:
            self.index.chunks.append(self.chunk)
            self.chunk = None

    def flush_span(self) -> None:
        if self.span:
            self.index.spans.append((self.span[0], self.span[1] - self.span[0]))
            self.span = []

    def finish(self) -> None:
        self.flush_chunk()
        self.flush_span()


def chunk_head(file: InputFile, at: int, length: int) -> ChunkIndex:
    """The index of a chunk, without message indexes, from its own first bytes."""
    content = Cursor(file.peek(at + RECORD_HEAD, min(length, 256)), file.path, at + RECORD_HEAD)
    start, end, size, _ = content.numbers("QQQI")
    compression = content.text()
    (compressed,) = content.numbers("Q")
    return ChunkIndex(start, end, at, length + RECORD_HEAD, {}, 0, compression, compressed, size)
