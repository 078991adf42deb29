"""When each message was made: microseconds since boot, or since 1970, and UTC by the GNSS receiver's time.

A message's own time is its field `timestamp`. What has none, or one that is long past (PX4 logs the last value of every
topic when a log begins, and some topics keep their first stamp for ever), gets the time at which it was written: that
of the messages before it. Boot time to UTC is one affine fit per segment. A receiver's message comes late, never early,
so the fit lies on the upper envelope of (UTC - boot time).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...schemas import Segment
from ...signals.envelope import Line, fit
from .clock_kernels import BACKWARD, follow
from .log import Log, Topic

Ints = NDArray[np.int64]

SECOND_NS: Final = 1_000_000_000
STALE_US: Final = 10_000_000
"""An older stamp is not the time of what is logged now."""
EPOCH_US: Final = 1_000_000_000_000_000
"""September 2001: clocks that show more count since 1970, not since boot (PX4 on Linux, simulators)."""
RECEIVERS: Final = ("vehicle_gps_position", "sensor_gps", "vehicle_global_position")
"""Topics with `time_utc_usec`, the first that is logged counts."""
FIX_3D: Final = 3
OWN_AGE_US: Final = 1_000_000
"""A sample is published at most so long after it was taken."""


@dataclass(frozen=True, eq=False)
class Clock:
    """Stamps for every message of a log.

    ``boot_us`` (n,) is each message's time on the log's clock, ``own`` (n,) whether it says so itself, ``time_ns`` (n,)
    its stamp, ``segment`` (n,) its segment, ``lines`` the way from one to the other by segment; ``reference`` says what
    stamps count from.
    """

    boot_us: Ints
    own: NDArray[np.bool_]
    time_ns: Ints
    segment: Ints
    lines: tuple[Line, ...]
    segments: tuple[Segment, ...]
    reference: str

    def stamps(self, topic: Topic) -> Ints:
        """Time of each message (n,), ns."""
        return self.time_ns[topic.order]

    def earlier(self, topic: Topic, age_us: Ints) -> Ints:
        """Stamps of what was taken ``age_us`` (n,) before each message's time."""
        if not np.any(age_us):
            return self.stamps(topic)
        return _stamped(self.boot_us[topic.order] - age_us, self.segment[topic.order], self.lines)

    def sampled(self, topic: Topic, column: str = "timestamp_sample") -> Ints:
        """Stamps of the samples' own times in ``column``, where it says one."""
        if not topic.has(column, "timestamp"):
            return self.stamps(topic)
        age = topic.integers("timestamp") - topic.integers(column)
        believed = self.own[topic.order] & (topic.integers(column) > 0) & (age >= 0) & (age <= OWN_AGE_US)
        return self.earlier(topic, np.where(believed, age, 0))


def read_clock(log: Log) -> Clock:
    """The log's clock: follow the messages' times, find the segments, and fit each to UTC."""
    own, subject = _own_times(log)
    arrival, begins, why = _followed(own, subject, len(log.topics) + 1, log.start_us)
    believed = (own > 0) & (own <= arrival) & (arrival - own <= STALE_US)
    boot = np.where(believed, own, arrival)
    at, utc = _receiver_times(log, believed)
    offset = utc - boot[at] * 1000
    edges, reasons = _segments(begins, why, boot, at, offset)
    segment = np.repeat(np.arange(len(reasons)), np.diff(edges))
    spans = [_span(boot[start:stop], believed[start:stop]) for start, stop in pairwise(edges)]
    fits = [_fit(span, boot[at[segment[at] == s]], offset[segment[at] == s]) for s, span in enumerate(spans)]
    lines = _lines(fits, spans)
    segments = tuple(
        Segment("", s, line.stamp(low * 1000), line.stamp(high * 1000), line.stamp(low * 1000) - low * 1000, reason)
        for s, (line, (low, high), reason) in enumerate(zip(lines, spans, reasons, strict=True))
    )
    return Clock(boot, believed, _stamped(boot, segment, lines), segment, lines, segments, _reference(fits, spans))


def time_us(topic: Topic) -> Ints | None:
    """The messages' own times (n,), us, or None where the topic has none."""
    return topic.integers("timestamp") if topic.has("timestamp") else None


def _own_times(log: Log) -> tuple[Ints, NDArray[np.int32]]:
    """By message its own time (0: none) and its topic's number; logged texts are the last."""
    own = np.zeros(log.count, np.int64)
    subject = np.full(log.count, len(log.topics), np.int32)
    for number, topic in enumerate(log.topics):
        times = time_us(topic)
        if times is not None:
            own[topic.order] = times
            subject[topic.order] = number
    for said in log.said:
        own[said.order] = min(said.time_us, 2**62)
    return own, subject


def _followed(own: Ints, subject: NDArray[np.int32], subjects: int, start_us: int) -> tuple[Ints, Ints, Ints]:
    """The time at which each message was written, and of the pieces of the clock the first message and why it begins.

    Where no message is near the header's time, that is not this clock's.
    """
    arrival, begins, why, grounded = follow(own, subject, subjects, start_us)
    if not np.any(grounded) and np.any(own > 0):
        arrival, begins, why, grounded = follow(own, subject, subjects, int(own[own > 0][0]))
    if grounded[0] == 0 and len(begins) > 1:
        arrival[: begins[1]] = arrival[begins[1]]
        begins, why = begins[1:], why[1:]
        begins[0] = 0
    return arrival, begins, why


def _receiver_times(log: Log, believed: NDArray[np.bool_]) -> tuple[Ints, Ints]:
    """Numbers of the receiver's messages with a 3D fix, and their UTC at the message's time, ns."""
    topics = next((found for name in RECEIVERS if (found := log.named(name))), ())
    orders, times = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    for topic in topics:
        if not topic.has("timestamp", "time_utc_usec"):
            continue
        utc = topic.integers("time_utc_usec")
        good = (utc > EPOCH_US) & (utc < 2**53) & believed[topic.order]
        if topic.has("fix_type"):
            good &= topic.integers("fix_type") >= FIX_3D
        if topic.has("timestamp_time_relative"):
            before = topic.integers("timestamp_time_relative")
            utc = utc - np.where(np.abs(before) <= OWN_AGE_US, before, 0)
        orders.append(topic.order[good])
        times.append(utc[good] * 1000)
    order = np.concatenate(orders)
    sequence = np.argsort(order, kind="stable")
    return order[sequence], np.concatenate(times)[sequence]


def _segments(begins: Ints, why: Ints, boot: Ints, at: Ints, offset: Ints) -> tuple[list[int], list[str]]:
    """Edges of the segments among the messages, and why each begins: a leap forward is a gap of the log, unless the
    receiver says that the clock was set."""
    ends = [*begins[1:].tolist(), len(boot)]
    known = [_median(offset[(at >= start) & (at < stop)]) for start, stop in zip(begins.tolist(), ends, strict=True)]
    edges, reasons, current = [0], ["start"], known[0]
    for p in range(1, len(begins)):
        here, start = known[p], int(begins[p])
        told = here is not None and current is not None
        set_to_utc = boot[start - 1] < EPOCH_US <= boot[start]
        same = abs(here - current) < SECOND_NS if told else why[p] != BACKWARD and not set_to_utc  # type: ignore[operator]
        if not same:
            edges.append(start)
            reasons.append("reboot" if why[p] == BACKWARD and boot[start] < EPOCH_US else "clock step")
            current = here
        elif current is None:
            current = here
    return [*edges, len(boot)], reasons


def _median(values: Ints) -> int | None:
    return int(np.median(values)) if len(values) else None


def _span(boot: Ints, believed: NDArray[np.bool_]) -> tuple[int, int]:
    said = boot[believed] if np.any(believed) else boot
    return int(said.min()), int(said.max())


def _fit(span: tuple[int, int], boot: Ints, offset: Ints) -> Line | None:
    """Boot time to UTC, ns; None where nothing tells."""
    return Line(0) if span[0] >= EPOCH_US else fit(boot * 1000, offset)


def _lines(fits: Sequence[Line | None], spans: Sequence[tuple[int, int]]) -> tuple[Line, ...]:
    """A line for every segment: one without UTC begins 1 s after the last sample before it, or ends 1 s before the
    first segment with UTC."""
    known = next((s for s, line in enumerate(fits) if line is not None), None)
    lines = list(fits)
    for s in range((known or 0) - 1, -1, -1):
        after = lines[s + 1]
        if after is not None:
            lines[s] = Line(after.stamp(spans[s + 1][0] * 1000) - SECOND_NS - spans[s][1] * 1000)
    placed: list[Line] = []
    end = 0
    for line, (low, high) in zip(lines, spans, strict=True):
        placed.append(line or Line(end + SECOND_NS - low * 1000 if placed else 0))
        end = max(end, placed[-1].stamp(high * 1000))
    return tuple(placed)


def _stamped(boot_us: Ints, segment: Ints, lines: Sequence[Line]) -> Ints:
    if len(lines) == 1:
        return lines[0].at(boot_us * 1000)
    result = np.empty(len(boot_us), np.int64)
    for number, line in enumerate(lines):
        chosen = segment == number
        result[chosen] = line.at(boot_us[chosen] * 1000)
    return result


def _reference(fits: Sequence[Line | None], spans: Sequence[tuple[int, int]]) -> str:
    if spans[0][0] >= EPOCH_US:
        return "UTC by the log's clock"
    return "UTC by GNSS" if any(line is not None for line in fits) else "since boot"
