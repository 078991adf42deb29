"""Quaternions and Euler angles of a table as attitudes of the body FLU in ENU."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...geometry.frames import enu_flu_from_ned_frd
from ...geometry.quaternions import conjugate, multiply, normalize, rotate
from ...schemas.csv_options import AttitudeColumns, World
from ...schemas.errors import InputError, UsageError
from .guesses import Guess

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

NORM_TOLERANCE: Final = 0.01
STRAY: Final = 0.001
"""Where fewer than this part of the quaternions are not of unit norm, they alone are left out."""
UPRIGHT: Final = 0.9
"""Part of gravity that must point up in the world for axes to be believed."""
QUARTER_TURN: Final = np.array([0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)])
TURN_AXES: Final[Mapping[str, int]] = {"x": 0, "y": 1, "z": 2}


@dataclass(frozen=True, eq=False)
class Checked:
    """Unit quaternions (n, 4) as printed, x y z w; ``present`` (n,) those that are there, ``refused`` those that are
    not of unit norm."""

    orientation: Floats
    present: Mask
    refused: Mask


def quaternions(wxyz: Floats, allow_any_norm: bool, line: NDArray[np.int64], source: str) -> Checked:
    """Check the norms (n,); InputError where not only a few stray ones are off by more than `NORM_TOLERANCE`."""
    norm = np.linalg.norm(wxyz, axis=1)
    present = np.isfinite(norm) & (norm > 1e-9)
    off = present & (np.abs(norm - 1.0) > NORM_TOLERANCE)
    wrong = int(np.count_nonzero(off))
    if wrong > STRAY * np.count_nonzero(present) and not allow_any_norm:
        first = int(np.flatnonzero(off)[0])
        raise InputError(
            f"{source}, line {int(line[first]) + 1}: a quaternion has the norm {norm[first]:.4f}, not 1 ({wrong:,} of "
            f"{int(np.count_nonzero(present)):,} are off by over 1 %); give --normalize to scale them"
        )
    refused = np.zeros_like(off) if allow_any_norm else off
    return Checked(normalize(wxyz[:, [1, 2, 3, 0]]), present & ~refused, refused)


def from_euler(rpy_rad: Floats, order: str) -> Floats:
    """Quaternions of roll, pitch, yaw (n, 3) about x, y, z, in ``order`` of the turns about the moving axes."""
    from scipy.spatial.transform import Rotation

    if sorted(order) != ["x", "y", "z"]:
        raise UsageError(f"{order!r} is no order of Euler angles; it holds x, y and z once each, as in zyx")
    angles = rpy_rad[:, [TURN_AXES[axis] for axis in order]]
    finite = np.isfinite(angles).all(axis=1)
    result = np.full((len(angles), 4), np.nan)
    result[finite] = Rotation.from_euler(order.upper(), angles[finite]).as_quat()
    return result


def in_enu(q: Floats, world: World, inverse: bool) -> Floats:
    """Body FLU to ENU of quaternions (n, 4) that are given in the axes of ``world``."""
    q = conjugate(q) if inverse else q
    if world is World.NED:
        return enu_flu_from_ned_frd(q)
    return multiply(QUARTER_TURN, q) if world is World.NWU else q


def guess_axes(
    q: Floats, specific_force: Floats | None, usual: World, said: AttitudeColumns
) -> tuple[AttitudeColumns, Guess]:
    """The axes in which gravity points up, else the usual ones of such a column."""
    what = "axes of the attitude"
    if specific_force is None:
        return replace(said, world=usual), Guess(what, str(usual), "there is no accelerometer to check them with")
    other = World.NED if usual is World.ENU else World.ENU
    ways = [(world, inverse) for inverse in (said.inverse, not said.inverse) for world in (usual, other)]
    found = [(_upright(in_enu(q, world, inverse), specific_force), world, inverse) for world, inverse in ways]
    best = max(found, key=lambda way: round(way[0], 3))
    value = f"{best[1]}{' (world to body)' if best[2] else ''}"
    because = f"{best[0]:.1%} of the specific force then points up on average"
    if best[0] < UPRIGHT:
        return said, Guess(what, "none", f"at best {because}")
    return replace(said, world=best[1], inverse=best[2]), Guess(what, value, because)


def _upright(q: Floats, specific_force: Floats) -> float:
    in_world = rotate(q, specific_force)
    good = np.isfinite(in_world).all(axis=1)
    if not np.any(good):
        return 0.0
    return float(in_world[good, 2].mean() / np.linalg.norm(specific_force[good], axis=1).mean())
