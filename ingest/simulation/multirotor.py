"""A multirotor that flies a list of manoeuvres; attitude and body rate follow from the path.

Differential flatness (Mellinger, Kumar, ICRA 2011, doi:10.1109/ICRA.2011.5980409): rotors push along the body's z
axis, so with linear rotor drag d (Faessler, Franchi, Scaramuzza, IEEE RA-L 3(2), 2018, doi:10.1109/LRA.2017.2776353)

    c = a + g e_z + d (v - wind),   b_z = c / |c|                                           (1)
    b_y = b_z x n / |b_z x n|,  n = (sin psi, cos psi, 0): the nose's heading psi            (2)
    b_x = b_y x b_z
    omega = (db_y . b_z, db_z . b_x, db_x . b_y)                                            (3)

with all derivatives in closed form. An accelerometer feels a + g e_z, hence tilt at low speed (through the drag) and
almost nothing of a coordinated turn: what makes attitude estimation in flight hard.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from ...geometry.quaternions import from_matrix
from .motion import GRAVITY, Floats, Motion
from .profiles import Profile, held

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Manoeuvre:
    """Hold a ground speed m/s, a rate of turn deg/s (clockwise) and a rate of climb m/s for a time."""

    duration_s: float
    speed: float = 0.0
    turn_deg_s: float = 0.0
    climb: float = 0.0
    flying: bool = True


@dataclass(frozen=True)
class Gust:
    """A harmonic wobble of the velocity, m/s east, north, up, and of the heading, deg, in flight only."""

    frequency_hz: float
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    heading_deg: float = 0.0


@dataclass(frozen=True)
class Multirotor:
    """The flight as data: heading clockwise from true north, ``slope_deg`` the ground's tilt east and north.

    ``phases`` (rad, one per gust) are what differs from run to run. Before take-off and after landing it stands still.
    """

    manoeuvres: tuple[Manoeuvre, ...]
    gusts: tuple[Gust, ...] = ()
    heading_deg: float = 0.0
    slope_deg: tuple[float, float] = (0.0, 0.0)
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    drag: float = 0.25
    blend_s: float = 1.0
    phases: tuple[float, ...] = ()

    @property
    def duration_s(self) -> float:
        """Sum of the manoeuvres."""
        return float(sum(m.duration_s for m in self.manoeuvres))

    def drawn(self, random: np.random.Generator) -> "Multirotor":
        """The same flight with the gusts' phases drawn."""
        return replace(self, phases=tuple(random.uniform(0.0, 2.0 * np.pi, len(self.gusts)).tolist()))

    def at(self, time_s: Floats) -> Motion:
        """See `Trajectory.at`."""
        v, a, jerk = self._path(time_s)
        flying, flying_rate = self._flying(time_s), self._flying(time_s, 1)
        wind, slope = np.array(self.wind), GRAVITY * self._slope
        c = a + GRAVITY * UP + self.drag * (v - _times(flying, wind)) + _times(1.0 - flying, slope)
        c_rate = jerk + self.drag * (a - _times(flying_rate, wind)) - _times(flying_rate, slope)
        orientation, angular_velocity = _attitude(c, c_rate, *self._nose(time_s))
        position = np.asarray(self._position(np.clip(time_s, 0.0, self.duration_s)))
        return Motion(time_s, position, v, a, orientation, angular_velocity, flying)

    @property
    def _slope(self) -> Floats:
        return np.array([*np.tan(np.radians(self.slope_deg)), 0.0])

    def _held(self, values: Sequence[float]) -> Profile:
        durations = np.array([m.duration_s for m in self.manoeuvres])
        return held(durations, np.array(values, dtype=np.float64), self.blend_s)

    @cached_property
    def _speed(self) -> Profile:
        return self._held([m.speed for m in self.manoeuvres])

    @cached_property
    def _climb(self) -> Profile:
        return self._held([m.climb for m in self.manoeuvres])

    @cached_property
    def _flying(self) -> Profile:
        return self._held([float(m.flying) for m in self.manoeuvres])

    @cached_property
    def _course(self) -> Profile:
        return self._held([np.radians(m.turn_deg_s) for m in self.manoeuvres]).integral()

    @cached_property
    def _position(self) -> BSpline:
        """The path's integral by quintic interpolation of the velocity: true to a micrometre."""
        time_s = np.linspace(0.0, self.duration_s, int(self.duration_s * 50) + 1)
        spline: BSpline = make_interp_spline(time_s, self._path(time_s)[0], k=5).antiderivative()
        return spline

    def _path(self, time_s: Floats) -> tuple[Floats, Floats, Floats]:
        """Velocity, acceleration, jerk (n, 3). Horizontally, z = V e^(i chi) holds north + i east."""
        V, dV, ddV = (self._speed(time_s, k) for k in range(3))
        chi, r, dr = (
            self._course(time_s) + np.radians(self.heading_deg),
            self._course(time_s, 1),
            self._course(time_s, 2),
        )
        ahead = np.cos(chi) + 1j * np.sin(chi)
        horizontal = (V * ahead, (dV + 1j * V * r) * ahead, (ddV - V * r * r + 1j * (2.0 * dV * r + V * dr)) * ahead)
        wobble = self._wobble(time_s, [gust.velocity for gust in self.gusts])
        v, a, jerk = (
            np.stack([z.imag, z.real, self._climb(time_s, k)], axis=-1) + wobble[k] for k, z in enumerate(horizontal)
        )
        return v, a, jerk

    def _nose(self, time_s: Floats) -> tuple[Floats, Floats]:
        """The nose's heading (n,), rad, and its rate."""
        psi, rate, _ = self._wobble(time_s, [(np.radians(gust.heading_deg),) for gust in self.gusts])
        start = np.radians(self.heading_deg)
        return start + self._course(time_s) + psi[:, 0], self._course(time_s, 1) + rate[:, 0]

    def _wobble(self, time_s: Floats, amplitudes: Sequence[tuple[float, ...]]) -> list[Floats]:
        """Value and two derivatives of flying(t) sum A_i sin(w_i t + phase_i), each (n, k)."""
        width = len(amplitudes[0]) if amplitudes else 1
        sums = [np.zeros((len(time_s), width)) for _ in range(3)]
        f = [self._flying(time_s, k) for k in range(3)]
        phases = self.phases or (0.0,) * len(self.gusts)
        for gust, amplitude, phase in zip(self.gusts, amplitudes, phases, strict=True):
            w = 2.0 * np.pi * gust.frequency_hz
            s, c = np.sin(w * time_s + phase), np.cos(w * time_s + phase)
            derivatives = (f[0] * s, f[1] * s + f[0] * w * c, f[2] * s + 2.0 * f[1] * w * c - f[0] * w * w * s)
            for total, value in zip(sums, derivatives, strict=True):
                total += _times(value, np.array(amplitude))
        return sums


def _times(scalars: Floats, vector: Floats) -> Floats:
    return scalars[:, np.newaxis] * vector


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.sum(a * b, axis=-1))


def _unit(vector: Floats, rate: Floats) -> tuple[Floats, Floats]:
    """u = v / |v| and du/dt."""
    length = np.linalg.norm(vector, axis=-1, keepdims=True)
    u = vector / length
    return u, (rate - _times(_dot(u, rate), np.ones(3)) * u) / length


def _attitude(c: Floats, c_rate: Floats, psi: Floats, psi_rate: Floats) -> tuple[Floats, Floats]:
    """(1) to (3): orientation (n, 4) and body rate (n, 3) from the thrust's direction and the nose's heading."""
    none = np.zeros_like(psi)
    nose = np.stack([np.sin(psi), np.cos(psi), none], axis=-1)
    nose_rate = np.stack([np.cos(psi) * psi_rate, -np.sin(psi) * psi_rate, none], axis=-1)
    z, dz = _unit(c, c_rate)
    y, dy = _unit(np.cross(z, nose), np.cross(dz, nose) + np.cross(z, nose_rate))
    x, dx = np.cross(y, z), np.cross(dy, z) + np.cross(y, dz)
    orientation = from_matrix(np.stack([x, y, z], axis=-1))
    return orientation, np.stack([_dot(dy, z), _dot(dz, x), _dot(dx, y)], axis=-1)
