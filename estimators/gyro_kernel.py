"""Gyro integration as a kernel; `attlog.estimators.gyro` says the equations."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..geometry.jit import kernel, part
from ..geometry.kernels import Quaternion, Vector, advance, renormalize
from .loop_kernel import Floats, Span, Times, march

State = tuple[Quaternion, Vector, Vector]
"""Attitude, bias, and the rate at the sample before."""
Output = tuple[Floats, Floats, Floats]


@part
def step(
    lag: float, state: State, dt: float, rate: Vector, force: Vector, dt_mag: float, field: Vector
) -> tuple[State, Vector, int]:
    q, b, before = state
    u = (rate[0] - b[0], rate[1] - b[1], rate[2] - b[2])
    if dt == 0.0:
        before = u
    return (advance(renormalize(q), *interval_turn(before, u, dt, lag)), b, u), u, 0


@part
def interval_turn(a: Vector, b: Vector, dt: float, lag: float) -> Vector:
    """The rotation vector over an interval from rate a to rate b, measured by a gyro that lags by ``lag`` s.

    Mean rate, its slope over the lag, and the coning term dt^2/12 a x b.
    """
    old, new, cone = 0.5 * dt - lag, 0.5 * dt + lag, dt * dt / 12.0
    return (
        old * a[0] + new * b[0] + cone * (a[1] * b[2] - a[2] * b[1]),
        old * a[1] + new * b[1] + cone * (a[2] * b[0] - a[0] * b[2]),
        old * a[2] + new * b[2] + cone * (a[0] * b[1] - a[1] * b[0]),
    )


@part
def write(output: Output, k: int, lag: float, state: State, u: Vector) -> None:
    orientation, angular_velocity, gyro_bias = output
    q, b, _ = state
    for i in range(4):
        orientation[k, i] = q[i]
    for i in range(3):
        angular_velocity[k, i] = u[i]
        gyro_bias[k, i] = b[i]


@kernel
def run(
    lag: float,
    state: State,
    imu: tuple[Times, Floats, Floats],
    mag: tuple[Times, Floats],
    span: Span,
    output: Output,
    status: NDArray[np.uint32],
) -> Any:
    return march(step, write, lag, state, imu, mag, span, output, status)
