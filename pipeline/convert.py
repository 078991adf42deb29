"""A log of any format to one MCAP."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from .. import ingest, storage
from ..schemas import records
from ..schemas.columns import Columns
from ..schemas.csv_options import CsvOptions
from ..schemas.errors import InputError
from ..schemas.finding import Finding
from ..schemas.recording import Recording, Segment
from ..schemas.sensors import SensorProfile, profile
from ..schemas.source import Completeness, Ingested, IngestOptions, Source
from .bodies import bodies_columns
from .findings import both
from .inputs import check_target, head_of, is_mcap, outputs
from .provenance import software
from .recordings import recordings
from .text import count, moment, seconds
from .verbs import Place, verb

LEVEL = 1
"""Zstandard's level: 5 % more bytes than its 3, a third less time."""


@dataclass(frozen=True)
class Conversion:
    """What `convert` did with one log."""

    source: str
    output: str
    format: str
    vehicle: str
    channels: int
    messages: int
    start_ns: int
    end_ns: int
    completeness: Completeness
    segments: tuple[Segment, ...]
    findings: tuple[Finding, ...]

    @property
    def complete(self) -> bool:
        """Whether no byte of the source was skipped."""
        return self.completeness.complete

    def to_text(self) -> str:
        """What ``attlog convert`` prints."""
        size = f"{count(self.channels, 'channel')}, {count(self.messages, 'message')}"
        lines = [
            f"{self.source} -> {self.output}",
            f"  {self.format}{f', {self.vehicle}' if self.vehicle else ''}: {size}, "
            f"{seconds(self.end_ns - self.start_ns)} from {moment(self.start_ns)}",
            f"  {completeness_text(self.completeness)}",
        ]
        lines += [f"  {line}" for line in segment_lines(self.segments, self.start_ns)]
        lines += [f"  {line}" for line in finding_lines(self.findings, self.start_ns)]
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """The same for --json."""
        return {
            "output": self.output,
            "format": self.format,
            "vehicle": self.vehicle,
            "channels": self.channels,
            "messages": self.messages,
            "start_ns": self.start_ns,
            "end_ns": self.end_ns,
            "complete": self.complete,
            "completeness": vars(self.completeness) | {"dropped": dict(self.completeness.dropped)},
            "segments": [vars(segment) for segment in self.segments],
            "findings": [vars(finding) for finding in self.findings],
        }


def completeness_text(completeness: Completeness) -> str:
    """``read completely`` or what was skipped."""
    read = f"read {completeness.bytes_read:,} of {count(completeness.bytes_total, 'byte')}"
    if completeness.complete:
        return read
    dropped = ", ".join(f"{number:,} {reason}" for reason, number in completeness.dropped.items() if number)
    return f"{read}, skipped {count(completeness.bytes_skipped, 'byte')}" + (f" ({dropped})" if dropped else "")


def segment_lines(segments: Iterable[Segment], start_ns: int) -> list[str]:
    """One line for each segment, where there are several."""
    listed = list(segments)
    if len(listed) < 2:
        return []
    return [
        f"segment {s.index}{f' of vehicle {s.vehicle}' if s.vehicle else ''}: "
        f"{seconds(s.start_ns - start_ns)} to {seconds(s.end_ns - start_ns)}: {s.reason}"
        for s in listed
    ]


def finding_lines(findings: Iterable[Finding], start_ns: int) -> list[str]:
    """One line for each finding that is at least a warning; equal lines once, with how often."""
    lines = Counter(
        f"{f.severity.name.lower()} at {seconds(f.time_ns - start_ns)}: {f.topic or 'log'}: {f.kind}: {f.advice}"
        for f in findings
        if f.severity >= 30
    )
    return [line if times == 1 else f"{line} ({times} times)" for line, times in lines.items()]


def ingest_options(
    vehicle: int | Literal["all"] | None = None,
    sensor: str | SensorProfile | None = None,
    dialect: str = "ardupilotmega",
    csv: CsvOptions | None = None,
) -> IngestOptions:
    """The options of `convert` and `run` that the ingestors see."""
    named = profile(sensor) if isinstance(sensor, str) else sensor
    return IngestOptions(vehicle, named, dialect, csv or CsvOptions())


def read_source(path: Path, options: IngestOptions) -> tuple[Source, Ingested]:
    """Recognise and read a log; InputError for an MCAP, which needs no conversion."""
    if is_mcap(path):
        raise InputError(f"{path}: is an MCAP already; estimate, analyze, annotate and info take it as it is")
    source = ingest.source_of(path)
    return source, ingest.read(source, options)


def metadata_records(source: Source, ingested: Ingested) -> dict[str, dict[str, str]]:
    """The file's metadata: where it comes from, how complete it is, the vehicle, its parameters, the segments."""
    named = {
        records.SOURCE: {
            "name": source.name,
            "sha256": source.sha256,
            "bytes": str(source.size),
            "format": ingested.format,
        },
        records.COMPLETENESS: records.completeness_record(ingested.completeness),
        records.VEHICLE: dict(ingested.vehicle),
        records.PARAMETERS: records.parameters_record(ingested.parameters),
        records.SEGMENTS: records.segments_record(ingested.segments),
        records.SOFTWARE: {"converted_by": software()},
    }
    return named | {name: dict(entries) for name, entries in ingested.metadata.items()}


def ingested_recordings(ingested: Ingested, metadata: dict[str, dict[str, str]]) -> dict[str, Recording]:
    """The vehicles of a source as recordings."""
    return recordings(ingested.columns, metadata)


def summary(source: Source, ingested: Ingested, output: Path, columns: Iterable[Columns]) -> Conversion:
    """The result of writing ``columns``."""
    filled = [channel for channel in columns if len(channel)]
    times = [(int(channel.time_ns.min()), int(channel.time_ns.max())) for channel in filled]
    about = ingested.vehicle
    name = " ".join(about[key] for key in ("autopilot", "type", "firmware") if about.get(key))
    return Conversion(
        source=str(source.path or source.name),
        output=str(output),
        format=ingested.format,
        vehicle=name,
        channels=len(filled),
        messages=sum(len(channel) for channel in filled),
        start_ns=min((start for start, _ in times), default=0),
        end_ns=max((end for _, end in times), default=0),
        completeness=ingested.completeness,
        segments=ingested.segments,
        findings=ingested.findings,
    )


def is_log(path: Path) -> bool:
    """Whether some ingestor takes the file, or the folder as a whole; how folders are searched."""
    if path.is_dir():
        return ingest.recognize_folder(path) is not None
    try:
        ingest.recognize(head_of(path), path.name)
    except InputError:
        return False
    return not is_mcap(path)


@verb(is_log)
def convert(
    source: Place,
    output: Place | None = None,
    *,
    vehicle: int | Literal["all"] | None = None,
    sensor: str | SensorProfile | None = None,
    dialect: str = "ardupilotmega",
    csv: CsvOptions | None = None,
    compression: str = "zstd",
    force: bool = False,
) -> Conversion:
    """Turn a log into an MCAP: every message of the source, and the unified channels of its sensors and attitudes.

    ``output`` is a file, or a folder; without it the MCAP is written beside the log. ``vehicle`` is the system id whose
    topics have no prefix ("all": every vehicle has one); ``sensor`` a profile (name or `SensorProfile`) for a source of
    raw counts; ``csv`` what a table of numbers does not say itself (`ingest.serial_csv.csv_options`); ``compression``
    zstd, lz4 or none. InputError or StorageError where it cannot be done.
    """
    path = Path(source)
    target = outputs([path], output)[0]
    check_target(target, path, force)
    log, ingested = read_source(path, ingest_options(vehicle, sensor, dialect, csv))
    metadata = metadata_records(log, ingested)
    vehicles = ingested_recordings(ingested, metadata)
    viewed = bodies_columns(list(vehicles.values()))
    columns = [*ingested.columns, *viewed, *both(ingested.findings, ingested.notes)]
    target.parent.mkdir(parents=True, exist_ok=True)
    storage.write(target, columns, metadata=metadata, compression=compression, level=LEVEL, force=force)
    return summary(log, ingested, target, columns)
