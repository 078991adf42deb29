"""Quaternion EKF with gyro bias: `ekf9` with a magnetometer, `ekf6` without.

The scheme is that of a quaternion EKF on gyro, accelerometer and magnetometer (Kito and Kojima, Nanzan University 2021,
eq 2.1 to 2.20; equation numbers in brackets are theirs), in the multiplicative form of E. J. Lefferts, F. L. Markley,
M. D. Shuster, Kalman filtering for spacecraft attitude estimation, JGCD 5(5), 1982, doi:10.2514/3.56190. The quaternion
keeps unit norm and the covariance is three angles d in the world, R = Exp(d) R_est, and the bias b in the body:

    q_k = q_k-1 * Exp(mean rate dt)                                                                (2.3, 2.4)
    d' = d - R dt b + noise,   P <- F P F^T + Q,  Q = [N_gyro^2, N_bias^2] dt                      (2.5, 2.18)
    f_world / g = e_z - d x e_z + noise: two scalars, d_x and d_y, with unit rows                  (2.6 to 2.8)
    heading of m_world = declination: one scalar, d_z, with a unit row                             (2.12)
    K = P H^T (H P H^T + R)^-1, x += K (y - h), P -= K H P, one scalar after the other             (2.16 to 2.18)

All noise is a density per root hertz and each step uses its own interval: N^2 dt to predict, N^2 / dt to measure, so
that the result does not hang on the log's rate. What flight needs:

* Linear acceleration is noise that lasts: ``acc_noise`` is its density at best (standard deviation times root of twice
  its correlation time), and ``acc_motion`` times the acceleration of the last ``motion_s`` is added (R. K. Mehra, On
  the identification of variances and adaptive Kalman filtering, IEEE TAC 15(2), 1970, doi:10.1109/TAC.1970.1099422).
  That acceleration is f_world / g - e_z without what is shorter than ``smooth_s`` and what the tilt's own variance
  explains. f enters as f / g, not f / |f|: its mean is right however hard one shakes.
* The field turns the heading alone, so neither dip nor disturbance tilts the estimate. A field off its usual length and
  dip adds noise, ``mag_excess`` times the relative difference; the usual field is learnt over ``mag_memory_s``.
* A rate that changes between two samples adds noise, its change times ``rate_error``; turning does, too: the rate times
  ``scale_error``, for scale and misalignment. ``gyro_lag_s`` makes up for the delay of the gyro's own filters.
* A heading beyond 5 sigma counts as one of 5; a field refused for 10 s on end is believed again.

The innovations are the two tilt angles and the heading, rad. ``attitude_covariance`` and the state's are turned into
the body; the state's first three are the correction just made.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..schemas.estimate import Estimate
from ..schemas.recording import Recording
from .alignment import GRAVITY, Start
from .inputs import Inputs, prepare
from .output import empty, result
from .parameters import ImuParameters, MargParameters, quantity
from .registry import Estimator
from .runs import each_run

if TYPE_CHECKING:
    from .ekf_kernel import Covariance

STATE_NAMES = (
    "attitude_error_x",
    "attitude_error_y",
    "attitude_error_z",
    "gyro_bias_x",
    "gyro_bias_y",
    "gyro_bias_z",
)
INNOVATION_NAMES = ("tilt_east", "tilt_north", "heading")


@dataclass(frozen=True)
class Noise(ImuParameters):
    """Noise of gyro and accelerometer, and what is known of the bias at the start."""

    gyro_lag_s: float = quantity(0.002, "s", "delay of the gyro's own filters, made up for")
    gyro_noise: float = quantity(0.0006, "rad/s/rtHz", "density of the gyro's noise")
    bias_walk: float = quantity(0.00015, "rad/s/rts", "random walk of the gyro's bias")
    bias_sigma: float = quantity(0.02, "rad/s", "bias at the start, where no rest shows it")
    rate_error: float = quantity(0.1, "", "share of a step's rate change that is error")
    scale_error: float = quantity(0.003, "1/rtHz", "gyro noise per rad/s of turning: scale and misalignment")
    acc_noise: float = quantity(0.08, "m/s^2/rtHz", "density of linear acceleration", minimum=1e-9)
    acc_motion: float = quantity(0.2, "1/rtHz", "more of it per m/s^2 of recent acceleration")
    smooth_s: float = quantity(0.1, "s", "what is shorter is vibration, not acceleration", minimum=1e-6)
    motion_s: float = quantity(0.8, "s", "how long an acceleration counts as recent", minimum=1e-3)


@dataclass(frozen=True)
class Ekf6(Noise):
    """Six axes: nothing more."""


@dataclass(frozen=True)
class Ekf9(Noise, MargParameters):
    """Nine axes."""

    mag_noise: float = quantity(0.016, "rad/rtHz", "density of the heading's noise", minimum=1e-9)
    mag_excess: float = quantity(2.4, "rad/rtHz", "more of it per relative difference from the usual field")
    mag_memory_s: float = quantity(120.0, "s", "time over which the usual field is learnt", minimum=1e-3)


def run_ekf9(recording: Recording, parameters: Ekf9) -> Estimate:
    """Raises MissingSensorError without the IMU or the magnetometer."""
    inputs = prepare(recording, parameters, mag=True, needs_mag=True)
    return _run("ekf9", inputs, parameters, (parameters.mag_noise, parameters.mag_excess, parameters.mag_memory_s))


def run_ekf6(recording: Recording, parameters: Ekf6) -> Estimate:
    """Raises MissingSensorError without the IMU. The heading starts at 0."""
    return _run("ekf6", prepare(recording, parameters, mag=False), parameters, (1.0, 0.0, 1.0))


def _run(name: str, inputs: Inputs, noise: Noise, field: tuple[float, float, float]) -> Estimate:
    from .ekf_kernel import Constants, State
    from .ekf_output_kernel import run

    measured = 3 if inputs.has_mag else 2
    widths = {**WIDTHS, "innovation": measured, "innovation_covariance": measured * measured}
    output = empty(len(inputs.time_ns), widths.values())
    declination = math.radians(inputs.declination_deg)
    mag_noise, mag_excess, mag_memory_s = field

    def begin(start: Start) -> tuple[Constants, State]:
        level, vertical, strength2 = _usual(start)
        constants = Constants(
            lag=noise.gyro_lag_s,
            gyro=noise.gyro_noise**2,
            bias_walk=noise.bias_walk**2,
            rate_error=noise.rate_error**2,
            scale_error=noise.scale_error**2,
            force=(noise.acc_noise / GRAVITY) ** 2,
            force_motion=noise.acc_motion**2,
            per_gravity=1.0 / GRAVITY,
            motion_rate=1.0 / noise.motion_s,
            smooth_rate=1.0 / noise.smooth_s,
            field=mag_noise**2,
            field_excess=mag_excess**2,
            per_strength2=1.0 / strength2,
            forget=1.0 / mag_memory_s,
            north=(math.sin(declination), math.cos(declination)),
        )
        none = (0.0, 0.0, 0.0)
        return constants, State(
            start.orientation, start.bias, none, _covariance(start, noise), none, 0.0, level, vertical, 0.0
        )

    each_run(inputs, run, begin, output, mag=True)
    filled = dict(zip(widths, output, strict=True))
    return result(name, inputs, filled, state_names=STATE_NAMES, innovation_names=INNOVATION_NAMES[:measured])


WIDTHS = {
    "orientation": 4,
    "angular_velocity": 3,
    "gyro_bias": 3,
    "attitude_covariance": 9,
    "rpy_sigma_deg": 3,
    "rate_sigma": 3,
    "bias_sigma": 3,
    "state": 6,
    "state_covariance": 36,
}
"""In the order of the kernel's output."""


def _usual(start: Start) -> tuple[float, float, float]:
    """Horizontal and vertical part of the first field, and its length squared."""
    if start.field is None:
        return 0.0, 0.0, 1.0
    x, y, z = start.field
    return math.hypot(x, y), z, max(x * x + y * y + z * z, 1e-30)


def _covariance(start: Start, noise: Noise) -> "Covariance":
    tilt, heading = start.tilt_sigma**2, start.heading_sigma**2
    bias = (noise.bias_sigma if math.isnan(start.bias_sigma) else start.bias_sigma) ** 2
    none = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return (tilt, 0.0, 0.0, tilt, 0.0, heading), none, (bias, 0.0, 0.0, bias, 0.0, bias)


EKF9 = Estimator(
    "ekf9",
    Ekf9,
    run_ekf9,
    needs_mag=True,
    summary="quaternion EKF with gyro bias: gyro, accelerometer, magnetometer",
    source="Lefferts, Markley, Shuster 1982, doi:10.2514/3.56190",
)
EKF6 = Estimator(
    "ekf6",
    Ekf6,
    run_ekf6,
    needs_mag=False,
    summary="quaternion EKF with gyro bias: gyro, accelerometer",
    source="Lefferts, Markley, Shuster 1982, doi:10.2514/3.56190",
)
