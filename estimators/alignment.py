"""Where an estimate starts: attitude from gravity and the magnetic field of the first moments, bias from rest.

1. Rest: over the first 1.5 s the gyro and the accelerometer hardly vary, and the directions of gravity and field stay
   put although the mean rate would have turned them. Then the mean rate is the bias.
2. Vectors of a window are brought into the first sample's frame by the gyro, so that turning does no harm; the median
   of each component withstands shocks. The window is 0.5 s if its force is as long as gravity, else 2 s, in which
   vibration and most accelerations average out.
3. TRIAD: up from the force, magnetic east from field x up; the declination turns the heading to true north.
"""

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .inputs import Inputs, Run

GRAVITY = 9.80665
WINDOWS_S = (0.5, 2.0)
GRAVITY_TOLERANCE = 0.03
MAG_WAIT_S = 5.0
"""How long a start waits for the first magnetic sample of a slow or late magnetometer."""
MAG_SIGMA = 0.1
REST_S = 1.5
REST_RATE = 0.05
REST_RATE_VERTICAL = 0.02
REST_RATE_SPREAD = 0.05
REST_FORCE_SPREAD = 0.5
REST_TURN_FORCE, REST_TURN_FIELD = 0.002, 0.008
"""Change of direction, rad, that the sensors' own noise makes at rest."""
REST_SIGMA = 5e-4

Floats = NDArray[np.float64]
Vector: TypeAlias = tuple[float, float, float]
Quaternion: TypeAlias = tuple[float, float, float, float]


@dataclass(frozen=True)
class Start:
    """First attitude and bias, with standard deviations in rad and rad/s; ``field`` in the world, None without one.

    ``heading_sigma`` is 0 for a heading that is set, not measured; pi where one will be measured later.
    ``bias_sigma`` is NaN where no rest showed the bias.
    """

    orientation: Quaternion
    bias: Vector
    field: Vector | None
    tilt_sigma: float
    heading_sigma: float
    bias_sigma: float


def align(inputs: Inputs, run: Run, *, heading: float = 0.0, bias: Vector | None = None) -> Start:
    """Start a run. ``heading``: NED yaw, rad, where the magnetometer gives none; ``bias``: known from before a gap."""
    still, sigma = (None, math.nan) if bias is not None else _rest(inputs, run)
    known = bias if bias is not None else still if still is not None else (0.0, 0.0, 0.0)
    up = np.array([0.0, 0.0, 1.0])
    deviation = spread = 1.0
    for window_s in WINDOWS_S:
        forces, fields = _window(inputs, run, window_s, known)
        force = _median(forces)
        length = _length(force)
        if length > 0.0:
            up, deviation = force / length, abs(length / GRAVITY - 1.0)
            spread = float(_median(np.abs(forces - force)).max()) / GRAVITY
        if deviation < GRAVITY_TOLERANCE:
            break
    field = _median(fields) if len(fields) else None
    rotation, seen = triad(up, field, heading, math.radians(inputs.declination_deg))
    tilt_sigma = min(0.01 + deviation + spread, 1.0)
    world = _vector(rotation @ field) if field is not None and seen else None
    heading_sigma = MAG_SIGMA if seen else math.pi if inputs.has_mag else 0.0
    return Start(_quaternion(rotation), known, world, tilt_sigma, heading_sigma, sigma)


def triad(up: Floats, field: Floats | None, heading: float, declination: float) -> tuple[Floats, bool]:
    """Body-to-world matrix (3, 3) of the direction up (3,) and the field (3,), both in the body, rad.

    Without a field, or with a vertical one, ``heading`` (NED yaw) is taken; the second result says which it was.
    """
    north = None
    if field is not None:
        east = _cross(field, up)
        if _length(east) > 1e-6 * _length(field):
            north, angle = _cross(up, east), declination
    seen = north is not None
    if north is None:
        nose = np.array([1.0, 0.0, 0.0]) if abs(up[0]) < 0.999 else np.array([0.0, 0.0, -math.copysign(1.0, up[0])])
        north, angle = nose - (nose @ up) * up, heading
    north = north / _length(north)
    east = _cross(north, up)
    c, s = math.cos(angle), math.sin(angle)
    # The first row is east, the second north: what lies at the angle east of north is what `north` points to.
    return np.stack([c * east + s * north, c * north - s * east, up]), seen


def heading_of(q: Quaternion) -> float:
    """NED yaw of the nose, rad."""
    x, y, z, w = q
    return math.atan2(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + z * w))


def _rest(inputs: Inputs, run: Run) -> tuple[Vector | None, float]:
    """Bias of a body at rest and its standard deviation; None if it does not rest."""
    first, last = _span(inputs, run, REST_S)
    rate, force = inputs.angular_velocity[first:last], inputs.specific_force[first:last]
    duration_s = float(inputs.time_ns[last - 1] - inputs.time_ns[first]) * 1e-9
    if len(rate) < 10 or duration_s < 0.8 * REST_S:
        return None, math.nan
    mean, spread = rate.mean(axis=0), rate.std(axis=0)
    if _length(mean) > REST_RATE or spread.max() > REST_RATE_SPREAD:
        return None, math.nan
    if force.std(axis=0).max() > REST_FORCE_SPREAD or _moves(force, mean, duration_s, REST_TURN_FORCE):
        return None, math.nan
    rows = slice(*np.searchsorted(inputs.mag_time_ns, inputs.time_ns[[first, last - 1]]))
    field = inputs.field[rows]
    if len(field) >= 4:
        if _moves(field, mean, duration_s, REST_TURN_FIELD):
            return None, math.nan
    elif abs(mean @ force.mean(axis=0)) > REST_RATE_VERTICAL * GRAVITY:
        return None, math.nan
    return _vector(mean), REST_SIGMA + float(spread.max()) / math.sqrt(len(rate))


def _moves(vectors: Floats, rate: Floats, duration_s: float, noise: float) -> bool:
    """Whether a direction changes from the first half to the second as a true rate would make it."""
    half = len(vectors) // 2
    early, late = (part / _length(part) for part in (vectors[:half].mean(axis=0), vectors[half:].mean(axis=0)))
    return _length(late - early) > noise + 0.3 * _length(_cross(rate, early)) * duration_s / 2.0


def _window(inputs: Inputs, run: Run, window_s: float, bias: Vector) -> tuple[Floats, Floats]:
    from .alignment_kernel import unturned

    first, last = _span(inputs, run, window_s)
    rows = _mag_rows(inputs, run, first, last)
    if rows.stop > rows.start:  # a late magnetometer: turn back from its own stamp
        last = max(last, min(run.last, int(np.searchsorted(inputs.time_ns, inputs.mag_time_ns[rows.stop - 1])) + 1))
    part = slice(first, last)
    forces, fields = unturned(
        inputs.time_ns[part],
        inputs.angular_velocity[part],
        inputs.specific_force[part],
        bias,
        inputs.mag_time_ns[rows],
        inputs.field[rows],
    )
    return forces[: _span(inputs, run, window_s)[1] - first], fields


def _mag_rows(inputs: Inputs, run: Run, first: int, last: int) -> slice:
    """Magnetic samples of the window, or the first one behind it within `MAG_WAIT_S` and the run."""
    stamps, times = inputs.mag_time_ns, inputs.time_ns
    start = int(np.searchsorted(stamps, times[first]))
    stop = int(np.searchsorted(stamps, times[last - 1], side="right"))
    latest = min(int(times[first]) + int(MAG_WAIT_S * 1e9), int(times[run.last - 1]))
    if stop <= start and start < len(stamps) and stamps[start] <= latest:
        stop = start + 1
    return slice(start, max(start, stop))


def _span(inputs: Inputs, run: Run, window_s: float) -> tuple[int, int]:
    end = inputs.time_ns[run.first] + int(window_s * 1e9)
    return run.first, min(run.last, max(run.first + 1, int(np.searchsorted(inputs.time_ns, end, side="right"))))


def _quaternion(rotation: Floats) -> Quaternion:
    """Of one matrix, from its largest component (Shepperd 1978, doi:10.2514/3.55767b); scipy's call costs 0.2 ms."""
    r = rotation.tolist()
    squares = [r[0][0], r[1][1], r[2][2], r[0][0] + r[1][1] + r[2][2]]
    i = squares.index(max(squares))
    q = [0.0, 0.0, 0.0, 0.0]
    if i == 3:
        q = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1], 1.0 + squares[3]]
    else:
        j, k = (i + 1) % 3, (i + 2) % 3
        q[i] = 1.0 + r[i][i] - r[j][j] - r[k][k]
        q[j], q[k], q[3] = r[i][j] + r[j][i], r[i][k] + r[k][i], r[k][j] - r[j][k]
    size = math.hypot(*q)
    return (q[0] / size, q[1] / size, q[2] / size, q[3] / size)


def _vector(values: Floats) -> Vector:
    x, y, z = values.tolist()
    return (x, y, z)


def _median(vectors: Floats) -> Floats:
    """Of each component, (n, 3) to (3,); numpy's own takes ten times as long for a few vectors."""
    ordered = np.sort(vectors, axis=0)
    return np.asarray(0.5 * (ordered[(len(ordered) - 1) // 2] + ordered[len(ordered) // 2]))


def _cross(a: Floats, b: Floats) -> Floats:
    """a x b of single vectors, as above."""
    (x, y, z), (u, v, w) = a.tolist(), b.tolist()
    return np.array([y * w - z * v, z * u - x * w, x * v - y * u])


def _length(v: Floats) -> float:
    return math.hypot(*v.tolist())
