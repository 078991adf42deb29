"""The walk along a log's clock: which stamps are true, and where the clock starts anew."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...geometry.jit import inline_kernel, kernel

Ints = NDArray[np.int64]

SLACK_US: Final = 1_000_000
"""Records are written by several threads: a stamp this far before or after its neighbours' means nothing."""
MINUTE_US: Final = 60_000_000
HOUR_US: Final = 3_600_000_000
LONGEST_US: Final = 2**52
"""142 years: no count since boot is higher."""
NO_TIME: Final = -1
LOOK: Final = 7
"""So many stamps decide whether a jump is the clock's or one record's."""
NEITHER, BACKWARD, FORWARD = range(3)


@kernel
def _agreeing(time_us: Ints, start: int, low: int, high: int) -> tuple[int, int]:
    """Of the next stamps: how many there are (at most LOOK), and how many lie within [low, high]."""
    seen = 0
    inside = 0
    for i in range(start, time_us.size):
        if 0 <= time_us[i] <= LONGEST_US:
            seen += 1
            if low <= time_us[i] <= high:
                inside += 1
            if seen == LOOK:
                break
    return seen, inside


@inline_kernel
def _absurd(time_us: Ints, i: int, latest: int) -> bool:
    """Whether the stamp of record ``i``, away from ``latest`` (-1: none yet), is that record's own error."""
    t = int(time_us[i])
    if latest < 0:
        seen, near = _agreeing(time_us, i + 1, t - SLACK_US, t + HOUR_US)
        return 2 * near < seen
    if t < latest:
        seen, before = _agreeing(time_us, i + 1, latest - SLACK_US, latest + MINUTE_US)
        return seen == 0 or 2 * before > seen
    seen, before = _agreeing(time_us, i + 1, latest - SLACK_US, t - SLACK_US)
    _, near = _agreeing(time_us, i + 1, t - SLACK_US, t + HOUR_US)
    return 2 * before > seen or (near == 0 and t - latest > HOUR_US)


@kernel
def pieces(time_us: Ints) -> tuple[Ints, NDArray[np.int32], Ints, Ints, int]:
    """Follow the clock through all records, in the log's order; ``time_us`` is NO_TIME where one has none.

    Returns the time of every record (its neighbour's where it has none or an absurd one), the number of the piece it
    is in, where each piece begins, why (BACKWARD, FORWARD), and how many stamps were absurd.
    """
    filled = np.empty(time_us.size, np.int64)
    piece = np.zeros(time_us.size, np.int32)
    begins = [0]
    reasons = [NEITHER]
    absurd = 0
    latest = -1
    last = -1
    for i in range(time_us.size):
        t = int(time_us[i]) if time_us[i] <= LONGEST_US else -1
        absurd += t < 0 and time_us[i] != NO_TIME
        if t >= 0 and (latest < 0 or abs(t - latest) > SLACK_US):
            if _absurd(time_us, i, latest):
                absurd += 1
                t = -1
            elif latest >= 0:
                begins.append(i)
                reasons.append(BACKWARD if t < latest else FORWARD)
                latest = t
        if t >= 0:
            last = t
            latest = max(latest, t)
        filled[i] = last
        piece[i] = len(begins) - 1
    lead = 0
    while lead < filled.size and filled[lead] < 0:
        lead += 1
    filled[:lead] = filled[lead] if lead < filled.size else 0
    return filled, piece, np.array(begins), np.array(reasons), absurd
