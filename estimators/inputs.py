"""The gate before every estimator: one IMU and at most one magnetometer, usable samples only, cut where time breaks."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..schemas.errors import InputError, MissingSensorError
from ..schemas.estimate import North, Status
from ..schemas.finding import Finding, Kind, Severity
from ..schemas.recording import Recording
from .parameters import ImuParameters

Floats = NDArray[np.float64]
Times = NDArray[np.int64]

LOW_RATE_NS = 100_100_000
"""Median interval beyond which attitude estimates are not to be trusted: 10 Hz, and 0.1 % for jitter."""
BRIDGED_INTERVALS = 5.0
COASTED_INTERVALS = 2.5
LARGEST = 1e6
"""Beyond any sensor, in SI units: such samples are damage."""
TOLD_GAP_S = 0.1
"""Gaps shorter than this, or than five intervals, are nothing to tell."""
RESTARTED = (Severity.WARN, "no samples: the estimate starts anew behind the gap, with the bias that it had")
BRIDGED = (Severity.INFO, "no samples: bridged with the mean of the rates around the gap")
MAX_FINDINGS = 50
"""Gaps reported one by one; the rest as one finding, lest a radio log drown in them."""


@dataclass(frozen=True)
class Run:
    """Samples first to last - 1, unbroken; ``fresh``: nothing is known from before (start, reboot, clock step)."""

    first: int
    last: int
    fresh: bool


@dataclass(frozen=True, eq=False)
class Inputs:
    """What an estimator runs on. Arrays are C-contiguous float64 and finite; stamps do not decrease.

    ``mag_time_ns`` and ``field`` are empty without a magnetometer. ``declination_deg`` is 0 where it is not known.
    """

    time_ns: Times
    angular_velocity: Floats
    specific_force: Floats
    mag_time_ns: Times
    field: Floats
    runs: tuple[Run, ...]
    interval_s: float
    topics: tuple[str, ...]
    north: North
    declination_deg: float
    status: NDArray[np.uint32]
    findings: tuple[Finding, ...]

    @property
    def has_mag(self) -> bool:
        return len(self.mag_time_ns) > 0

    @property
    def coast_s(self) -> float:
        """Interval beyond which a step counts as a bridged gap."""
        return COASTED_INTERVALS * self.interval_s


def prepare(recording: Recording, parameters: ImuParameters, *, mag: bool, needs_mag: bool = False) -> Inputs:
    """Select, check and cut. ``mag``: use the magnetometer of the parameters if there is one.

    Raises MissingSensorError where the IMU, or a needed magnetometer, is not there or has no usable sample; InputError
    where arrays do not fit together.
    """
    time_ns, rate, force, topic, findings = _imu(recording, parameters.imu)
    mag_time_ns, field, mag_topic, mag_findings = _mag(recording, parameters, mag, needs_mag)
    findings += mag_findings
    status = np.zeros(len(time_ns), np.uint32)
    intervals = np.diff(time_ns)
    longest = int(intervals.max(initial=0))
    interval_s = _median_s(intervals)
    if longest > LOW_RATE_NS and 2 * int(np.count_nonzero(intervals > LOW_RATE_NS)) > len(intervals):
        status |= np.uint32(Status.LOW_RATE)
        findings.append(_low_rate(time_ns, topic, interval_s))
    told_ns = max(TOLD_GAP_S, BRIDGED_INTERVALS * interval_s) * 1e9
    wide = (np.flatnonzero(intervals > told_ns) + 1).tolist() if longest > told_ns else []
    max_gap_ns = max(parameters.max_gap_s * 1e9, BRIDGED_INTERVALS * interval_s * 1e9)
    runs = _runs(recording, time_ns, [index for index in wide if intervals[index - 1] > max_gap_ns])
    status[[run.first for run in runs]] |= np.uint32(Status.RESTART)
    findings += _gaps(time_ns, [run.first for run in runs if not run.fresh], topic, RESTARTED)
    starts = {run.first for run in runs}
    findings += _gaps(time_ns, [index for index in wide if index not in starts], topic, BRIDGED)
    north, declination_deg = North.ARBITRARY, 0.0
    if len(mag_time_ns):
        north, declination_deg = _north(recording)
    elif mag:
        status |= np.uint32(Status.MAGNETOMETER_MISSING)
    topics = (topic, mag_topic) if len(mag_time_ns) else (topic,)
    return Inputs(
        time_ns, rate, force, mag_time_ns, field, runs, interval_s, topics, north, declination_deg, status,
        tuple(findings),
    )  # fmt: skip


def _imu(recording: Recording, number: int) -> tuple[Times, Floats, Floats, str, list[Finding]]:
    imu = recording.imu.get(number)
    if imu is None:
        raise MissingSensorError(f"there is no IMU {number}; the recording has {_list('imu', list(recording.imu))}")
    topic = imu.topic or f"{recording.prefix}/imu{number}/data_raw"
    rate, force = _vectors(imu.angular_velocity, topic), _vectors(imu.specific_force, topic)
    time_ns = np.ascontiguousarray(imu.time_ns, dtype=np.int64)
    if not len(time_ns) == len(rate) == len(force):
        raise InputError(f"{topic}: {len(time_ns)} stamps, {len(rate)} rates and {len(force)} forces do not match")
    findings: list[Finding] = []
    if not (_within(rate) and _within(force)):
        good = _usable(rate) & _usable(force)
        findings += _skipped(time_ns, good, topic)
        time_ns, rate, force = time_ns[good], rate[good], force[good]
    if len(time_ns) == 0:
        raise MissingSensorError(f"{topic} has no usable sample")
    if not _sorted(time_ns):
        order = np.argsort(time_ns, kind="stable")
        time_ns, rate, force = time_ns[order], rate[order], force[order]
    return time_ns, rate, force, topic, findings


def _mag(
    recording: Recording, parameters: ImuParameters, wanted: bool, needed: bool
) -> tuple[Times, Floats, str, list[Finding]]:
    number = getattr(parameters, "mag", None)
    mag = recording.mag.get(number) if wanted and number is not None else None
    nothing = (np.empty(0, np.int64), np.empty((0, 3)), "")
    if mag is None:
        if needed:
            asked = "mag=none was asked for" if number is None else f"there is no magnetometer {number}"
            raise MissingSensorError(f"{asked}; the recording has {_list('mag', list(recording.mag))}")
        return *nothing, _no_mag(recording, number, wanted)
    topic = mag.topic or f"{recording.prefix}/mag{number}/field"
    field, time_ns = _vectors(mag.field, topic), np.ascontiguousarray(mag.time_ns, dtype=np.int64)
    if len(field) != len(time_ns):
        raise InputError(f"{topic}: {len(time_ns)} stamps and {len(field)} fields do not match")
    findings: list[Finding] = []
    if not (_within(field) and np.all(field[:, 0])):
        good = _usable(field) & field.any(axis=1)
        findings += _skipped(time_ns, good, topic)
        time_ns, field = time_ns[good], field[good]
    if not _sorted(time_ns):
        order = np.argsort(time_ns, kind="stable")
        time_ns, field = time_ns[order], field[order]
    if len(time_ns) == 0 and needed:
        raise MissingSensorError(f"{topic} has no usable sample")
    return time_ns, field, topic, findings


def _within(vectors: Floats) -> bool:
    """Whether all is usable; a NaN compares as False."""
    return bool(vectors.max(initial=0.0) < LARGEST and vectors.min(initial=0.0) > -LARGEST)


def _usable(vectors: Floats) -> NDArray[np.bool_]:
    """Which vectors are."""
    return np.asarray((np.abs(vectors) < LARGEST).all(axis=1))


def _sorted(time_ns: Times) -> bool:
    return bool(np.all(time_ns[1:] >= time_ns[:-1]))


def _vectors(values: Floats, topic: str) -> Floats:
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{topic}: vectors of shape {array.shape}, not (n, 3)")
    return array


def _list(kind: str, numbers: list[int]) -> str:
    return ", ".join(f"{kind} {number}" for number in sorted(numbers)) or f"no {kind}"


def _median_s(intervals: NDArray[np.int64]) -> float:
    """Of at most a few thousand intervals spread over the log: it only sets thresholds."""
    if len(intervals) == 0:
        return 0.0
    return float(np.median(intervals[:: max(1, len(intervals) // 4096)])) * 1e-9


def _runs(recording: Recording, time_ns: Times, gaps: list[int]) -> tuple[Run, ...]:
    starts = {0: True} | dict.fromkeys(gaps, False)
    for segment in recording.segments:
        index = int(np.searchsorted(time_ns, segment.start_ns))
        if index < len(time_ns):
            starts[index] = True
    firsts = sorted(starts)
    lasts = [*firsts[1:], len(time_ns)]
    return tuple(Run(first, last, starts[first]) for first, last in zip(firsts, lasts, strict=True))


def _gaps(time_ns: Times, gaps: list[int], topic: str, what: tuple[Severity, str]) -> list[Finding]:
    """A finding for each gap, given the first samples behind them."""
    severity, advice = what
    findings = []
    for index in gaps[:MAX_FINDINGS]:
        start, end = int(time_ns[index - 1]), int(time_ns[index])
        findings.append(Finding(start, end, severity, Kind.GAP, topic, (end - start) * 1e-9, "s", advice))
    if len(gaps) > MAX_FINDINGS:
        start, end = int(time_ns[gaps[MAX_FINDINGS] - 1]), int(time_ns[gaps[-1]])
        more = float(len(gaps) - MAX_FINDINGS)
        findings.append(Finding(start, end, severity, Kind.GAP, topic, more, "more gaps", advice))
    return findings


def _skipped(time_ns: Times, good: NDArray[np.bool_], topic: str) -> list[Finding]:
    bad = np.flatnonzero(~good)
    if len(bad) == 0:
        return []
    span = int(time_ns[bad[0]]), int(time_ns[bad[-1]])
    advice = "not finite, beyond any sensor, or a field of zero: these samples are left out"
    return [Finding(*span, Severity.WARN, Kind.SKIPPED, topic, float(len(bad)), "samples", advice)]


def _low_rate(time_ns: Times, topic: str, interval_s: float) -> Finding:
    advice = "below 10 Hz attitude cannot be followed: do not trust this estimate; log the IMU faster"
    span = int(time_ns[0]), int(time_ns[-1])
    return Finding(*span, Severity.ERROR, Kind.LOW_RATE, topic, 1.0 / max(interval_s, 1e-9), "Hz", advice)


def _no_mag(recording: Recording, number: int | None, wanted: bool) -> list[Finding]:
    if not wanted or number is None or not recording.mag:
        return []
    topic = f"{recording.prefix}/mag{number}/field"
    advice = f"no such magnetometer, heading is arbitrary; choose mag={min(recording.mag)}"
    return [Finding(0, 0, Severity.WARN, Kind.SKIPPED, topic, 0.0, "samples", advice)]


def _north(recording: Recording) -> tuple[North, float]:
    """The pipeline reports a declination that is not known; here it only decides what the heading counts from."""
    if recording.declination is None:
        return North.MAGNETIC, 0.0
    return North.TRUE, float(recording.declination.degrees)
