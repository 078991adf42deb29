"""An affine map from one clock to another, on the envelope of pairs of which one member comes late."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

OUTLIER_NS: Final = 500_000_000
SHORTEST_NS: Final = 300_000_000_000
"""Below five minutes the drift of a crystal is less than the jitter of the pairs."""
STEEPEST: Final = 200e-6
"""More than any crystal drifts."""
BINS: Final = 256


@dataclass(frozen=True)
class Line:
    """Stamp = boot + offset + drift (boot - origin), all ns."""

    offset_ns: int
    drift: float = 0.0
    origin_ns: int = 0

    def at(self, boot_ns: Ints) -> Ints:
        """Stamps of the times ``boot_ns`` (n,)."""
        plain = boot_ns + self.offset_ns
        if self.drift == 0.0:
            return np.asarray(plain)
        return np.asarray(plain + np.rint(self.drift * (boot_ns - self.origin_ns)).astype(np.int64))

    def stamp(self, boot_ns: int) -> int:
        """The stamp of one time."""
        return boot_ns + self.offset_ns + round(self.drift * (boot_ns - self.origin_ns))


def median_offset(offset_ns: Ints) -> int | None:
    """The middle one, or None of none."""
    return int(np.median(offset_ns)) if len(offset_ns) else None


def fit(boot_ns: Ints, offset_ns: Ints) -> Line | None:
    """The line through the upper envelope of ``offset_ns`` over ``boot_ns`` (n,); None without a point.

    Of the lines that no point lies above, the one with the least sum of distances (Moon, Skelly, Towsley, INFOCOM
    1999, for clock skew from one-way delays): the edge of the convex hull over the mean time.
    """
    if len(boot_ns) == 0:
        return None
    near = np.abs(offset_ns - int(np.median(offset_ns))) < OUTLIER_NS
    boot, offset = boot_ns[near], offset_ns[near]
    top = int(offset.max()) if len(offset) else int(np.median(offset_ns))
    if len(boot) < 3 or int(boot.max() - boot.min()) < SHORTEST_NS:
        return Line(top)
    origin, base = int(boot.min()), int(np.median(offset))
    slope, height = edge((boot - origin).astype(np.float64), (offset - base).astype(np.float64))
    if abs(slope) > STEEPEST:
        return Line(top)
    return Line(base + round(height), slope, origin)


def edge(x: Floats, y: Floats) -> tuple[float, float]:
    """Slope and height at 0 of the upper convex hull's edge over the mean of ``x``, for points (n,), x >= 0."""
    across, up = _highest(x, y)
    if len(across) < 2:
        return 0.0, float(y.max())
    left, right = _edge(across, up, float(x.mean()))
    slope = float((up[right] - up[left]) / (across[right] - across[left]))
    return slope, float(up[left] - slope * across[left])


def _highest(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """The highest point of each of some equal spans of x, in order of x."""
    if np.any(x[1:] < x[:-1]):
        order = np.argsort(x, kind="stable")
        x, y = x[order], y[order]
    edges = np.unique(np.searchsorted(x, np.linspace(0.0, x[-1], BINS + 1)[1:-1]))
    parts = pairwise([0, *edges[(edges > 0) & (edges < len(x))].tolist(), len(x)])
    chosen = [start + int(y[start:stop].argmax()) for start, stop in parts]
    return x[chosen], y[chosen]


def _edge(x: Floats, y: Floats, middle: float) -> tuple[int, int]:
    """The two neighbours of the upper convex hull between which ``middle`` lies."""
    hull: list[int] = []
    for i in range(len(x)):
        while len(hull) > 1 and (y[hull[-1]] - y[hull[-2]]) * (x[i] - x[hull[-2]]) <= (y[i] - y[hull[-2]]) * (
            x[hull[-1]] - x[hull[-2]]
        ):
            hull.pop()
        hull.append(i)
    right = next((k for k in range(1, len(hull)) if x[hull[k]] >= middle), len(hull) - 1)
    return hull[right - 1], hull[right]
