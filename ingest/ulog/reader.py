"""A ULog to everything that attlog makes of it."""

from collections.abc import Iterator
from dataclasses import replace

from ...schemas import Completeness, Finding, Ingested, InputError, Kind, Severity, Source
from . import attitudes, passthrough, sensors
from .clock import SECOND_NS, Clock, read_clock
from .log import Log
from .messages import collected
from .notes import notes
from .scan import head, plain, scan
from .vehicle import last_parameters, metadata, vehicle


def ingest(source: Source) -> Ingested:
    """`attlog.ingest.ulog.read`."""
    raw = plain(source.data)
    begin = head(raw, source.name)
    log = collected(begin, scan(raw, begin))
    if not log.topics and not log.said:
        raise InputError(
            f"{source.name}: no data in the {source.size} bytes of this ULog, only {log.count} messages of "
            "definitions; was it copied completely?"
        )
    clock = read_clock(log)
    parameters = last_parameters(log)
    about = vehicle(log, parameters)
    columns = (
        *sensors.imu(log, clock),
        *sensors.mag(log, clock),
        *sensors.gnss(log, clock),
        *attitudes.reference(log, clock),
        *attitudes.onboard(log, clock),
        *passthrough.columns(log.topics, clock),
    )
    findings = [*_clock_findings(clock), *_dropouts(log, clock), *_skipped(log, clock)]
    return Ingested(
        "ulog",
        columns,
        Completeness(source.size, source.size - log.bytes_skipped, log.count, log.bytes_skipped, dict(log.dropped)),
        tuple(replace(segment, vehicle=about["sysid"]) for segment in clock.segments),
        about,
        parameters,
        tuple(findings),
        tuple(sorted(notes(log, clock), key=lambda note: note.time_ns)),
        {"time": {"reference": clock.reference}, **metadata(log)},
    )


def _clock_findings(clock: Clock) -> Iterator[Finding]:
    for before, segment in zip(clock.segments, clock.segments[1:], strict=False):
        kind = Kind.REBOOT if segment.reason == "reboot" else Kind.CLOCK_STEP
        step = (segment.start_ns - before.end_ns) / SECOND_NS
        advice = f"{segment.reason}: estimators start anew here"
        yield Finding(before.end_ns, segment.start_ns, Severity.WARN, kind, "", step, "s", advice)


def _dropouts(log: Log, clock: Clock) -> Iterator[Finding]:
    """Where the logger could not write: from the last message before, so long as it says."""
    for order, duration_ms in log.dropouts:
        start = int(clock.time_ns[order])
        advice = "the autopilot's logger lost messages of any topic here (a slow card, or too much logged)"
        end, length = start + duration_ms * 1_000_000, duration_ms / 1000
        yield Finding(start, end, Severity.WARN, Kind.GAP, "", length, "s", advice)


def _skipped(log: Log, clock: Clock) -> Iterator[Finding]:
    if log.bytes_skipped:
        reasons = ", ".join(f"{count} {reason}" for reason, count in log.dropped.items())
        start, end = clock.segments[0].start_ns, clock.segments[-1].end_ns
        advice = f"bytes that are no message were skipped: {reasons}"
        yield Finding(start, end, Severity.WARN, Kind.SKIPPED, "", log.bytes_skipped, "bytes", advice)
