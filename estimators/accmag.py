"""Accelerometer and magnetometer alone, each sample by itself: TRIAD with gravity as the first vector.

    up = f / |f|,  east = m x up / |m x up|,  north = up x east,  R = [east north up]^T turned by the declination

H. D. Black, A passive system for determining the attitude of a satellite, AIAA Journal 2(7), 1964,
doi:10.2514/3.2555. No memory and no gyro, so no drift and no smoothing: every acceleration tilts it. The field is
interpolated between magnetic samples; across more than `MAG_LIMIT_S`, or outside them, the nearest one is held and the
status says that the magnetometer is missing.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..geometry.quaternions import from_matrix
from ..schemas.estimate import Estimate, Status
from ..schemas.recording import Recording
from .inputs import Inputs, prepare
from .output import result
from .parameters import MargParameters
from .registry import Estimator

MAG_LIMIT_S = 0.5

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Parameters(MargParameters):
    """Nothing to tune."""


def run(recording: Recording, parameters: Parameters) -> Estimate:
    """Raises MissingSensorError without the IMU or the magnetometer. Rows that no frame fits (free fall, vertical
    field) hold the attitude before them."""
    inputs = prepare(recording, parameters, mag=True, needs_mag=True)
    field, missing = _interpolated(inputs)
    inputs.status[missing] |= np.uint32(Status.MAGNETOMETER_MISSING)
    frames, good = triads(inputs.specific_force, field, math.radians(inputs.declination_deg))
    inputs.status[~good] |= np.uint32(Status.COASTING)
    held = np.maximum.accumulate(np.where(good, np.arange(len(good)), 0))
    frames = frames[held]
    return result("accmag", inputs, {"orientation": from_matrix(frames)})


def triads(force: Floats, field: Floats, declination: float) -> tuple[Floats, NDArray[np.bool_]]:
    """Body-to-world matrices (n, 3, 3) of forces and fields (n, 3); identity, and False, where no frame fits."""
    with np.errstate(all="ignore"):
        up = force / np.linalg.norm(force, axis=1, keepdims=True)
        east = np.cross(field, up)
        good = np.linalg.norm(east, axis=1) > 1e-6 * np.linalg.norm(field, axis=1)
        east = east / np.linalg.norm(east, axis=1, keepdims=True)
        north = np.cross(up, east)
        c, s = math.cos(declination), math.sin(declination)
        frames = np.stack([c * east + s * north, c * north - s * east, up], axis=1)
    frames[~good] = np.eye(3)
    return frames, good


def _interpolated(inputs: Inputs) -> tuple[Floats, NDArray[np.bool_]]:
    stamps, times = inputs.mag_time_ns, inputs.time_ns
    origin = times[0]
    at, known = (times - origin) * 1e-9, (stamps - origin) * 1e-9
    field = np.stack([np.interp(at, known, inputs.field[:, i]) for i in range(3)], axis=1)
    after = np.searchsorted(stamps, times)
    before = np.maximum(after - 1, 0)
    after = np.minimum(after, len(stamps) - 1)
    wide = known[after] - known[before] > MAG_LIMIT_S
    far = np.minimum(np.abs(at - known[before]), np.abs(at - known[after])) > MAG_LIMIT_S
    nearest = np.where(np.abs(at - known[before]) < np.abs(at - known[after]), before, after)
    exact = stamps[after] == times
    field[wide & ~exact] = inputs.field[nearest[wide & ~exact]]
    return field, (wide & ~exact) | far


ESTIMATOR = Estimator(
    "accmag",
    Parameters,
    run,
    needs_mag=True,
    summary="accelerometer and magnetometer, sample by sample (TRIAD)",
    source="Black 1964, doi:10.2514/3.2555",
)
