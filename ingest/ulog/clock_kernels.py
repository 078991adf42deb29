"""The walk along a log's clock: what the time was at each message, and where the clock starts anew."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...geometry.jit import kernel, part

Ints = NDArray[np.int64]

LATE_US: Final = 200_000
"""A message is written at most so long after its time; an older one tells of another clock, or of a value kept long."""
NEAR_US: Final = 10_000_000
FORWARD_US: Final = 120_000_000
"""A dropout lasts 65 s at most."""
ADVANCES: Final = 4
"""So many topics' steps forward, without a message on the old clock between, make a new clock."""
LOOK: Final = 7
"""So many stamps decide whether a leap forward is the clock's or one message's."""
FARTHEST: Final = 5000
"""Within so many messages they have to come."""
BACKWARD, FORWARD = 1, 2


@part
def _follows(time: int, latest: int, late: int) -> bool:
    return latest - late <= time <= latest + FORWARD_US


@part
def _absurd(own: Ints, i: int, now: int) -> bool:
    """Whether the stamp of message ``i``, ahead of ``now``, is that message's own error: most others stay behind."""
    seen = 0
    behind = 0
    for j in range(i + 1, min(i + FARTHEST, own.size)):
        if own[j] > 0 and _follows(own[j], now, LATE_US):
            seen += 1
            behind += int(own[j] < own[i] - LATE_US)
        if seen == LOOK:
            break
    return 2 * behind > seen


@kernel
def follow(own: Ints, subject: NDArray[np.int32], subjects: int, start: int) -> tuple[Ints, Ints, Ints, Ints]:
    """Follow the clock through all messages, in the log's order.

    ``own`` (n,) is each message's own time in us, 0 where it has none, ``subject`` (n,) who says it (below
    ``subjects``), ``start`` the time at which the log begins. Returns the time at which each message was written, and
    by piece of the clock its first message, why it begins (0, BACKWARD, FORWARD), and how many messages were on it.
    """
    size = own.size
    arrival = np.empty(size, np.int64)
    begins = np.zeros(size + 1, np.int64)
    why = np.zeros(size + 1, np.int64)
    grounded = np.zeros(size + 1, np.int64)
    last = np.zeros(subjects, np.int64)  # on the clock
    seen = np.zeros(subjects, np.int64)  # at all
    stray = np.zeros(subjects, np.int64)  # beside the clock, since message `first`
    stray_of = np.full(subjects, -1, np.int64)
    now = start
    count = 1
    first = -1
    top = 0
    advances = 0
    backward = 0
    i = 0
    while i < size:
        time = own[i]
        who = subject[i]
        if time > 0 and time != seen[who]:
            if _follows(time, now, LATE_US) and (time <= now + LATE_US or not _absurd(own, i, now)):
                now = max(now, time)
                last[who] = time
                grounded[count - 1] += 1
                first = -1
            else:
                if first < 0 or not _follows(time, top, NEAR_US):
                    first, top, advances, backward = i, time, 0, 0
                if stray_of[who] == first and time > stray[who]:
                    advances += 1
                if time < last[who]:
                    backward += 1
                stray[who], stray_of[who] = time, first
                top = max(top, time)
                anew = own[first] > now or backward > 0 or grounded[count - 1] == 0
                if advances == ADVANCES and anew:
                    begins[count] = first
                    why[count] = FORWARD if own[first] > now else BACKWARD
                    count += 1
                    i, now = first, own[first]
                    first = -1
                    last[:] = 0
                    seen[:] = 0
                    continue
            seen[who] = time
        arrival[i] = now
        i += 1
    return arrival, begins[:count], why[:count], grounded[:count]
