"""`open`: an MCAP file's channels as columns."""

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property, partial
from types import TracebackType

import numpy as np

from ..schemas.columns import Channel, Columns
from ..schemas.errors import InputError, UsageError
from .batches import batched
from .cdr import PayloadError, watched
from .channels import ChannelInfo, decoded, type_of
from .chunks_in import ChunkReader, Messages, Records, definitions, times
from .collect import Collector, Payloads
from .crc import crc32
from .index import read_index
from .input_file import InputFile
from .records import (
    MESSAGE_HEAD,
    RECORD_HEAD,
    Attachment,
    ChannelRecord,
    ChunkIndex,
    Cursor,
    SchemaRecord,
    Statistics,
    damaged,
)
from .writer import QOS, QOS_KEY


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
            collectors = self._collect(list(infos.values()), start_ns, end_ns, crc)
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
            if chunk.message_indexes:
                yield records, reader.indexed(chunk, indexes, wanted)
            else:
                yield records, _wanted(reader.scanned(records), wanted)
        for records in self.loose():
            yield records, _wanted(reader.scanned(records), wanted)

    def _collect(
        self, infos: Sequence[ChannelInfo], start_ns: int | None, end_ns: int | None, crc: bool
    ) -> dict[int, Collector]:
        whole = start_ns is None and end_ns is None
        possible = sum(chunk.size for chunk in self.index.chunks) + self.file.size
        collectors = {}
        for info in infos:
            expected = min(info.count, possible // MESSAGE_HEAD) if whole else 0
            watch = {"watch": partial(watched, info.channel.type)} if info.encoding == "cdr" and not info.raw else {}
            collectors[info.id] = Collector(self.file, info.id, expected, **watch)
        for records, found in batched(self.parts(set(collectors), start_ns, end_ns, crc), len(collectors)):
            with self._guard(records.offset):
                for number, messages in found.items():
                    collectors[number].add(records, messages.between(start_ns, end_ns))
        return collectors

    def _columns(self, info: ChannelInfo, payloads: Payloads) -> Columns:
        try:
            with self._guard(0):
                return decoded(info, payloads)
        except PayloadError as error:
            raise InputError(
                f"{self.path}: {info.channel.topic}, message {error.row} (log time {payloads.time_ns[error.row]} ns): "
                f"{error}; the file is damaged, or {info.schema_name!r} is not the type of the channel's messages"
            ) from error

    def _info(self, record: ChannelRecord, topic: str) -> ChannelInfo:
        schema = self.index.schemas.get(record.schema_id)
        if schema is None and record.schema_id:
            raise damaged(
                self.path, self.index.data_end, f"{record.topic} has the schema {record.schema_id}, which is missing"
            )
        message, why = type_of(record, schema)
        metadata = {key: value for key, value in record.metadata.items() if (key, value) != (QOS_KEY, QOS)}
        name, encoding = (schema.name, schema.encoding) if schema else ("", "")
        count = self.statistics.counts.get(record.id, 0)
        channel = Channel(topic, message, metadata)
        span = partial(self._span, record.id)
        return ChannelInfo(channel, count, record.encoding, name, encoding, record.id, record.metadata, why, span)

    def _span(self, number: int) -> tuple[int, int]:
        return self._spans.get(number, (0, 0))

    @cached_property
    def _spans(self) -> dict[int, tuple[int, int]]:
        """Channel id -> first and last log time."""
        found: dict[int, tuple[int, int]] = {}
        with self._guard(0):
            for number, messages in self._positions():
                if len(messages.at):
                    first, last = int(messages.time_ns.min()), int(messages.time_ns.max())
                    earlier = found.get(number, (first, last))
                    found[number] = min(first, earlier[0]), max(last, earlier[1])
        return found

    def _positions(self) -> Iterator[tuple[int, Messages]]:
        """Every channel's messages in every chunk; chunks with message indexes are not unpacked."""
        reader = ChunkReader(self.file, crc=True)
        for chunk in self.index.chunks:
            if chunk.message_indexes:
                indexes = self.file.view(chunk.offset + chunk.length, chunk.message_index_length)
                yield from reader.indexed(chunk, indexes).items()
            else:
                yield from reader.scanned(reader.load(chunk)[0]).items()
        for records in self.loose():
            yield from reader.scanned(records).items()

    def loose(self, only: int | None = None) -> Iterator[Records]:
        """The messages outside chunks, part by part, or the part at the offset ``only``."""
        for offset, length in self.index.spans:
            if only not in (None, offset):
                continue
            yield Records(np.frombuffer(self.file.view(offset, length), np.uint8), offset)

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
        for number, messages in self._positions():
            counts[number] = counts.get(number, 0) + len(messages.at)
        index, spans = self.index, self._spans.values()
        return Statistics(
            sum(counts.values()),
            len(index.schemas),
            len(index.channels),
            len(index.attachments),
            len(index.metadata),
            len(index.chunks),
            min((start for start, _ in spans), default=0),
            max((end for _, end in spans), default=0),
            counts,
        )

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


def open_log(path: str | os.PathLike[str]) -> LogFile:
    """Open an MCAP file for reading; InputError where it is none, is cut off or is damaged."""
    return LogFile(path)
