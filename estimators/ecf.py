"""Explicit complementary filter with bias, with a magnetometer or without.

R. Mahony, T. Hamel, J.-M. Pflimlin, Nonlinear complementary filters on the special orthogonal group, IEEE TAC 53(5),
2008, doi:10.1109/TAC.2008.923738, eq 32. R turns the body into the world:

    dR/dt = R [(gyro - b + kp w_mes) x]                                                            (1)
    db/dt = -ki w_mes                                                                              (2)
    w_mes = k_acc f/|f| x R^T e_z + k_mag m/|m| x R^T m0                                           (3)

Each step uses its own interval and this sample's measurement with the attitude before it:
R_k = R_k-1 Exp((gyro_k - b + kp w_mes) dt). A magnetometer slower than the IMU acts at its own samples, for its own
interval. What flight needs beyond (3), and what switches it off:

* ``heading_only``: the field turns the estimate about the vertical alone, by the sine of the heading error, so that a
  wrong dip or a disturbed field does not tilt it. False: as (3) stands, m0 being the first field.
* ``gate``: the force enters as f/g, whose mean is right however hard one shakes, and counts 1 / (1 + (a / gate)^2)
  where a is the acceleration of the last ``motion_s``, less what is shorter than ``smooth_s``. inf: f/|f|, always.
* ``mag_gate``: a field whose length is off the usual one by a share x counts 1 / (1 + (x / mag_gate)^2). inf: always.
* ``ki_start``, ``start_gain``: where the log does not begin at rest, w_mes and ki are larger, and accelerations doubted
  less, for about ``settle_s``. Both 0, or a rest at the start: (1) and (2).
"""

import math
from dataclasses import dataclass

from ..schemas.estimate import Estimate
from ..schemas.recording import Recording
from .alignment import GRAVITY, Start, Vector
from .inputs import prepare
from .output import empty, result
from .parameters import MargParameters, choice, quantity
from .registry import Estimator
from .runs import each_run

SMALLEST_FIELD = 1e-12
"""Tesla: less than any magnetometer resolves."""


@dataclass(frozen=True)
class Parameters(MargParameters):
    """Gains of (1) to (3)."""

    kp: float = quantity(1.0, "1/s", "gain of the attitude, times k_acc and k_mag")
    ki: float = quantity(0.005, "1/s^2", "gain of the bias, times k_acc and k_mag")
    ki_start: float = quantity(0.1, "1/s^2", "added to ki while a bias settles that no rest has shown")
    start_gain: float = quantity(2.0, "", "added to the factor on w_mes meanwhile, from 1")
    settle_s: float = quantity(30.0, "s", "time constant of that", minimum=1e-3)
    k_acc: float = quantity(0.25, "", "weight of the accelerometer")
    k_mag: float = quantity(0.1, "", "weight of the magnetometer")
    gate: float = quantity(2.0, "m/s^2", "recent acceleration at which the accelerometer counts half", minimum=1e-6)
    smooth_s: float = quantity(0.1, "s", "what is shorter is vibration, not acceleration", minimum=1e-6)
    motion_s: float = quantity(0.5, "s", "how long an acceleration counts as recent", minimum=1e-3)
    mag_gate: float = quantity(
        0.05, "", "relative difference from the usual field at which it counts half", minimum=1e-6
    )
    mag_memory_s: float = quantity(120.0, "s", "time over which the usual field is learnt", minimum=1e-3)
    heading_only: bool = choice(True, "the magnetometer turns about the vertical only")


def run(recording: Recording, parameters: Parameters) -> Estimate:
    """Filter; raises MissingSensorError without the IMU. Without the magnetometer the heading is arbitrary."""
    from . import ecf_kernel

    inputs = prepare(recording, parameters, mag=True)
    output = empty(len(inputs.time_ns), (4, 3, 3))

    def begin(start: Start) -> tuple[object, object]:
        m0 = _m0(parameters.heading_only, start, math.radians(inputs.declination_deg))
        constants = ecf_kernel.Constants(
            parameters.kp,
            parameters.ki,
            parameters.ki_start,
            parameters.start_gain,
            min(parameters.settle_s, parameters.smooth_s, parameters.motion_s),
            1.0 / parameters.settle_s,
            parameters.k_acc,
            parameters.k_mag,
            GRAVITY,
            1.0 / parameters.gate**2,
            1.0 / parameters.motion_s,
            1.0 / parameters.smooth_s,
            1.0 / parameters.mag_gate**2,
            1.0 / parameters.mag_memory_s,
            m0,
            parameters.heading_only,
        )
        first = start.field or (inputs.field[0].tolist() if inputs.has_mag else None)
        per_usual = 1.0 / max(math.hypot(*first), SMALLEST_FIELD) if first else 0.0
        return constants, (
            start.orientation,
            start.bias,
            (0.0, 0.0, 0.0),
            0.0,
            per_usual,
            float(math.isnan(start.bias_sigma)),
        )

    each_run(inputs, ecf_kernel.run, begin, output, mag=True)
    return result("ecf", inputs, dict(zip(("orientation", "angular_velocity", "gyro_bias"), output, strict=True)))


def _m0(heading_only: bool, start: Start, declination: float) -> Vector:
    """The first field's direction in the world; its horizontal direction over cos(dip) where only heading counts."""
    east, north = math.sin(declination), math.cos(declination)
    if start.field is None:
        return (east, north, 0.0)
    x, y, z = start.field
    length, level = math.hypot(x, y, z), math.hypot(x, y)
    if heading_only:
        return (east * length / level, north * length / level, 0.0)
    return (x / length, y / length, z / length)


ESTIMATOR = Estimator(
    "ecf",
    Parameters,
    run,
    needs_mag=False,
    summary="explicit complementary filter with gyro bias (Mahony, Hamel, Pflimlin)",
    source="Mahony, Hamel, Pflimlin 2008, doi:10.1109/TAC.2008.923738",
)
