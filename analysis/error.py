"""The error of an attitude estimate: against a reference, at the estimate's own stamps.

With E = R_est R_ref^T in the world ENU, as a quaternion e:

    total       = 2 atan2(|e_xyz|, |e_w|)                 the angle of E
    inclination = 2 atan2(|e_xy|, |e_zw|)                 between the two verticals; = 2 acos sqrt(e_w^2 + e_z^2)
    heading     = -2 atan2(e_z, e_w), wrapped             the rest, about the vertical; the minus makes it a NED yaw
    roll, pitch, yaw: differences of the ZYX angles of body FRD in NED, wrapped to (-180, 180]

E = (rotation by inclination about a horizontal axis) (rotation by heading about the vertical), so that an error of the
heading reads the same at every attitude, which a difference of yaw does not.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..geometry.frames import rpy_ned_deg
from ..geometry.quaternions import conjugate, multiply, normalize, slerp
from ..schemas.columns import Time
from ..schemas.errors import UsageError
from ..schemas.estimate import North
from ..schemas.recording import Attitude
from ..signals.interpolation import covered
from .alignment import Alignment, ConstantRotation, constant_rotation, wrap_deg
from .summary import COMPONENTS, EULER, Statistics, statistics

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
Span = tuple[int, int]
"""Nanoseconds, half open: [start, end)."""

MAX_PITCH_DEG: Final = 85.0
"""Nearer to the vertical than this, roll and yaw of the reference mean little: drawn, not counted."""
_BLOCK: Final = 1 << 14


@dataclass(frozen=True)
class ErrorOptions:
    """What to compare and how. Spans are half open, nanoseconds on the log's clock."""

    alignment: Alignment = Alignment.NONE
    exclude: tuple[Span, ...] = ()
    start_ns: int | None = None
    end_ns: int | None = None


@dataclass(frozen=True)
class Counts:
    """What became of the estimate's samples between start and end.

    ``samples`` = ``counted`` + ``not_finite`` + ``without_reference`` + ``excluded``; of the counted ones,
    ``near_vertical`` do not count for roll, pitch and yaw.
    """

    samples: int
    counted: int
    not_finite: int
    without_reference: int
    excluded: int
    near_vertical: int


@dataclass(frozen=True, eq=False)
class AttitudeError:
    """Errors in degrees at ``time_ns`` (n,), the estimate's stamps from start to end.

    ``degrees`` (n, 6) in the order of `COMPONENTS`, NaN where there is no reference. ``counted`` (n,): samples in the
    statistics; ``euler_counted`` (n,): those in the statistics of roll, pitch and yaw. ``removed`` is the constant
    rotation that was taken out of the estimate first.
    """

    estimate: Attitude
    reference: Attitude
    options: ErrorOptions
    removed: ConstantRotation
    time_ns: Time
    degrees: Floats
    counted: Mask
    euler_counted: Mask
    counts: Counts

    def __getitem__(self, component: str) -> Floats:
        """One component (n,), degrees."""
        return self.degrees[:, COMPONENTS.index(component)]

    @cached_property
    def statistics(self) -> Mapping[str, Statistics]:
        """Of each component, over the samples that count."""
        masks = {name: self.euler_counted if name in EULER else self.counted for name in COMPONENTS}
        return {name: statistics(self[name][mask]) for name, mask in masks.items()}


def default_alignment(estimate: Attitude, reference: Attitude) -> Alignment:
    """``yaw`` where the heading of either counts from nowhere (metadata north = arbitrary), else ``none``."""
    arbitrary = any(side.metadata.get("north") == North.ARBITRARY for side in (estimate, reference))
    return Alignment.YAW if arbitrary else Alignment.NONE


def attitude_error(
    estimate: Attitude,
    reference: Attitude,
    *,
    alignment: Alignment | str | None = None,
    exclude: Iterable[Span] = (),
    start_ns: int | None = None,
    end_ns: int | None = None,
) -> AttitudeError:
    """Compare ``estimate`` with ``reference``, interpolated by slerp to the estimate's stamps.

    The reference is bridged over at most 2.5 of its median intervals and never extrapolated. ``alignment`` None means
    `default_alignment`. ``exclude`` and the time outside [``start_ns``, ``end_ns``) neither count nor take part in the
    alignment; excluded samples keep their error, to be drawn. UsageError for an unknown alignment or a backward span.
    """
    kind = default_alignment(estimate, reference) if alignment is None else _alignment(alignment)
    options = ErrorOptions(kind, tuple(_checked(span) for span in exclude), start_ns, end_ns)
    estimate_at = _between(estimate, start_ns, end_ns)
    at_ns, q_est = estimate_at.time_ns, normalize(estimate_at.orientation)
    q_ref = _reference_at(reference, at_ns)

    finite = np.isfinite(q_est).all(axis=1)
    referred = np.isfinite(q_ref[:, 0])
    excluded = _within(at_ns, options.exclude)
    counted = finite & referred & ~excluded
    removed = constant_rotation(kind, q_est[counted], q_ref[counted])
    degrees = np.empty((len(at_ns), len(COMPONENTS)), order="F")
    near_vertical = np.zeros(len(at_ns), dtype=np.bool_)
    for part in _blocks(len(at_ns)):
        near_vertical[part] = _compare(removed.removed_from(q_est[part]), q_ref[part], degrees[part])
    counts = Counts(
        samples=len(at_ns),
        counted=int(counted.sum()),
        not_finite=int((~finite).sum()),
        without_reference=int((finite & ~referred).sum()),
        excluded=int((finite & referred & excluded).sum()),
        near_vertical=int((counted & near_vertical).sum()),
    )
    euler_counted = counted & ~near_vertical
    return AttitudeError(estimate, reference, options, removed, at_ns, degrees, counted, euler_counted, counts)


def _compare(q_est: Floats, q_ref: Floats, degrees: Floats) -> Mask:
    """Fill ``degrees`` (n, 6); tell where the reference is too near to the vertical for roll and yaw."""
    x, y, z, w = np.moveaxis(multiply(q_est, conjugate(q_ref)), -1, 0)
    level, upright = x * x + y * y, z * z + w * w
    degrees[:, 0] = np.degrees(2.0 * np.arctan2(np.sqrt(level + z * z), np.abs(w)))
    degrees[:, 1] = np.degrees(2.0 * np.arctan2(np.sqrt(level), np.sqrt(upright)))
    degrees[:, 2] = wrap_deg(-2.0 * np.degrees(np.arctan2(z, w)))
    reference = rpy_ned_deg(q_ref)
    degrees[:, 3:] = wrap_deg(rpy_ned_deg(q_est) - reference)
    return np.abs(reference[:, 1]) > MAX_PITCH_DEG


def _reference_at(reference: Attitude, at_ns: Time) -> Floats:
    """The reference's attitudes (m, 4) at ``at_ns``; NaN where it has none."""
    time_ns, first = np.unique(reference.time_ns, return_index=True)
    orientation = normalize(reference.orientation[first])
    known = np.isfinite(orientation).all(axis=1)
    time_ns, orientation = time_ns[known], orientation[known]
    result = np.empty((len(at_ns), 4))
    for part in _blocks(len(at_ns)):
        result[part] = slerp(time_ns, orientation, at_ns[part])
    result[~covered(time_ns, at_ns)] = np.nan
    return result


def _blocks(count: int) -> Iterator[slice]:
    """Pieces whose intermediate arrays stay in the processor's cache."""
    return (slice(start, start + _BLOCK) for start in range(0, count, _BLOCK))


def _between(attitude: Attitude, start_ns: int | None, end_ns: int | None) -> Attitude:
    if start_ns is None and end_ns is None:
        return attitude
    lowest, highest = np.iinfo(np.int64).min, np.iinfo(np.int64).max
    span = (lowest if start_ns is None else start_ns, highest if end_ns is None else end_ns)
    inside = _within(attitude.time_ns, [_checked(span)])
    return replace(attitude, time_ns=attitude.time_ns[inside], orientation=attitude.orientation[inside])


def _within(at_ns: Time, spans: Iterable[Span]) -> Mask:
    inside = np.zeros(len(at_ns), dtype=np.bool_)
    for start_ns, end_ns in spans:
        inside |= (at_ns >= start_ns) & (at_ns < end_ns)
    return inside


def _checked(span: Span) -> Span:
    start_ns, end_ns = span
    if end_ns < start_ns:
        raise UsageError(f"a span of time ends before it starts: {start_ns} to {end_ns} ns; swap the two")
    return int(start_ns), int(end_ns)


def _alignment(name: Alignment | str) -> Alignment:
    try:
        return Alignment(name)
    except ValueError:
        raise UsageError(f"no alignment {name!r}; there are: {', '.join(Alignment)}") from None
