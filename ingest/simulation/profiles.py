"""Smooth functions of time from a few numbers: what a pilot is told to hold, and for how long."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

Floats = NDArray[np.float64]
DEGREE = 5
"""Quintic: four continuous derivatives."""


@dataclass(frozen=True, eq=False)
class Profile:
    """A B-spline with its derivatives; constant before its first and after its last knot's reach."""

    spline: BSpline
    reach_s: tuple[float, float]

    def __call__(self, time_s: Floats, derivative: int = 0) -> Floats:
        """Value or derivative at ``time_s`` (n,)."""
        values: Floats = self.spline(np.clip(time_s, *self.reach_s), nu=derivative)
        return values

    def integral(self) -> "Profile":
        """The antiderivative that is 0 at the beginning."""
        area = self.spline.antiderivative()
        return Profile(BSpline(area.t, area.c - area(self.reach_s[0]), area.k), self.reach_s)


def held(durations_s: Floats, values: Floats, blend_s: float) -> Profile:
    """Hold ``values`` (n,) for ``durations_s`` (n,) each, passing from one to the next within about 3 ``blend_s``.

    The values are the control points of a uniform B-spline with knots ``blend_s`` apart: where six successive ones are
    equal the profile is that value exactly, between two values it never overshoots, and its integral is kept. Ends at
    the value 0 only if the first and last values are 0.
    """
    ends = np.cumsum(durations_s)
    pad = DEGREE + 1
    count = int(np.ceil(ends[-1] / blend_s)) + 1 + 2 * pad
    at_s = (np.arange(count) - pad) * blend_s
    control = values[np.clip(np.searchsorted(ends, at_s, side="right"), 0, len(values) - 1)]
    knots = (np.arange(count + DEGREE + 1) - pad - (DEGREE + 1) / 2) * blend_s
    return Profile(BSpline(knots, control, DEGREE), (float(knots[DEGREE]), float(knots[-DEGREE - 1])))
