"""Unit quaternions x y z w on the last axis, vectorised over all others. ``a * b`` first turns by b, then by a."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def normalize(q: ArrayLike) -> Floats:
    """Scale to unit norm; a zero or non-finite quaternion becomes NaN."""
    values = np.asarray(q, dtype=np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(values / np.linalg.norm(values, axis=-1, keepdims=True))


def conjugate(q: ArrayLike) -> Floats:
    """The inverse of a unit quaternion."""
    return np.asarray(np.asarray(q, dtype=np.float64) * np.array([-1.0, -1.0, -1.0, 1.0]))


def multiply(a: ArrayLike, b: ArrayLike) -> Floats:
    """Hamilton product."""
    ax, ay, az, aw = _components(a)
    bx, by, bz, bw = _components(b)
    product = (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )
    return np.stack(product, axis=-1)


def rotate(q: ArrayLike, v: ArrayLike) -> Floats:
    """Turn vectors (…, 3) by quaternions (…, 4): body vectors into the world for a body-to-world quaternion."""
    quaternion = np.asarray(q, dtype=np.float64)
    vector = np.asarray(v, dtype=np.float64)
    axis, w = quaternion[..., :3], quaternion[..., 3:]
    twice = 2.0 * np.cross(axis, vector)
    return np.asarray(vector + w * twice + np.cross(axis, twice))


def from_rotation_vector(rotation: ArrayLike) -> Floats:
    """Exp: rotation vectors (…, 3) in rad to quaternions."""
    vector = np.asarray(rotation, dtype=np.float64)
    angle = np.linalg.norm(vector, axis=-1, keepdims=True)
    return np.concatenate([0.5 * np.sinc(angle / (2.0 * np.pi)) * vector, np.cos(0.5 * angle)], axis=-1)


def to_rotation_vector(q: ArrayLike) -> Floats:
    """Log: quaternions to rotation vectors (…, 3), rad, at most pi long."""
    quaternion = np.asarray(q, dtype=np.float64)
    quaternion = np.where(quaternion[..., 3:] < 0.0, -quaternion, quaternion)
    axis, w = quaternion[..., :3], quaternion[..., 3:]
    sine = np.linalg.norm(axis, axis=-1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        factor = np.where(sine > 1e-12, 2.0 * np.arctan2(sine, w) / sine, 2.0)
    return np.asarray(factor * axis)


def angle_rad(q: ArrayLike) -> Floats:
    """The rotation's angle, rad, 0 to pi."""
    quaternion = np.asarray(q, dtype=np.float64)
    sine = np.linalg.norm(quaternion[..., :3], axis=-1)
    return np.asarray(2.0 * np.arctan2(sine, np.abs(quaternion[..., 3])))


def to_matrix(q: ArrayLike) -> Floats:
    """Rotation matrices (…, 3, 3)."""
    x, y, z, w = _components(q)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def from_matrix(matrix: ArrayLike) -> Floats:
    """Quaternions of rotation matrices (…, 3, 3), w not negative (scipy's conversion)."""
    from scipy.spatial.transform import Rotation

    m = np.asarray(matrix, dtype=np.float64)
    flat = Rotation.from_matrix(m.reshape(-1, 3, 3)).as_quat(canonical=True)
    return np.asarray(flat, dtype=np.float64).reshape((*m.shape[:-2], 4))


def slerp(time_ns: NDArray[np.int64], q: ArrayLike, at_ns: NDArray[np.int64]) -> Floats:
    """Interpolate along the great arc: quaternions (n, 4) at increasing stamps (n,) to stamps (m,); NaN outside them.

    Whoever must not bridge a gap masks the result; a stamp that is in ``time_ns`` gets that very quaternion.
    """
    quaternion = np.asarray(q, dtype=np.float64)
    if len(time_ns) == 0:
        return np.full((len(at_ns), 4), np.nan)
    after = np.clip(np.searchsorted(time_ns, at_ns, side="right"), 1, max(len(time_ns) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(time_ns) - 1)
    span = np.maximum(time_ns[after] - time_ns[before], 1)
    part = (at_ns - time_ns[before]) / span
    result = _arc(quaternion[before], quaternion[after], part[:, np.newaxis])
    result[(at_ns < time_ns[0]) | (at_ns > time_ns[-1])] = np.nan
    return result


def _arc(a: Floats, b: Floats, part: Floats) -> Floats:
    cosine = np.sum(a * b, axis=-1, keepdims=True)
    b = np.where(cosine < 0.0, -b, b)
    half = np.arctan2(np.linalg.norm(b - a, axis=-1, keepdims=True), np.linalg.norm(b + a, axis=-1, keepdims=True))
    angle = 2.0 * half
    sine = np.sin(angle)
    near = sine < 1e-9
    with np.errstate(invalid="ignore", divide="ignore"):
        weight_a = np.where(near, 1.0 - part, np.sin((1.0 - part) * angle) / sine)
        weight_b = np.where(near, part, np.sin(part * angle) / sine)
    return normalize(weight_a * a + weight_b * b)


def _components(q: ArrayLike) -> tuple[Any, Any, Any, Any]:
    quaternion = np.asarray(q, dtype=np.float64)
    return quaternion[..., 0], quaternion[..., 1], quaternion[..., 2], quaternion[..., 3]
