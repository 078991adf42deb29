"""Truth: where a body is and how it moves and turns, at any instants."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...geometry.quaternions import conjugate, rotate

Floats = NDArray[np.float64]

GRAVITY = 9.80665
"""m/s^2, along down everywhere: the flights are short and low."""


@dataclass(frozen=True, eq=False)
class Motion:
    """A body at the instants ``time_s`` (n,).

    ``position`` m, ``velocity`` m/s, ``acceleration`` m/s^2: (n, 3) in the local world ENU. ``orientation`` (n, 4)
    x y z w, body FLU to ENU. ``angular_velocity`` (n, 3) rad/s in the body FLU. ``activity`` (n,) 0 at rest to 1 in
    flight, which scales what only a running vehicle does (vibration).
    """

    time_s: Floats
    position: Floats
    velocity: Floats
    acceleration: Floats
    orientation: Floats
    angular_velocity: Floats
    activity: Floats

    def in_body(self, world: Floats) -> Floats:
        """World vectors (n, 3) or (3,) seen from the body."""
        return rotate(conjugate(self.orientation), np.broadcast_to(world, (len(self.time_s), 3)))

    @property
    def specific_force(self) -> Floats:
        """What an ideal accelerometer reads (n, 3), body FLU: acceleration less gravity."""
        return self.in_body(self.acceleration + np.array([0.0, 0.0, GRAVITY]))


class Trajectory(Protocol):
    """A motion as a function of time; the derivatives are exact, not differenced."""

    @property
    def duration_s(self) -> float:
        """From the first instant, 0, to the last."""
        ...

    def drawn(self, random: np.random.Generator) -> "Trajectory":
        """The same with what differs from run to run (phases, amplitudes) drawn; itself where nothing does."""
        ...

    def at(self, time_s: Floats) -> Motion:
        """The motion at any instants (n,), in any order; the body rests before 0 and after the end."""
        ...
