"""Attitude estimates of a recording, added to its MCAP."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .. import estimators, storage
from ..schemas.columns import Columns
from ..schemas.errors import InputError, MissingSensorError, UsageError
from ..schemas.estimate import Estimate, North
from ..schemas.finding import Finding
from ..schemas.recording import Recording
from ..schemas.unified import estimate_columns
from .bodies import bodies_columns
from .convert import finding_lines
from .declination import with_declination
from .findings import both, replaced
from .inputs import in_place_target, is_mcap
from .logs import everything_said, load, open_log
from .own import moved, places
from .provenance import made_from
from .text import table
from .verbs import Place, verb

WITH_MAGNETOMETER = ("ecf", "ekf9", "gyro")
WITHOUT_MAGNETOMETER = ("ecf", "ekf6", "gyro")


@dataclass(frozen=True)
class Made:
    """One estimate of a log: its topic, its inputs, and how it went."""

    name: str
    topic: str
    estimator: str
    inputs: tuple[str, ...]
    samples: int
    north: str
    declination_deg: float
    findings: tuple[Finding, ...]


@dataclass(frozen=True)
class Estimation:
    """What `estimate` did with one log: the estimates made, and those that could not be, with the reason."""

    source: str
    output: str
    made: tuple[Made, ...]
    skipped: Mapping[str, str]
    start_ns: int
    remarks: tuple[str, ...] = ()

    complete = True

    def to_text(self) -> str:
        """What ``attlog estimate`` prints."""
        rows = [(m.topic, f"{m.samples:,}", m.north, f"{m.declination_deg:.1f}", " ".join(m.inputs)) for m in self.made]
        lines = [self.output, table(("estimate", "samples", "north", "declination [deg]", "inputs"), rows, (1, 3))]
        lines += self.remarks
        lines += [f"skipped {name}: {reason}" for name, reason in self.skipped.items()]
        lines += finding_lines(dict.fromkeys(f for made in self.made for f in made.findings), self.start_ns)
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """The same for --json."""
        return {
            "output": self.output,
            "estimates": [vars(m) | {"findings": [vars(f) for f in m.findings]} for m in self.made],
            "skipped": dict(self.skipped),
            "remarks": list(self.remarks),
        }


@dataclass(frozen=True, eq=False)
class Estimated:
    """A recording that knows the attitudes just estimated, the estimates as channels, and what is told of them."""

    recording: Recording
    columns: tuple[Columns, ...]
    made: tuple[Made, ...]
    skipped: Mapping[str, str]
    findings: tuple[Finding, ...]


def default_selections(recording: Recording) -> tuple[str, ...]:
    """What runs where nothing was asked for."""
    return WITH_MAGNETOMETER if recording.mag else WITHOUT_MAGNETOMETER


def estimate_recording(
    recording: Recording, selected: Sequence[str] | None = None, declination_deg: float | None = None
) -> Estimated:
    """Run estimators (``["ecf", "ekf9:imu=1"]``; by default what the sensors allow) on a recording in memory.

    One whose sensor is lacking is skipped, with the reason. UsageError for an unknown estimator or parameter.
    """
    chosen = [estimators.parse(text) for text in selected or default_selections(recording)]
    _check_names([selection.name for selection in chosen])
    ready, findings = with_declination(recording, declination_deg)
    columns: list[Columns] = []
    made: list[Made] = []
    skipped: dict[str, str] = {}
    attitudes = dict(recording.estimates)
    for selection in chosen:
        try:
            estimate = estimators.estimate(ready, selection)
        except MissingSensorError as error:
            skipped[selection.name] = str(error)
            continue
        topic = f"{recording.prefix}{estimate.attitude.topic}"
        attitudes[estimate.name] = dataclasses.replace(estimate.attitude, topic=topic)
        made.append(_made(estimate, topic))
        # An estimate is large: it becomes a channel before the next one is made.
        about = made_from(recording, estimate.inputs)
        columns.append(estimate_columns(estimate, prefix=recording.prefix, metadata=about))
    if all(each.north != North.MAGNETIC for each in made):
        findings = []
    everything = (*findings, *(finding for each in made for finding in each.findings))
    known = dataclasses.replace(ready, estimates=attitudes)
    return Estimated(known, tuple(columns), tuple(made), skipped, everything)


def _made(estimate: Estimate, topic: str) -> Made:
    return Made(
        estimate.name,
        topic,
        estimate.estimator,
        estimate.inputs,
        len(estimate.time_ns),
        str(estimate.north),
        estimate.declination_deg,
        estimate.findings,
    )


def _check_names(names: Sequence[str]) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise UsageError(
            f"two estimates would be called {', '.join(twice)}: name one with as=, as in -e ecf:kp=1,as=mine"
        )


def estimate_vehicles(
    path: Path,
    vehicles: Mapping[str, Recording],
    selected: Sequence[str] | None,
    declination_deg: float | None,
    hints: Sequence[str] = (),
) -> list[Estimated]:
    """Estimate on every vehicle that has an IMU; InputError where none could be estimated at all."""
    done = [
        estimate_recording(recording, selected, declination_deg) if recording.imu else _untouched(recording)
        for recording in vehicles.values()
    ]
    if not any(each.made for each in done):
        reasons = [reason for each in done for reason in each.skipped.values()] or ["the log has no IMU channel"]
        raise InputError(f"{path}: nothing could be estimated: {'; '.join([*reasons, *hints])}")
    return done


def _untouched(recording: Recording) -> Estimated:
    return Estimated(recording, (), (), {}, ())


@verb(is_mcap, in_place=True)
def estimate(
    source: Place,
    estimators: Sequence[str] | None = None,
    *,
    declination: float | None = None,
    topics: Sequence[str] = (),
    output: Place | None = None,
    force: bool = False,
) -> Estimation:
    """Estimate the attitude from the sensors of an MCAP and add each estimate as ``/estimate/{name}/attitude``.

    ``estimators`` are names with parameters, as ``"ecf:imu=1,kp=0.3,as=soft"``; by default ecf, ekf9 and gyro, or ecf,
    ekf6 and gyro without a magnetometer. ``declination`` in degrees, east positive, overrides what the log knows.
    ``topics`` say ROLE=TOPIC for channels of other software (``"imu=/phone/imu"``, ``"reference=/vicon/pose"``). The
    file is annotated in place, or copied to ``output``. An estimate of the same name is replaced. InputError where the
    file cannot be read or nothing could be estimated, UsageError for an unknown estimator or parameter.
    """
    path, target = Path(source), in_place_target(source, output, force)
    with open_log(path) as log:
        loaded = load(log, topics)
        findings, notes = everything_said(log)
        start_ns, there = log.start_ns, places(log)
    done = estimate_vehicles(path, loaded.vehicles, estimators, declination, loaded.remarks)
    columns = [channel for each in done for channel in each.columns]
    remade = {channel.channel.topic for channel in columns}
    new = [finding for each in done for finding in each.findings]
    columns += both(replaced(findings, new, remade.__contains__), notes)
    columns += bodies_columns([each.recording for each in done])
    gone = frozenset(there.values())
    storage.annotate(path, moved(columns, there), remove=gone.__contains__, metadata=loaded.metadata, output=target)
    return estimation(path, target, done, start_ns, loaded.remarks)


def estimation(
    source: Path, output: Path, done: Sequence[Estimated], start_ns: int, remarks: tuple[str, ...] = ()
) -> Estimation:
    """The result for all vehicles of a log."""
    made = tuple(made for each in done for made in each.made)
    skipped = {f"{each.recording.prefix}{name}": why for each in done for name, why in each.skipped.items()}
    return Estimation(str(source), str(output), made, skipped, start_ns, remarks)
