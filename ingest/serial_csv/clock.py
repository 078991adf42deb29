"""A device's clock made into stamps that only rise: wrapped counters, resets, steps, single wrong or repeated stamps.

The stamps are cut wherever they fall, or leap by more than `CUT_INTERVALS`. A short piece between two that go on as if
it were not there is a glitch: its samples keep their place, and their stamps are interpolated. Any other cut is a gap,
or begins a new segment.
"""

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

SECOND: Final = 10**9
WRAP_TICKS: Final = 1 << 32
"""millis() and micros() count in 32 bits."""
LEAP_S: Final = 1.0
LEAP_INTERVALS: Final = 20.0
"""What goes on within both of these is the same clock."""
CUT_INTERVALS: Final = 1.5
GLITCH_SAMPLES: Final = 5
"""A run of wrong stamps that is longer is another clock."""
STEP_S: Final = 3600.0
"""A leap forward beyond this is a clock that was set."""
PAUSE_NS: Final = SECOND
"""Between the last sample before a fault and the first after it, where nothing tells the true time."""

WRAPPED: Final = "counter wrapped"
RESET: Final = "reset"
STEPPED: Final = "clock step"


@dataclass(frozen=True)
class Break:
    """A new segment begins with sample ``start``: why, by what the clock leapt (ns), and what the log's time was."""

    start: int
    reason: str
    leap_ns: int


@dataclass(frozen=True, eq=False)
class Stamps:
    """``time_ns`` (n,) rising, ``segment`` (n,) counts from 0; ``breaks`` begin segments 1, 2, …; ``offset_ns`` of each
    segment is what was added to the device's own time. ``glitched`` and ``repeated`` (n,) mark repaired stamps."""

    time_ns: Ints
    breaks: tuple[Break, ...]
    offset_ns: tuple[int, ...]
    glitched: Mask
    repeated: Mask

    @property
    def first(self) -> list[int]:
        """The number of the first sample of each segment."""
        return [0, *(found.start for found in self.breaks)]


def stamps(device_ns: Ints, tick_ns: int) -> Stamps:
    """Rising stamps of a device's own (n,), n > 0, which were counted in ticks of ``tick_ns`` (wraps: 2^32 ticks)."""
    steps = np.diff(device_ns)
    glitched = np.zeros(len(device_ns), np.bool_)
    if len(steps) == 0 or (int(steps.min()) > 0 and _is_steady(steps)):
        return Stamps(device_ns, (), (0,), glitched, np.zeros(len(device_ns), np.bool_))
    walk = _Walk(device_ns, tick_ns, _interval(steps))
    time_ns = device_ns + np.repeat(walk.offsets, np.diff([*walk.starts, len(device_ns)]))
    glitched[walk.glitched] = True
    if walk.glitched:
        good = np.flatnonzero(~glitched)
        time_ns[glitched] = _between(good, time_ns[good], np.flatnonzero(glitched), walk.interval)
    time_ns, repeated = spread(time_ns, walk.interval)
    offsets = [walk.offsets[0]] + [walk.offsets[walk.starts.index(found.start)] for found in walk.breaks]
    return Stamps(time_ns, tuple(walk.breaks), tuple(offsets), glitched, repeated)


def _interval(steps: Ints) -> float:
    rising = steps[steps > 0]
    return float(np.median(rising)) if len(rising) else float(SECOND)


def _is_steady(steps: Ints) -> bool:
    longest = int(steps.max())
    return longest < LEAP_S * SECOND or longest < LEAP_INTERVALS * _interval(steps)


@dataclass(eq=False)
class _Walk:
    """The pieces between cuts, taken in order. ``starts`` and ``offsets`` are those of the pieces."""

    device_ns: Ints
    tick_ns: int
    interval: float
    starts: list[int] = field(default_factory=list)
    offsets: list[int] = field(default_factory=list)
    breaks: list[Break] = field(default_factory=list)
    glitched: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.leap = max(LEAP_S * SECOND, LEAP_INTERVALS * self.interval)
        steps = np.diff(self.device_ns)
        cuts = np.flatnonzero((steps < 0) | (steps > CUT_INTERVALS * self.interval)) + 1
        self.starts = [0, *cuts.tolist()]
        edges = [*self.starts, len(self.device_ns)]
        offset, last = 0, None
        for number, (start, end) in enumerate(pairwise(edges)):
            if self._is_glitch(number, last, edges):
                self.glitched += range(start, end)
            else:
                offset += 0 if last is None else self._moved(start, last)
                last = end - 1
            self.offsets.append(offset)

    def _is_glitch(self, number: int, last: int | None, edges: list[int]) -> bool:
        """Whether a short piece is left out and one of the next goes on from the last good sample."""
        start, end, count = edges[number], edges[number + 1], len(self.device_ns)
        if last is None:
            return number == 0 and end == 1 < count - 1 and not self._plausible(start, end)
        if end == count:
            return end - start == 1 and count > 2 and not self._plausible(last, start)
        if self._near(last, start):
            return False
        later = [edge for edge in edges[number + 1 : number + 1 + GLITCH_SAMPLES] if edge - start <= GLITCH_SAMPLES]
        return any(edge < count and self._near(last, edge) for edge in later)

    def _near(self, last: int, start: int) -> bool:
        return 0 < self._step(last, start) <= self.leap

    def _plausible(self, last: int, start: int) -> bool:
        return 0 < self._step(last, start) <= STEP_S * SECOND or self._wraps(self._step(last, start))

    def _wraps(self, step: int) -> bool:
        return 0 < step + WRAP_TICKS * self.tick_ns <= self.leap

    def _step(self, last: int, start: int) -> int:
        return int(self.device_ns[start]) - int(self.device_ns[last])

    def _moved(self, start: int, last: int) -> int:
        """What must be added to a piece's own time beyond what was to the last; a new segment is noted."""
        step = self._step(last, start)
        if 0 < step <= STEP_S * SECOND:
            return 0
        if self._wraps(step):
            self.breaks.append(Break(start, WRAPPED, step))
            return WRAP_TICKS * self.tick_ns
        if step > 0:
            self.breaks.append(Break(start, STEPPED, step))
            return 0
        began = self.breaks[-1].start if self.breaks else 0
        early = self.device_ns[start] <= max(self.device_ns[began], int(self.device_ns[last]) // 2)
        self.breaks.append(Break(start, RESET if early else STEPPED, step))
        return PAUSE_NS - step


def _between(good: Ints, time_ns: Ints, at: Ints, interval: float) -> Ints:
    """Stamps of samples ``at`` by their place among the good ones; beyond the last one by the usual interval."""
    base = int(time_ns[0])
    inside = np.interp(at, good, (time_ns - base).astype(np.float64))
    beyond = np.maximum(at - good[-1], 0) * interval - np.maximum(good[0] - at, 0) * interval
    return np.asarray(base + np.rint(inside + beyond).astype(np.int64))


def spread(time_ns: Ints, interval: float) -> tuple[Ints, Mask]:
    """Stamps that repeat the one before, evenly put before the next; and which ones (n,) were."""
    fresh = np.concatenate([[True], np.diff(time_ns) > 0])
    if bool(np.all(fresh)):
        return time_ns, ~fresh
    first = np.flatnonzero(fresh)
    run = np.cumsum(fresh) - 1
    size = np.diff(np.append(first, len(time_ns)))
    own = time_ns[first]
    room = np.diff(np.append(own, own[-1] + np.int64(max(interval, 1.0) * size[-1])))
    room = np.minimum(room, np.int64(max(interval, 1.0)) * size)
    place = np.arange(len(time_ns)) - first[run]
    moved = own[run] + (room[run] * place) // size[run]
    return moved, ~fresh
