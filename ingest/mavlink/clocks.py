"""One sender's clock: where it starts anew, and how its times relate to the log's stamps.

Times are microseconds. A clock's observations are its messages' own times with the stamps at which they arrived, in the
order of the log. Within a piece, arrival = envelope(own) + delay with delay >= 0, since links only delay: the envelope
is the line below all observations that lies closest to them (Moon, Skelly, Towsley, INFOCOM 1999,
doi:10.1109/INFCOM.1999.749287).
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...signals.envelope import edge
from .rows_kernel import WRAP_US
from .scan_kernel import Ints

STEP_US: Final = 1_000_000
WINDOW_US: Final = 10_000_000
WINDOW_MOST: Final = 2000
ENOUGH: Final = 20
FEW: Final = 3
WRAP_SLACK_US: Final = 60_000_000
SPAN_US: Final = 60_000_000
LARGEST_DRIFT: Final = 500e-6
SIMULATED_DRIFT: Final = 0.02

START: Final = "start"
REBOOT: Final = "reboot"
STEP: Final = "clock_step"
WRAP: Final = "wrap"


@dataclass(frozen=True)
class Line:
    """``to = to0 + rate (of - of0)``, in microseconds."""

    of0: int
    to0: int
    rate: float = 1.0

    def __call__(self, of: Ints) -> Ints:
        """The line at ``of``."""
        return np.asarray(self.to0 + (of - self.of0) + np.rint((of - self.of0) * (self.rate - 1.0)).astype(np.int64))

    def at(self, of: int) -> int:
        """The line at one value."""
        return int(self(np.array([of]))[0])


@dataclass(frozen=True, eq=False)
class Observations:
    """A clock's own times in the order of the log: frame, stamp (-1 in raw streams), own time."""

    frame: Ints
    stamp: Ints
    own: Ints

    def __len__(self) -> int:
        return len(self.frame)

    def part(self, start: int, stop: int) -> "Observations":
        """The observations ``[start, stop)``."""
        return Observations(self.frame[start:stop], self.stamp[start:stop], self.own[start:stop])


@dataclass(frozen=True)
class Break:
    """A piece begins at observation ``at``; ``sets_utc``: because the sender's UTC was set anew, not its own clock."""

    at: int
    reason: str
    sets_utc: bool = False


def unwrap(seen: Observations, stamped: bool) -> tuple[Observations, Ints]:
    """Own times that count on where time_boot_ms began anew, and how often it had, per observation."""
    if seen.own.max() - seen.own.min() < WRAP_US // 2:
        return seen, np.zeros(len(seen), np.int64)
    step = np.diff(seen.own)
    passed = np.diff(seen.stamp) if stamped else np.zeros(len(step), np.int64)
    down = np.abs(step + WRAP_US - passed) < WRAP_SLACK_US
    up = np.abs(step - WRAP_US - passed) < WRAP_SLACK_US  # late messages of the time before
    wraps = np.concatenate(([0], np.cumsum(down.astype(np.int64) - up)))
    return Observations(seen.frame, seen.stamp, seen.own + wraps * WRAP_US), wraps


def breaks(seen: Observations, wraps: Ints, stamped: bool) -> list[Break]:
    """Where the clock's pieces begin, the first one apart: reboots, steps of the clock that stamps the log, wraps."""
    found = _stamped_breaks(seen) if stamped else _raw_breaks(seen.own)
    firsts = np.unique(np.maximum.accumulate(wraps), return_index=True)[1][1:]
    found += [Break(int(at), WRAP) for at in firsts if all(abs(at - b.at) > 1 for b in found)]
    return sorted(found, key=lambda b: b.at)


def _stamped_breaks(seen: Observations) -> list[Break]:
    offset = seen.stamp - seen.own
    jump = np.diff(offset)
    found: list[Break] = []
    start = 0
    for k in np.flatnonzero((jump > STEP_US) | (jump < -STEP_US)):
        before = _window(seen.stamp, int(k), start, -1)
        after = _window(seen.stamp, int(k) + 1, len(seen), 1)
        change = offset[after].min() - offset[before].min()
        fell = seen.own[after].min() < seen.own[before].max() - STEP_US
        least = STEP_US if _lasts(seen.stamp[after]) and _lasts(seen.stamp[before]) else WINDOW_US
        if abs(change) <= least or abs(jump[k]) < 0.5 * abs(change):
            continue
        if len(seen.own[after]) < FEW or (len(seen.own[before]) < FEW and not fell):
            continue  # one stray message at an end of the log
        found.append(Break(int(k) + 1, REBOOT if fell else STEP))
        start = int(k) + 1
    return found


def _lasts(stamp: Ints) -> bool:
    """Whether a window holds enough to tell a step from a link's jitter."""
    return len(stamp) >= ENOUGH or bool(stamp.max() - stamp.min() > WINDOW_US // 2)


def _window(stamp: Ints, at: int, limit: int, way: int) -> slice:
    """Observations from ``at`` on, one way, until the stamps are 10 s away."""
    if way > 0:
        part = stamp[at : min(limit, at + WINDOW_MOST)]
        far = np.flatnonzero(np.abs(part - stamp[at]) > WINDOW_US)
        return slice(at, at + (int(far[0]) if len(far) else len(part)))
    part = stamp[max(limit, at + 1 - WINDOW_MOST) : at + 1]
    far = np.flatnonzero(np.abs(part - stamp[at]) > WINDOW_US)
    return slice(at + 1 - len(part) + (int(far[-1]) + 1 if len(far) else 0), at + 1)


def _raw_breaks(own: Ints) -> list[Break]:
    """Without stamps a fall of the clock that lasts is a reboot, one that the next messages undo is disorder."""
    found: list[Break] = []
    start = 0
    for k in np.flatnonzero(np.diff(own) < -STEP_US):
        reached = own[max(start, k - 19) : k + 1].max()
        if own[k + 1 : k + 21].max() < reached - STEP_US // 2:
            found.append(Break(int(k) + 1, REBOOT))
            start = int(k) + 1
    return found


def envelope(seen: Observations) -> Line:
    """Stamps as a line of own times, below all observations and close to them."""
    own0, stamp0 = int(seen.own[0]), int(seen.stamp[0])
    own = (seen.own - own0).astype(np.float64)
    delay = (seen.stamp - seen.own - (stamp0 - own0)).astype(np.float64)
    span = float(own.max() - own.min())
    rate = _simulated_rate(own, delay, span)
    offset = delay if rate == 1.0 else delay - (rate - 1.0) * own
    slope = -edge(own - own.min(), -offset)[0] if span >= SPAN_US else 0.0
    if rate == 1.0:
        slope = min(max(slope, -LARGEST_DRIFT), LARGEST_DRIFT)
    lowest = float((offset - slope * own if slope else offset).min())
    return Line(own0, stamp0 + round(lowest), rate + slope)


def _simulated_rate(own: NDArray[np.float64], delay: NDArray[np.float64], span: float) -> float:
    """1, or the rate of a simulation that does not run in real time."""
    if span < WINDOW_US or own[-1] <= own[0]:
        return 1.0
    rate = 1.0 + float((delay[-1] - delay[0]) / (own[-1] - own[0]))
    return rate if rate > 0 and abs(rate - 1.0) > SIMULATED_DRIFT else 1.0


def fit_pairs(own: Ints, utc: Ints) -> Line:
    """UTC as a line of own times, from pairs that were read at one instant: median offset, slope where it shows."""
    x = (own - own[0]).astype(np.float64)
    y = (utc - own - (utc[0] - own[0])).astype(np.float64)
    span = float(np.ptp(x))
    slope = 0.0
    if span >= SPAN_US and len(x) >= 10:
        centred = x - x.mean()
        slope = float((centred * (y - y.mean())).sum() / (centred * centred).sum())
        slope = min(max(slope, -LARGEST_DRIFT), LARGEST_DRIFT)
        if abs(slope) * span < 2000.0:  # two milliseconds: the pairs' own resolution
            slope = 0.0
    return Line(int(own[0]), int(utc[0]) + round(float(np.median(y - slope * x))), 1.0 + slope)


def utc_steps(own: Ints, utc: Ints) -> Ints:
    """Positions among the pairs at which the sender's UTC was set anew, for good."""
    offset = utc - own
    jumps = np.flatnonzero(np.abs(np.diff(offset)) > STEP_US) + 1
    lasting = [
        at for at in jumps if abs(np.median(offset[at : at + 5]) - np.median(offset[max(0, at - 5) : at])) > STEP_US
    ]
    return np.array(lasting, np.int64)
