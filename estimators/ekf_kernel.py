"""The quaternion EKF's step; `attlog.estimators.ekf` says the equations and their source.

State: attitude error d in the world (R = Exp(d) R_est, rad) and gyro bias error (body, rad/s). The covariance is three
blocks: ``A`` (attitude, symmetric, upper half row by row), ``C`` (attitude x bias, full), ``B`` (bias, symmetric).
"""

import math
from typing import NamedTuple, TypeAlias

import numpy as np

from ..geometry.jit import part
from ..geometry.kernels import Matrix, Quaternion, Vector, advance, exponential, matrix, multiply, renormalize, turned
from ..schemas.estimate import Status
from .gyro_kernel import interval_turn

Symmetric: TypeAlias = tuple[float, float, float, float, float, float]
Covariance: TypeAlias = tuple[Symmetric, Matrix, Symmetric]
Correction: TypeAlias = tuple[float, float, float, float, float, float]

ACCELEROMETER_REJECTED = int(Status.ACCELEROMETER_REJECTED)
MAGNETOMETER_REJECTED = int(Status.MAGNETOMETER_REJECTED)
DROWNED = 8.0
"""A sensor is marked as rejected where its noise is this many times what it is at best: it weighs a ninth."""
SHOCK = 4.0
"""Accelerations beyond 2 g count as that, in g^2, lest one crash blind the filter for long."""
OUTLIER = 25.0
"""A heading further off than 5 standard deviations counts as just that far."""
PATIENCE_S, HASTE = 10.0, 8.0
"""Rejected for longer than this without a break, the field is believed again, and learnt so many times faster."""


class Constants(NamedTuple):
    """Noise as densities squared (per Hz); ``north`` is the field's horizontal direction, east and north."""

    lag: float
    gyro: float
    bias_walk: float
    rate_error: float
    scale_error: float
    force: float
    force_motion: float
    per_gravity: float
    motion_rate: float
    smooth_rate: float
    field: float
    field_excess: float
    per_strength2: float
    forget: float
    north: tuple[float, float]


class State(NamedTuple):
    """After a sample. ``pull`` is the acceleration without vibration, ``motion`` its recent mean square, in g
    and g^2, in the world; ``horizontal`` and ``vertical`` are
    the field that the filter has come to know; ``refused_s`` how long its heading has been an outlier."""

    q: Quaternion
    b: Vector
    rate: Vector
    P: Covariance
    pull: Vector
    motion: float
    horizontal: float
    vertical: float
    refused_s: float


class Report(NamedTuple):
    """What a step measured: innovations (rad) and their covariance's parts, and the correction that it made."""

    innovation: Vector
    prior: Symmetric
    noise: Vector
    correction: Correction
    rate_noise: float


@part
def predict(c: Constants, P: Covariance, R: Matrix, spread: float, dt: float) -> Covariance:
    """P <- F P F^T + Q, with d' = d - R dt b."""
    a, x, b = P
    m = (R[0] * dt, R[1] * dt, R[2] * dt, R[3] * dt, R[4] * dt, R[5] * dt, R[6] * dt, R[7] * dt, R[8] * dt)
    y = (
        x[0] - (m[0] * b[0] + m[1] * b[1] + m[2] * b[2]),
        x[1] - (m[0] * b[1] + m[1] * b[3] + m[2] * b[4]),
        x[2] - (m[0] * b[2] + m[1] * b[4] + m[2] * b[5]),
        x[3] - (m[3] * b[0] + m[4] * b[1] + m[5] * b[2]),
        x[4] - (m[3] * b[1] + m[4] * b[3] + m[5] * b[4]),
        x[5] - (m[3] * b[2] + m[4] * b[4] + m[5] * b[5]),
        x[6] - (m[6] * b[0] + m[7] * b[1] + m[8] * b[2]),
        x[7] - (m[6] * b[1] + m[7] * b[3] + m[8] * b[4]),
        x[8] - (m[6] * b[2] + m[7] * b[4] + m[8] * b[5]),
    )
    qa, qb = c.gyro * dt + spread, c.bias_walk * dt
    a = (
        a[0] - (m[0] * x[0] + m[1] * x[1] + m[2] * x[2]) - (y[0] * m[0] + y[1] * m[1] + y[2] * m[2]) + qa,
        a[1] - (m[0] * x[3] + m[1] * x[4] + m[2] * x[5]) - (y[0] * m[3] + y[1] * m[4] + y[2] * m[5]),
        a[2] - (m[0] * x[6] + m[1] * x[7] + m[2] * x[8]) - (y[0] * m[6] + y[1] * m[7] + y[2] * m[8]),
        a[3] - (m[3] * x[3] + m[4] * x[4] + m[5] * x[5]) - (y[3] * m[3] + y[4] * m[4] + y[5] * m[5]) + qa,
        a[4] - (m[3] * x[6] + m[4] * x[7] + m[5] * x[8]) - (y[3] * m[6] + y[4] * m[7] + y[5] * m[8]),
        a[5] - (m[6] * x[6] + m[7] * x[7] + m[8] * x[8]) - (y[6] * m[6] + y[7] * m[7] + y[8] * m[8]) + qa,
    )
    return a, y, (b[0] + qb, b[1], b[2], b[3] + qb, b[4], b[5] + qb)


@part
def condition(
    P: Covariance, row: Correction, noise: float, residual: float, d: Correction
) -> tuple[Covariance, Correction]:
    """Fold in one scalar that measures one component of d: ``row`` is that row of P, ``residual`` z minus it."""
    a, x, b = P
    h0, h1, h2, h3, h4, h5 = row
    w = 1.0 / noise
    k0, k1, k2, k3, k4, k5 = h0 * w, h1 * w, h2 * w, h3 * w, h4 * w, h5 * w
    a = (a[0] - k0 * h0, a[1] - k0 * h1, a[2] - k0 * h2, a[3] - k1 * h1, a[4] - k1 * h2, a[5] - k2 * h2)
    x = (
        x[0] - k0 * h3,
        x[1] - k0 * h4,
        x[2] - k0 * h5,
        x[3] - k1 * h3,
        x[4] - k1 * h4,
        x[5] - k1 * h5,
        x[6] - k2 * h3,
        x[7] - k2 * h4,
        x[8] - k2 * h5,
    )
    b = (b[0] - k3 * h3, b[1] - k3 * h4, b[2] - k3 * h5, b[3] - k4 * h4, b[4] - k4 * h5, b[5] - k5 * h5)
    r = residual
    return (a, x, b), (d[0] + k0 * r, d[1] + k1 * r, d[2] + k2 * r, d[3] + k3 * r, d[4] + k4 * r, d[5] + k5 * r)


@part
def angle(y: float, x: float) -> float:
    """atan2(y, x), by its series where that is exact to 1e-13 and ten times faster."""
    t = y / x if x > 0.0 else 1.0
    if abs(t) < 0.05:
        s = t * t
        return t * (1.0 - s * (1 / 3 - s * (1 / 5 - s * (1 / 7 - s / 9))))
    return math.atan2(y, x)


@part
def step(
    c: Constants, state: State, dt: float, rate: Vector, force: Vector, dt_mag: float, field: Vector
) -> tuple[State, Report, int]:
    q, b, before, P, pull, motion, horizontal, vertical, refused_s = state
    flags = 0

    # 1. predict: the mean of the interval's rates turns the attitude
    u = (rate[0] - b[0], rate[1] - b[1], rate[2] - b[2])
    if dt == 0.0:
        before = rate
    jump = ((rate[0] - before[0]) ** 2 + (rate[1] - before[1]) ** 2 + (rate[2] - before[2]) ** 2) * dt * dt
    old = (before[0] - b[0], before[1] - b[1], before[2] - b[2])
    q = advance(renormalize(q), *interval_turn(old, u, dt, c.lag))
    R = matrix(q)
    turning = (rate[0] * rate[0] + rate[1] * rate[1] + rate[2] * rate[2]) * dt
    P = predict(c, P, R, c.rate_error * jump + c.scale_error * turning, dt)
    prior = P[0]

    # 2. accelerometer: two angles about the world's east and north, as noisy as the motion of the last second or so
    d = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    tilt_x = tilt_y = heading = np.nan
    noise_tilt = noise_heading = rate_noise = np.nan
    if dt > 0.0:
        per_s = 1.0 / dt
        rate_noise = c.gyro * per_s
        f = turned(R, force)
        tilt_x, tilt_y, lift = f[1] * c.per_gravity, -f[0] * c.per_gravity, f[2] * c.per_gravity - 1.0
        smooth = min(c.smooth_rate * dt, 1.0)
        east, north, up = pull
        east, north, up = east + smooth * (tilt_y - east), north + smooth * (tilt_x - north), up + smooth * (lift - up)
        pull = (east, north, up)
        moved = max(east * east + north * north + up * up - (prior[0] + prior[3]), 0.0)
        motion += min(c.motion_rate * dt, 1.0) * (min(moved, SHOCK) - motion)
        noise_tilt = (c.force + c.force_motion * motion) * per_s
        if c.force_motion * motion > DROWNED * c.force:
            flags |= ACCELEROMETER_REJECTED
        a, x, _ = P
        P, d = condition(P, (a[0], a[1], a[2], x[0], x[1], x[2]), a[0] + noise_tilt, tilt_x - d[0], d)
        a, x, _ = P
        P, d = condition(P, (a[1], a[3], a[4], x[3], x[4], x[5]), a[3] + noise_tilt, tilt_y - d[1], d)

    # 3. magnetometer: one angle about the vertical
    if dt_mag > 0.0:
        f = turned(R, field)
        level = math.sqrt(f[0] * f[0] + f[1] * f[1])
        if level > 0.0:
            e, n = c.north
            heading = angle(f[0] * n - f[1] * e, f[0] * e + f[1] * n)
            odd = ((level - horizontal) ** 2 + (f[2] - vertical) ** 2) * c.per_strength2
            noise_heading = (c.field + c.field_excess * odd) / dt_mag
            a, x, _ = P
            bound = heading * heading / OUTLIER - a[5]
            drowned = c.field_excess * odd > DROWNED * c.field
            if drowned or bound > noise_heading:
                flags |= MAGNETOMETER_REJECTED
                refused_s += dt_mag
                if bound > noise_heading and refused_s < PATIENCE_S:
                    noise_heading = bound
            else:
                refused_s = 0.0
            s = a[5] + noise_heading
            P, d = condition(P, (a[2], a[4], a[5], x[6], x[7], x[8]), s, heading - d[2], d)
            share = min(dt_mag * (c.forget if refused_s < PATIENCE_S else HASTE * c.forget), 1.0)
            horizontal, vertical = horizontal + share * (level - horizontal), vertical + share * (f[2] - vertical)

    # 4. move the correction into the attitude and the bias
    q = multiply(exponential(d[0], d[1], d[2]), q)
    b = (b[0] + d[3], b[1] + d[4], b[2] + d[5])
    report = Report((tilt_x, tilt_y, heading), prior, (noise_tilt, noise_tilt, noise_heading), d, rate_noise)
    return State(q, b, rate, P, pull, motion, horizontal, vertical, refused_s), report, flags
