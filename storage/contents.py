"""What a file being written holds so far, and the summary that says so at its end."""

import struct
from collections.abc import Iterable
from dataclasses import dataclass, field

from .crc import crc32
from .records import (
    MAGIC,
    Attachment,
    AttachmentIndex,
    ChannelRecord,
    ChunkIndex,
    MetadataIndex,
    Op,
    SchemaRecord,
    Statistics,
    metadata_record,
    record,
    text,
)
from .sink import Sink


@dataclass
class Contents:
    """Grows as records are written."""

    schemas: dict[int, SchemaRecord] = field(default_factory=dict)
    channels: dict[int, ChannelRecord] = field(default_factory=dict)
    chunks: list[ChunkIndex] = field(default_factory=list)
    attachments: list[AttachmentIndex] = field(default_factory=list)
    metadata: list[MetadataIndex] = field(default_factory=list)
    counts: dict[int, int] = field(default_factory=dict)
    start_ns: int | None = None
    end_ns: int | None = None

    def saw(self, start_ns: int, end_ns: int) -> None:
        """Widen the span of time."""
        self.start_ns = start_ns if self.start_ns is None else min(self.start_ns, start_ns)
        self.end_ns = end_ns if self.end_ns is None else max(self.end_ns, end_ns)

    def statistics(self) -> Statistics:
        """The Statistics record."""
        return Statistics(
            sum(self.counts.values()),
            len(self.schemas),
            len(self.channels),
            len(self.attachments),
            len(self.metadata),
            len(self.chunks),
            self.start_ns or 0,
            self.end_ns or 0,
            {number: count for number, count in sorted(self.counts.items()) if count},
        )


def write_header(sink: Sink, profile: str, library: str) -> None:
    """Magic and Header."""
    sink.write(MAGIC + record(Op.HEADER, text(profile) + text(library)))


def write_metadata(sink: Sink, contents: Contents, name: str, entries: dict[str, str]) -> None:
    """A Metadata record."""
    packed = metadata_record(name, entries)
    contents.metadata.append(MetadataIndex(sink.position, len(packed), name))
    sink.write(packed)


def write_attachment(sink: Sink, contents: Contents, item: Attachment) -> None:
    """An Attachment record with its CRC."""
    head = struct.pack("<QQ", item.log_time, item.create_time) + text(item.name) + text(item.media_type)
    head += struct.pack("<Q", len(item.data))
    checksum = crc32(item.data, crc32(head))
    length = len(head) + len(item.data) + 4
    place = AttachmentIndex(
        sink.position, length + 9, item.log_time, item.create_time, len(item.data), item.name, item.media_type
    )
    contents.attachments.append(place)
    sink.write(struct.pack("<BQ", Op.ATTACHMENT, length) + head)
    sink.write(item.data)
    sink.write(struct.pack("<I", checksum))


def write_end(sink: Sink, contents: Contents) -> None:
    """DataEnd, summary, summary offsets, Footer, magic."""
    sink.write(record(Op.DATA_END, struct.pack("<I", sink.crc)))
    groups: dict[int, Iterable[bytes]] = {
        Op.SCHEMA: [schema.pack() for schema in contents.schemas.values()],
        Op.CHANNEL: [channel.pack() for channel in contents.channels.values()],
        Op.STATISTICS: [contents.statistics().pack()],
        Op.CHUNK_INDEX: [chunk.pack() for chunk in contents.chunks],
        Op.ATTACHMENT_INDEX: [item.pack() for item in contents.attachments],
        Op.METADATA_INDEX: [item.pack() for item in contents.metadata],
    }
    start = at = sink.position
    summary, offsets = [], []
    for op, records in groups.items():
        packed = b"".join(records)
        if packed:
            summary.append(packed)
            offsets.append(record(Op.SUMMARY_OFFSET, struct.pack("<BQQ", op, at, len(packed))))
            at += len(packed)
    body = b"".join(summary + offsets) + struct.pack("<BQQQ", Op.FOOTER, 20, start, at)
    sink.write(body + struct.pack("<I", crc32(body)) + MAGIC)
