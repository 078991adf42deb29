"""What is to be said of a log's damage."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from ...schemas.finding import Finding, Kind, Severity
from ...schemas.source import Completeness
from .definitions import Dialect
from .frames import Frames
from .times import Timeline

BAD_CHECKSUM: Final = "bad checksum"
NO_FRAME: Final = "no frame"
TORN: Final = "torn last record"
# By chance 256 broken frames of one message imply the same CRC_EXTRA once.
ENOUGH: Final = 8


def completeness(frames: Frames, size: int) -> Completeness:
    """Bytes and messages; ``dropped`` counts runs of bad bytes, those that begin with a whole frame apart."""
    damage = frames.damage
    counts = {
        BAD_CHECKSUM: damage.checksum_failures,
        NO_FRAME: len(damage.runs) - damage.checksum_failures,
        TORN: int(damage.torn > 0),
    }
    dropped = {reason: count for reason, count in counts.items() if count}
    return Completeness(size, size - damage.bytes - damage.torn, len(frames), damage.bytes, dropped)


def findings(frames: Frames, line: Timeline, dialect: Dialect) -> list[Finding]:
    """One finding for each kind of loss."""
    span = int(line.times_ns.min()), int(line.times_ns.max())
    found = [*_skipped(frames, dialect), *_stamps(frames), *_unknown(frames), *_times(frames, line)]
    return [Finding(*span, severity, kind, "", float(value), unit, text) for severity, kind, value, unit, text in found]


Loss = tuple[Severity, Kind, int, str, str]


def _skipped(frames: Frames, dialect: Dialect) -> Iterator[Loss]:
    damage = frames.damage
    if len(damage.runs):
        text = f"{len(damage.runs)} runs of bytes between the frames were skipped, {damage.bytes} B"
        yield Severity.WARN, Kind.SKIPPED, damage.bytes, "B", text
    if damage.torn:
        text = f"the last record is torn: {damage.torn} B of it are there; was the log copied completely?"
        yield Severity.WARN, Kind.SKIPPED, damage.torn, "B", text
    other = damage.runs[damage.runs[:, 3] >= 0, 2:]
    versions, counts = np.unique(other, axis=0, return_counts=True)
    for (identity, extra), count in zip(versions.tolist(), counts.tolist(), strict=True):
        if count >= ENOUGH:
            name = dialect.definition(identity).name
            text = (
                f"{count} of the skipped frames are message {identity} by another definition than {dialect.name}'s "
                f"{name} (CRC_EXTRA {extra}); another --dialect may know it"
            )
            yield Severity.INFO, Kind.SKIPPED, count, "messages", text


def _stamps(frames: Frames) -> Iterator[Loss]:
    damage = frames.damage
    if damage.stamps_lost or damage.stamps_wrong:
        total = damage.stamps_lost + damage.stamps_wrong
        text = (
            f"{damage.stamps_lost} frames had lost their stamp and {damage.stamps_wrong} had an impossible one; "
            "both were interpolated between their neighbours'"
        )
        yield Severity.WARN, Kind.CLOCK_STEP, total, "messages", text


def _unknown(frames: Frames) -> Iterator[Loss]:
    for identity in sorted({g.definition.id for g in frames.groups if not g.known}):
        groups = [g for g in frames.groups if g.definition.id == identity]
        count = sum(len(g) for g in groups)
        text = f"{count} frames of message {identity}, which the dialect does not know, are kept as raw payload"
        yield Severity.INFO, Kind.SKIPPED, count, "messages", f"{text}; another --dialect may know it"


def _times(frames: Frames, line: Timeline) -> Iterator[Loss]:
    displaced = int(line.by_arrival[:, 1].sum())
    if displaced:
        text = f"{displaced} messages whose own time lies far from their arrival took the arrival's time"
        yield Severity.INFO, Kind.CLOCK_STEP, displaced, "messages", text
    if not line.clocks and not frames.stamped:
        text = "no message says a time and the stream has no stamps: messages are numbered, a millisecond apart"
        yield Severity.ERROR, Kind.CLOCK_STEP, len(frames), "messages", text
    for clock in line.clocks:
        rates = [p.arrival.rate for p in clock.pieces if p.arrival is not None]
        fast = next((rate for rate in rates if abs(rate - 1) > 0.01), None)
        if fast is not None:
            text = (
                f"system {clock.system} lived {1 / fast:.2f} s in a second of the log's stamps; its own time was kept"
            )
            yield Severity.WARN, Kind.CLOCK_STEP, round(1 / fast), "1", text
