"""A MAVLink log as columns."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from ...schemas.columns import Columns
from ...schemas.errors import InputError
from ...schemas.finding import Finding
from ...schemas.recording import Segment
from ...schemas.source import Ingested, IngestOptions, Source
from . import about, attitudes, damage, definitions, fixes, inertial, passthrough, times, vehicles
from . import frames as framing
from .notes import notes

FORMAT: Final = "mavlink"


def read(source: Source, options: IngestOptions) -> Ingested:
    """Telemetry log or raw stream, MAVLink 1 and 2 mixed, to columns.

    InputError where the bytes hold no frame with a right checksum, or where RAW_IMU holds counts of unknown scale;
    UsageError for a vehicle or a dialect that there is not.
    """
    dialect = definitions.dialect(options.dialect)
    frames = framing.find(source.data, dialect)
    if len(frames) == 0:
        raise InputError(
            f"{source.name}: no MAVLink frame with a right checksum in {source.size} bytes; "
            f"is it a telemetry log, and of the dialect {dialect.name}?"
        )
    found = vehicles.find(frames, options)
    line = times.timeline(frames, found)
    columns = list(passthrough.channels(frames, line))
    findings = damage.findings(frames, line, dialect)
    segments: list[Segment] = []
    parameters = [about.parameters(frames, vehicle) for vehicle in found]
    for vehicle, stated in zip(found, parameters, strict=True):
        more, said = _unified(source, frames, line, vehicle, options, stated, required=vehicle is found[0])
        columns += more
        findings += said + times.findings(frames, line, vehicle)
        segments += times.segments(line, vehicle)
    return Ingested(
        format=FORMAT,
        columns=tuple(_sorted(c) for c in columns),
        completeness=damage.completeness(frames, source.size),
        segments=tuple(segments),
        vehicle=about.vehicle_record(frames, found[0], dialect) if found else {},
        parameters=parameters[0] if parameters else {},
        findings=tuple(sorted(findings, key=lambda f: f.time_ns)),
        notes=notes(frames, line, found, dialect),
        metadata=_metadata(frames, line, found, dialect),
    )


def _unified(
    source: Source,
    frames: framing.Frames,
    line: times.Timeline,
    vehicle: vehicles.Vehicle,
    options: IngestOptions,
    parameters: Mapping[str, float],
    *,
    required: bool,
) -> tuple[list[Columns], list[Finding]]:
    try:
        sensed, said = inertial.channels(frames, line, vehicle, options.sensor, required=required)
    except InputError as error:
        raise InputError(f"{source.name}: {error}") from error
    estimated, more = attitudes.channels(frames, line, vehicle, parameters)
    return [*sensed, *fixes.channels(frames, line, vehicle), *estimated], said + more


def _sorted(columns: Columns) -> Columns:
    if np.all(columns.time_ns[1:] >= columns.time_ns[:-1]):
        return columns
    return columns.select(np.argsort(columns.time_ns, kind="stable"))


def _metadata(
    frames: framing.Frames, line: times.Timeline, found: list[vehicles.Vehicle], dialect: definitions.Dialect
) -> dict[str, dict[str, str]]:
    """The record ``mavlink``: how the log was read."""
    clock = line.clock_of(found[0]) if found else -1
    source = line.clocks[clock].pieces[0].source if clock >= 0 else ("log stamps" if frames.stamped else "none")
    record = {
        "stream": "telemetry log" if frames.stamped else "raw",
        "dialect": dialect.name,
        "systems": " ".join(sorted({f"{g.system}/{g.component}" for g in frames.groups})),
        "utc_from": source,
        "bad_runs": str(len(frames.damage.runs)),
        "stamps_repaired": str(frames.damage.stamps_lost + frames.damage.stamps_wrong),
        "unknown_messages": str(sum(len(g) for g in frames.groups if not g.known)),
    }
    others = {f"vehicle{v.system}": about.vehicle_record(frames, v, dialect) for v in found[1:]}
    return {"mavlink": record, **others}
