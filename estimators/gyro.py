"""Gyro integration from an initial alignment: what the angular rate alone knows.

    q_k = q_k-1 * Exp((w_k-1 + w_k) dt / 2 + (w_k - w_k-1) lag + w_k-1 x w_k dt^2 / 12),    w = gyro - bias

The second term makes up for the delay of the gyro's own filters, the third is coning to the order that two samples
allow (Savage, Strapdown Inertial Navigation Integration Algorithm Design Part 1, J. Guidance 21(1), 1998,
doi:10.2514/2.4228). Exact for a constant rate. The bias is that of the rest at the start, else 0; the magnetometer,
where there is one, gives the first heading only.
"""

from dataclasses import dataclass

from ..schemas.estimate import Estimate
from ..schemas.recording import Recording
from .alignment import Start
from .inputs import prepare
from .output import empty, result
from .parameters import MargParameters, quantity
from .registry import Estimator
from .runs import each_run


@dataclass(frozen=True)
class Parameters(MargParameters):
    """Nothing to tune but the gyro's delay."""

    gyro_lag_s: float = quantity(0.002, "s", "delay of the gyro's own filters, made up for")


def run(recording: Recording, parameters: Parameters) -> Estimate:
    """Integrate; raises MissingSensorError without the IMU."""
    from . import gyro_kernel

    inputs = prepare(recording, parameters, mag=True)
    output = empty(len(inputs.time_ns), (4, 3, 3))

    def begin(start: Start) -> tuple[object, object]:
        return parameters.gyro_lag_s, (start.orientation, start.bias, (0.0, 0.0, 0.0))

    each_run(inputs, gyro_kernel.run, begin, output, mag=False)
    return result("gyro", inputs, dict(zip(("orientation", "angular_velocity", "gyro_bias"), output, strict=True)))


ESTIMATOR = Estimator(
    "gyro",
    Parameters,
    run,
    needs_mag=False,
    summary="gyro integration from an initial alignment",
    source="Savage 1998, doi:10.2514/2.4228",
)
