"""`recover`: a whole MCAP of whatever is sound in one that was cut off or damaged."""

import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from ..schemas.errors import InputError, StorageError
from .chunks_in import I8, U2, ChunkReader, Messages, Records, walk
from .contents import Contents, write_attachment, write_end, write_header, write_metadata
from .crc import crc32
from .input_file import InputFile
from .ragged import Bytes, window
from .rebuilt import Rebuilt
from .records import (
    MESSAGE_HEAD,
    RECORD_HEAD,
    Attachment,
    ChannelRecord,
    ChunkIndex,
    Cursor,
    Op,
    SchemaRecord,
    read_channel,
    read_schema,
)
from .salvage import Stretch, What, stretches
from .sink import Sink, replacing
from .torn import unpacked, whole_records
from .writer import LIBRARY

NO_RECORD: Final = "no record"
TORN_RECORD: Final = "torn last record"
BAD_CHUNK: Final = "damaged chunk"
BAD_ATTACHMENT: Final = "damaged attachment"
NO_CHANNEL: Final = "message without a channel"
RECORD: Final = "recovery"
"""The metadata record that says what was lost."""


@dataclass
class Recovery:
    """What was kept: chunks, messages (of them ``saved`` out of a torn chunk); what not: bytes, and counts by reason.

    ``ended`` says whether the file had its end, ``notes`` tell each loss with its place.
    """

    bytes_total: int = 0
    bytes_skipped: int = 0
    chunks: int = 0
    messages: int = 0
    saved: int = 0
    ended: bool = False
    dropped: dict[str, int] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    @property
    def complete(self) -> bool:
        """Whether every byte of the file was kept."""
        return self.bytes_skipped == 0 and not self.dropped

    def lose(self, reason: str, start: int, end: int) -> None:
        """Count a loss."""
        self.dropped[reason] = self.dropped.get(reason, 0) + 1
        self.bytes_skipped += end - start
        self.notes.append(f"byte {start:,}: {reason}, {end - start:,} bytes")


def recover(
    path: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    force: bool = False,
    metadata: Mapping[str, Mapping[str, str]] | None = None,
) -> Recovery:
    """Write every sound chunk, message, attachment and metadata record of ``path`` to ``output``, with a new summary.

    Chunks with a wrong CRC are left out and counted; of one that the file's end cuts off, the whole messages are kept.
    ``path`` is only read. InputError where it is no MCAP, or nothing of it is sound.
    """
    with InputFile(path) as file:
        if Path(output).exists() and os.path.samefile(path, output):
            raise StorageError(f"{output}: is the damaged file itself; give another name")
        if file.size == 0:
            raise InputError(f"{path}: is empty (0 bytes); there is nothing to recover")
        data = np.memmap(file.path, np.uint8, "r")
        found = list(stretches(data, file.path))
        if not any(stretch.what is What.RECORD for stretch in found):
            raise InputError(f"{path}: no MCAP record is in it; there is nothing to recover")
        job = _Job(file, data)
        job.learn(found)
        with replacing(Path(output), force) as sink:
            job.write(sink, found, metadata or {})
        return job.report


class _Job:
    """The recovery of one file."""

    def __init__(self, file: InputFile, data: Bytes) -> None:
        self.file = file
        self.data = data
        self.reader = ChunkReader(file, crc=True)
        self.report = Recovery(bytes_total=file.size)
        self.chunks: dict[int, dict[int, Messages]] = {}
        self.profile = ""
        self.past_data = False
        self.schemas: dict[int, SchemaRecord] = {}
        self.channels: dict[int, ChannelRecord] = {}

    def learn(self, found: list[Stretch]) -> None:
        """Schemas and channels, the best-kept ones first: of sound chunks, of the summary, loose, of bad chunks."""
        loose: list[object] = []
        doubtful: list[object] = []
        after_end = False
        summary: list[object] = []
        for stretch in found:
            if stretch.what is What.TORN and stretch.op == Op.CHUNK:
                doubtful += self._definitions(self._torn(stretch))
            if stretch.what is not What.RECORD:
                continue
            if stretch.op == Op.CHUNK:
                records = self._sound(stretch)
                surveyed = None if records is None else self._survey(records)
                if surveyed is None:
                    doubtful += self._definitions(self._torn(stretch))
                else:
                    self.chunks[stretch.start] = surveyed[0]
                    self._remember(surveyed[1])
            elif stretch.op in (Op.SCHEMA, Op.CHANNEL):
                (summary if after_end else loose).append(self._definition(stretch))
            elif stretch.op == Op.HEADER and not self.profile:
                self.profile = self._content(stretch).text()
            after_end = after_end or stretch.op == Op.DATA_END
            self.report.ended = self.report.ended or stretch.op == Op.FOOTER
        self._remember([*summary, *loose, *doubtful])
        known = self.schemas.keys() | {0}
        self.channels = {number: c for number, c in self.channels.items() if c.schema_id in known}

    def write(self, sink: Sink, found: list[Stretch], metadata: Mapping[str, Mapping[str, str]]) -> None:
        """The whole file."""
        contents = Contents(dict(self.schemas), dict(self.channels))
        out = Rebuilt(sink, contents)
        write_header(sink, self.profile, LIBRARY)
        sink.write(b"".join(schema.pack() for schema in self.schemas.values()))
        sink.write(b"".join(channel.pack() for channel in self.channels.values()))
        for stretch in found:
            self._copy(out, stretch)
        out.flush()
        self.report.messages = sum(contents.counts.values())
        self.report.chunks = len(contents.chunks)
        for title, entries in {**metadata, RECORD: _record(self.report)}.items():
            write_metadata(sink, contents, title, dict(entries))
        write_end(sink, contents)

    def _copy(self, out: Rebuilt, stretch: Stretch) -> None:
        start, end = stretch.start, stretch.end
        if self.past_data and stretch.what is not What.RECORD:
            self.report.notes.append(f"byte {start:,}: the old summary is damaged; a new one was made")
            return
        self.past_data = self.past_data or (stretch.what is What.RECORD and stretch.op == Op.DATA_END)
        if stretch.what is What.GARBAGE:
            self.report.lose(NO_RECORD, start, end)
        elif stretch.what is What.TORN:
            self._copy_torn(out, stretch)
        elif stretch.op == Op.CHUNK:
            self._copy_chunk(out, stretch)
        elif stretch.op == Op.MESSAGE:
            self._copy_message(out, stretch)
        elif stretch.op == Op.METADATA:
            content = self._content(stretch)
            write_metadata(out.sink, out.contents, content.text(), content.text_map())
        elif stretch.op == Op.ATTACHMENT:
            self._copy_attachment(out, stretch)
        elif stretch.op >= 0x80:
            out.sink.write(self.data[start:end].tobytes())

    def _copy_chunk(self, out: Rebuilt, stretch: Stretch) -> None:
        found = self.chunks.get(stretch.start)
        records = None if found is None else self._sound(stretch)
        if found is None or records is None:
            self.report.lose(BAD_CHUNK, stretch.start, stretch.end)
            return
        content = self._content(stretch)
        content.numbers("QQQI")
        compression, size = content.text(), len(records.data)
        body = content.take(content.numbers("Q")[0])
        self._count_undescribed(found, stretch)
        out.records(records, found, self.file, (bytes(body), size, compression))

    def _copy_torn(self, out: Rebuilt, stretch: Stretch) -> None:
        before = sum(out.contents.counts.values())
        if stretch.op == Op.CHUNK:
            records = Records(self._torn(stretch), stretch.start)
            surveyed = self._survey(records)
            if surveyed is not None:
                self._count_undescribed(surveyed[0], stretch)
                out.records(records, surveyed[0], self.file)
        saved = sum(out.contents.counts.values()) - before
        self.report.saved += saved
        self.report.lose(TORN_RECORD, stretch.start, stretch.end)
        if saved:
            self.report.notes.append(f"byte {stretch.start:,}: {saved:,} messages of the torn chunk were saved")

    def _copy_message(self, out: Rebuilt, stretch: Stretch) -> None:
        channel, _, time_ns = self._content(stretch).numbers("HIQ")
        if channel in self.channels and time_ns < 1 << 63:
            out.message(channel, time_ns, self.data[stretch.start : stretch.end])
        else:
            self.report.lose(NO_CHANNEL, stretch.start, stretch.end)

    def _copy_attachment(self, out: Rebuilt, stretch: Stretch) -> None:
        content = self._content(stretch)
        log_time, create_time = content.numbers("QQ")
        name, media_type = content.text(), content.text()
        data = bytes(content.take(content.numbers("Q")[0]))
        end = content.at
        (checksum,) = content.numbers("I")
        if checksum and crc32(content.data[:end]) != checksum:
            self.report.lose(BAD_ATTACHMENT, stretch.start, stretch.end)
            return
        write_attachment(out.sink, out.contents, Attachment(name, data, media_type, log_time, create_time))

    def _count_undescribed(self, found: Mapping[int, Messages], stretch: Stretch) -> None:
        """Count the messages whose channel nothing describes."""
        for number, messages in found.items():
            if number not in self.channels:
                count = len(messages.at)
                self.report.dropped[NO_CHANNEL] = self.report.dropped.get(NO_CHANNEL, 0) + count
                what = f"{count:,} messages of channel {number}, which nothing describes"
                self.report.notes.append(f"byte {stretch.start:,}: {what}")

    def _sound(self, stretch: Stretch) -> Records | None:
        """The records of a chunk; None where its CRC is wrong or it does not unpack."""
        index = ChunkIndex(0, 0, stretch.start, stretch.end - stretch.start, {}, 0, "", 0, 0)
        try:
            return self.reader.load(index, indexed=False)[0]
        except InputError:
            return None

    def _survey(self, records: Records) -> tuple[dict[int, Messages], list[object]] | None:
        """The messages by channel, and the definitions; None where the records are not sound."""
        messages: list[int] = []
        defined: list[object] = []
        try:
            for op, at, length in walk(self.file, records):
                if op == Op.MESSAGE:
                    messages.append(at)
                elif op in (Op.SCHEMA, Op.CHANNEL):
                    content = Cursor(records.data.data[at + RECORD_HEAD : at + length], self.file.path, records.offset)
                    defined.append(read_schema(content) if op == Op.SCHEMA else read_channel(content))
        except InputError:
            return None
        if not messages:
            return {}, defined
        if messages[-1] + MESSAGE_HEAD > len(records.data):
            return None
        places = np.array(messages, np.int64)
        channels, times = window(records.data, U2)[places + RECORD_HEAD], window(records.data, I8)[places + 15]
        if int(times.min()) < 0:
            return None
        return {int(c): Messages(places[channels == c], times[channels == c]) for c in np.unique(channels)}, defined

    def _torn(self, stretch: Stretch) -> Bytes:
        """The whole records at the beginning of a chunk that is cut off or damaged."""
        content = Cursor(self.data[stretch.start + RECORD_HEAD : stretch.end].data, self.file.path, stretch.start)
        try:
            _, _, size, _ = content.numbers("QQQI")
            compression = content.text()
            content.numbers("Q")
        except InputError:
            return np.zeros(0, np.uint8)
        return whole_records(unpacked(content.data[content.at :], compression, size))

    def _definitions(self, data: Bytes) -> list[object]:
        surveyed = self._survey(Records(data, 0))
        return [] if surveyed is None else surveyed[1]

    def _definition(self, stretch: Stretch) -> object:
        content = self._content(stretch)
        return read_schema(content) if stretch.op == Op.SCHEMA else read_channel(content)

    def _remember(self, found: Collection[object]) -> None:
        for entry in found:
            if isinstance(entry, SchemaRecord) and entry.id:
                self.schemas.setdefault(entry.id, entry)
            elif isinstance(entry, ChannelRecord):
                self.channels.setdefault(entry.id, entry)

    def _content(self, stretch: Stretch) -> Cursor:
        return Cursor(self.data[stretch.start + RECORD_HEAD : stretch.end].data, self.file.path, stretch.start)


def _record(report: Recovery) -> dict[str, str]:
    counts = {f"dropped.{reason}": str(number) for reason, number in report.dropped.items()}
    notes = {f"note.{number:04d}": note for number, note in enumerate(report.notes[:100])}
    return {
        "bytes_total": str(report.bytes_total),
        "bytes_skipped": str(report.bytes_skipped),
        "had_its_end": "yes" if report.ended else "no",
        **counts,
        **notes,
    }
