"""What is said about a component of the error: a handful of numbers over the samples that count."""

from dataclasses import dataclass, fields
from typing import Final

import numpy as np
from numpy.typing import NDArray

COMPONENTS: Final = ("total", "inclination", "heading", "roll", "pitch", "yaw")
"""The components of an attitude error, in the order of attlog_msgs/msg/ErrorStatistics."""
EULER: Final = ("roll", "pitch", "yaw")


@dataclass(frozen=True)
class Statistics:
    """Of one component, in its own unit (degrees); NaN where ``count`` is 0.

    ``sd`` is the population's, sqrt(mean((x - mean)^2)), divided by n and not by n - 1: successive errors of a filter
    are correlated, so n - 1 would promise what it cannot hold, and rmse^2 = mean^2 + sd^2 holds as it stands.
    ``median``, ``p95`` and ``max`` are those of the absolute value.
    """

    count: int
    rmse: float
    sd: float
    mean: float
    median: float
    p95: float
    max: float


NUMBERS: Final = tuple(field.name for field in fields(Statistics))


def statistics(values: NDArray[np.float64]) -> Statistics:
    """Over the finite ones of ``values`` (n,)."""
    finite = values[np.isfinite(values)]
    if len(finite) == 0:
        return Statistics(0, *[float("nan")] * (len(NUMBERS) - 1))
    mean = float(np.mean(finite))
    deviation = finite - mean
    variance = float(np.mean(deviation * deviation))
    size = np.abs(finite)
    median, p95 = (float(x) for x in np.percentile(size, (50.0, 95.0), overwrite_input=True))
    rmse = float(np.sqrt(mean * mean + variance))
    return Statistics(len(finite), rmse, float(np.sqrt(variance)), mean, median, p95, float(size.max()))
