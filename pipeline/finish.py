"""A recording's stream as channels: what `record` does at the end, and `recover` where it could not."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from .. import storage
from ..ingest import live
from ..ingest.live import options as said
from ..schemas.columns import Columns
from ..schemas.errors import StorageError
from ..schemas.source import IngestOptions
from ..storage.writer import is_derived
from .batch import describe
from .bodies import bodies_columns
from .convert import completeness_text, finding_lines, ingested_recordings, metadata_records, segment_lines, summary
from .findings import both
from .text import count, moment, seconds

RECORDING: Final = "recording"
"""The metadata record that says how a file was recorded, so that it can be read at any later time."""
DECODED: Final = "decoded"
YES: Final = "yes"
SUFFIXES: Final = {live.Kind.MAVLINK: ".tlog", live.Kind.CSV: ".csv"}


@dataclass(frozen=True)
class RecordedFile:
    """One file of a recording: ``reason`` says why it holds the stream alone, "" where it was read."""

    output: str
    channels: int
    messages: int
    start_ns: int
    end_ns: int
    reason: str = ""
    details: tuple[str, ...] = ()

    @property
    def complete(self) -> bool:
        """Whether what arrived could be read."""
        return not self.reason

    def to_text(self) -> str:
        """What ``attlog record`` prints of it."""
        size = f"{count(self.channels, 'channel')}, {count(self.messages, 'message')}"
        lines = [f"{self.output}: {size}, {seconds(self.end_ns - self.start_ns)} from {moment(self.start_ns)}"]
        if self.reason:
            lines.append(f"only the stream as it arrived, since it cannot be read: {self.reason}")
            lines.append(f"say more about it with: attlog recover {self.output} (it takes the options of convert)")
        return "\n  ".join([*lines, *self.details])

    def to_dict(self) -> dict[str, Any]:
        """The same for --json."""
        return vars(self) | {"details": list(self.details)}


def is_unread(path: Path) -> bool:
    """Whether the file is a recording whose stream was not made into channels."""
    with storage.open(path) as log:
        about = log.metadata.get(RECORDING, {})
        return live.TOPIC in log.topics and "format" in about and about.get(DECODED) != YES


def finish(path: str | Path, options: IngestOptions | None = None) -> RecordedFile:
    """Replace a recording that holds the stream alone by one that holds its channels too.

    ``options`` take the place of those that the recording was started with. Where the stream cannot be read the file
    stays, and says why.
    """
    place = Path(path)
    with storage.open(place) as log:
        stream = log[live.TOPIC]
        metadata = {name: dict(entries) for name, entries in log.metadata.items()}
    about = metadata[RECORDING]
    try:
        return _finished(place, stream, metadata, options or said.from_text(about["options"]))
    except StorageError:
        raise
    except Exception as error:  # whatever it is, what was recorded is safe, and how to go on is told
        about = about | {DECODED: f"no: {describe(str(place), error)}"}
        storage.annotate(place, metadata={RECORDING: about})
        return described(place)


def _finished(
    place: Path,
    stream: Columns,
    metadata: Mapping[str, Mapping[str, str]],
    options: IngestOptions,
) -> RecordedFile:
    about = metadata[RECORDING]
    kind = live.Kind(about["format"])
    pieces = live.from_columns(stream)
    read = live.read(about["name"] + SUFFIXES[kind], kind, pieces, options, about.get("header", "").encode())
    records = metadata_records(read.source, read.ingested)
    vehicles = ingested_recordings(read.ingested, records)
    viewed = bodies_columns(list(vehicles.values()))
    columns = [*read.ingested.columns, *viewed, *both(read.ingested.findings, read.ingested.notes)]
    stream = replace(stream, time_ns=live.arrivals_of(stream) + read.shift_ns)
    kept = [stream] if about.get("keep_stream", YES) == YES else []
    now = {**metadata, **records, RECORDING: {**about, "options": said.to_text(options), DECODED: YES}}
    storage.write(
        place,
        [*columns, *kept],
        metadata=now,
        compression=about.get("compression", "zstd"),
        force=True,
        apart=lambda topic: topic == live.TOPIC or is_derived(topic),
    )
    done = summary(read.source, read.ingested, place, columns)
    details = [
        *([done.vehicle] if done.vehicle else []),
        completeness_text(done.completeness),
        *segment_lines(done.segments, done.start_ns),
        *finding_lines(done.findings, done.start_ns),
    ]
    return RecordedFile(str(place), done.channels, done.messages, done.start_ns, done.end_ns, "", tuple(details))


def described(place: Path) -> RecordedFile:
    """A file of a recording as it is on the disk."""
    with storage.open(place) as log:
        known = log.metadata.get(RECORDING, {}).get(DECODED, "no: it was not tried")
        counts = [info.count for topic, info in log.topics.items() if topic != live.TOPIC and info.count]
        reason = "" if known == YES else known.removeprefix("no: ")
        return RecordedFile(str(place), len(counts), sum(counts), log.start_ns, log.end_ns, reason)
