"""The two pairs of frames, and the Euler angles that people read. Nothing else in attlog converts between frames.

attlog: world ENU (east, north, up; true north), body FLU (forward, left, up), quaternion body to world.
Autopilots: world NED, body FRD. Euler angles: ZYX roll, pitch, yaw of the body FRD in NED.
"""

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from .quaternions import Floats, conjugate, from_rotation_vector, multiply

_H: Final = np.sqrt(0.5)
ENU_FROM_NED: Final[Floats] = np.array([_H, _H, 0.0, 0.0])
"""Quaternion x y z w: half a turn about the axis between north and east."""
FRD_FROM_FLU: Final[Floats] = np.array([1.0, 0.0, 0.0, 0.0])
"""Quaternion x y z w: half a turn about the forward axis."""


def flu_from_frd(vector: ArrayLike) -> Floats:
    """Body vectors (…, 3): forward right down to forward left up. Its own inverse."""
    return np.asarray(np.asarray(vector, dtype=np.float64) * np.array([1.0, -1.0, -1.0]))


frd_from_flu = flu_from_frd


def enu_from_ned(vector: ArrayLike) -> Floats:
    """World vectors (…, 3): north east down to east north up. Its own inverse."""
    v = np.asarray(vector, dtype=np.float64)
    return np.asarray(v[..., [1, 0, 2]] * np.array([1.0, 1.0, -1.0]))


ned_from_enu = enu_from_ned


def enu_flu_from_ned_frd(q: ArrayLike) -> Floats:
    """Quaternions (…, 4): body FRD to NED becomes body FLU to ENU."""
    return multiply(multiply(ENU_FROM_NED, q), FRD_FROM_FLU)


def ned_frd_from_enu_flu(q: ArrayLike) -> Floats:
    """Quaternions (…, 4): body FLU to ENU becomes body FRD to NED."""
    return multiply(multiply(conjugate(ENU_FROM_NED), q), conjugate(FRD_FROM_FLU))


def rpy_ned_deg(orientation: ArrayLike) -> Floats:
    """Roll, pitch, yaw (…, 3) in degrees, of quaternions (…, 4) body FLU to ENU. Yaw is in (-180, 180]."""
    q = np.asarray(orientation, dtype=np.float64)
    x, y, z, w = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    # Rows of the ENU-from-FLU matrix, read in NED and FRD: nose to north and east, and the vertical in the body.
    north, east = 2 * (x * y + z * w), 1 - 2 * (y * y + z * z)
    up_x, up_y, up_z = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)
    roll = np.arctan2(up_y, up_z)
    pitch = np.arctan2(up_x, np.hypot(up_y, up_z))
    yaw = np.arctan2(east, north)
    angles = np.degrees(np.stack([roll, pitch, yaw], axis=-1))
    return np.where(angles <= -180.0, 180.0, angles)


def orientation_from_rpy_ned(rpy: ArrayLike) -> Floats:
    """Quaternions (…, 4) body FLU to ENU, of ZYX roll, pitch, yaw (…, 3) in rad of the body FRD in NED."""
    return enu_flu_from_ned_frd(_zyx(np.asarray(rpy, dtype=np.float64)))


def _zyx(rpy: Floats) -> Floats:
    """The product of yaw, pitch and roll, multiplied out."""
    half = 0.5 * rpy
    (cr, cp, cy), (sr, sp, sy) = np.moveaxis(np.cos(half), -1, 0), np.moveaxis(np.sin(half), -1, 0)
    result = np.empty((*rpy.shape[:-1], 4))
    result[..., 0] = sr * cp * cy - cr * sp * sy
    result[..., 1] = cr * sp * cy + sr * cp * sy
    result[..., 2] = cr * cp * sy - sr * sp * cy
    result[..., 3] = cr * cp * cy + sr * sp * sy
    return result


def turn_heading(orientation: ArrayLike, angle_rad: ArrayLike) -> Floats:
    """Add ``angle_rad`` to the NED yaw of quaternions (…, 4) body FLU to ENU: a turn about the world's vertical.

    An attitude whose heading counts from magnetic north becomes one from true north by adding the declination.
    """
    down = -np.asarray(angle_rad, dtype=np.float64)[..., np.newaxis] * np.array([0.0, 0.0, 1.0])
    return multiply(from_rotation_vector(down), orientation)


def remove_trim(orientation: ArrayLike, trim_rad: ArrayLike) -> Floats:
    """Attitudes of the autopilot's own frame, from ones that ArduPilot logs after AHRS_TRIM.

    ArduPilot turns the attitude by the trim, R_logged = R R(trim)^T with R(trim) of roll and pitch trim (3,) in rad,
    body FRD (AP_AHRS, "rotation_autopilot_body_to_vehicle_body").
    """
    trim = _zyx(np.asarray(trim_rad, dtype=np.float64))
    return enu_flu_from_ned_frd(multiply(ned_frd_from_enu_flu(orientation), trim))
