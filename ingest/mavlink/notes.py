"""What the vehicles said: status texts, changes of mode and of arming."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from ...schemas.columns import Table
from ...schemas.finding import Note, Severity
from .definitions import Dialect
from .frames import Frames, Group
from .passthrough import with_clean_texts
from .times import Timeline
from .vehicles import Vehicle

# MAV_SEVERITY: emergency, alert, critical, error, warning, notice, info, debug
SEVERITIES: Final = (
    Severity.FATAL,
    Severity.FATAL,
    Severity.ERROR,
    Severity.ERROR,
    Severity.WARN,
    Severity.INFO,
    Severity.INFO,
    Severity.DEBUG,
)
# Until 2015 ArduPilot counted the other way: low, medium, high, critical; its banner, of low severity, tells.
OLD_SEVERITIES: Final = {1: Severity.INFO, 2: Severity.WARN, 3: Severity.ERROR, 4: Severity.FATAL}
OLD_BANNERS: Final = (b"GROUND START", b"Initialising APM", b"Calibrating barometer")
ARMED: Final = 128
CHUNK: Final = 50


def notes(frames: Frames, line: Timeline, vehicles: list[Vehicle], dialect: Dialect) -> tuple[Note, ...]:
    """All notes of a log in the order of time; those of other systems than the first vehicle say whose they are."""
    main = vehicles[0].system if vehicles else -1
    found = [note for group in frames.of("STATUSTEXT") for note in _texts(group, line, main)]
    for vehicle in vehicles:
        beats = [g for g in frames.of("HEARTBEAT", system=vehicle.system) if g.component == vehicle.component]
        found += [note for group in beats for note in _states(group, line, main, dialect)]
    return tuple(sorted(found, key=lambda note: note.time_ns))


def _name(group: Group, main: int, name: str) -> str:
    return name if group.system == main else f"system {group.system} {name}"


@dataclass
class _Parts:
    """A status text that comes in chunks."""

    time_ns: int
    severity: Severity
    identity: int
    next_chunk: int
    text: bytes


def _texts(group: Group, line: Timeline, main: int) -> Iterator[Note]:
    rows = with_clean_texts(group)
    name = _name(group, main, "STATUSTEXT")
    columns = (rows[field].tolist() for field in ("text", "id", "chunk_seq"))
    parts: _Parts | None = None
    for time_ns, severity, text, identity, chunk in zip(
        line.of(group).tolist(), _severities(rows), *columns, strict=True
    ):
        if parts is not None and not (identity == parts.identity and chunk == parts.next_chunk):
            yield _note(name, parts.time_ns, parts.severity, parts.text)
            parts = None
        if identity == 0:
            yield _note(name, time_ns, severity, text)
            continue
        parts = parts or _Parts(time_ns, severity, identity, chunk, b"")
        parts.text += text
        parts.next_chunk = chunk + 1
        if len(text) < CHUNK:
            yield _note(name, parts.time_ns, parts.severity, parts.text)
            parts = None
    if parts is not None:
        yield _note(name, parts.time_ns, parts.severity, parts.text)


def _severities(rows: Table) -> list[Severity]:
    levels = rows["severity"].tolist()
    low = rows["text"][rows["severity"] == 1].tolist()
    old = OLD_SEVERITIES if any(text.startswith(OLD_BANNERS) for text in low) else {}
    return [old.get(level) or SEVERITIES[min(level, len(SEVERITIES) - 1)] for level in levels]


def _note(name: str, time_ns: int, severity: Severity, text: bytes) -> Note:
    return Note(time_ns, severity, name, text.decode("utf-8", "replace"))


def _states(group: Group, line: Timeline, main: int, dialect: Dialect) -> Iterator[Note]:
    rows, times = group.rows, line.of(group)
    armed = (rows["base_mode"] & ARMED) != 0
    for at in np.flatnonzero(np.diff(armed, prepend=False)):
        text = "armed" if armed[at] else "disarmed"
        yield Note(int(times[at]), Severity.INFO, _name(group, main, "arming"), text)
    mode = rows["custom_mode"].astype(np.int64) << 8 | (rows["base_mode"] & ~np.uint8(ARMED))
    before = ""
    for at in np.flatnonzero(np.diff(mode, prepend=-1)):
        text = _mode(dialect, rows[at])
        if text != before:
            yield Note(int(times[at]), Severity.INFO, _name(group, main, "mode"), f"mode {text}")
        before = text


def _mode(dialect: Dialect, row: np.void) -> str:
    from pymavlink import mavutil

    fields = ("type", "autopilot", "base_mode", "custom_mode", "system_status", "mavlink_version")
    message = dialect.module.MAVLink_heartbeat_message(*(int(row[name]) for name in fields))
    return str(mavutil.mode_string_v10(message))
