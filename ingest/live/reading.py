"""A recording's pieces as columns, by the ingestor that reads the same format from a file."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...schemas.errors import InputError
from ...schemas.finding import Finding, Kind, Note, Severity
from ...schemas.source import Ingested, IngestOptions, Source
from .address import Kind as Format
from .pieces import MICROSECOND, Bytes, Pieces

NEWLINE: Final = 10
STAMP: Final = 8
LOST: Final = "lost"
ANOTHER_DATE_NS: Final = 60 * 10**9


@dataclass(frozen=True, eq=False)
class Live:
    """A recording as the file that it amounts to (a telemetry log, or lines of text), and what is in it."""

    source: Source
    ingested: Ingested
    shift_ns: int = 0
    """From the time of arrival to the log's, where the device keeps another date (a replay, a simulation)."""


def read(name: str, kind: Format, pieces: Pieces, options: IngestOptions, header: bytes = b"") -> Live:
    """Read what arrived; InputError where nothing of it can be.

    MAVLink frames get their arrival as the stamp that a telemetry log has. Lines get their time from the device's
    clock, which is fitted to the arrivals' lower envelope, or from the arrivals where no column is a time; ``header``
    are lines that came before those of this file.
    """
    if len(pieces.data) == 0:
        raise InputError(f"{name}: nothing arrived")
    live: Live = _READERS[kind](name, pieces, options, header)
    shift = _shift(pieces, live.ingested)
    told = tuple(_link_findings(pieces, shift))
    notes = tuple(Note(time_ns + shift, Severity.INFO, "link", text) for time_ns, text in pieces.events)
    ingested = live.ingested
    ingested = replace(ingested, findings=(*ingested.findings, *told), notes=(*ingested.notes, *notes))
    return replace(live, ingested=ingested, shift_ns=shift)


def _shift(pieces: Pieces, ingested: Ingested) -> int:
    first = min((int(c.time_ns.min()) for c in ingested.columns if len(c)), default=int(pieces.time_ns[0]))
    apart = first - int(pieces.time_ns[0])
    return apart if abs(apart) > ANOTHER_DATE_NS else 0


def _mavlink(name: str, pieces: Pieces, options: IngestOptions, _header: bytes) -> Live:
    from .. import mavlink
    from ..mavlink.definitions import dialect

    source = Source(name, telemetry_log(pieces, dialect(options.dialect).crc_extra))
    return Live(source, mavlink.read(source, options))


def telemetry_log(pieces: Pieces, crc_extra: NDArray[np.int16]) -> Bytes:
    """The bytes of a .tlog: before each frame the arrival of its last byte, in big-endian microseconds."""
    from .cutting import frame_sizes, frames

    places, _ = frames(pieces.data, crc_extra)
    if len(places) == 0:
        return pieces.data
    arrived = pieces.arrival_of(places + frame_sizes(pieces.data, places) - 1) // MICROSECOND
    stamps = arrived.astype(">u8").view(np.uint8)
    return np.asarray(np.insert(pieces.data, np.repeat(places, STAMP), stamps))


def _lines(name: str, pieces: Pieces, options: IngestOptions, header: bytes) -> Live:
    from ..serial_csv.reader import ingest

    ends = np.flatnonzero(pieces.data == NEWLINE)
    if len(ends) == 0:
        raise InputError(f"{name}: no line has arrived as a whole; are the port and its baud rate right?")
    source = Source(name, np.concatenate([np.frombuffer(header, np.uint8), pieces.data[: ends[-1] + 1]]))
    line_ns = pieces.arrival_of(ends)
    line_ns = np.concatenate([np.full(header.count(b"\n"), line_ns[0]), line_ns])
    return Live(source, ingest(source, options, line_ns))


_READERS: Final[Mapping[Format, Any]] = {Format.MAVLINK: _mavlink, Format.CSV: _lines}


def header_of(data: Bytes) -> bytes:
    """The lines that name a table's columns, as they stand at the beginning of what arrived."""
    from ..serial_csv.dialect import sniff

    dialect = sniff(data)
    lines = data.tobytes().split(b"\n")
    return b"".join(lines[number] + b"\n" for number in (dialect.header_lines if dialect is not None else ()))


def _link_findings(pieces: Pieces, shift_ns: int) -> Iterator[Finding]:
    """One finding for each time without a link."""
    for number, (time_ns, text) in enumerate(pieces.events):
        if not text.startswith(LOST):
            continue
        after = pieces.events[number + 1 :]
        end_ns = after[0][0] if after else time_ns
        advice = f"the link was lost ({text.removeprefix(LOST).strip(': ')}); what was sent meanwhile is missing"
        yield Finding(
            time_ns + shift_ns, end_ns + shift_ns, Severity.WARN, Kind.GAP, "", (end_ns - time_ns) / 1e9, "s", advice
        )
