"""The pieces of every sender's clock, with the line from its own times to UTC in each.

UTC comes from SYSTEM_TIME or from own times that count from 1970; else from what another piece or the main vehicle
tells about the log's stamps; else from those stamps, where they are UTC; else times count from the vehicle's boot.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from . import clocks
from .clocks import REBOOT, START, STEP, WRAP, Break, Line, Observations
from .frames import Frames
from .rows_kernel import WRAP_US
from .senders import UTC_FROM_US, UTC_TO_US, Sender, senders

AFTER_US: Final = 1_000_000
MOST_PIECES: Final = 8
APART: Final = 20

SYSTEM_TIME: Final = "SYSTEM_TIME"
OWN: Final = "own time"
STAMPS: Final = "log stamps"
BOOT: Final = "since boot"


@dataclass(frozen=True)
class Piece:
    """A stretch of a clock from frame ``first`` on. Own times count from boot, modulo the wrap, or from 1970.

    ``arrival`` leads from own time to stamp (None in raw streams), ``utc`` from own time to UTC (us); ``own_first`` is
    the first own time, ``own_min`` and ``own_max`` bound them.
    """

    first: int
    reason: str
    own_first: int
    own_min: int
    own_max: int
    arrival: Line | None
    utc: Line | None
    source: str

    @property
    def start_us(self) -> int:
        """UTC of the earliest own time."""
        assert self.utc is not None
        return self.utc.at(self.own_min)

    @property
    def end_us(self) -> int:
        """UTC of the latest own time."""
        assert self.utc is not None
        return self.utc.at(self.own_max)


@dataclass(frozen=True)
class Clock:
    """The clock of one component; ``unix`` where its times count from 1970."""

    system: int
    component: int
    unix: bool
    seen: int
    pieces: tuple[Piece, ...]


def build(frames: Frames, main: tuple[int, int] | None) -> list[Clock]:
    """All clocks of a log, resolved; the first is that of ``main`` (system, component), or the one seen most."""
    found = [clock for clock in (_clock(sender, frames.stamped) for sender in senders(frames)) if clock.pieces]
    found.sort(key=lambda c: ((c.system, c.component) != main, c.unix, -c.seen))
    return _resolved(frames, found)


def _clock(sender: Sender, stamped: bool) -> Clock:
    seen = sender.seen
    found = _breaks(sender, stamped)
    if len(found) > max(MOST_PIECES, len(seen) // 4):  # what starts anew with every other message is no clock
        return Clock(sender.system, sender.component, sender.unix, len(seen), ())
    stamp_edges = [b.at for b in found if b.reason in (REBOOT, STEP) and not b.sets_utc]
    utc_edges = [b.at for b in found if b.reason == REBOOT or b.sets_utc]
    pieces = []
    for start, stop, reason in _stretches(found, len(seen)):
        arrival = clocks.envelope(seen.part(*_around(stamp_edges, start, len(seen)))) if stamped else None
        utc, source = _utc(sender, *_around(utc_edges, start, len(seen)))
        ahead = int(sender.wraps[start]) * WRAP_US
        pieces.append(_piece(seen.part(start, stop), reason, ahead, arrival, utc, source))
    return Clock(sender.system, sender.component, sender.unix, len(seen), tuple(pieces))


def _breaks(sender: Sender, stamped: bool) -> list[Break]:
    """Where pieces begin: reboots, steps, wraps, and where UTC is set anew."""
    found = clocks.breaks(sender.seen, sender.wraps, stamped)
    pairs, frames = sender.pairs, sender.seen.frame
    boots = np.searchsorted(pairs.frame, [frames[b.at] for b in found if b.reason == REBOOT])
    for low, high in pairwise((0, *boots.tolist(), len(pairs.frame))):
        for at in low + clocks.utc_steps(pairs.own[low:high], pairs.utc[low:high]):
            place = int(np.searchsorted(frames, pairs.frame[at]))
            if 0 < place < len(frames) and all(abs(place - b.at) > APART for b in found):
                found.append(Break(place, STEP, sets_utc=True))
    return sorted(found, key=lambda b: b.at)


def _utc(sender: Sender, low: int, high: int) -> tuple[Line | None, str]:
    """What the sender itself says of UTC among its observations ``[low, high)``."""
    if sender.unix:
        return Line(0, 0), OWN
    pairs = sender.pairs
    inside = (pairs.frame >= sender.seen.frame[low]) & (pairs.frame <= sender.seen.frame[high - 1])
    if not inside.any():
        return None, ""
    return clocks.fit_pairs(pairs.own[inside], pairs.utc[inside]), SYSTEM_TIME


def _stretches(found: list[Break], size: int) -> list[tuple[int, int, str]]:
    starts = [0, *(b.at for b in found)]
    return list(zip(starts, [*starts[1:], size], [START, *(b.reason for b in found)], strict=True))


def _around(edges: list[int], at: int, size: int) -> tuple[int, int]:
    """The stretch between ``edges`` that holds observation ``at``."""
    return max([0, *(e for e in edges if e <= at)]), min([size, *(e for e in edges if e > at)])


def _piece(seen: Observations, reason: str, ahead: int, arrival: Line | None, utc: Line | None, source: str) -> Piece:
    """``ahead``: what the unwrapped own times are ahead of those in the messages."""
    own = seen.own - ahead
    arrival, utc = (line and replace(line, of0=line.of0 - ahead) for line in (arrival, utc))
    return Piece(int(seen.frame[0]), reason, int(own[0]), int(own.min()), int(own.max()), arrival, utc, source)


@dataclass(frozen=True)
class _Known:
    """What the log's stamps lack to UTC, near a stamp."""

    system: int
    stamp: int
    lacks: int


def _resolved(frames: Frames, clocks_: list[Clock]) -> list[Clock]:
    known: list[_Known] = []
    for clock in clocks_:
        known += [_known(clock, p) for p in clock.pieces if p.utc is not None and p.arrival is not None]
    done: list[Clock] = []
    for clock in clocks_:
        near = _of_system(known, clock.system) or _of_system(known, clocks_[0].system) or known
        pieces: list[Piece] = []
        for piece in clock.pieces:
            filled = piece if piece.utc is not None else _with_utc(frames, piece, near, done)
            pieces.append(_after(pieces[-1], filled) if pieces else filled)
        if clock is clocks_[0] and not known:
            known += [_known(clock, p) for p in pieces if p.arrival is not None]
        done.append(replace(clock, pieces=tuple(pieces)))
    return done


def _of_system(known: list[_Known], system: int) -> list[_Known]:
    return [k for k in known if k.system == system]


def _known(clock: Clock, piece: Piece) -> _Known:
    assert piece.arrival is not None
    assert piece.utc is not None
    stamp = piece.arrival.at(piece.own_first)
    return _Known(clock.system, stamp, piece.utc.at(piece.own_first) - stamp)


def _with_utc(frames: Frames, piece: Piece, near: list[_Known], done: list[Clock]) -> Piece:
    if piece.arrival is None:
        return replace(piece, utc=_beside(piece, done), source=BOOT)
    stamp = piece.arrival.at(piece.own_first)
    rate = piece.arrival.rate if abs(piece.arrival.rate - 1) <= clocks.LARGEST_DRIFT else 1.0
    if near:
        lacks = min(near, key=lambda k: abs(k.stamp - stamp)).lacks
        return replace(piece, utc=Line(piece.own_first, stamp + lacks, rate), source=STAMPS)
    if are_utc(frames):
        return replace(piece, utc=Line(piece.own_first, stamp, rate), source=STAMPS)
    return replace(piece, utc=Line(0, 0), source=BOOT)


def _beside(piece: Piece, done: list[Clock]) -> Line:
    """In a raw stream: since boot for the main clock, for another so that it starts at the main clock's time there."""
    if not done or not done[0].pieces:
        return Line(0, 0)
    main = [p for p in done[0].pieces if p.first <= piece.first] or [done[0].pieces[0]]
    return Line(piece.own_first, main[-1].start_us)


def _after(before: Piece, piece: Piece) -> Piece:
    """The piece, moved where it would begin before its predecessor's end: time never runs backward."""
    assert before.utc is not None
    assert piece.utc is not None
    if piece.start_us > before.end_us:
        return piece
    ahead = WRAP_US if piece.reason == WRAP else 0
    if piece.reason in (STEP, WRAP) and piece.own_min + ahead > before.own_max:
        return replace(piece, utc=replace(before.utc, of0=before.utc.of0 - ahead), source=before.source)
    late = before.end_us + AFTER_US - piece.start_us
    return replace(piece, utc=replace(piece.utc, to0=piece.utc.to0 + late))


def are_utc(frames: Frames) -> bool:
    """Whether the log's stamps count from 1970."""
    middle = int(np.median(frames.stamps_us)) if len(frames) else 0
    return frames.stamped and UTC_FROM_US <= middle < UTC_TO_US
