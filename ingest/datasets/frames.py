"""The two constant rotations between a motion-capture reference and an IMU, from the recording itself.

    R = R_W R_ref R_B                                                                                   (1)

R_B turns the sensor's axes into those of the marker body, R_W the capture's world into one with z up. With the body
rates of both, w_ref = R_B w_gyro, R_B is the solution of Wahba's problem (Kabsch, Acta Cryst. A32, 1976,
doi:10.1107/S0567739476001873), and R_W the shortest turn that brings the mean specific force upright. The heading stays
arbitrary.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...geometry.quaternions import (
    conjugate,
    from_matrix,
    from_rotation_vector,
    multiply,
    rotate,
    slerp,
    to_rotation_vector,
)
from ...schemas.columns import Time
from ...signals.interpolation import covered

Floats = NDArray[np.float64]

IDENTITY: Final = np.array([0.0, 0.0, 0.0, 1.0])
STEP_NS: Final = 50_000_000
"""Rates are compared as mean rates over this long, which evens out delays and held values."""
MIN_EXCITATION: Final = 0.02
"""Part of the largest principal rate that the second one must reach, or R_B cannot be told."""
MIN_RATE: Final = 0.1
"""rad/s; the largest principal rate must be above it, RMS."""


@dataclass(frozen=True, eq=False)
class Frames:
    """R_W and R_B (4,) of (1); ``residual`` is the RMS of w_ref - R_B w_gyro, rad/s, NaN where R_B cannot be told."""

    world: Floats
    body: Floats
    residual: float

    def applied_to(self, reference: Floats) -> Floats:
        """(1) for quaternions (n, 4)."""
        return multiply(multiply(self.world, reference), self.body)


def frames(imu_ns: Time, rate: Floats, force: Floats, reference_ns: Time, reference: Floats) -> Frames:
    """R_W and R_B from rate and specific force (n, 3), rad/s and m/s^2, and a reference (m, 4) on the same clock."""
    body, residual = _body(imu_ns, rate, reference_ns, reference)
    inside = covered(reference_ns, imu_ns)
    if not np.any(inside):
        return Frames(IDENTITY, body, residual)
    at = slerp(reference_ns, reference, imu_ns[inside])
    up = rotate(multiply(at, body), force[inside]).mean(axis=0)
    return Frames(_upright(up), body, residual)


def _body(imu_ns: Time, rate: Floats, reference_ns: Time, reference: Floats) -> tuple[Floats, float]:
    edges = np.arange(max(imu_ns[0], reference_ns[0]), min(imu_ns[-1], reference_ns[-1]), STEP_NS)
    if len(edges) < 4:
        return IDENTITY, float("nan")
    q = slerp(reference_ns, reference, edges)
    turned = to_rotation_vector(multiply(conjugate(q[:-1]), q[1:])) / (STEP_NS * 1e-9)
    felt = np.diff(_integral(imu_ns, rate, edges), axis=0) / (STEP_NS * 1e-9)
    seen = covered(reference_ns, edges)
    good = seen[1:] & seen[:-1]
    if np.count_nonzero(good) < 4:
        return IDENTITY, float("nan")
    # The gyroscope's bias goes out with the means.
    turned, felt = turned[good] - turned[good].mean(axis=0), felt[good] - felt[good].mean(axis=0)
    u, size, vt = np.linalg.svd(turned.T @ felt / len(felt))
    if size[0] < MIN_RATE**2 or size[1] < MIN_EXCITATION * size[0]:
        return IDENTITY, float("nan")
    matrix = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt))]) @ vt
    residual = turned - felt @ matrix.T
    return from_matrix(matrix), float(np.sqrt(np.mean(np.sum(residual**2, axis=1))))


def _integral(time_ns: Time, values: Floats, at_ns: Time) -> Floats:
    """The running integral of samples (n, 3), by trapezoids, at stamps (m,)."""
    steps = np.diff(time_ns) * 1e-9
    sums = np.concatenate(
        [np.zeros((1, 3)), np.cumsum(0.5 * (values[1:] + values[:-1]) * steps[:, np.newaxis], axis=0)]
    )
    base = time_ns[0]
    return np.stack([np.interp(at_ns - base, time_ns - base, sums[:, axis]) for axis in range(3)], axis=1)


def _upright(up: Floats) -> Floats:
    """The shortest turn that brings ``up`` (3,) onto z."""
    axis = np.cross(up, [0.0, 0.0, 1.0])
    sine, cosine = float(np.linalg.norm(axis)), float(up[2])
    if sine == 0.0:
        return IDENTITY if cosine >= 0.0 else np.array([1.0, 0.0, 0.0, 0.0])
    return from_rotation_vector(axis / sine * np.arctan2(sine, cosine))
