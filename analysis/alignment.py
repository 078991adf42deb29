"""The constant rotation between a reference and an estimate: found by least squares, and taken out.

An estimate may differ from its reference by constants that are no errors of the filter: another north, a reference
whose world is not levelled, a sensor mounted askew in the body that the reference follows:

    R_est,k = R_W R_ref,k R_B                                                                           (1)

``yaw`` looks for R_W alone, about the vertical; ``full`` for R_W and R_B, the hand-eye problem (Zhuang, Roth, Sudhakar,
IEEE T-RA 10(4), 1994, doi:10.1109/70.313105). Both minimise the residual angles a_k in the chordal sense:

    min sum ||R_est,k - R_W R_ref,k R_B||_F^2 = min 8 sum sin^2(a_k / 2) = min 8 sum (1 - c_k^2)        (2)
    c_k = q_est,k . (w q_ref,k b) = q_est,k . M q_ref,k,   M = L(w) R(b), a rotation of R^4             (3)

With m = vec M, sum c_k^2 = m' C m and C = sum p_k p_k', p_k = vec(q_est,k q_ref,k'): 16 x 16 numbers hold all the data,
and the quaternions' signs drop out. m starts at C's leading eigenvector; M <- the rotation nearest to unvec(C m)
(orthogonal Procrustes: Schoenemann, Psychometrika 31, 1966, doi:10.1007/BF02289451) then never lowers the sum, which
is convex in M. M splits into w and b since its isoclinic parts are the rank-one matrix w b' (van Elfrinkhof 1897;
Mebius 2005, arXiv:math/0501249). Where the motion does not tell R_W and R_B apart (rest, a single axis), a vanishing
weight on M = 1 picks the smaller rotations.
"""

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..geometry.quaternions import conjugate, multiply, normalize, to_rotation_vector

Floats = NDArray[np.float64]

IDENTITY: Final[Floats] = np.array([0.0, 0.0, 0.0, 1.0])
PRIOR: Final = 1e-12
"""Weight of M = 1 per sample: above rounding, below any motion."""
MAX_ITERATIONS: Final = 500
_BLOCK: Final = 1 << 14


class Alignment(StrEnum):
    """Which constant rotation is removed before errors are counted."""

    NONE = "none"
    YAW = "yaw"
    FULL = "full"


@dataclass(frozen=True, eq=False)
class ConstantRotation:
    """R_est = R_W R_ref R_B: ``world`` and ``body`` (4,), quaternions x y z w in ENU and in the body FLU."""

    world: Floats = field(default_factory=lambda: IDENTITY)
    body: Floats = field(default_factory=lambda: IDENTITY)

    @property
    def heading_deg(self) -> float:
        """Part of the world rotation about the vertical, degrees, signed as NED yaw."""
        return float(wrap_deg(-2.0 * np.degrees(np.arctan2(self.world[2], self.world[3]))))

    @property
    def world_deg(self) -> Floats:
        """Rotation vector (3,) of the world rotation, degrees, ENU."""
        return np.degrees(to_rotation_vector(self.world))

    @property
    def body_deg(self) -> Floats:
        """Rotation vector (3,) of the body rotation, degrees, body FLU."""
        return np.degrees(to_rotation_vector(self.body))

    def removed_from(self, orientation: Floats) -> Floats:
        """Estimates (n, 4) as they were without this rotation: R_W' R_est R_B'."""
        for part, turn in ((self.world, _from_left), (self.body, _from_right)):
            if not np.array_equal(part, IDENTITY):
                orientation = turn(orientation, conjugate(part))
        return orientation


def wrap_deg(angle: Floats | float) -> Floats:
    """Degrees brought into (-180, 180]."""
    return np.asarray(angle - 360.0 * np.ceil((np.asarray(angle) - 180.0) / 360.0))


def constant_rotation(kind: Alignment, estimate: Floats, reference: Floats) -> ConstantRotation:
    """The rotation of ``kind`` that fits unit quaternions (n, 4) of the same instants best; identity for n = 0."""
    if len(estimate) == 0:
        return ConstantRotation()
    return _FITS[kind](estimate, reference)


def _nothing(estimate: Floats, reference: Floats) -> ConstantRotation:
    return ConstantRotation()


def _yaw(estimate: Floats, reference: Floats) -> ConstantRotation:
    """(2) over R_W = turn by psi about up: sum (e_w cos psi/2 + e_z sin psi/2)^2 is largest at psi below."""
    e = multiply(estimate, conjugate(reference))
    z, w = e[:, 2], e[:, 3]
    half = 0.5 * np.arctan2(2.0 * np.sum(z * w), np.sum(w * w - z * z))
    return ConstantRotation(world=np.array([0.0, 0.0, np.sin(half), np.cos(half)]))


def _full(estimate: Floats, reference: Floats) -> ConstantRotation:
    moments = _moments(estimate, reference)
    turn = _nearest_rotation(np.linalg.eigh(moments)[1][:, -1].reshape(4, 4))
    for _ in range(MAX_ITERATIONS):
        better = _nearest_rotation((moments @ turn.ravel()).reshape(4, 4) / len(estimate))
        change = float(np.abs(better - turn).max())
        turn = better
        if change < 1e-15:
            break
    return _split(turn)


def _moments(estimate: Floats, reference: Floats) -> Floats:
    total = np.zeros((16, 16))
    for start in range(0, len(estimate), _BLOCK):
        part = slice(start, start + _BLOCK)
        products = (estimate[part, :, np.newaxis] * reference[part, np.newaxis, :]).reshape(-1, 16)
        total += products.T @ products
    return total


def _nearest_rotation(matrix: Floats) -> Floats:
    """The M of SO(4) with the largest tr(M' matrix), and of the two signs the one nearer to the identity."""
    u, _, vt = np.linalg.svd(_signed(matrix) + PRIOR * np.eye(4))
    u[:, -1] *= np.sign(np.linalg.det(u) * np.linalg.det(vt))
    return _signed(u @ vt)


def _signed(matrix: Floats) -> Floats:
    return matrix if np.trace(matrix) >= 0.0 else -matrix


def _split(turn: Floats) -> ConstantRotation:
    """w and b of M q = w q b. tr(M' L(e_i) R(e_j)) / 4 = w_i b_j, whose singular vectors are w and b."""
    basis = np.eye(4)
    products = np.array([[[multiply(multiply(i, q), j) for q in basis] for j in basis] for i in basis])
    u, _, vt = np.linalg.svd(np.einsum("ijqr,rq->ij", products, turn) / 4.0)
    world, body = u[:, 0], vt[0]
    sign = 1.0 if world[3] >= 0.0 else -1.0
    return ConstantRotation(normalize(sign * world), normalize(sign * body))


def _from_left(orientation: Floats, turn: Floats) -> Floats:
    return multiply(turn, orientation)


def _from_right(orientation: Floats, turn: Floats) -> Floats:
    return multiply(orientation, turn)


_FITS = {Alignment.NONE: _nothing, Alignment.YAW: _yaw, Alignment.FULL: _full}
