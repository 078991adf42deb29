"""A person's notes in a log."""

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from .. import storage
from ..schemas.errors import InputError, UsageError
from ..schemas.finding import Note, Severity
from .findings import ANNOTATIONS, PERSON, notes_columns
from .inputs import in_place_target, is_mcap
from .logs import everything_said, open_log
from .own import moved, places
from .text import seconds, table
from .verbs import Place, verb

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
                _check_row(path, reader.line_num, row)
                notes.append(NoteText(row["at"], row["text"], row.get("to") or None, row.get("severity") or "info"))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: cannot be read as a CSV of notes: {why}") from error
    return notes


def _check_row(path: Place, line: int, row: Mapping[str, str]) -> None:
    try:
        severity_of(row.get("severity") or "info")
        for spelled in filter(None, (row["at"], row.get("to"))):
            moment_ns(spelled, 0)
    except UsageError as error:
        raise InputError(f"{path}, line {line}: {error}") from error


def _dated(text: NoteText, start_ns: int) -> Note:
    at_ns = moment_ns(text.at, start_ns)
    end_ns = None if text.to is None else moment_ns(text.to, start_ns)
    if end_ns is not None and end_ns < at_ns:
        raise UsageError(f"a note from {text.at} cannot end at {text.to}")
    return Note(at_ns, severity_of(text.severity), PERSON, text.text, end_ns)


@verb(is_mcap, in_place=True)
def annotate(
    source: Place,
    text: str | None = None,
    *,
    at: str | None = None,
    to: str | None = None,
    severity: str = "info",
    notes: Place | None = None,
    remove: Sequence[int] = (),
    output: Place | None = None,
    force: bool = False,
) -> Annotated:
    """Add a note at ``at`` (until ``to``) to an MCAP's ``/annotations``, or those of a CSV with at,to,severity,text.

    Times are written as ``12.3s`` or ``1m5s`` after the log's start or as a date with its zone. ``remove`` takes notes
    out by the number that the result lists them with. Without a text, a CSV and ``remove`` the notes are only listed.
    InputError where the file cannot be read or a note is outside of it, UsageError for what is no time or severity.
    """
    add = _wanted(text, at, to, severity, notes)
    path, target = Path(source), in_place_target(source, output, force)
    with open_log(path) as log:
        _, said = everything_said(log)
        start_ns, end_ns, there = log.start_ns, log.end_ns, places(log)
    own = [note for note in said if note.name == PERSON]
    fresh = [_dated(each, start_ns) for each in add]
    _check(path, own, fresh, remove, (start_ns, end_ns))
    kept = [note for number, note in enumerate(own, 1) if number not in remove]
    mine = sorted([*kept, *fresh], key=lambda note: note.time_ns)
    if add or remove or target != path:
        everyone = [*(note for note in said if note.name != PERSON), *mine]
        columns = [notes_columns(everyone)] if everyone else []
        storage.annotate(path, moved(columns, there), remove={there[ANNOTATIONS]}.__contains__, output=target)
    return Annotated(str(path), str(target), tuple(mine), start_ns)


def _wanted(text: str | None, at: str | None, to: str | None, severity: str, notes: Place | None) -> list[NoteText]:
    if (text is None) != (at is None):
        raise UsageError('a note needs both a text and a time: --at 12.3s "text"')
    if to is not None and at is None:
        raise UsageError("--to needs --at: a note begins before it ends")
    if text is not None and not text.strip():
        raise UsageError("the note's text is empty")
    severity_of(severity)
    single = [NoteText(at, text, to, severity)] if text is not None and at is not None else []
    return [*single, *(notes_from_csv(notes) if notes is not None else [])]


def _check(path: Path, own: list[Note], fresh: list[Note], remove: Sequence[int], span: tuple[int, int]) -> None:
    wrong = [number for number in remove if not 1 <= number <= len(own)]
    if wrong:
        raise InputError(f"{path}: there is no note {wrong[0]}; there are {len(own)} (attlog annotate {path} --list)")
    outside = [note for note in fresh if not span[0] <= note.time_ns <= span[1]]
    if outside:
        raise InputError(
            f"{path}: the time of {outside[0].text!r} is outside the log, which lasts {seconds(span[1] - span[0])}"
        )
