"""What the EKF writes at each sample: its world-frame covariance turned into the body, and what follows from it."""

import math
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..geometry.jit import kernel, part
from ..geometry.kernels import Matrix, Quaternion, Vector, matrix, turned_back
from .ekf_kernel import Constants, Report, State, Symmetric, step
from .loop_kernel import Floats, Span, Times, march

Output: TypeAlias = tuple[Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats]
"""orientation, angular_velocity, gyro_bias, attitude_covariance, rpy_sigma_deg, rate_sigma, bias_sigma, state,
state_covariance, innovation, innovation_covariance: fields of Estimate, each (n, width)."""

DEGREES = 180.0 / math.pi


@part
def single(value: float) -> float:
    """A covariance to single precision: seven digits are more than it deserves, and the file packs to half."""
    return np.float64(np.float32(value))


@part
def rpy_sigma(a: Symmetric, R: Matrix) -> tuple[float, float, float]:
    """Standard deviations (deg) of NED roll, pitch, yaw of an attitude error in the world with covariance a.

    From the rates of ZYX angles: with n = R10 d_y + R00 d_x over cos pitch (the turn about the nose's horizontal),
    d roll = n / cos^2 pitch, d pitch = (R10 d_x - R00 d_y) / cos pitch, d yaw = sin pitch d roll - d_z.
    """
    cos2 = max(R[0] * R[0] + R[3] * R[3], 1e-12)
    e, n = R[0] / cos2, R[3] / cos2
    roll = e * e * a[0] + 2.0 * e * n * a[1] + n * n * a[3]
    pitch = (n * n * a[0] - 2.0 * e * n * a[1] + e * e * a[3]) * cos2
    s = R[6]
    yaw = s * s * roll - 2.0 * s * (e * a[2] + n * a[4]) + a[5]
    return (
        single(DEGREES * math.sqrt(max(roll, 0.0))),
        single(DEGREES * math.sqrt(max(pitch, 0.0))),
        single(DEGREES * math.sqrt(max(yaw, 0.0))),
    )


@part
def write(output: Output, k: int, c: Constants, state: State, report: Report) -> None:
    q, b, rate, P = state.q, state.b, state.rate, state.P
    orientation, angular_velocity, gyro_bias, covariance, angles, rates, biases, full, full_P, innovation, S = output
    R = matrix(q)
    a, _, v = P
    put4(orientation, k, q)
    put3(angular_velocity, k, (rate[0] - b[0], rate[1] - b[1], rate[2] - b[2]))
    put3(gyro_bias, k, b)
    put3(angles, k, rpy_sigma(a, R))
    put3(biases, k, (single(math.sqrt(v[0])), single(math.sqrt(v[3])), single(math.sqrt(v[5]))))
    noise = report.rate_noise
    put3(
        rates,
        k,
        (single(math.sqrt(v[0] + noise)), single(math.sqrt(v[3] + noise)), single(math.sqrt(v[5] + noise))),
    )
    body = in_body(a, R)
    put9(covariance, k, body)
    write_state(full, full_P, k, R, state, body, report)
    if innovation.shape[1] == 3:
        write_three(innovation, S, k, report)
    else:
        write_two(innovation, S, k, report)


@part
def put3(rows: Floats, k: int, v: Vector) -> None:
    rows[k, 0], rows[k, 1], rows[k, 2] = v


@part
def put4(rows: Floats, k: int, q: Quaternion) -> None:
    rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3] = q


@part
def put9(rows: Floats, k: int, m: Matrix) -> None:
    rows[k, 0], rows[k, 1], rows[k, 2] = m[0], m[1], m[2]
    rows[k, 3], rows[k, 4], rows[k, 5] = m[3], m[4], m[5]
    rows[k, 6], rows[k, 7], rows[k, 8] = m[6], m[7], m[8]


@part
def in_body(a: Symmetric, R: Matrix) -> Matrix:
    """R^T A R, rounded."""
    left = turned_back(R, (a[0], a[1], a[2]))
    middle = turned_back(R, (a[1], a[3], a[4]))
    right = turned_back(R, (a[2], a[4], a[5]))
    first = turned_back(R, (left[0], middle[0], right[0]))
    second = turned_back(R, (left[1], middle[1], right[1]))
    third = turned_back(R, (left[2], middle[2], right[2]))
    xx, xy, xz = single(first[0]), single(first[1]), single(first[2])
    yy, yz, zz = single(second[1]), single(second[2]), single(third[2])
    return (xx, xy, xz, xy, yy, yz, xz, yz, zz)


@part
def write_state(full: Floats, full_P: Floats, k: int, R: Matrix, state: State, body: Matrix, report: Report) -> None:
    """Six states, right attitude error and bias, both in the body."""
    _, x, v = state.P
    d = report.correction
    put3(full, k, turned_back(R, (d[0], d[1], d[2])))
    full[k, 3], full[k, 4], full[k, 5] = state.b
    mixed = (
        turned_back(R, (x[0], x[3], x[6])),
        turned_back(R, (x[1], x[4], x[7])),
        turned_back(R, (x[2], x[5], x[8])),
    )
    bias = (v[0], v[1], v[2], v[1], v[3], v[4], v[2], v[4], v[5])
    for i in range(3):
        for j in range(3):
            value = single(mixed[j][i])
            full_P[k, 6 * i + 3 + j] = value
            full_P[k, 6 * (3 + j) + i] = value
            full_P[k, 6 * i + j] = body[3 * i + j]
            full_P[k, 6 * (3 + i) + 3 + j] = single(bias[3 * i + j])


@part
def write_three(innovation: Floats, S: Floats, k: int, report: Report) -> None:
    """S = H P H^T + R of tilt and heading; NaN where the sample had no such measurement."""
    a, (rx, ry, rz) = report.prior, report.noise
    none = 0.0 * rz
    put3(innovation, k, report.innovation)
    xz, yz = single(a[2] + none), single(a[4] + none)
    xy = single(a[1] + 0.0 * rx)
    put9(S, k, (single(a[0] + rx), xy, xz, xy, single(a[3] + ry), yz, xz, yz, single(a[5] + rz)))


@part
def write_two(innovation: Floats, S: Floats, k: int, report: Report) -> None:
    """As `write_three`, of the tilt alone."""
    a, (rx, ry, _) = report.prior, report.noise
    innovation[k, 0], innovation[k, 1] = report.innovation[0], report.innovation[1]
    S[k, 1] = S[k, 2] = single(a[1] + 0.0 * rx)
    S[k, 0], S[k, 3] = single(a[0] + rx), single(a[3] + ry)


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
