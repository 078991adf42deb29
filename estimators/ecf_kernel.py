"""The explicit complementary filter's step; `attlog.estimators.ecf` says the equations and their source."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..geometry.jit import kernel, part
from ..geometry.kernels import (
    Quaternion,
    Vector,
    advance,
    cross,
    matrix,
    norm,
    renormalize,
    turned,
    turned_back,
)
from ..schemas.estimate import Status
from .loop_kernel import Floats, Span, Times, march

State = tuple[Quaternion, Vector, Vector, float, float, float]
"""Attitude; bias; horizontal acceleration without vibration; its recent square, over the gate's; one over the usual
field's length; what is left of the settling, from 1 to 0."""
Output = tuple[Floats, Floats, Floats]

ACCELEROMETER_REJECTED = int(Status.ACCELEROMETER_REJECTED)
MAGNETOMETER_REJECTED = int(Status.MAGNETOMETER_REJECTED)
SHOCK = 4.0
"""Accelerations beyond 2 g count as that, in g^2."""
DROWNED = 8.0
"""A sensor is marked as rejected where it weighs less than a ninth of what it does at best."""


class Constants(NamedTuple):
    """Gains of (1) to (3); ``gate`` and ``mag_gate`` are one over their squares, ``m0`` the field in the world."""

    kp: float
    ki: float
    ki_start: float
    start_gain: float
    briefest_s: float
    settle_rate: float
    k_acc: float
    k_mag: float
    gravity: float
    gate: float
    motion_rate: float
    smooth_rate: float
    mag_gate: float
    forget: float
    m0: Vector
    heading_only: bool


@part
def step(
    c: Constants, state: State, dt: float, rate: Vector, force: Vector, dt_mag: float, field: Vector
) -> tuple[State, Vector, int]:
    """Sample k: w_mes from the attitude of k - 1, then R_k = R_k-1 Exp((gyro - b + kp w_mes) dt)."""
    q, b, pull, motion, per_usual, settling = state
    flags = 0
    rotation = matrix(q)
    up = (rotation[6], rotation[7], rotation[8])  # v_hat of gravity: R^T e_z
    boost, ki, doubt = 1.0, c.ki, 1.0
    brief = dt if dt < c.briefest_s else c.briefest_s  # for the low-passes, which must not overshoot
    if settling > 1e-4:
        boost, ki, doubt = 1.0 + c.start_gain * settling, c.ki + c.ki_start * settling, 1.0 - settling * settling
        settling -= settling * c.settle_rate * brief
    e = cross(force, up)  # as long as the horizontal force
    if c.gate > 0.0:
        weight = boost * c.k_acc * dt / (c.gravity * (1.0 + motion * doubt))
        smooth = c.smooth_rate * brief
        pull = (
            pull[0] + smooth * (e[0] - pull[0]),
            pull[1] + smooth * (e[1] - pull[1]),
            pull[2] + smooth * (e[2] - pull[2]),
        )
        square = pull[0] * pull[0] + pull[1] * pull[1] + pull[2] * pull[2]
        moved = min(square, SHOCK * c.gravity * c.gravity) * c.gate
        motion += c.motion_rate * brief * (moved - motion)
        if motion > DROWNED:
            flags |= ACCELEROMETER_REJECTED
    else:
        length = norm(force)
        weight = boost * c.k_acc * dt / length if length > 0.0 else 0.0
    wx, wy, wz = weight * e[0], weight * e[1], weight * e[2]  # w_mes, times the interval of the sensor it comes from
    if dt_mag > 0.0:
        square = field[0] * field[0] + field[1] * field[1] + field[2] * field[2]
        if c.mag_gate > 0.0:
            share = min(0.5 * (square * per_usual * per_usual - 1.0), 1.0)  # of the length, more than usual
            odd = share * share * c.mag_gate
            if odd > DROWNED:
                flags |= MAGNETOMETER_REJECTED
            weight = boost * c.k_mag * dt_mag * per_usual / (1.0 + odd)
            per_usual -= per_usual * share * min(dt_mag * c.forget, 1.0)
        else:
            weight = boost * c.k_mag * dt_mag / math.sqrt(square) if square > 0.0 else 0.0
        if c.heading_only:
            f = turned(rotation, field)
            weight = weight * (f[0] * c.m0[1] - f[1] * c.m0[0])
            e = up
        else:
            e = cross(field, turned_back(rotation, c.m0))
        wx, wy, wz = wx + weight * e[0], wy + weight * e[1], wz + weight * e[2]
    u = (rate[0] - b[0], rate[1] - b[1], rate[2] - b[2])
    q = advance(renormalize(q), u[0] * dt + c.kp * wx, u[1] * dt + c.kp * wy, u[2] * dt + c.kp * wz)
    b = (b[0] - ki * wx, b[1] - ki * wy, b[2] - ki * wz)
    return (q, b, pull, motion, per_usual, settling), u, flags


@part
def write(output: Output, k: int, c: Constants, state: State, u: Vector) -> None:
    orientation, angular_velocity, gyro_bias = output
    q, b, _, _, _, _ = state
    for i in range(4):
        orientation[k, i] = q[i]
    for i in range(3):
        angular_velocity[k, i] = u[i]
        gyro_bias[k, i] = b[i]


@kernel
def run(
    c: Constants,
    state: State,
    imu: tuple[Times, Floats, Floats],
    mag: tuple[Times, Floats],
    span: Span,
    output: Output,
    status: NDArray[np.uint32],
) -> Any:
    return march(step, write, c, state, imu, mag, span, output, status)
