"""A person's notes in a log."""

import csv
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any, overload

from .. import storage
from ..schemas.errors import InputError, UsageError
from ..schemas.finding import Note, Severity
from .batch import TIMEOUT_S, run_all
from .estimate import everything_said, open_log
from .findings import ANNOTATIONS, PERSON, notes_columns
from .inputs import check_target, expand, is_mcap, outputs
from .outcomes import Outcomes
from .text import seconds, table

_AFTER = re.compile(r"^(?:(?P<h>\d+)h)?(?:(?P<m>\d+)m(?!s))?(?:(?P<value>\d+(?:\.\d+)?)(?P<unit>ms|us|ns|s)?)?$")
_UNITS = {"s": 10**9, "ms": 10**6, "us": 10**3, "ns": 1}


@dataclass(frozen=True)
class Annotated:
    """The notes of one log after `annotate`, a person's numbered from 1 in order of time."""

    source: str
    output: str
    notes: tuple[Note, ...]
    start_ns: int

    complete = True

    def to_text(self) -> str:
        """What ``attlog annotate`` prints."""
        rows = [
            (str(number), seconds(n.time_ns - self.start_ns), self._until(n), n.severity.name.lower(), n.text)
            for number, n in enumerate(self.notes, 1)
        ]
        return f"{self.output}\n{table(('note', 'at', 'to', 'severity', 'text'), rows, (0, 1, 2))}"

    def _until(self, note: Note) -> str:
        return "" if note.end_ns is None else seconds(note.end_ns - self.start_ns)

    def to_dict(self) -> dict[str, Any]:
        """The same for --json."""
        return {"output": self.output, "start_ns": self.start_ns, "notes": [vars(note) for note in self.notes]}


@dataclass(frozen=True)
class NoteText:
    """A note before its log is known: times as people write them (``12.3s``, ``1m5s``, ``2015-06-11T12:13:14Z``)."""

    at: str
    text: str
    to: str | None = None
    severity: str = "info"


def moment_ns(spelled: str, start_ns: int) -> int:
    """A time as written, in the log's nanoseconds: after ``start_ns``, or a date; UsageError where it is neither."""
    match = _AFTER.match(spelled.strip())
    if match and any(match.groups()):
        whole = int(match["h"] or 0) * 3600 + int(match["m"] or 0) * 60
        return start_ns + whole * 10**9 + round(float(match["value"] or 0) * _UNITS[match["unit"] or "s"])
    try:
        when = datetime.fromisoformat(spelled.strip())
    except ValueError:
        raise UsageError(
            f"{spelled!r} is no time: write 12.3s after the log's start, 1m5s, or 2015-06-11T12:13:14Z"
        ) from None
    if when.tzinfo is None:
        raise UsageError(f"{spelled!r} has no time zone: end it with Z for UTC, or with an offset such as +02:00")
    return round(when.timestamp() * 1e6) * 1000


def severity_of(spelled: str) -> Severity:
    """``warn`` -> Severity.WARN; UsageError lists the names."""
    try:
        return Severity[spelled.upper()]
    except KeyError:
        names = ", ".join(severity.name.lower() for severity in Severity)
        raise UsageError(f"{spelled!r} is no severity; there are: {names}") from None


def notes_from_csv(path: str | Path) -> list[NoteText]:
    """Notes from a CSV with the columns at, text and, where wanted, to and severity; InputError names the line."""
    notes = []
    try:
        with Path(path).open(newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file)
            if not {"at", "text"} <= set(reader.fieldnames or ()):
                raise InputError(f"{path}: a CSV of notes begins with a header line: at,to,severity,text")
            for row in reader:
                if not row["at"] or not row["text"]:
                    raise InputError(f"{path}, line {reader.line_num}: a note needs a time and a text")
                notes.append(NoteText(row["at"], row["text"], row.get("to") or None, row.get("severity") or "info"))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: cannot be read as a CSV of notes: {error}") from error
    return notes


def _dated(text: NoteText, start_ns: int) -> Note:
    at_ns = moment_ns(text.at, start_ns)
    end_ns = None if text.to is None else moment_ns(text.to, start_ns)
    if end_ns is not None and end_ns < at_ns:
        raise UsageError(f"a note from {text.at} cannot end at {text.to}")
    return Note(at_ns, severity_of(text.severity), PERSON, text.text, end_ns)


def annotate_one(path: Path, output: Path, *, add: Sequence[NoteText], remove: Sequence[int], force: bool) -> Annotated:
    """Add and remove notes of one MCAP; nothing is written where nothing changes."""
    if output != path:
        check_target(output, path, force)
    with open_log(path) as log:
        _, notes = everything_said(log)
        start_ns, end_ns = log.start_ns, log.end_ns
    own = [note for note in notes if note.name == PERSON]
    wrong = [number for number in remove if not 1 <= number <= len(own)]
    if wrong:
        raise InputError(f"{path}: there is no note {wrong[0]}; there are {len(own)} (attlog annotate {path} --list)")
    kept = [note for number, note in enumerate(own, 1) if number not in remove]
    fresh = [replace(note) for note in (_dated(text, start_ns) for text in add)]
    outside = [note for note in fresh if not start_ns <= note.time_ns <= end_ns]
    if outside:
        raise InputError(f"{path}: {outside[0].text!r} is outside the log, which lasts {seconds(end_ns - start_ns)}")
    mine = sorted([*kept, *fresh], key=lambda note: note.time_ns)
    if add or remove or output != path:
        everyone = [*(note for note in notes if note.name != PERSON), *mine]
        columns = [notes_columns(everyone)] if everyone else []
        output.parent.mkdir(parents=True, exist_ok=True)
        storage.annotate(path, columns, remove={ANNOTATIONS}.__contains__, output=output)
    return Annotated(str(path), str(output), tuple(mine), start_ns)


@overload
def annotate(source: str | Path, text: str | None = ..., **options: Any) -> Annotated: ...
@overload
def annotate(source: Iterable[str | Path], text: str | None = ..., **options: Any) -> Outcomes[Annotated]: ...
def annotate(
    source: str | Path | Iterable[str | Path],
    text: str | None = None,
    *,
    at: str | None = None,
    to: str | None = None,
    severity: str = "info",
    notes: str | Path | None = None,
    remove: Sequence[int] = (),
    output: str | Path | None = None,
    force: bool = False,
    jobs: int | None = None,
    timeout_s: float = TIMEOUT_S,
) -> Annotated | Outcomes[Annotated]:
    """Add a note at ``at`` (until ``to``) to an MCAP's ``/annotations``, or those of a CSV with at,to,severity,text.

    Times are written as ``12.3s`` or ``1m5s`` after the log's start or as a date with its zone. ``remove`` takes notes
    out by the number that the result lists them with. Without a text, a CSV and ``remove`` the notes are only listed.

    One MCAP gives `Annotated`, or raises InputError or UsageError; a list gives `Outcomes`.
    """
    if (text is None) != (at is None):
        raise UsageError('a note needs both a text and a time: --at 12.3s "text"')
    add = [NoteText(at, text, to, severity)] if text is not None and at is not None else []
    add += notes_from_csv(notes) if notes is not None else []
    severity_of(severity)
    settings: dict[str, Any] = {"add": add, "remove": tuple(remove), "force": force}
    if isinstance(source, str | Path):
        target = outputs([Path(source)], output)[0] if output is not None else Path(source)
        return annotate_one(Path(source), target, **settings)
    files = expand(source, is_mcap)
    targets = outputs(files, output) if output is not None else files
    pairs = zip(files, targets, strict=True)
    return run_all(
        [(str(file), partial(annotate_one, file, target, **settings)) for file, target in pairs], jobs or 1, timeout_s
    )
