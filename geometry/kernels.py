"""Scalar rotations for Numba kernels: quaternions and vectors are tuples, so that they live in registers.

Quaternions are x y z w, Hamilton, ``multiply(a, b)`` first turns by b, then by a, as in `attlog.geometry.quaternions`.
Matrices are nine numbers, row by row.
"""

import math
from typing import TypeAlias

from .jit import part

Vector: TypeAlias = tuple[float, float, float]
Quaternion: TypeAlias = tuple[float, float, float, float]
Matrix: TypeAlias = tuple[float, float, float, float, float, float, float, float, float]


@part
def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """Hamilton product."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


@part
def conjugate(q: Quaternion) -> Quaternion:
    """The inverse of a unit quaternion."""
    return (-q[0], -q[1], -q[2], q[3])


@part
def half_angle(x: float, y: float, z: float) -> tuple[float, float]:
    """sin(a / 2) / a and cos(a / 2) of the rotation vector (x, y, z) of angle a rad; exact to rounding."""
    square = 0.25 * (x * x + y * y + z * z)
    if square < 1e-4:  # in both series the next term is below 1e-16
        sine = 0.5 - square * (1 / 12 - square / 240)
        return sine, 1.0 - square * (0.5 - square * (1 / 24 - square / 720))
    if square < 0.01:
        sine = 0.5 - square * (1 / 12 - square * (1 / 240 - square * (1 / 10080 - square / 725760)))
        cosine = square * (0.5 - square * (1 / 24 - square * (1 / 720 - square * (1 / 40320 - square / 3628800))))
        return sine, 1.0 - cosine
    half = math.sqrt(square)
    return 0.5 * math.sin(half) / half, math.cos(half)


@part
def exponential(x: float, y: float, z: float) -> Quaternion:
    """The turn by the rotation vector (x, y, z), rad."""
    sine, cosine = half_angle(x, y, z)
    return (sine * x, sine * y, sine * z, cosine)


@part
def advance(q: Quaternion, x: float, y: float, z: float) -> Quaternion:
    """q * Exp(x, y, z), rad, in the order that keeps the chain of operations short."""
    a, b, c, d = q
    sine, cosine = half_angle(x, y, z)
    return (
        cosine * a + sine * (d * x + (b * z - c * y)),
        cosine * b + sine * (d * y + (c * x - a * z)),
        cosine * c + sine * (d * z + (a * y - b * x)),
        cosine * d - sine * (a * x + (b * y + c * z)),
    )


@part
def renormalize(q: Quaternion) -> Quaternion:
    """One Newton step towards unit norm, for quaternions that only rounding has moved from it."""
    scale = 1.5 - 0.5 * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return (q[0] * scale, q[1] * scale, q[2] * scale, q[3] * scale)


@part
def matrix(q: Quaternion) -> Matrix:
    """The rotation matrix of a unit quaternion, row by row."""
    x, y, z, w = q
    return (
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - z * w),
        2.0 * (x * z + y * w),
        2.0 * (x * y + z * w),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - x * w),
        2.0 * (x * z - y * w),
        2.0 * (y * z + x * w),
        1.0 - 2.0 * (x * x + y * y),
    )


@part
def turned(m: Matrix, v: Vector) -> Vector:
    """M v: a body vector in the world, for a body-to-world matrix."""
    return (
        m[0] * v[0] + m[1] * v[1] + m[2] * v[2],
        m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
        m[6] * v[0] + m[7] * v[1] + m[8] * v[2],
    )


@part
def turned_back(m: Matrix, v: Vector) -> Vector:
    """M^T v: a world vector in the body, for a body-to-world matrix."""
    return (
        m[0] * v[0] + m[3] * v[1] + m[6] * v[2],
        m[1] * v[0] + m[4] * v[1] + m[7] * v[2],
        m[2] * v[0] + m[5] * v[1] + m[8] * v[2],
    )


@part
def rotate(q: Quaternion, v: Vector) -> Vector:
    """Turn a vector by a unit quaternion."""
    return turned(matrix(q), v)


@part
def cross(a: Vector, b: Vector) -> Vector:
    """a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@part
def norm(v: Vector) -> float:
    """Length of a vector."""
    return math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
