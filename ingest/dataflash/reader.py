"""A DataFlash log to everything that attlog makes of it."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ...schemas import Completeness, Finding, Ingested, IngestOptions, InputError, Kind, Severity, Source
from ...schemas.columns import Columns
from . import attitudes, binary, passthrough, sensors
from .clock import Clock, read_clock
from .log import Log
from .notes import notes, vehicle
from .parameters import last_values


def ingest(source: Source, options: IngestOptions, *, text: bool) -> Ingested:
    """`attlog.ingest.dataflash.read`; ``options`` have nothing to say here, a log is one vehicle's."""
    with np.errstate(invalid="ignore", over="ignore"):  # damaged values may be signalling NaNs
        return _ingested(source, _parsed(source, text), text)


def _ingested(source: Source, log: Log, text: bool) -> Ingested:
    clock = read_clock(log)
    parameters = last_values(log)
    about = vehicle(log, parameters)
    findings = [*_clock_findings(clock), *_skipped(log, clock)]
    columns = (*_unified(log, clock, findings), *passthrough.columns(log.records, clock))
    segments = tuple(replace(segment, vehicle=about.get("sysid", "")) for segment in clock.segments)
    completeness = Completeness(
        source.size, source.size - log.bytes_skipped, log.count, log.bytes_skipped, dict(log.dropped)
    )
    said = sorted(notes(log, clock, about.get("type", "")), key=lambda note: note.time_ns)
    metadata = {"time": {"reference": "UTC by GPS" if clock.utc else "since boot"}}
    return Ingested(
        "dataflash-text" if text else "dataflash",
        columns,
        completeness,
        segments,
        about,
        parameters,
        tuple(findings),
        tuple(said),
        metadata,
    )


def _parsed(source: Source, is_text: bool) -> Log:
    if is_text:
        from . import text

        log = text.parse(source.data)
    else:
        log = binary.parse(source.data)
    if not any(records.format.name != "FMT" and len(records) for records in log.records):
        raise InputError(
            f"{source.name}: no DataFlash record in {source.size} bytes; "
            "is it an ArduPilot .BIN or .log, and was it copied completely?"
        )
    return log


def _unified(log: Log, clock: Clock, findings: list[Finding]) -> Iterator[Columns]:
    yield from sensors.imu(log, clock)
    for columns in sensors.mag(log, clock):
        yield columns
        findings.extend(_repeated(columns))
    yield from sensors.gnss(log, clock)
    yield from attitudes.reference(log, clock)
    yield from attitudes.onboard(log, clock, findings)


def _repeated(columns: Columns) -> Iterator[Finding]:
    count = int(columns.channel.metadata["repeated"])
    if count:
        start, end = int(columns.time_ns.min()), int(columns.time_ns.max())
        advice = "the compass stopped and its last measurement was logged again; each measurement is kept once"
        yield Finding(start, end, Severity.WARN, Kind.SKIPPED, columns.channel.topic, count, "records", advice)


def _clock_findings(clock: Clock) -> Iterator[Finding]:
    for before, segment in zip(clock.segments, clock.segments[1:], strict=False):
        kind = Kind.REBOOT if segment.reason == "reboot" else Kind.CLOCK_STEP
        step = (segment.start_ns - before.end_ns) / 1e9
        placed = "" if clock.known[segment.index] or not clock.utc else "; no GPS time: its place in time is unknown"
        advice = f"{segment.reason}: estimators start anew here{placed}"
        yield Finding(before.end_ns, segment.start_ns, Severity.WARN, kind, "", step, "s", advice)
    first = clock.segments[0]
    if not clock.timed:
        advice = "no record of this log has a time: all stamps are 0"
        yield Finding(first.start_ns, first.end_ns, Severity.ERROR, Kind.CLOCK_STEP, "", 0.0, "s", advice)
    if clock.absurd:
        advice = "records whose time cannot be true have their neighbour's"
        yield Finding(first.start_ns, first.end_ns, Severity.WARN, Kind.CLOCK_STEP, "", clock.absurd, "records", advice)


def _skipped(log: Log, clock: Clock) -> Iterator[Finding]:
    if log.bytes_skipped:
        reasons = ", ".join(f"{count} {reason}" for reason, count in log.dropped.items())
        start, end = clock.segments[0].start_ns, clock.segments[-1].end_ns
        advice = f"bytes that are no record were skipped: {reasons}"
        yield Finding(start, end, Severity.WARN, Kind.SKIPPED, "", log.bytes_skipped, "bytes", advice)
