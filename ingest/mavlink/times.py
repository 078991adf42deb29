"""Times of all messages, and the segments and findings that tell of the clocks."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from ...schemas.finding import Finding, Kind, Severity
from ...schemas.recording import Segment
from . import pieces
from .assign_kernel import assign
from .clocks import REBOOT, STEP, WRAP, Line
from .frames import Frames, Group
from .pieces import Clock, Piece
from .scan_kernel import Ints
from .senders import prompt
from .vehicles import Vehicle

FOREVER: Final = int(np.iinfo(np.int64).max)
NS: Final = 1000
ARRIVAL: Final = "arrival"


@dataclass(frozen=True, eq=False)
class Timeline:
    """``times_ns`` by row; per group how many messages took their arrival's time (in all, in spite of an own time);
    the clocks with their pieces, and first and last time of each piece, all clocks' pieces counted through.
    """

    times_ns: Ints
    by_arrival: Ints
    clocks: tuple[Clock, ...]
    spans: Ints

    def of(self, group: Group) -> Ints:
        """The times of a group's messages."""
        return self.times_ns[group.first_row : group.first_row + len(group)]

    def stamped_by(self, group: Group) -> dict[str, str]:
        """The channel metadata ``stamped_by`` of messages that took their arrival's time."""
        by_arrival = int(self.by_arrival[group.number, 0])
        if by_arrival == len(group):
            return {"stamped_by": ARRIVAL}
        return {"stamped_by": f"own time; {by_arrival} of {len(group)} by {ARRIVAL}"} if by_arrival else {}

    def clock_of(self, vehicle: Vehicle) -> int:
        """The number of the vehicle's clock, -1 where it has none: its autopilot's, else its first."""
        own = [i for i, c in enumerate(self.clocks) if c.system == vehicle.system]
        return min(own, key=lambda i: (self.clocks[i].component != vehicle.component, self.clocks[i].unix), default=-1)

    def pieces_of(self, clock: int) -> list[tuple[Piece, int, int]]:
        """A clock's pieces with first and last time (ns), those without a message left out."""
        first = sum(len(c.pieces) for c in self.clocks[:clock])
        spans = self.spans[first : first + len(self.clocks[clock].pieces)]
        joined = zip(self.clocks[clock].pieces, spans, strict=True)
        return [(piece, int(a), int(b)) for piece, (a, b) in joined if a <= b]


def timeline(frames: Frames, vehicles: Sequence[Vehicle]) -> Timeline:
    """Give every message its time."""
    main = (vehicles[0].system, vehicles[0].component) if vehicles else None
    clocks = tuple(pieces.build(frames, main))
    parents = {v.system: v.component for v in vehicles}
    groups = np.array([_clocks_of(g, clocks, parents) for g in frames.groups], np.int64).reshape(-1, 4)
    starts = np.cumsum([0, *(len(c.pieces) for c in clocks)])
    table, rates = _tables(clocks)
    times, by_arrival, spans = assign(
        frames.groups_of,
        frames.rows_of,
        frames.own_us,
        frames.stamps_us,
        frames.stamped,
        groups,
        starts,
        table,
        rates,
    )
    return Timeline(times, by_arrival, clocks, spans)


def _clocks_of(group: Group, clocks: Sequence[Clock], parents: dict[int, int]) -> tuple[int, int, int, int]:
    """The clocks that `assign_kernel.assign` needs for a group."""
    mine = {c.unix: i for i, c in enumerate(clocks) if (c.system, c.component) == (group.system, group.component)}
    component = parents.get(group.system)
    family = [i for i, c in enumerate(clocks) if c.system == group.system]
    parent = min(family, key=lambda i: (clocks[i].component != component, i), default=0 if clocks else -1)
    return mine.get(False, -1), mine.get(True, -1), parent, int(prompt(group))


def _tables(clocks: Sequence[Clock]) -> tuple[Ints, np.ndarray[tuple[int, ...], np.dtype[np.float64]]]:
    rows, rates = [], []
    for clock in clocks:
        for i, piece in enumerate(clock.pieces):
            assert piece.utc is not None
            arrival = piece.arrival or Line(0, 0)
            low = NS * piece.start_us if i else -FOREVER
            high = NS * clock.pieces[i + 1].start_us - 1 if i + 1 < len(clock.pieces) else FOREVER
            own = (piece.first, piece.own_first, piece.own_min, piece.own_max)
            rows.append((*own, arrival.of0, arrival.to0, piece.utc.of0, NS * piece.utc.to0, low, high))
            rates.append((arrival.rate, piece.utc.rate))
    return np.array(rows, np.int64).reshape(-1, 10), np.array(rates, np.float64).reshape(-1, 2)


def segments(line: Timeline, vehicle: Vehicle) -> list[Segment]:
    """The vehicle's segments; none where it says no time."""
    clock = line.clock_of(vehicle)
    if clock < 0:
        return []
    found = []
    for index, (piece, start, end) in enumerate(line.pieces_of(clock)):
        assert piece.utc is not None
        offset = NS * (piece.utc.at(piece.own_first) - piece.own_first)
        found.append(Segment(str(vehicle.system), index, start, end, offset, piece.reason))
    return found


def findings(frames: Frames, line: Timeline, vehicle: Vehicle) -> list[Finding]:
    """Reboots, clock steps and wraps of the vehicle's clock."""
    clock = line.clock_of(vehicle)
    found = line.pieces_of(clock) if clock >= 0 else []
    result = []
    for (before, _, _), (piece, start, _) in pairwise(found):
        where = f"system {vehicle.system}"
        if frames.stamped:
            where += f", {(frames.stamps_us[piece.first] - frames.stamps_us[0]) / 1e6:.1f} s into the log"
        kind = Kind.REBOOT if piece.reason == REBOOT else Kind.CLOCK_STEP
        gap = (piece.start_us - before.end_us) / 1e6
        result.append(Finding(start, start, Severity.WARN, kind, "", gap, "s", _text(where, before, piece)))
    return result


def _text(where: str, before: Piece, piece: Piece) -> str:
    last, first = before.own_max / 1e6, piece.own_first / 1e6
    if piece.reason == REBOOT:
        return (
            f"{where}: the vehicle rebooted, its clock fell from {last:.3f} s to {first:.3f} s; estimators restart here"
        )
    if piece.reason == WRAP:
        return f"{where}: the 32-bit millisecond clock began anew after 49.7 days; estimators restart here"
    assert piece.reason == STEP
    return f"{where}: a clock was set anew (the vehicle's at {first:.3f} s); estimators restart here"
