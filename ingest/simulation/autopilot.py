"""A plausible autopilot: modes, messages, parameters, and an attitude of its own that is a little wrong."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.signal import lfilter

from ...geometry.quaternions import from_rotation_vector, multiply
from .motion import Floats


@dataclass(frozen=True)
class Mode:
    """From ``time_s`` on: ArduCopter's mode number and its name, and whether motors are armed."""

    time_s: float
    number: int
    name: str
    armed: bool


@dataclass(frozen=True)
class Remark:
    """A line that the autopilot says; ``severity`` as MAV_SEVERITY (6 = info, 4 = warning)."""

    time_s: float
    severity: int
    text: str


@dataclass(frozen=True)
class Autopilot:
    """What it sends besides sensors. Its attitude is the truth turned by a slowly wandering error (Gauss-Markov,
    ``correlation_s``; standard deviations in degrees). ``trim_rad`` is AHRS_TRIM, roll and pitch."""

    attitude_hz: float
    tilt_sigma_deg: float
    heading_sigma_deg: float
    correlation_s: float
    trim_rad: tuple[float, float] = (0.0, 0.0)
    modes: tuple[Mode, ...] = ()
    remarks: tuple[Remark, ...] = ()
    parameters: Mapping[str, float] = field(default_factory=dict)

    def estimate(self, orientation: Floats, interval_s: float, random: np.random.Generator) -> Floats:
        """What it believes the attitudes (n, 4), ``interval_s`` apart, to be: Exp(error) R_true, error in the world."""
        keep = np.exp(-interval_s / self.correlation_s)
        drive = random.normal(0.0, 1.0, (len(orientation), 3))
        drive[1:] *= np.sqrt(1.0 - keep * keep)
        wander = np.asarray(lfilter([1.0], [1.0, -keep], drive, axis=0))
        sigma = np.radians([self.tilt_sigma_deg, self.tilt_sigma_deg, self.heading_sigma_deg])
        return multiply(from_rotation_vector(sigma * wander), orientation)
