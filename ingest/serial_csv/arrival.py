"""A device's time as UTC, where it is known when each line arrived.

Lines are only ever delayed, so the fit is the arrivals' lower envelope, one line for each segment, as for MAVLink.
"""

from dataclasses import replace
from itertools import pairwise
from typing import Final

import numpy as np

from .clock import Ints, Stamps

MICROSECOND: Final = 1000
KNOWS_UTC_NS: Final = 946_684_800 * 10**9
"""2000-01-01: a device whose time is later than this tells the date itself."""


def fitted(stamped: Stamps, arrived_ns: Ints) -> Stamps:
    """The stamps (n,) in UTC, from the arrivals (n,) of their lines; as they are where the device itself knows UTC."""
    from ..mavlink.clocks import Observations, envelope  # late, since it needs Numba

    if len(stamped.time_ns) == 0 or int(stamped.time_ns[0]) > KNOWS_UTC_NS:
        return stamped
    time_ns = np.empty_like(stamped.time_ns)
    offsets = []
    edges = [*stamped.first, len(time_ns)]
    for number, (start, end) in enumerate(pairwise(edges)):
        own, arrived = stamped.time_ns[start:end], arrived_ns[start:end]
        seen = Observations(np.arange(start, end), arrived // MICROSECOND, own // MICROSECOND)
        line = envelope(seen)
        ahead = own - line.of0 * MICROSECOND
        utc = line.to0 * MICROSECOND + ahead + np.rint(ahead * (line.rate - 1.0)).astype(np.int64)
        if start and utc[0] <= time_ns[start - 1]:
            utc += time_ns[start - 1] + MICROSECOND - utc[0]
        time_ns[start:end] = utc
        offsets.append(stamped.offset_ns[number] + int(utc[0] - own[0]))
    return replace(stamped, time_ns=time_ns, offset_ns=tuple(offsets))


def rising(line_ns: Ints) -> Ints:
    """Arrival stamps of which none repeats the one before: lines that arrive together are a microsecond apart."""
    steps = np.arange(len(line_ns), dtype=np.int64) * MICROSECOND
    return np.asarray(np.maximum.accumulate(line_ns - steps) + steps)
