"""When each record was made: the autopilot's microseconds since boot, and UTC by way of GPS week and millisecond.

Boot time to UTC is one affine fit per segment. GPS records are written late, never early, so the fit lies on the
upper envelope of (GPS time - boot time). A segment ends where the boot clock starts anew.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...schemas import Segment
from ...signals.envelope import Line, fit, median_offset
from .clock_kernels import BACKWARD, FORWARD, NO_TIME, pieces
from .leap_seconds import SECOND_NS, utc_from_gps
from .log import Log, Records

Ints = NDArray[np.int64]

FIX_3D: Final = 3
SAME_CLOCK_NS: Final = SECOND_NS
"""Two stretches whose GPS offsets agree this well are on one clock."""
WRAP_US: Final = 2**32 * 1000
"""A 32-bit count of milliseconds starts anew after 49.7 days."""
GPS_TYPES: Final = frozenset({"GPS", "GPS2", "GPSB"})
WEEK_COLUMNS: Final = (("GWk", "GMS"), ("Week", "TimeMS"), ("Wk", "TWk"))
REASONS: Final = {BACKWARD: "reboot", FORWARD: "clock step"}


@dataclass(frozen=True, eq=False)
class Clock:
    """Stamps for every record of a log.

    ``boot_us`` (n,) is each record's time since boot (a neighbour's where it has none), ``segment`` (n,) its segment,
    ``lines`` the way from boot time to the stamp, one per segment; ``known`` says of each segment whether GPS told its
    UTC; ``absurd`` counts stamps that could not be true; ``timed`` is False where no record has any time.
    """

    boot_us: Ints
    segment: NDArray[np.int32]
    lines: tuple[Line, ...]
    segments: tuple[Segment, ...]
    known: tuple[bool, ...]
    absurd: int = 0
    timed: bool = True

    @property
    def utc(self) -> bool:
        """Whether stamps are UTC, not time since boot."""
        return any(self.known)

    def stamps(self, records: Records) -> Ints:
        """Time of each record (n,), ns."""
        return np.asarray(self._stamps[records.order])

    @cached_property
    def _stamps(self) -> Ints:
        return self.at(self.boot_us, slice(None))

    def at(self, boot_us: Ints, order: Ints | slice) -> Ints:
        """Stamps of the times since boot ``boot_us`` (n,), in the segments of the records ``order`` (n,)."""
        if len(self.lines) == 1:
            return self.lines[0].at(boot_us * 1000)
        result = np.empty(len(boot_us), np.int64)
        segment = self.segment[order]
        for number in np.unique(segment).tolist():
            chosen = segment == number
            result[chosen] = self.lines[number].at(boot_us[chosen] * 1000)
        return result


def time_column(records: Records) -> tuple[str, int] | None:
    """The column with the records' own time since boot, and its unit in us; None where the type has none."""
    form = records.format
    first = form.columns[0] if form.columns else ""
    if form.name in GPS_TYPES and form.has("Week", "T"):
        column, scale = "T", 1000
    elif first == "TimeMS" and not form.has("Week") and not form.name.startswith(("ACC", "GYR")):
        column, scale = "TimeMS", 1000
    elif first == "TimeUS" or (first == "StartTime" and form.name == "TIME"):
        column, scale = first, 1
    else:
        return None
    return (column, scale) if records.data.dtype[column].kind in "iu" else None


def read_clock(log: Log) -> Clock:
    """The log's clock: follow the times since boot, find the segments, and fit each to GPS time."""
    own = _own_times(log)
    boot, piece, begins, why, absurd = pieces(own)
    wrapped = _unwrap(boot, begins, log)
    gps_order, gps_utc = gps_times(log)
    offset = gps_utc - boot[gps_order] * 1000
    segment, reasons = _segments(piece, why, wrapped, [offset[piece[gps_order] == p] for p in range(len(begins))])
    fits: list[Line | None] = []
    for number in range(len(reasons)):
        chosen = segment[gps_order] == number
        fits.append(fit(boot[gps_order[chosen]] * 1000, offset[chosen]))
    spans = [_span(boot[segment == number] if len(reasons) > 1 else boot) for number in range(len(reasons))]
    lines = _placed(fits, spans)
    segments = tuple(
        Segment("", number, line.stamp(low), line.stamp(high), line.stamp(low) - low, reason)
        for number, (line, (low, high), reason) in enumerate(zip(lines, spans, reasons, strict=True))
    )
    known = tuple(line is not None for line in fits)
    return Clock(boot, segment, lines, segments, known, absurd, timed=bool(np.any(own != NO_TIME)))


def _own_times(log: Log) -> Ints:
    """Time since boot (n,) of every record, us, NO_TIME where it has none.

    The oldest logs have GPS time and no other: a record's time then lies between its neighbouring fixes'.
    """
    own = np.full(log.count, NO_TIME, np.int64)
    for records in log.records:
        column = time_column(records)
        if column is not None:
            name, scale = column
            times = records.data[name]
            own[records.order] = times if scale == 1 else times.astype(np.int64) * scale
    if np.any(own != NO_TIME):
        return own
    order, utc = gps_times(log)
    if len(order) == 0:
        return own
    return np.asarray(np.interp(np.arange(log.count), order, (utc - utc[0]) // 1000), dtype=np.int64)


def gps_times(log: Log) -> tuple[Ints, Ints]:
    """Numbers of the GPS records with a 3D fix and a week, and their UTC in ns, in the log's order."""
    orders, times = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    for records in (part for part in log.records if part.format.name in GPS_TYPES):
        week, millisecond = next((pair for pair in WEEK_COLUMNS if records.format.has(*pair)), ("", ""))
        if not week:
            continue
        good = (records.data[week] > 0) & (records.data[millisecond] > 0)
        if records.format.has("Status"):
            good &= records.data["Status"] >= FIX_3D
        orders.append(records.order[good])
        times.append(utc_from_gps(records.data[week][good], records.data[millisecond][good]))
    order, utc = np.concatenate(orders), np.concatenate(times)
    sequence = np.argsort(order, kind="stable")
    return order[sequence], utc[sequence]


def _unwrap(boot: Ints, begins: Ints, log: Log) -> set[int]:
    """Let counts of 32 bits that started anew go on counting, in place; the pieces that begin so."""
    if any("TimeUS" in records.format.columns[:1] for records in log.records):
        return set()
    wrapped = set()
    for number, start in enumerate(begins.tolist()):
        if start and boot[start - 1] % WRAP_US > 0.9 * WRAP_US and boot[start] % WRAP_US < 0.1 * WRAP_US:
            boot[start:] += WRAP_US
            wrapped.add(number)
    return wrapped


def _segments(
    piece: NDArray[np.int32], why: Ints, wrapped: set[int], offsets: Sequence[Ints]
) -> tuple[NDArray[np.int32], list[str]]:
    """Pieces to segments: a jump of the stamps is a gap, or records out of order, where GPS says the clock ran on."""
    number = np.zeros(len(why), np.int32)
    reasons = ["start"]
    known = [median_offset(offsets[0])]
    for p in range(1, len(why)):
        here, current = median_offset(offsets[p]), known[-1]
        unknown = here is None or current is None
        same = why[p] == FORWARD if unknown else _agree(here, current)
        if p in wrapped or not same:
            reasons.append("counter wrapped" if p in wrapped else REASONS[int(why[p])])
            known.append(here)
        elif current is None:
            known[-1] = here
            if len(known) > 1 and _agree(here, known[-2]) and reasons[-1] == REASONS[BACKWARD]:
                number[number == len(known) - 1] -= 1
                known.pop()
                reasons.pop()
        number[p] = len(reasons) - 1
    return (number[piece] if len(why) > 1 else piece), reasons


def _agree(a: int | None, b: int | None) -> bool:
    return a is not None and b is not None and abs(a - b) < SAME_CLOCK_NS


def _span(boot_us: Ints) -> tuple[int, int]:
    return (int(boot_us.min()) * 1000, int(boot_us.max()) * 1000) if len(boot_us) else (0, 0)


def _placed(fits: Sequence[Line | None], spans: Sequence[tuple[int, int]]) -> tuple[Line, ...]:
    """A line for every segment: one without UTC begins 1 s after the last sample before it.

    Segments before the first that knows UTC end 1 s before that one begins.
    """
    lines: list[Line] = []
    end = 0
    for line, (low, high) in zip(_backward(fits, spans), spans, strict=True):
        lines.append(line or (Line(end + SECOND_NS - low) if lines else Line(0)))
        end = max(lines[-1].stamp(high), end)
    return tuple(lines)


def _backward(fits: Sequence[Line | None], spans: Sequence[tuple[int, int]]) -> list[Line | None]:
    result = list(fits)
    first = next((number for number, line in enumerate(fits) if line is not None), 0)
    for number in range(first - 1, -1, -1):
        after = result[number + 1]
        if after is not None:
            result[number] = Line(after.stamp(spans[number + 1][0]) - SECOND_NS - spans[number][1])
    return result
