"""How wrong each attitude of a log is, added to its MCAP."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from .. import storage
from ..analysis.channels import error_columns
from ..analysis.error import AttitudeError, Span, attitude_error
from ..analysis.table import ErrorTable
from ..schemas.clock import ClockAlignment
from ..schemas.columns import Columns
from ..schemas.errors import InputError, UsageError
from ..schemas.recording import Attitude, Recording
from .inputs import in_place_target, is_mcap
from .logs import load, open_log, shifted
from .own import OWN_TYPES
from .provenance import software
from .verbs import Place, verb

LONGEST_S = 1e9
TRUTH = "truth"
ONBOARD = "onboard"
PREFERRED_ONBOARD = ("att", "attitude", "vehicle_attitude")


@dataclass(frozen=True)
class Analysis:
    """What `analyze` found in one log."""

    source: str
    output: str
    table: ErrorTable
    remarks: tuple[str, ...] = ()

    complete = True

    def to_text(self) -> str:
        """What ``attlog analyze`` prints."""
        return "\n".join([self.table.to_text(), *self.remarks])

    def to_dict(self) -> dict[str, Any]:
        """The same for --json."""
        return {"output": self.output, "errors": self.table.to_dicts(), "remarks": list(self.remarks)}


@dataclass(frozen=True)
class AnalysisOptions:
    """What to compare with what; times are seconds from the log's first message."""

    reference: str | None = None
    alignment: str | None = None
    start_s: float | None = None
    end_s: float | None = None
    exclude_s: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        bounds = (-LONGEST_S if self.start_s is None else self.start_s, LONGEST_S if self.end_s is None else self.end_s)
        for first, last in (bounds, *self.exclude_s):
            if not -LONGEST_S <= first < last <= LONGEST_S:
                raise UsageError(f"from {first:g} to {last:g} s is no span of time: seconds, the smaller first")


def attitudes(recording: Recording) -> dict[str, Attitude]:
    """Every attitude by the name that it is scored under; the truth is ``truth``."""
    named = {TRUTH: recording.reference} if recording.reference is not None else {}
    named |= {f"{ONBOARD}_{name}": attitude for name, attitude in recording.onboard.items()}
    return named | dict(recording.estimates)


def choose_reference(recording: Recording, wanted: str | None) -> tuple[str, Attitude]:
    """The attitude that all others are compared with: as ``wanted`` (truth, onboard, or a name), else the truth, else
    the autopilot's. InputError where the log has no such attitude, or none to compare with at all."""
    known = attitudes(recording)
    first = next((f"{ONBOARD}_{name}" for name in PREFERRED_ONBOARD if name in recording.onboard), None)
    first = first or next((name for name in known if name.startswith(f"{ONBOARD}_")), None)
    if wanted is None:
        name = TRUTH if recording.reference is not None else first
        if name is None:
            raise InputError("no attitude to compare with: neither a truth nor one of the autopilot's own is logged")
        return name, known[name]
    name = first if wanted == ONBOARD and first else wanted if wanted in known else f"{ONBOARD}_{wanted}"
    if name not in known:
        raise InputError(f"there is no attitude {wanted!r}; there are: {', '.join(known) or 'none'}")
    return name, known[name]


def is_other_log(reference: str) -> bool:
    """Whether a reference is spelled as a file, not as an attitude's name."""
    return reference.endswith(".mcap") or Path(reference).is_file()


def with_reference_of(
    other: Path, vehicles: Mapping[str, Recording], alignments: Mapping[str, ClockAlignment]
) -> tuple[dict[str, Recording], str]:
    """The main vehicle with another log's attitude for its truth, on this log's clock; and a line that says so."""
    with open_log(other) as log:
        theirs = load(log).vehicles
    if "" not in theirs:
        raise InputError(f"{other}: no attitude to compare with: it has none that attlog knows")
    _, attitude = choose_reference(theirs[""], None)
    found = alignments.get(other.name)
    aligned = shifted(replace(attitude, name="reference", topic=f"{other.name}:{attitude.topic}"), found)
    line = (
        f"clock aligned: {found.in_words()}" if found else f"{other.name}: clock taken as it is; attlog align finds it"
    )
    main = vehicles.get("", Recording())
    return {**vehicles, "": replace(main, reference=aligned)}, line


def errors_of(recording: Recording, options: AnalysisOptions, start_ns: int) -> dict[str, AttitudeError]:
    """The error of every attitude but the reference, by name."""
    reference_name, reference = choose_reference(recording, options.reference)
    span = {
        "start_ns": _at(options.start_s, start_ns),
        "end_ns": _at(options.end_s, start_ns),
        "exclude": _spans(options.exclude_s, start_ns),
        "alignment": options.alignment,
    }
    errors = {
        name: attitude_error(attitude, reference, **span)  # type: ignore[arg-type]
        for name, attitude in attitudes(recording).items()
        if name != reference_name
    }
    if errors and not any(error.counts.counted for error in errors.values()):
        first, last = ((int(at) - start_ns) / 1e9 for at in reference.time_ns[[0, -1]])
        raise InputError(f"no sample counts in that span; {reference.topic} lasts from {first:.1f} to {last:.1f} s")
    return errors


def _at(after_s: float | None, start_ns: int) -> int | None:
    return None if after_s is None else start_ns + round(after_s * 1e9)


def _spans(spans: Iterable[tuple[float, float]], start_ns: int) -> tuple[Span, ...]:
    return tuple((start_ns + round(first * 1e9), start_ns + round(last * 1e9)) for first, last in spans)


@dataclass(frozen=True, eq=False)
class Analyzed:
    """The errors of one vehicle's attitudes."""

    recording: Recording
    errors: dict[str, AttitudeError]

    def columns(self) -> list[Columns]:
        """The errors as channels."""
        prefix, about = self.recording.prefix, {"software": software()}
        return [error_columns(e, name=name, prefix=prefix, metadata=about) for name, e in self.errors.items()]

    def table(self, file: str) -> ErrorTable:
        """The errors as a table, under ``file`` and the vehicle's prefix."""
        return ErrorTable.from_errors(self.errors, f"{file}{self.recording.prefix}")


def analyze_recordings(
    recordings: Iterable[Recording], options: AnalysisOptions, start_ns: int
) -> tuple[list[Analyzed], list[str]]:
    """The errors of every vehicle that has something to compare, and why the others have not."""
    done: list[Analyzed] = []
    reasons: list[str] = []
    for recording in recordings:
        try:
            done.append(Analyzed(recording, errors_of(recording, options, start_ns)))
        except InputError as error:
            reasons.append(f"{recording.prefix or 'log'}: {error}")
    return [each for each in done if each.errors], reasons


def is_error(log: storage.LogFile, topic: str) -> bool:
    """Whether the topic holds errors that attlog wrote, which a new analysis replaces."""
    return "error" in topic.split("/")[1:3] and log.topics[topic].schema_name.startswith(OWN_TYPES)


@verb(is_mcap, in_place=True)
def analyze(
    source: Place,
    *,
    reference: str | None = None,
    alignment: str | None = None,
    start: float | None = None,
    end: float | None = None,
    exclude: Sequence[tuple[float, float]] = (),
    topics: Sequence[str] = (),
    output: Place | None = None,
    force: bool = False,
) -> Analysis:
    """Compare every attitude of an MCAP with a reference and add the errors as ``/error/{name}/attitude``, degrees.

    ``reference`` is ``truth``, ``onboard``, the name of an attitude, or another MCAP, whose truth (else onboard
    attitude) is taken on the clock that `align` found; by default the truth, else the autopilot's. ``topics`` say
    ROLE=TOPIC for channels of other software, as for `estimate`.
    ``alignment`` says which constant rotation between the two is removed first: ``none``, ``yaw`` (about the vertical)
    or ``full``; by default none, but yaw where a heading counts from an arbitrary north. Only samples from ``start`` to
    ``end`` (seconds from the log's first message) and outside the spans ``exclude`` count. The file is annotated in
    place, or copied to ``output``. InputError where the file cannot be read or has nothing to compare.
    """
    path, target = Path(source), in_place_target(source, output, force)
    with open_log(path) as log:
        loaded = load(log, topics)
        start_ns, gone = log.start_ns, frozenset(topic for topic in log.topics if is_error(log, topic))
    vehicles, remarks = dict(loaded.vehicles), loaded.remarks
    if reference is not None and is_other_log(reference):
        vehicles, line = with_reference_of(Path(reference), vehicles, loaded.alignments)
        reference, remarks = TRUTH, (*remarks, line)
    options = AnalysisOptions(reference, alignment, start, end, tuple(exclude))
    done, reasons = analyze_recordings(vehicles.values(), options, start_ns)
    if not done:
        why = reasons or ["the log has no two attitudes"]
        raise InputError(f"{path}: nothing to compare: {'; '.join([*why, *remarks])}")
    columns = [channel for each in done for channel in each.columns()]
    storage.annotate(path, columns, remove=gone.__contains__, metadata=loaded.metadata, output=target)
    return analysis(path, target, done, remarks)


def analysis(source: Path, output: Path, done: Sequence[Analyzed], remarks: tuple[str, ...] = ()) -> Analysis:
    """The result for all vehicles of a log."""
    table = ErrorTable.joined(each.table(str(output)) for each in done)
    return Analysis(str(source), str(output), table, remarks)
