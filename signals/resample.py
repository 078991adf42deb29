"""A sampled signal at other instants: by straight lines, or the nearest sample. `covered` says where it is known."""

import numpy as np
from numpy.typing import NDArray

Times = NDArray[np.int64]
Floats = NDArray[np.float64]


def bracket(time_ns: Times, at_ns: Times) -> tuple[NDArray[np.intp], NDArray[np.intp], Floats]:
    """Samples before and after each instant (m,), of strictly increasing stamps (n,), n at least 1, and the part of the
    way between them, 0 to 1; beyond the ends the outermost sample."""
    after = np.clip(np.searchsorted(time_ns, at_ns, side="right"), 1, max(len(time_ns) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(time_ns) - 1)
    span = np.maximum(time_ns[after] - time_ns[before], 1)
    return before, after, np.clip((at_ns - time_ns[before]) / span, 0.0, 1.0)


def linear(time_ns: Times, values: Floats, at_ns: Times) -> Floats:
    """Values (n,) or (n, k) at the instants (m,); a stamp that is in ``time_ns`` gets that very value."""
    before, after, part = bracket(time_ns, at_ns)
    part = part.reshape(-1, *[1] * (values.ndim - 1))
    low, high = values[before], values[after]
    with np.errstate(invalid="ignore"):
        blend = low + (high - low) * part
    return np.asarray(np.where(part == 0.0, low, np.where(part == 1.0, high, blend)))


def linear_angle(time_ns: Times, values: Floats, at_ns: Times, turn: float) -> Floats:
    """As `linear`, of angles (n,) that repeat with ``turn``, the short way round; within (-turn/2, turn/2]."""
    before, after, part = bracket(time_ns, at_ns)
    step = values[after] - values[before]
    step = step - turn * np.round(step / turn)
    angle = values[before] + step * part
    return np.asarray(np.where(part == 1.0, values[after], angle - turn * np.ceil(angle / turn - 0.5)))


def nearest(time_ns: Times, at_ns: Times) -> NDArray[np.intp]:
    """Which sample (n,) is nearest to each instant (m,); of two as near the earlier."""
    before, after, part = bracket(time_ns, at_ns)
    return np.where(part > 0.5, after, before)
