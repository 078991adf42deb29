"""A run as the columns of a log, with nothing lost to a telemetry link."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ...schemas import records
from ...schemas.columns import Columns
from ...schemas.finding import Note, Severity
from ...schemas.source import Completeness, Ingested
from ...schemas.unified import attitude_columns, fix_columns, imu_columns, mag_columns
from .autopilot import Mode
from .run import SimulatedRun

SOURCE = "simulation"
NO_FIX, FIX = -1, 0
_SEVERITIES = {3: Severity.ERROR, 4: Severity.WARN}


def ingested(run: SimulatedRun) -> Ingested:
    """The run as an ingestor would hand it on: columns, one segment, the vehicle, its parameters and notes."""
    columns = run_columns(run)
    return Ingested(
        format=SOURCE,
        columns=columns,
        completeness=Completeness(0, 0, sum(len(channel) for channel in columns)),
        segments=(run.segment,),
        vehicle={"type": "simulated", **run.provenance},
        parameters=run.scenario.autopilot.parameters,
        notes=notes(run),
        metadata={"simulation": dict(run.provenance)},
    )


def run_columns(run: SimulatedRun) -> tuple[Columns, ...]:
    """IMU, magnetometer, fixes, the truth and the autopilot's attitude."""
    imu, mag, fix, about = run.imu, run.magnetometer, run.fix, run.provenance
    status = np.where(run.fixed, FIX, NO_FIX)
    place = (fix.latitude_deg, fix.longitude_deg, fix.altitude_m)
    latitude, longitude, altitude = (np.where(run.fixed, part, np.nan) for part in place)
    return (
        imu_columns(imu.topic, imu.time_ns, imu.angular_velocity, imu.specific_force, source=SOURCE, metadata=about),
        mag_columns(mag.topic, mag.time_ns, mag.field, source=SOURCE, metadata=about),
        fix_columns(fix.topic, fix.time_ns, latitude, longitude, altitude, status, source=SOURCE, metadata=about),
        *(
            attitude_columns(
                attitude.topic,
                attitude.time_ns,
                attitude.orientation,
                child_frame_id=child,
                source=SOURCE,
                metadata={**about, **attitude.metadata},
            )
            for attitude, child in ((run.reference, "reference"), (run.onboard, "onboard_attitude"))
        ),
    )


def notes(run: SimulatedRun) -> tuple[Note, ...]:
    """What the autopilot says, and its changes of mode and arming, in order of time."""
    pilot = run.scenario.autopilot
    said = [(r.time_s, _SEVERITIES.get(r.severity, Severity.INFO), "STATUSTEXT", r.text) for r in pilot.remarks]
    said += [(time_s, Severity.INFO, name, text) for time_s, name, text in _changes(pilot.modes)]
    stamps = run.stamps_ns(np.array([line[0] for line in said]))
    lines = (Note(int(stamp), *line[1:]) for stamp, line in zip(stamps, said, strict=True))
    return tuple(sorted(lines, key=lambda note: note.time_ns))


def _changes(modes: Sequence[Mode]) -> Iterator[tuple[float, str, str]]:
    name, armed = "", False
    for mode in modes:
        if mode.name != name:
            yield mode.time_s, "mode", f"mode {mode.name}"
        if mode.armed != armed:
            yield mode.time_s, "arming", "armed" if mode.armed else "disarmed"
        name, armed = mode.name, mode.armed


def write_mcap(run: SimulatedRun, path: str | Path, *, compression: str = "zstd", force: bool = False) -> None:
    """Write the run as an MCAP of its sensors, truth and onboard attitude; StorageError where that cannot be."""
    from ... import storage

    log = ingested(run)
    metadata = {
        records.SOURCE: {"name": f"simulate {run.scenario.name} --seed {run.seed}", "format": SOURCE},
        records.COMPLETENESS: records.completeness_record(log.completeness),
        records.VEHICLE: dict(log.vehicle),
        records.PARAMETERS: records.parameters_record(log.parameters),
        records.SEGMENTS: records.segments_record(log.segments),
    }
    storage.write(Path(path), log.columns, metadata=metadata, compression=compression, force=force)
