"""Sensors as data: when they sample, and what they make of the truth."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .motion import Floats

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]
ZERO: Vector = (0.0, 0.0, 0.0)
UNITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Sampling:
    """When samples are taken. ``jitter_s`` is the standard deviation of an instant about its place in the raster, cut
    at 0.4 intervals; what is stamped t was measured ``delay_s`` earlier; the fraction ``lost`` never arrives."""

    rate_hz: float
    jitter_s: float = 0.0
    delay_s: float = 0.0
    lost: float = 0.0

    def instants(self, duration_s: float, random: np.random.Generator) -> Floats:
        """Increasing stamps (n,) in [0, duration_s], s."""
        count = int(np.floor(duration_s * self.rate_hz)) + 1
        limit = 0.4 / self.rate_hz
        jitter = np.clip(random.normal(0.0, 1.0, count) * self.jitter_s, -limit, limit)
        stamps = np.clip(np.arange(count) / self.rate_hz + jitter, 0.0, duration_s)
        kept = random.random(count) >= self.lost
        return np.asarray(stamps[kept])


@dataclass(frozen=True)
class Triad:
    """Three axes: measured = quantise(limit(matrix truth + bias + walk + noise)), in the truth's unit u.

    ``noise_density`` u/sqrt(Hz): a sample's standard deviation is density / sqrt(interval). ``bias_walk`` u/sqrt(s):
    the bias wanders by walk * sqrt(interval) from sample to sample. ``quantum`` and ``limit`` 0: none.
    """

    noise_density: float = 0.0
    bias: Vector = ZERO
    bias_walk: float = 0.0
    matrix: Matrix = UNITY
    quantum: float = 0.0
    limit: float = 0.0

    def measure(self, truth: Floats, time_s: Floats, interval_s: float, random: np.random.Generator) -> Floats:
        """Readings (n, 3) of ``truth`` (n, 3) at the stamps ``time_s`` (n,), nominally ``interval_s`` apart."""
        steps = np.sqrt(np.diff(time_s, prepend=time_s[:1]))[:, np.newaxis]
        walk = np.cumsum(random.normal(0.0, 1.0, truth.shape) * steps, axis=0) * self.bias_walk
        noise = random.normal(0.0, 1.0, truth.shape) * (self.noise_density / np.sqrt(interval_s))
        # Element by element: a matrix product may round differently from one machine to another.
        mixed = sum(truth[:, k : k + 1] * np.array(self.matrix)[:, k] for k in range(3))
        reading = np.asarray(mixed + np.array(self.bias) + walk + noise)
        if self.limit:
            reading = np.clip(reading, -self.limit, self.limit)
        return np.round(reading / self.quantum) * self.quantum if self.quantum else reading


@dataclass(frozen=True)
class Vibration:
    """Rotors shake the accelerometer: a harmonic of ``amplitude`` m/s^2 per axis, aliased as sampling has it."""

    frequency_hz: float
    amplitude: Vector

    def at(self, time_s: Floats, activity: Floats, phase: float) -> Floats:
        """Specific force (n, 3) that it adds."""
        wave = activity * np.sin(2.0 * np.pi * self.frequency_hz * time_s + phase)
        return np.asarray(wave[:, np.newaxis] * np.array(self.amplitude))


@dataclass(frozen=True)
class Disturbance:
    """A magnetic field fixed in the world, tesla ENU, that comes and goes smoothly within ``ramp_s``."""

    start_s: float
    end_s: float
    field_enu: Vector
    ramp_s: float = 1.0

    def at(self, time_s: Floats) -> Floats:
        """The field (n, 3)."""
        rise = np.clip((time_s - self.start_s) / self.ramp_s, 0.0, 1.0)
        fall = np.clip((self.end_s - time_s) / self.ramp_s, 0.0, 1.0)
        x = np.minimum(rise, fall)
        return np.asarray((x * x * (3.0 - 2.0 * x))[:, np.newaxis] * np.array(self.field_enu))


@dataclass(frozen=True)
class Suite:
    """The sensors of a vehicle: rad/s, m/s^2, tesla, metres."""

    imu: Sampling
    gyroscope: Triad
    accelerometer: Triad
    compass: Sampling
    magnetometer: Triad
    satellites: Sampling
    position_noise_m: Vector = ZERO
    first_fix_s: float = 0.0
    vibrations: tuple[Vibration, ...] = ()
    disturbances: tuple[Disturbance, ...] = ()


def measured(
    sampling: Sampling, triad: Triad, truth: Callable[[Floats], Floats], stamps_s: Floats, random: np.random.Generator
) -> Floats:
    """Readings (n, 3) at ``stamps_s`` (n,) of a truth that is asked ``delay_s`` earlier."""
    return triad.measure(truth(stamps_s - sampling.delay_s), stamps_s, 1.0 / sampling.rate_hz, random)
