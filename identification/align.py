"""Offset and drift between the clocks of two sensors on one body, from how it turns.

With Theta the integral of the angular rate (`turning`), over each interval of m reference samples from s to s':

    y_k = [Theta_sensor(f(s')) - Theta_sensor(f(s))] / (s' - s)         mean rate by the sensor
    x_k = [Theta_reference(s') - Theta_reference(s)] / (s' - s)         mean rate by the reference
    f(s) = s + d + g (s - e)                                            offset d at the epoch e, drift g      (1)
    y_k(d, g) = A x_k + b + noise                                                                             (2)

A (3 x 3) is the rotation between the two, with the gyro's scale and misalignment; b its bias. A first d comes from the
magnitudes alone (`coarse`). Then d and g solve, by Newton's method, with r_k the residual of (2),

    sum w z_k . r_k = 0,   sum w (s - e) z_k . r_k = 0,   z_k = A dx/dt                                       (3)

Least squares would have the sensor's own dy/dd in place of z; its noise is that of y, and would pull d towards instants
between samples. The reference's derivative is an instrument free of it (Soederstroem & Stoica, "Instrumental Variable
Methods for System Identification", Springer 1983, doi:10.1007/BFb0009019). A and b are eliminated by projection (Frisch
& Waugh, Econometrica 1(4), 1933, doi:10.2307/1907330); Huber's weights w bound what a shock or a reset does. With
(1, s - e) written u, the covariance is B^-1 M B^-T, B = sum w u u' (z . dy/dd), and M the sum of squares of the scores
w u (z . r) summed over blocks of time (batch means), which holds for correlated residuals too; for white noise of the
sensor alone it is the Cramer-Rao bound. The interval m is the one of those tried whose variance is smallest.

This is the temporal calibration of Kelly & Sukhatme (IJRR 33, 2014, doi:10.1177/0278364913492895) reduced to rotations.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..schemas.clock import ClockAlignment
from ..schemas.errors import InputError
from .coarse import candidates
from .turning import Floats, Mask, Turning

LONGEST_WINDOW_S: Final = 0.4
LEAST_CORRELATION: Final = 0.7
LARGEST_SIGMA_S: Final = 0.1
LEAST_INTERVALS: Final = 30
LEAST_RATE: Final = 0.01
"""rad/s, deviation of the reference's rate; less is no motion."""
SAME_S: Final = 0.5
AMBIGUOUS: Final = 0.98
BLOCK_S: Final = 1.0
MAX_ITERATIONS: Final = 30
HUBER: Final = 1.345


@dataclass(frozen=True, eq=False)
class Fit:
    """Equation (1) at its optimum: ``parameters`` (2,) offset s and drift s/s, ``covariance`` (2, 2)."""

    parameters: Floats
    covariance: Floats
    correlation: float
    intervals: int
    window_s: float

    @property
    def best_known_s(self) -> float:
        """When, after the epoch, the offset is known best: where it does not correlate with the drift."""
        drift = float(self.covariance[1, 1])
        return -float(self.covariance[0, 1]) / drift if drift > 0.0 else 0.0

    @property
    def offset_s(self) -> float:
        """The offset then."""
        return float(self.parameters[0] + self.parameters[1] * self.best_known_s)

    @property
    def sigma_s(self) -> float:
        """The standard deviation of that."""
        variance = float(self.covariance[0, 0] + self.covariance[0, 1] * self.best_known_s)
        return float(np.sqrt(max(variance, 0.0)))


@dataclass(frozen=True, eq=False)
class _Data:
    """The reference's intervals: begin, end (n,) s, mean rate (n, 3) and its derivative, time from the epoch (n,)."""

    begin: Floats
    end: Floats
    rate: Floats
    slope: Floats
    centred: Floats
    window_s: float

    @property
    def middle(self) -> Floats:
        """The intervals' middles (n,), s."""
        return 0.5 * (self.begin + self.end)


def align(sensor: Turning, reference: Turning, *, clock: str, sensor_name: str, drift: bool = True) -> ClockAlignment:
    """Offset and drift that take stamps of ``reference`` to the clock of ``sensor``; see the module for how.

    ``drift`` False holds the drift at 0. InputError where there are too few samples, no motion, or motion that repeats
    itself so that two offsets fit equally well.
    """
    what = f"{clock} cannot be aligned with {sensor_name}"
    if min(len(sensor.time_ns), len(reference.time_ns)) < LEAST_INTERVALS:
        raise InputError(f"{what}: fewer than {LEAST_INTERVALS} samples")
    if min(_liveliness(sensor), _liveliness(reference)) < LEAST_RATE:
        raise InputError(f"{what}: there is no motion to align on; take a log in which the body turns")
    zero = int(sensor.time_ns[0]) - int(reference.time_ns[0])
    steps = _steps(sensor, reference)
    rough = [_refined(sensor, reference, steps[:1], lag, drift) for lag, _ in candidates(sensor, reference)]
    good = sorted((fit for fit in rough if fit is not None), key=lambda fit: -fit.correlation)
    best = _refined(sensor, reference, steps, float(good[0].parameters[0]), drift) if good else None
    if best is None or good[0].correlation < LEAST_CORRELATION or best.sigma_s > LARGEST_SIGMA_S:
        reached = f"{good[0].correlation:.2f}" if good else "none"
        raise InputError(
            f"{what}: the angular rates do not agree at any offset (correlation {reached}, {LEAST_CORRELATION} is the "
            "least); there is no common motion to align on"
        )
    if any(_rival(good[0], other) for other in good[1:]):
        raise InputError(f"{what}: the motion repeats itself, and two offsets fit equally well; take a longer log")
    return ClockAlignment(
        clock=clock,
        sensor=sensor_name,
        epoch_ns=int(reference.time_ns[0]) + round((_epoch_s(reference) + best.best_known_s) * 1e9),
        offset_ns=zero + round(best.offset_s * 1e9),
        offset_sigma_s=best.sigma_s,
        drift_ppm=float(best.parameters[1]) * 1e6,
        drift_sigma_ppm=float(np.sqrt(best.covariance[1, 1])) * 1e6,
        correlation=best.correlation,
        samples=best.intervals,
        window_s=best.window_s,
    )


def _rival(best: Fit, other: Fit) -> bool:
    apart = abs(float(best.parameters[0] - other.parameters[0]))
    return apart > SAME_S and other.correlation > AMBIGUOUS * best.correlation


def _liveliness(turning: Turning) -> float:
    """Deviation of the rate, rad/s, in means over the longest window, in which noise averages out."""
    time_s = turning.seconds(int(turning.time_ns[0]))
    angle, run = turning.at(int(turning.time_ns[0]), np.arange(0.0, time_s[-1], LONGEST_WINDOW_S))
    rates = np.diff(angle, axis=0)[(run[1:] == run[:-1]) & (run[1:] >= 0)] / LONGEST_WINDOW_S
    return float(np.linalg.norm(rates.std(axis=0))) if len(rates) else 0.0


def _epoch_s(reference: Turning) -> float:
    """The middle of the reference, s after its first stamp."""
    return float(reference.time_ns[-1] - reference.time_ns[0]) * 0.5e-9


def _steps(sensor: Turning, reference: Turning) -> list[int]:
    """Interval lengths in reference samples: from the longest, halved down to the sampling."""
    shortest = max(sensor.interval_s, reference.interval_s)
    longest = max(LONGEST_WINDOW_S, shortest)
    windows = longest * 0.5 ** np.arange(int(np.log2(longest / shortest)) + 1)
    return list(dict.fromkeys(max(1, round(window / reference.interval_s)) for window in windows.tolist()))


def _refined(sensor: Turning, reference: Turning, steps: list[int], lag: float, drift: bool) -> Fit | None:
    """From long intervals, which forgive a poor start, to short ones; the one that knows the offset best."""
    parameters = np.array([lag, 0.0])
    found: list[Fit] = []
    for step in steps:
        fit = _gauss_newton(sensor, _intervals(reference, step), parameters, drift)
        if fit is not None:
            parameters = fit.parameters
            found.append(fit)
    return min(found, key=lambda fit: fit.sigma_s, default=None)


def _intervals(reference: Turning, step: int) -> _Data:
    time_s = reference.seconds(int(reference.time_ns[0]))
    begin, end = time_s[:-step], time_s[step:]
    rate = (reference.angle[step:] - reference.angle[:-step]) / (end - begin)[:, np.newaxis]
    middle = 0.5 * (begin + end)
    slope = np.gradient(rate, middle, axis=0) if len(middle) > 1 else np.zeros_like(rate)
    whole = reference.run[step:] == reference.run[:-step]
    whole[1:-1] &= (reference.run[step + 2 :] == reference.run[: -step - 2]) if len(whole) > 2 else True
    whole[[0, -1]] = False
    window = float(np.median(end - begin))
    centred = middle - _epoch_s(reference)
    return _Data(begin[whole], end[whole], rate[whole], slope[whole], centred[whole], window)


def _gauss_newton(sensor: Turning, data: _Data, start: Floats, drift: bool) -> Fit | None:
    parameters = start.copy()
    kept = 2 if drift else 1
    limit = max(data.window_s, 0.05)
    problem = _Problem.at(sensor, data, parameters)
    for _ in range(MAX_ITERATIONS):
        if problem is None:
            return None
        step = np.zeros(2)
        step[:kept] = np.linalg.solve(problem.bread[:kept, :kept], problem.score.sum(axis=0)[:kept])
        parameters = parameters + np.clip(step, -limit, limit)
        problem = _Problem.at(sensor, data, parameters)
        if abs(step[0]) < 1e-8 and abs(step[1]) * np.ptp(data.centred) < 1e-8:
            break
    if problem is None:
        return None
    covariance = np.zeros((2, 2))
    covariance[:kept, :kept] = problem.covariance()[:kept, :kept]
    return Fit(parameters, covariance, problem.correlation, len(problem.block), data.window_s)


@dataclass(frozen=True, eq=False)
class _Problem:
    """Equation (2) about one value of the parameters: ``score`` (n, 2), ``bread`` (2, 2), ``block`` (n,)."""

    score: Floats
    bread: Floats
    block: NDArray[np.int64]
    correlation: float

    @classmethod
    def at(cls, sensor: Turning, data: _Data, parameters: Floats) -> "_Problem | None":
        y, usable = _mean_rate(sensor, data, parameters)
        if int(usable.sum()) < LEAST_INTERVALS + 2:
            return None
        slope_y = np.gradient(y, data.middle, axis=0)
        usable[1:-1] &= usable[2:] & usable[:-2]
        usable[[0, -1]] = False
        x, y = data.rate[usable], y[usable]
        design = np.column_stack([x, np.ones(len(x))])
        weight = np.ones(len(x))
        for _ in range(3):
            solution, residual = _regressed(design, y, weight)
            weight = _huber(residual)
        slope = data.slope[usable] @ solution[:3]
        centred = data.centred[usable][:, np.newaxis]
        _, residual = _regressed(design, y, weight)
        z = [_regressed(design, each, weight)[1] for each in (slope, slope * centred)]
        w = weight[:, np.newaxis]
        score = -np.stack([np.sum(w * each * residual, axis=1) for each in z], axis=1)
        own = slope_y[usable]
        bread = np.array([[np.sum(w * each * sensed) for sensed in (own, own * centred)] for each in z])
        if not np.linalg.cond(bread) < 1e14:
            return None
        spread = y - np.average(y, axis=0, weights=weight)
        explained = 1.0 - float(np.sum(w * residual**2) / np.sum(w * spread**2))
        block = np.floor(data.begin[usable] / max(BLOCK_S, 4.0 * data.window_s)).astype(np.int64)
        return cls(score, bread, block, float(np.sqrt(max(explained, 0.0))))

    def covariance(self) -> Floats:
        """B^-1 M B^-T."""
        numbers = np.unique(self.block, return_inverse=True)[1]
        sums = np.stack([np.bincount(numbers, self.score[:, k]) for k in range(2)], axis=1)
        count = len(sums)
        meat = sums.T @ sums * (count / max(count - 2, 1))
        inverse = np.linalg.inv(self.bread)
        return np.asarray(inverse @ meat @ inverse.T)


def _mean_rate(sensor: Turning, data: _Data, parameters: Floats) -> tuple[Floats, Mask]:
    """y (n, 3) of (2), and where the sensor covers the interval."""
    offset, drift = parameters
    shift = offset + drift * data.centred
    zero = int(sensor.time_ns[0])
    first, run = sensor.at(zero, data.begin + shift)
    last, run_last = sensor.at(zero, data.end + shift)
    return (last - first) / (data.end - data.begin)[:, np.newaxis], (run == run_last) & (run >= 0)


def _regressed(design: Floats, y: Floats, weight: Floats) -> tuple[Floats, Floats]:
    """Weighted least squares of y (n, 3) on the design (n, 4): coefficients (4, 3), residuals (n, 3)."""
    weighted = design * weight[:, np.newaxis]
    solution = np.linalg.lstsq(weighted.T @ design, weighted.T @ y, rcond=1e-12)[0]
    return np.asarray(solution), np.asarray(y - design @ solution)


def _huber(residual: Floats) -> Floats:
    size = np.linalg.norm(residual, axis=1)
    scale = float(np.median(size)) / 1.5382  # the median of a chi variable of three degrees of freedom
    if scale == 0.0:
        return np.ones(len(size))
    return np.asarray(np.minimum(1.0, HUBER * 1.5382 * scale / np.maximum(size, 1e-300)))
