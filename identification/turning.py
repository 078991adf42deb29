"""How far a body has turned: the integral of its angular rate, from a gyro or from an attitude, so that both compare.

    Theta(t) = integral of omega dt, in the body
    gyro:      Theta_k+1 = Theta_k + (omega_k + omega_k+1) dt / 2
    attitude:  Theta_k+1 = Theta_k + Log(q_k* q_k+1)

The difference of Theta over an interval is that interval's mean rate, whatever the sampling on either side.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..geometry.quaternions import conjugate, multiply, normalize, to_rotation_vector
from ..schemas.columns import Time
from ..schemas.recording import Attitude, Imu

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

GAP_INTERVALS: Final = 5.0
"""A pause of more than this many median intervals parts two runs."""


@dataclass(frozen=True, eq=False)
class Turning:
    """``angle`` (n, 3) rad and ``rate`` (n, 3) rad/s in the body at strictly increasing ``time_ns`` (n,).

    ``run`` (n,) counts the pauses before a sample: angles compare within one run only.
    """

    time_ns: Time
    angle: Floats
    rate: Floats
    run: NDArray[np.int64]

    @property
    def interval_s(self) -> float:
        """Median interval."""
        return float(np.median(np.diff(self.time_ns))) * 1e-9

    def seconds(self, zero_ns: int) -> Floats:
        """The stamps (n,) in s after ``zero_ns``."""
        return np.asarray((self.time_ns - zero_ns) * 1e-9)

    def at(self, zero_ns: int, time_s: Floats) -> tuple[Floats, NDArray[np.int64]]:
        """Angle (m, 3) at ``zero_ns + time_s`` (m,), cubic between samples, and the run; run -1 where there is none."""
        own = self.seconds(zero_ns)
        first = np.clip(np.searchsorted(own, time_s, side="right") - 1, 0, len(own) - 2)
        step = own[first + 1] - own[first]
        x = ((time_s - own[first]) / step)[:, np.newaxis]
        h = step[:, np.newaxis]
        a, b, ra, rb = self.angle[first], self.angle[first + 1], self.rate[first], self.rate[first + 1]
        cubic = a + (b - a) * x * x * (3 - 2 * x) + h * x * (1 - x) * (ra * (1 - x) - rb * x)
        inside = (time_s >= own[0]) & (time_s <= own[-1]) & (self.run[first] == self.run[first + 1])
        return cubic, np.where(inside, self.run[first], -1)


def from_imu(imu: Imu) -> Turning:
    """Of a gyro's samples; those that are not finite are left out."""
    time_ns, rate = _usable(imu.time_ns, imu.angular_velocity)
    step = 0.5 * (rate[1:] + rate[:-1]) * (np.diff(time_ns) * 1e-9)[:, np.newaxis]
    return Turning(time_ns, _summed(step), rate, _runs(time_ns))


def from_attitude(attitude: Attitude) -> Turning:
    """Of an attitude's samples; those that are not finite are left out."""
    time_ns, orientation = _usable(attitude.time_ns, normalize(attitude.orientation))
    angle = _summed(to_rotation_vector(multiply(conjugate(orientation[:-1]), orientation[1:])))
    time_s = (time_ns - time_ns[:1]) * 1e-9
    rate = np.gradient(angle, time_s, axis=0) if len(time_ns) > 1 else np.zeros_like(angle)
    return Turning(time_ns, angle, np.asarray(rate), _runs(time_ns))


def _usable(time_ns: Time, values: Floats) -> tuple[Time, Floats]:
    finite = np.isfinite(values).all(axis=1)
    stamps, first = np.unique(time_ns[finite], return_index=True)
    return stamps, values[finite][first]


def _summed(steps: Floats) -> Floats:
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


def _runs(time_ns: Time) -> NDArray[np.int64]:
    intervals = np.diff(time_ns)
    if len(intervals) == 0:
        return np.zeros(len(time_ns), np.int64)
    breaks = intervals > GAP_INTERVALS * np.median(intervals)
    return np.concatenate([[0], np.cumsum(breaks)])
