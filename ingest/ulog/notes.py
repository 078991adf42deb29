"""What the vehicle itself said: logged texts, events, arming, modes and parameters as lines of ``/annotations``."""

import re
from collections.abc import Iterator
from typing import Final

import numpy as np

from ...schemas import InputError, Note, Severity
from . import names
from .clock import Clock
from .events import SHOWN_GROUP, Definitions, definitions
from .information import multiple
from .log import Log, Topic

SEVERITY: Final = (
    Severity.FATAL,
    Severity.FATAL,
    Severity.FATAL,
    Severity.ERROR,
    Severity.WARN,
    Severity.INFO,
    Severity.INFO,
    Severity.DEBUG,
)
"""By level of syslog: emergency, alert, critical, error, warning, notice, info, debug."""
ALSO_EVENT: Final = "\t"
"""How a text ends that is logged for readers who do not know events."""
COLOR: Final = re.compile(r"\x1b\[[0-9;]*m")
EVENTS: Final = "metadata_events"


def notes(log: Log, clock: Clock) -> Iterator[Note]:
    """Everything that was said, in no order."""
    known = _definitions(log)
    yield from _texts(log, clock, known is not None and bool(log.named("event")))
    for topic in log.named("event"):
        yield from _events(topic, clock, known)
    for topic in log.named("vehicle_status"):
        yield from _changes(topic, clock, "arming_state", names.arming)
        yield from _changes(topic, clock, "nav_state", names.mode)
    yield from _parameters(log, clock)


def _texts(log: Log, clock: Clock, without_events: bool) -> Iterator[Note]:
    for said in log.said:
        if without_events and said.text.endswith(ALSO_EVENT):
            continue
        name = "log" if said.tag is None else f"log/{said.tag}"
        severity = SEVERITY[said.level] if 0 <= said.level < len(SEVERITY) else Severity.INFO
        yield Note(int(clock.time_ns[said.order]), severity, name, COLOR.sub("", said.text).strip())


def _definitions(log: Log) -> Definitions | None:
    pieces = multiple(entry for entry in log.multiple if entry.key == EVENTS).get(EVENTS)
    if not pieces or not log.named("event"):
        return None
    try:
        return definitions(b"".join(piece for piece in pieces[0] if isinstance(piece, bytes)))
    except InputError:
        return None


def _events(topic: Topic, clock: Clock, known: Definitions | None) -> Iterator[Note]:
    if not (topic.has("id", "log_levels") and topic.has_array(1, "arguments")):
        return
    numbers, levels = topic.integers("id").tolist(), (topic.integers("log_levels") >> 4 & 0xF).tolist()
    arguments = np.ascontiguousarray(topic["arguments"]).astype(np.uint8)
    for time_ns, number, level, row in zip(clock.stamps(topic).tolist(), numbers, levels, arguments, strict=True):
        if level >= len(SEVERITY):  # not for people
            continue
        if known is None or known.group(number) is None:
            yield Note(time_ns, SEVERITY[level], "event", _unknown(number, row.tobytes()))
        elif known.group(number) == SHOWN_GROUP:
            said = known.message(number, row.tobytes())
            yield Note(time_ns, SEVERITY[level], "event", said or _unknown(number, row.tobytes()))


def _unknown(number: int, arguments: bytes) -> str:
    values = arguments.rstrip(b"\0").hex(" ")
    return f"event {number}, arguments {values}" if values else f"event {number}"


def _changes(topic: Topic, clock: Clock, column: str, named: "names.Namer") -> Iterator[Note]:
    """The state at the beginning, and whenever its name changes."""
    if not topic.has(column):
        return
    values = topic.integers(column)
    begins = np.append(True, np.diff(values) != 0)
    stamps, last = clock.stamps(topic), ""
    for place in np.flatnonzero(begins).tolist():
        said = named(int(values[place]))
        if said != last:
            yield Note(int(stamps[place]), Severity.INFO, topic.name, said)
        last = said


def _parameters(log: Log, clock: Clock) -> Iterator[Note]:
    """Every change during the log."""
    before: dict[str, float] = {}
    for key, value, order, _ in log.parameters:
        if isinstance(value, str | bytes):
            continue
        if order >= log.data_begins:
            was = f" (was {before[key]:g})" if key in before else ""
            yield Note(int(clock.time_ns[order]), Severity.INFO, "parameter", f"{key} = {value:g}{was}")
        before[key] = value
