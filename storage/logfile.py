"""`open`: an MCAP file's channels as columns."""

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from types import TracebackType

import numpy as np

from ..schemas.columns import Channel, Columns, Table
from ..schemas.definition import Field, MessageType
from ..schemas.errors import InputError, UsageError
from ..schemas.passthrough import source_names
from .cdr import PayloadError, read_cdr, read_ros1, supported
from .chunks_in import ChunkReader, Messages, Records, definitions, times
from .collect import Collector, Payloads
from .crc import crc32
from .index import read_index
from .input_file import InputFile
from .json_columns import read_json
from .records import (
    RECORD_HEAD,
    Attachment,
    ChannelRecord,
    ChunkIndex,
    Cursor,
    SchemaRecord,
    Statistics,
    damaged,
)
from .ros1 import parse_ros1
from .writer import QOS, QOS_KEY

RAW = MessageType("attlog_msgs/msg/Raw", (Field("data", "uint8", 0, "the message as it is in the file"),))
"""The type of channels whose encoding is not known: one field, the bytes."""


@dataclass(frozen=True)
class ChannelInfo:
    """A channel of a file: ``encoding`` is its messages' (cdr, json, …), ``raw`` says why it stays undecoded."""

    channel: Channel
    count: int
    encoding: str
    schema_name: str
    schema_encoding: str
    id: int
    metadata: Mapping[str, str] = field(default_factory=dict)
    raw: str = ""

    @property
    def source_names(self) -> Mapping[str, str]:
        """The source's own field name -> the ROS name."""
        return source_names(self.channel.type)


class LogFile:
    """An open MCAP file, a context manager; `storage.open` makes one.

    ``topics`` says what is in it, ``read`` gives columns. Every method raises InputError where the file is damaged.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.file = InputFile(path)
        self.path = self.file.path
        try:
            with self._guard(0):
                self.index = read_index(self.file)
                self._complete()
        except BaseException:
            self.file.close()
            raise

    def __enter__(self) -> "LogFile":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; columns that were read stay valid."""
        self.file.close()

    @property
    def profile(self) -> str:
        """The profile that the file claims."""
        return self.index.profile

    @property
    def library(self) -> str:
        """The software that wrote the file."""
        return self.index.library

    @property
    def start_ns(self) -> int:
        """The first log time (0 without messages)."""
        return self.statistics.start_ns

    @property
    def end_ns(self) -> int:
        """The last log time (0 without messages)."""
        return self.statistics.end_ns

    @cached_property
    def statistics(self) -> Statistics:
        """The file's own Statistics record, or one that is counted now."""
        if self.index.statistics is not None:
            return self.index.statistics
        with self._guard(0):
            return self._counted()

    @cached_property
    def topics(self) -> Mapping[str, ChannelInfo]:
        """Topic -> channel. Where several channels share a topic, the later ones are ``topic#id``."""
        found: dict[str, ChannelInfo] = {}
        for record in self.index.channels.values():
            topic = record.topic if record.topic not in found else f"{record.topic}#{record.id}"
            found[topic] = self._info(record, topic)
        return found

    @cached_property
    def metadata(self) -> Mapping[str, Mapping[str, str]]:
        """Metadata records by name; of several with one name the last."""
        found = {}
        for item in self.index.metadata:
            content = Cursor(self.file.read(item.offset, item.length), self.path, item.offset)
            content.head()
            name = content.text()
            found[name] = content.text_map()
        return found

    @cached_property
    def attachments(self) -> tuple[Attachment, ...]:
        """The attached files, their CRCs checked."""
        return tuple(self._attachment(item.offset, item.length) for item in self.index.attachments)

    def __getitem__(self, topic: str) -> Columns:
        return self.read([topic])[topic]

    def read(
        self,
        topics: Iterable[str] | None = None,
        start_ns: int | None = None,
        end_ns: int | None = None,
        crc: bool = True,
    ) -> dict[str, Columns]:
        """The messages of the topics (all by default) from ``start_ns`` on and before ``end_ns``, sorted by log time.

        Chunks that hold nothing of these are skipped. ``crc=False`` leaves the chunks' checksums unchecked.
        UsageError for a topic that the file does not have.
        """
        wanted = list(self.topics if topics is None else dict.fromkeys(topics))
        for topic in wanted:
            if topic not in self.topics:
                raise UsageError(f"{self.path}: no topic {topic}; it has {', '.join(sorted(self.topics)) or 'none'}")
        infos = {topic: self.topics[topic] for topic in wanted}
        with self._guard(0):
            collectors = self._collect({info.id: info.count for info in infos.values()}, start_ns, end_ns, crc)
        return {topic: self._columns(info, collectors[info.id].payloads()) for topic, info in infos.items()}

    def parts(
        self, wanted: set[int] | None, start_ns: int | None = None, end_ns: int | None = None, crc: bool = True
    ) -> Iterator[tuple[Records, dict[int, Messages]]]:
        """Uncompressed records, part by part, with the messages of the wanted channel ids (None: all) in them."""
        reader = ChunkReader(self.file, crc)
        for chunk in sorted(self.index.chunks, key=lambda chunk: chunk.offset):
            if not times(chunk, start_ns, end_ns) or not _holds(chunk, wanted):
                continue
            records, indexes = reader.load(chunk)
            found = reader.indexed(chunk, indexes) if chunk.message_indexes else reader.scanned(records)
            yield records, _wanted(found, wanted)
        for offset, length in self.index.spans:
            records = Records(np.frombuffer(self.file.read(offset, length), np.uint8), offset)
            yield records, _wanted(reader.scanned(records), wanted)

    def _collect(
        self, expected: Mapping[int, int], start_ns: int | None, end_ns: int | None, crc: bool
    ) -> dict[int, Collector]:
        whole = start_ns is None and end_ns is None
        possible = sum(chunk.size for chunk in self.index.chunks) + self.file.size
        collectors = {
            number: Collector(self.file, number, min(count, possible // 31) if whole else 0)
            for number, count in expected.items()
        }
        for records, found in self.parts(set(collectors), start_ns, end_ns, crc):
            with self._guard(records.offset):
                for number, messages in found.items():
                    collectors[number].add(records, messages.between(start_ns, end_ns))
        return collectors

    def _columns(self, info: ChannelInfo, payloads: Payloads) -> Columns:
        channel = info.channel
        try:
            with self._guard(0):
                data: Table
                if info.raw:
                    data = _raw(payloads)
                elif info.encoding == "json":
                    message, data = read_json(info.schema_name or channel.topic, payloads)
                    channel = Channel(channel.topic, message, channel.metadata)
                else:
                    data = (read_ros1 if info.encoding == "ros1" else read_cdr)(channel.type, payloads)
        except PayloadError as error:
            raise InputError(
                f"{self.path}: {channel.topic}, message {error.row} (log time {int(payloads.time_ns[error.row])} ns): "
                f"{error}; the file is damaged, or the channel's schema {info.schema_name!r} is not that of its messages"
            ) from error
        return Columns(channel, payloads.time_ns, data)

    def _info(self, record: ChannelRecord, topic: str) -> ChannelInfo:
        schema = self.index.schemas.get(record.schema_id)
        if schema is None and record.schema_id:
            raise damaged(
                self.path, self.index.data_end, f"{record.topic} has the schema {record.schema_id}, which is missing"
            )
        message, why = _type(record, schema)
        metadata = {key: value for key, value in record.metadata.items() if (key, value) != (QOS_KEY, QOS)}
        name, encoding = (schema.name, schema.encoding) if schema else ("", "")
        count = self.statistics.counts.get(record.id, 0)
        channel = Channel(topic, message, metadata)
        return ChannelInfo(channel, count, record.encoding, name, encoding, record.id, record.metadata, why)

    def _complete(self) -> None:
        """Find the channels that only the chunks name."""
        index = self.index
        used = {number for chunk in index.chunks for number in chunk.message_indexes}
        unindexed = any(not chunk.message_indexes for chunk in index.chunks)
        if index.channels and used <= set(index.channels) and not (unindexed and index.statistics is None):
            return
        reader = ChunkReader(self.file, crc=True)
        for chunk in index.chunks:
            records, _ = reader.load(chunk, indexed=False)
            for found in definitions(self.file, records):
                if isinstance(found, SchemaRecord):
                    index.schemas[found.id] = found
                elif isinstance(found, ChannelRecord):
                    index.channels[found.id] = found
        if unknown := used - set(index.channels):
            raise damaged(self.path, index.data_end, f"messages on channel {min(unknown)}, which nothing describes")

    def _counted(self) -> Statistics:
        counts: dict[int, int] = {}
        first, last = [], []
        for _, found in self.parts(None):
            for number, messages in found.items():
                if len(messages.at):
                    counts[number] = counts.get(number, 0) + len(messages.at)
                    first.append(int(messages.time_ns.min()))
                    last.append(int(messages.time_ns.max()))
        index = self.index
        sizes = (
            len(index.schemas),
            len(index.channels),
            len(index.attachments),
            len(index.metadata),
            len(index.chunks),
        )
        return Statistics(sum(counts.values()), *sizes, min(first, default=0), max(last, default=0), counts)

    def _attachment(self, offset: int, length: int) -> Attachment:
        content = Cursor(self.file.read(offset, length), self.path, offset)
        content.head()
        log_time, create_time = content.numbers("QQ")
        name, media_type = content.text(), content.text()
        data = bytes(content.take(content.numbers("Q")[0]))
        end = content.at
        (checksum,) = content.numbers("I")
        if checksum and crc32(content.data[RECORD_HEAD:end]) != checksum:
            raise damaged(self.path, offset, f"the CRC of the attachment {name!r} is wrong")
        return Attachment(name, data, media_type, log_time, create_time)

    @contextmanager
    def _guard(self, offset: int) -> Iterator[None]:
        """Whatever a damaged file makes numpy or Python stumble over is that one error."""
        try:
            yield
        except PayloadError:
            raise
        except (ValueError, IndexError, OverflowError, MemoryError, TypeError) as error:
            raise damaged(self.path, offset, f"its contents contradict each other ({error})") from error


def _holds(chunk: ChunkIndex, wanted: set[int] | None) -> bool:
    return wanted is None or not chunk.message_indexes or not wanted.isdisjoint(chunk.message_indexes)


def _wanted(found: dict[int, Messages], wanted: set[int] | None) -> dict[int, Messages]:
    return found if wanted is None else {number: messages for number, messages in found.items() if number in wanted}


def _type(record: ChannelRecord, schema: SchemaRecord | None) -> tuple[MessageType, str]:
    """The channel's type, or RAW and the reason."""
    encoding = (record.encoding, schema.encoding if schema else "")
    if record.encoding == "json":
        return RAW, ""
    parsers = {("cdr", "ros2msg"): MessageType.parse, ("ros1", "ros1msg"): parse_ros1}
    if schema is None or encoding not in parsers:
        return RAW, f"messages encoded as {encoding[0]!r} with a schema in {encoding[1]!r} are not decoded"
    try:
        message = parsers[encoding](schema.name, schema.data.decode())
    except (InputError, ValueError) as error:
        return RAW, f"the schema cannot be read: {error}"
    return (message, "") if supported(message) else (RAW, "wide strings are not decoded")


def _raw(payloads: Payloads) -> Table:
    ends = payloads.start + payloads.size
    pieces = (payloads.data[a:b].tobytes() for a, b in zip(payloads.start.tolist(), ends.tolist(), strict=True))
    table = np.zeros(len(payloads), [("data", object)])
    table["data"] = np.fromiter(pieces, object, len(payloads))
    return table


def open_log(path: str | os.PathLike[str]) -> LogFile:
    """Open an MCAP file for reading; InputError where it is none, is cut off or is damaged."""
    return LogFile(path)
