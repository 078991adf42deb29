"""An MCAP's channels as Parquet or CSV files."""

import fnmatch
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import storage
from ..schemas import records
from ..schemas.columns import Columns, Time
from ..schemas.errors import InputError, UsageError
from ..schemas.flat import flat
from ..schemas.frames_out import arrow_table
from .inputs import is_mcap, outputs
from .logs import open_log
from .provenance import software
from .resampled import resampled
from .tables_out import SUFFIXES, written_together
from .text import count, table
from .verbs import Place, verb

if TYPE_CHECKING:
    import pyarrow as pa


@dataclass(frozen=True)
class ExportedFile:
    """One channel's file: ``rows``, how many of them are null since the channel has a gap there, its columns."""

    topic: str
    path: str
    rows: int
    unknown: int
    columns: int


@dataclass(frozen=True)
class Exported:
    """What `export` wrote of one log."""

    source: str
    output: str
    files: tuple[ExportedFile, ...]
    skipped: Mapping[str, str]

    complete = True

    def to_text(self) -> str:
        """What ``attlog export`` prints."""
        rows = [(Path(f.path).name, f.topic, f"{f.rows:,}", f"{f.unknown:,}", str(f.columns)) for f in self.files]
        listed = table(("file", "topic", "rows", "null rows", "columns"), rows, (2, 3, 4))
        lines = [f"{self.source} -> {self.output}: {count(len(self.files), 'file')}", listed]
        return "\n".join([*lines, *(f"skipped {topic}: {reason}" for topic, reason in self.skipped.items())])

    def to_dict(self) -> dict[str, Any]:
        """The same for --json."""
        return {"output": self.output, "files": [asdict(f) for f in self.files], "skipped": dict(self.skipped)}


@verb(is_mcap, suffix="")
def export(
    source: Place,
    output: Place | None = None,
    *,
    format: str = "parquet",
    topics: Sequence[str] = (),
    start: float | None = None,
    end: float | None = None,
    resample: str | None = None,
    force: bool = False,
) -> Exported:
    """Write each channel of an MCAP to a Parquet or CSV file of its own in the folder ``output``.

    Nested fields become columns with dotted names, fixed arrays ``name[0]``. ``topics`` are globs (all by default);
    ``start`` and ``end`` seconds from the log's first message, the end left out. ``resample`` names the channel on
    whose clock all are put (`resampled` says how). Parquet's schema holds units and provenance, CSV's header the units.
    By default the folder is named after the log and lies beside it. InputError where the log cannot be read, UsageError
    for a glob that matches nothing, StorageError where a file exists (without ``force``); then none is written.
    """
    if format not in SUFFIXES:
        raise UsageError(f"no format {format!r} to export to; there are: {', '.join(SUFFIXES)}")
    path = Path(source)
    folder = Path(output) if output is not None else outputs([path], None, "")[0]
    if folder.is_file():
        raise UsageError(f"{folder}: is a file; export writes a folder, name one with -o")
    with open_log(path) as log:
        wanted = _matching(log, topics)
        skipped = {t: log.topics[t].raw for t in wanted if log.topics[t].raw and format == "csv"}
        chosen = [topic for topic in wanted if topic not in skipped]
        span = _at(start, log.start_ns), _at(end, log.start_ns)
        clock = _clock(log, resample, span)
        columns = log.read(chosen, *(span if clock is None else (None, None)))
        about = _about(log, resample)
    names = _file_names(chosen, SUFFIXES[format])
    exported = []
    with written_together(folder, [names[topic] for topic in chosen], force) as write:
        for topic in chosen:
            made, known = _table(columns.pop(topic), clock, about)
            write(names[topic], made)
            exported.append(
                ExportedFile(topic, str(folder / names[topic]), made.num_rows, made.num_rows - known, made.num_columns)
            )
    return Exported(str(path), str(folder), tuple(exported), skipped)


def _matching(log: storage.LogFile, globs: Sequence[str]) -> list[str]:
    """The topics with messages that the globs name."""
    filled = [topic for topic, info in log.topics.items() if info.count]
    for glob in globs:
        if not fnmatch.filter(filled, glob):
            raise UsageError(f"{log.path}: no topic matches {glob}; there are {', '.join(sorted(filled)) or 'none'}")
    if not filled:
        raise InputError(f"{log.path}: has no messages to export")
    return sorted(topic for topic in filled if not globs or any(fnmatch.fnmatchcase(topic, glob) for glob in globs))


def _at(after_s: float | None, start_ns: int) -> int | None:
    return None if after_s is None else start_ns + round(after_s * 1e9)


def _clock(log: storage.LogFile, topic: str | None, span: tuple[int | None, int | None]) -> Time | None:
    """The stamps to resample onto, each once."""
    if topic is None:
        return None
    stamps = np.unique(log.read([topic], *span)[topic].time_ns)
    if len(stamps) == 0:
        raise InputError(f"{log.path}: {topic} has no messages there to resample onto")
    return stamps


def _about(log: storage.LogFile, resample: str | None) -> dict[str, Any]:
    about = {"source": dict(log.metadata.get(records.SOURCE, {})), "file": log.path.name, "software": software()}
    return about | ({"resampled_onto": resample} if resample else {})


def _table(columns: Columns, clock: Time | None, about: Mapping[str, Any]) -> tuple["pa.Table", int]:
    """The channel as a table, and how many of its rows are known."""
    channel = columns.channel
    whole = {"topic": channel.topic, "type": channel.type.name, "channel": dict(channel.metadata), **about}
    if clock is None:
        return arrow_table(flat(columns), whole), len(columns)
    columns, known = resampled(columns, clock)
    return arrow_table(flat(columns), whole, known), int(known.sum())


def _file_names(topics: Iterable[str], suffix: str) -> dict[str, str]:
    """``/imu0/data_raw`` -> ``imu0.data_raw.parquet``; distinct also where case does not count."""
    taken: set[str] = set()
    names = {}
    for topic in topics:
        plain = re.sub(r"[^\w.-]+", "_", topic.strip("/").replace("/", ".")).strip(".") or "channel"
        unique, number = plain, 2
        while unique.casefold() in taken:
            unique, number = f"{plain}_{number}", number + 1
        taken.add(unique.casefold())
        names[topic] = f"{unique}{suffix}"
    return names
