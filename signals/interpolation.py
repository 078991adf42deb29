"""Where a sampled signal may be interpolated: between samples, but not across gaps and never beyond its ends."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

GAP_INTERVALS: Final = 2.5
"""A pause of more than this many median intervals is a gap."""


def median_interval_ns(time_ns: NDArray[np.int64]) -> float:
    """Median of the intervals between increasing stamps (n,); NaN for fewer than two."""
    return float(np.median(np.diff(time_ns))) if len(time_ns) > 1 else float("nan")


def covered(
    time_ns: NDArray[np.int64], at_ns: NDArray[np.int64], gap_intervals: float = GAP_INTERVALS
) -> NDArray[np.bool_]:
    """Which stamps (m,) lie on a sample or between two samples (n,), strictly increasing, that no gap parts."""
    if len(time_ns) == 0:
        return np.zeros(len(at_ns), dtype=np.bool_)
    before = np.searchsorted(time_ns, at_ns, side="right") - 1
    inside = (before >= 0) & (at_ns <= time_ns[-1])
    interval = np.diff(time_ns, append=time_ns[-1])
    bridged = interval > gap_intervals * np.median(interval[:-1]) if len(time_ns) > 1 else interval > 0
    on_sample = time_ns[before] == at_ns
    return np.asarray(inside & (on_sample | ~bridged[before]))
