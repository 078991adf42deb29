"""Opening an MCAP and reading what a verb needs of it."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from .. import storage
from ..schemas.clock import ALIGNMENT, ClockAlignment, parse_alignments
from ..schemas.errors import InputError
from ..schemas.finding import Finding, Note
from ..schemas.recording import Attitude, Recording
from .findings import ANNOTATIONS, FINDINGS, findings_from, notes_from
from .foreign import adopt
from .foreign.roles import TOPICS
from .inputs import is_mcap
from .own import is_native, is_own, place_of
from .recordings import recordings


@dataclass(frozen=True, eq=False)
class Loaded:
    """The vehicles of an MCAP, prefix -> recording, attitudes on the sensors' clock where an alignment is stored.

    ``remarks`` are lines to be told: what other software's channels were taken for, which clocks were shifted.
    ``metadata`` is what has to be stored lest it be asked again.
    """

    vehicles: Mapping[str, Recording]
    remarks: tuple[str, ...]
    metadata: Mapping[str, Mapping[str, str]]
    alignments: Mapping[str, ClockAlignment]


def open_log(path: Path) -> storage.LogFile:
    """Open an MCAP; InputError tells what to do with a file that is none."""
    if path.exists() and not path.is_dir() and not is_mcap(path):
        raise InputError(f"{path}: is no MCAP; `attlog convert {path}` makes one, `attlog run {path}` does everything")
    return storage.open(path)


def load(log: storage.LogFile, topics: Sequence[str] = (), *, aligned: bool = True) -> Loaded:
    """The vehicles of an MCAP, whoever wrote it. ``topics``: ROLE=TOPIC, as `foreign.adopt` takes them."""
    columns = log.read([topic for topic in log.topics if is_native(log, topic)])
    vehicles = recordings(columns.values(), log.metadata)
    main = vehicles.get("", Recording(metadata=log.metadata))
    adopted = adopt(log, main, frozenset(topic for topic in log.topics if is_own(log, topic)), topics)
    if adopted.recording is not main:
        vehicles = {"": adopted.recording, **{name: each for name, each in vehicles.items() if name}}
    alignments = parse_alignments(log.metadata.get(ALIGNMENT, {}))
    metadata = {TOPICS: adopted.chosen} if adopted.chosen else {}
    if not aligned:
        return Loaded(vehicles, adopted.remarks, metadata, alignments)
    shifted = {name: _aligned(recording, alignments) for name, recording in vehicles.items()}
    clocks = {attitude.topic for each in vehicles.values() for attitude in _compared(each)}
    lines = tuple(f"clock aligned: {a.in_words()}" for name, a in alignments.items() if name in clocks)
    return Loaded(shifted, (*adopted.remarks, *lines), metadata, alignments)


def _compared(recording: Recording) -> list[Attitude]:
    reference = [recording.reference] if recording.reference is not None else []
    return [*reference, *recording.onboard.values()]


def _aligned(recording: Recording, alignments: Mapping[str, ClockAlignment]) -> Recording:
    reference = recording.reference
    return dataclasses.replace(
        recording,
        reference=None if reference is None else shifted(reference, alignments.get(reference.topic)),
        onboard={name: shifted(each, alignments.get(each.topic)) for name, each in recording.onboard.items()},
    )


def shifted(attitude: Attitude, alignment: ClockAlignment | None) -> Attitude:
    """The attitude with its stamps on the sensor's clock; its metadata says so."""
    if alignment is None:
        return attitude
    metadata = {**attitude.metadata, "clock_alignment": alignment.in_words()}
    return dataclasses.replace(attitude, time_ns=alignment.applied(attitude.time_ns), metadata=metadata)


def everything_said(log: storage.LogFile) -> tuple[list[Finding], list[Note]]:
    """The findings and notes of an MCAP."""
    findings, notes = place_of(log, FINDINGS), place_of(log, ANNOTATIONS)
    said = log.read([topic for topic in (findings, notes) if topic in log.topics])
    return findings_from(said.get(findings)), notes_from(said.get(notes))
