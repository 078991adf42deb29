"""Findings and notes as the channels ``/findings`` and ``/annotations``, and back."""

from collections.abc import Callable, Iterable

import numpy as np

from ..schemas.columns import Channel, Columns
from ..schemas.finding import Finding, Kind, Note, Severity
from ..schemas.messages import FINDING, LOG

FINDINGS = "/findings"
ANNOTATIONS = "/annotations"
MIRROR = "attlog/"
"""How the name of an annotation begins that says a finding in words."""
PERSON = "note"
"""The name of an annotation that a person made."""


def findings_columns(findings: Iterable[Finding]) -> Columns:
    """The channel ``/findings``, in order of time."""
    ordered = sorted(findings, key=lambda finding: (finding.time_ns, finding.topic, finding.kind))
    texts = {name: [getattr(f, name).encode() for f in ordered] for name in ("kind", "topic", "unit", "advice")}
    lengths = {name: max(map(len, values), default=1) for name, values in texts.items()}
    data = np.zeros(len(ordered), FINDING.dtype(lengths))
    time_ns = np.array([finding.time_ns for finding in ordered], dtype=np.int64)
    end_ns = np.array([finding.end_ns for finding in ordered], dtype=np.int64)
    data["header"]["stamp"]["sec"], data["header"]["stamp"]["nanosec"] = np.divmod(time_ns, 1_000_000_000)
    data["end"]["sec"], data["end"]["nanosec"] = np.divmod(end_ns, 1_000_000_000)
    data["severity"] = [finding.severity for finding in ordered]
    data["value"] = [finding.value for finding in ordered]
    for name, values in texts.items():
        data[name] = values
    return Columns(Channel(FINDINGS, FINDING), time_ns, data)


def findings_from(columns: Columns | None) -> list[Finding]:
    """The inverse of `findings_columns`."""
    if columns is None:
        return []
    end_ns = columns["end"]["sec"].astype(np.int64) * 1_000_000_000 + columns["end"]["nanosec"]
    rows = zip(columns.time_ns.tolist(), end_ns.tolist(), columns.data, strict=True)
    return [
        Finding(
            start,
            end,
            Severity(int(row["severity"])),
            Kind(_text(row["kind"])),
            _text(row["topic"]),
            float(row["value"]),
            _text(row["unit"]),
            _text(row["advice"]),
        )
        for start, end, row in rows
    ]


def notes_columns(notes: Iterable[Note]) -> Columns:
    """The channel ``/annotations``, in order of time."""
    ordered = sorted(notes, key=lambda note: note.time_ns)
    texts = {
        "name": [note.name.encode() for note in ordered],
        "msg": [note.text.encode() for note in ordered],
        "function": [f"until_ns={note.end_ns}".encode() if note.end_ns is not None else b"" for note in ordered],
    }
    lengths = {name: max(map(len, values), default=1) for name, values in texts.items()}
    data = np.zeros(len(ordered), LOG.dtype(lengths))
    time_ns = np.array([note.time_ns for note in ordered], dtype=np.int64)
    data["stamp"]["sec"], data["stamp"]["nanosec"] = np.divmod(time_ns, 1_000_000_000)
    data["level"] = [note.severity for note in ordered]
    for name, values in texts.items():
        data[name] = values
    return Columns(Channel(ANNOTATIONS, LOG), time_ns, data)


def notes_from(columns: Columns | None) -> list[Note]:
    """The inverse of `notes_columns`."""
    if columns is None:
        return []
    return [
        Note(time_ns, _severity(int(row["level"])), _text(row["name"]), _text(row["msg"]), _until(row["function"]))
        for time_ns, row in zip(columns.time_ns.tolist(), columns.data, strict=True)
    ]


def _until(function: bytes) -> int | None:
    text = _text(function)
    return int(text.removeprefix("until_ns=")) if text.startswith("until_ns=") else None


def _severity(level: int) -> Severity:
    return max((severity for severity in Severity if severity <= level), default=Severity.DEBUG)


def _text(value: bytes | str) -> str:
    return value if isinstance(value, str) else bytes(value).decode("utf-8", "replace")


def mirror(finding: Finding) -> Note:
    """The finding in words."""
    size = f" ({finding.value:.4g} {finding.unit})" if finding.unit else ""
    text = f"{finding.topic or 'log'}: {finding.kind}{size}: {finding.advice}"
    end = finding.end_ns if finding.end_ns > finding.time_ns else None
    return Note(finding.time_ns, finding.severity, f"{MIRROR}{finding.kind}", text, end)


def both(findings: Iterable[Finding], notes: Iterable[Note]) -> list[Columns]:
    """``/findings`` (none twice) and ``/annotations``, each where it has a message; old mirrors among ``notes`` go."""
    said = [note for note in notes if not note.name.startswith(MIRROR)]
    distinct = list(dict.fromkeys(findings))
    made = [findings_columns(distinct), notes_columns([*said, *map(mirror, distinct)])]
    return [columns for columns in made if len(columns)]


def replaced(existing: Iterable[Finding], new: Iterable[Finding], is_remade: Callable[[str], bool]) -> list[Finding]:
    """The findings after a channel was made anew: its old ones give way."""
    return [*(finding for finding in existing if not is_remade(finding.topic)), *new]
