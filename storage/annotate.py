"""`annotate`: channels and metadata added to a file, or taken out, while everything else is copied as it is."""

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from ..schemas.columns import Columns
from ..schemas.errors import StorageError
from .chunks_in import ChunkReader, Messages, Records
from .chunks_out import ChunkWriter
from .compression import codecs
from .contents import Contents, write_end, write_metadata
from .crc import crc32
from .filter import without
from .index import DATA_END_SIZE
from .logfile import LogFile
from .records import MAGIC, AttachmentIndex, ChunkIndex, Cursor, MetadataIndex, Op, damaged
from .sink import Sink, replacing
from .writer import add_channels, check, compression_name

COPY_SIZE = 4 << 20


def never(topic: str) -> bool:
    """Remove nothing."""
    return False


def annotate(
    path: str | os.PathLike[str],
    add: Iterable[Columns] = (),
    *,
    remove: Callable[[str], bool] = never,
    metadata: Mapping[str, Mapping[str, str] | None] | None = None,
    output: str | os.PathLike[str] | None = None,
    compression: str | None = None,
    force: bool = False,
) -> None:
    """Add channels to an MCAP file of any writer; those of the same topics, and of topics to ``remove``, go.

    ``metadata``: records to set by name (None takes the record out). Chunks without messages of removed channels are
    copied byte for byte; attachments, other records and the profile stay. New chunks are compressed as ``compression``
    says, else as the file's are. The file is replaced at once when everything is on the disk, or left as it was; with
    ``output`` it stays and the result is written there (StorageError if that exists, unless ``force``).
    """
    source, channels = Path(path), list(add)
    check(channels)
    same = output is None or _same_file(source, Path(output))
    with LogFile(source) as log, replacing(source if output is None else Path(output), force or same) as sink:
        _check_data(log)
        job = _Job(log, sink, {entry.channel.topic for entry in channels}, remove, metadata or {})
        job.copy()
        name = _compression(log) if compression is None else compression_name(compression)
        writer = ChunkWriter(sink, job.contents, name, codecs()[name])
        add_channels(writer, channels, log.index.channels, log.index.schemas)
        for title, entries in (metadata or {}).items():
            if entries is not None:
                write_metadata(sink, job.contents, title, dict(entries))
        write_end(sink, job.contents)
        if same and not log.file.is_current():
            raise StorageError(f"{path}: another program changed the file meanwhile; nothing was written, run it again")
        log.close()  # some systems do not rename over an open file


def _check_data(log: LogFile) -> None:
    """InputError where the CRC over all that is copied is wrong: a rewrite would hide the damage."""
    end = log.index.data_end
    tail = Cursor(log.file.read(end, DATA_END_SIZE), log.path, end)
    tail.head()
    (stored,) = tail.numbers("I")
    if not stored:
        return
    found = 0
    for start in range(0, end, COPY_SIZE):
        found = crc32(log.file.view(start, min(COPY_SIZE, end - start)), found)
    if found != stored:
        raise damaged(log.path, end, "the CRC of the data section is wrong")


def _same_file(one: Path, other: Path) -> bool:
    return other.exists() and one.exists() and one.samefile(other)


def _compression(log: LogFile) -> str:
    """The compression of the file's first chunk that attlog has, else zstd."""
    known = codecs()
    return next((chunk.compression for chunk in log.index.chunks if chunk.compression in known), "zstd")


class _Job:
    """The copy of one file."""

    def __init__(
        self,
        log: LogFile,
        sink: Sink,
        replaced: set[str],
        remove: Callable[[str], bool],
        metadata: Mapping[str, Mapping[str, str] | None],
    ) -> None:
        self.log = log
        self.sink = sink
        self.metadata = metadata
        self.reader = ChunkReader(log.file, crc=True)
        index = log.index
        self.gone = {c.id for c in index.channels.values() if c.topic in replaced or remove(c.topic)}
        left = {number: channel for number, channel in index.channels.items() if number not in self.gone}
        unused = {index.channels[number].schema_id for number in self.gone} - {c.schema_id for c in left.values()}
        self.gone_schemas = unused
        schemas = {number: schema for number, schema in index.schemas.items() if number not in unused}
        counts = {number: count for number, count in log.statistics.counts.items() if number not in self.gone}
        self.contents = Contents(schemas, left, counts=counts)
        self.run: list[int] = []

    def copy(self) -> None:
        """The data section in the order of the file."""
        self.sink.write(MAGIC)
        index = self.log.index
        places: list[tuple[int, Callable[[], None]]] = []
        places += [(c.offset, lambda c=c: self.chunk(c)) for c in index.chunks]  # type: ignore[misc]
        places += [(a.offset, lambda a=a: self.attachment(a)) for a in index.attachments]  # type: ignore[misc]
        places += [(m.offset, lambda m=m: self.record(m)) for m in index.metadata]  # type: ignore[misc]
        places += [(o, lambda o=o, n=n: self.verbatim(o, n)) for o, n in index.others]  # type: ignore[misc]
        places += [(o, lambda o=o, n=n: self.span(o, n)) for o, n in index.spans]  # type: ignore[misc]
        places += [(d[0], lambda d=d: self.definition(*d)) for d in index.definitions]  # type: ignore[misc]
        for _, act in sorted(places, key=lambda place: place[0]):
            act()
        self.flush()

    def verbatim(self, offset: int, length: int) -> int:
        """Copy bytes as they are (neighbours in one go); how far they move."""
        if self.run and self.run[1] == offset:
            self.run[1] += length
        else:
            self.flush()
            self.run = [offset, offset + length]
        return self.sink.position - self.run[0]

    def flush(self) -> None:
        """Do the copying that has been put off."""
        if self.run:
            at, end = self.run
            while at < end:
                size = min(COPY_SIZE, end - at)
                self.sink.write(self.log.file.view(at, size))
                at += size
            self.run = []

    def attachment(self, item: AttachmentIndex) -> None:
        moved = self.verbatim(item.offset, item.length)
        self.contents.attachments.append(replace(item, offset=item.offset + moved))

    def record(self, item: MetadataIndex) -> None:
        if item.name not in self.metadata:
            moved = self.verbatim(item.offset, item.length)
            self.contents.metadata.append(replace(item, offset=item.offset + moved))

    def definition(self, offset: int, length: int, op: int, number: int) -> None:
        if number not in (self.gone if op == Op.CHANNEL else self.gone_schemas):
            self.verbatim(offset, length)

    def chunk(self, chunk: ChunkIndex) -> None:
        if self.gone and (not chunk.message_indexes or not self.gone.isdisjoint(chunk.message_indexes)):
            records, indexes = self.reader.load(chunk)
            found = self.reader.indexed(chunk, indexes) if chunk.message_indexes else self.reader.scanned(records)
            if not self.gone.isdisjoint(found):
                self.rewritten(chunk, records, found)
                return
        moved = self.verbatim(chunk.offset, chunk.length + chunk.message_index_length)
        indexes_moved = {number: at + moved for number, at in chunk.message_indexes.items()}
        self.contents.chunks.append(replace(chunk, offset=chunk.offset + moved, message_indexes=indexes_moved))
        if chunk.message_indexes or chunk.end_ns:
            self.contents.saw(chunk.start_ns, chunk.end_ns)

    def rewritten(self, chunk: ChunkIndex, records: Records, found: dict[int, Messages]) -> None:
        """The chunk without what goes; where no message stays, its definitions alone, outside a chunk."""
        left = without(self.log.file, records, found, self.gone, self.gone_schemas)
        self.flush()
        if left.messages:
            writer = ChunkWriter(self.sink, self.contents, chunk.compression, self.reader.codecs[chunk.compression])
            writer.chunk(left.data.data, left.indexes, *left.span)
        elif left.definitions:
            self.sink.write(b"".join(left.definitions))

    def span(self, offset: int, length: int) -> None:
        """Messages outside chunks."""
        records = next(self.log.loose(offset))
        found = self.reader.scanned(records)
        left = without(self.log.file, records, found, self.gone, self.gone_schemas)
        if left.messages:
            self.contents.saw(*left.span)
        if self.gone.isdisjoint(found):
            self.verbatim(offset, length)
        else:
            self.flush()
            self.sink.write(left.data.data)
