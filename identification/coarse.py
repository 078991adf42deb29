"""About how far two clocks are apart: where the magnitudes of two angular rates agree best.

The magnitude does not depend on how a sensor is mounted. Masked normalised cross-correlation (D. Padfield, IEEE Trans.
Image Processing 21(5), 2012, doi:10.1109/TIP.2011.2181402): at every lag the correlation coefficient of the samples
that both have, all lags at once by FFT.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from .turning import Floats, Turning

GRID_S: Final = 0.02
MOST_POINTS: Final = 1 << 20
LEAST_OVERLAP: Final = 0.3
"""Of the shorter signal's samples; with fewer, chance agrees too easily."""
APART_S: Final = 1.0
"""Two lags nearer than this are one peak."""


def candidates(sensor: Turning, reference: Turning, count: int = 5) -> list[tuple[float, float]]:
    """The best lags: (seconds to add to the reference's time after its first stamp to get the sensor's after its own,
    correlation), best first; none where the two never vary together."""
    length = max(span_s(sensor), span_s(reference))
    grid = max(GRID_S, sensor.interval_s, reference.interval_s, length / MOST_POINTS)
    x, has_x = _magnitude(sensor, grid)
    y, has_y = _magnitude(reference, grid)
    lags, correlation = _masked_correlation(x, has_x, y, has_y)
    found: list[tuple[float, float]] = []
    apart = max(1, round(APART_S / grid))
    for _ in range(count):
        best = int(np.argmax(correlation))
        if correlation[best] <= 0.0:
            break
        found.append(((lags[best] + _vertex(correlation, best)) * grid, float(correlation[best])))
        correlation[max(0, best - apart) : best + apart + 1] = 0.0
    return found


def span_s(turning: Turning) -> float:
    """From the first to the last sample."""
    return float(turning.time_ns[-1] - turning.time_ns[0]) * 1e-9


def _magnitude(turning: Turning, grid: float) -> tuple[Floats, Floats]:
    """Mean rate's magnitude in each cell of the grid from the first sample on, and 1 where it is known, else 0."""
    zero = int(turning.time_ns[0])
    edges = np.arange(0.0, span_s(turning), grid)
    angle, run = turning.at(zero, edges)
    known = (run[1:] == run[:-1]) & (run[1:] >= 0)
    magnitude = np.linalg.norm(np.diff(angle, axis=0), axis=1) / grid
    return np.where(known, magnitude, 0.0), known.astype(np.float64)


def _masked_correlation(x: Floats, has_x: Floats, y: Floats, has_y: Floats) -> tuple[NDArray[np.int64], Floats]:
    size = fft.next_fast_len(len(x) + len(y), real=True)

    def across(a: Floats, b: Floats) -> Floats:
        product = fft.rfft(a, size) * np.conj(fft.rfft(b, size))
        return np.asarray(fft.irfft(product, size))

    n = across(has_x, has_y)
    number = np.maximum(n, 1.0)
    sum_x, sum_y = across(x, has_y), across(has_x, y)
    covariance = across(x, y) - sum_x * sum_y / number
    variance_x = across(x * x, has_y) - sum_x**2 / number
    variance_y = across(has_x, y * y) - sum_y**2 / number
    floor_x, floor_y = 1e-9 * float(np.sum(x * x)) + 1e-30, 1e-9 * float(np.sum(y * y)) + 1e-30
    enough = (n >= LEAST_OVERLAP * min(has_x.sum(), has_y.sum())) & (variance_x > floor_x) & (variance_y > floor_y)
    scale = np.sqrt(np.where(enough, variance_x * variance_y, 1.0))
    correlation = np.where(enough, covariance / scale, 0.0)
    lags = np.arange(size)
    lags = np.where(lags < len(x), lags, lags - size)
    order = np.argsort(lags)
    return lags[order], correlation[order]


def _vertex(values: Floats, peak: int) -> float:
    """Where between the neighbours the parabola through three values peaks."""
    if not 0 < peak < len(values) - 1:
        return 0.0
    left, top, right = values[peak - 1 : peak + 2]
    curvature = left - 2.0 * top + right
    return float(0.5 * (left - right) / curvature) if curvature < 0.0 else 0.0
