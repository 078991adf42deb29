"""The kernel that gives every message its time."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...geometry.jit import kernel
from .rows_kernel import UNIX_US
from .scan_kernel import Ints

EARLY_US: Final = 2_000_000
LATE_US: Final = 60_000_000
MADE_UP_NS: Final = 1_000_000

# Columns of the table of pieces, one row a piece
FIRST, OWN_FIRST, OWN_MIN, OWN_MAX, ARRIVAL_OF, ARRIVAL_TO, UTC_OF, UTC_TO_NS, LOW_NS, HIGH_NS = range(10)
# Columns of the table of groups
BOOT_CLOCK, UNIX_CLOCK, PARENT, IS_PROMPT = range(4)


@kernel
def piece_at(cursor: Ints, ends: Ints, table: Ints, clock: int, frame: int) -> int:
    """The piece of ``clock`` that ``frame`` lies in; frames come in order, so the cursor only moves on."""
    piece = cursor[clock]
    while piece + 1 < ends[clock] and table[piece + 1, FIRST] <= frame:
        piece += 1
    cursor[clock] = piece
    return int(piece)


@kernel
def utc_ns(table: Ints, rates: NDArray[np.float64], piece: int, own: int) -> int:
    """UTC of an own time (us), in nanoseconds, within the piece's bounds."""
    passed = 1000 * (own - table[piece, UTC_OF])
    time = table[piece, UTC_TO_NS] + passed + np.int64(np.rint(passed * (rates[piece, 1] - 1.0)))
    return int(min(max(time, table[piece, LOW_NS]), table[piece, HIGH_NS]))


@kernel
def own_at(
    table: Ints, rates: NDArray[np.float64], latest: Ints, piece: int, clock: int, stamp: int, stamped: bool
) -> int:
    """The clock's own time at a message's arrival: through the envelope, or the latest one heard in a raw stream."""
    if not stamped:
        return int(latest[clock])
    return int(table[piece, ARRIVAL_OF] + np.int64(np.rint((stamp - table[piece, ARRIVAL_TO]) / rates[piece, 0])))


@kernel
def assign(
    groups_of: NDArray[np.int32],
    rows_of: Ints,
    own_us: Ints,
    stamps_us: Ints,
    stamped: bool,
    groups: Ints,
    starts: Ints,
    table: Ints,
    rates: NDArray[np.float64],
) -> tuple[Ints, Ints, Ints]:
    """Times of all messages, by row, in nanoseconds.

    ``groups`` (g, 4): a group's clock for own times since boot and from 1970 and for arrival (-1 none), and whether its
    own times are prompt; ``starts`` (clocks + 1,): each clock's first piece; ``table`` (pieces, 10) and ``rates``
    (pieces, 2). Also returns per group how many messages took their arrival's time, in all and in spite of an own time,
    (g, 2), and per piece the first and the last time, (pieces, 2).
    """
    times = np.empty(len(own_us), np.int64)
    by_arrival = np.zeros((len(groups), 2), np.int64)
    spans = np.empty((len(table), 2), np.int64)
    spans[:, 0], spans[:, 1] = np.iinfo(np.int64).max, np.iinfo(np.int64).min
    cursor, ends = starts[:-1].copy(), starts[1:]
    latest = np.empty(len(ends), np.int64)
    for clock in range(len(ends)):
        latest[clock] = table[starts[clock], OWN_FIRST]
    for i in range(len(own_us)):
        group, own, stamp = groups_of[i], own_us[i], stamps_us[i]
        clock = -1
        if own >= 0:
            clock = groups[group, UNIX_CLOCK] if own >= UNIX_US else groups[group, BOOT_CLOCK]
        piece = -1
        if clock >= 0:
            piece = piece_at(cursor, ends, table, clock, i)
            prompt = groups[group, IS_PROMPT] == 1 and table[piece, OWN_MIN] <= own <= table[piece, OWN_MAX]
            if prompt:
                latest[clock] = own
            else:
                age = own_at(table, rates, latest, piece, clock, stamp, stamped) - own
                if age < -EARLY_US or age > LATE_US:
                    clock = -1
        if clock < 0:
            by_arrival[group, 0] += 1
            by_arrival[group, 1] += own >= 0
            clock = groups[group, PARENT]
            if clock < 0:
                times[rows_of[i]] = 1000 * stamp if stamped else i * MADE_UP_NS
                continue
            piece = piece_at(cursor, ends, table, clock, i)
            own = own_at(table, rates, latest, piece, clock, stamp, stamped)
        time = utc_ns(table, rates, piece, own)
        times[rows_of[i]] = time
        spans[piece, 0], spans[piece, 1] = min(spans[piece, 0], time), max(spans[piece, 1], time)
    return times, by_arrival, spans
