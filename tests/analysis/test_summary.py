"""The numbers, against numpy and by hand."""

import numpy as np
import pytest

from attlog.analysis import statistics


def test_by_hand():
    numbers = statistics(np.array([1.0, -3.0, np.nan, 5.0]))
    assert numbers.count == 3
    assert numbers.mean == pytest.approx(1.0)
    assert numbers.rmse == pytest.approx(np.sqrt(35 / 3))
    assert numbers.sd == pytest.approx(np.sqrt(35 / 3 - 1))
    assert (numbers.median, numbers.max) == (3.0, 5.0)


def test_against_numpy():
    values = np.random.default_rng(0).normal(3, 2, 10_001)
    numbers = statistics(values)
    assert numbers.sd == pytest.approx(np.std(values), rel=1e-12)
    assert numbers.rmse == pytest.approx(np.sqrt(np.mean(values**2)), rel=1e-12)
    assert numbers.rmse**2 == pytest.approx(numbers.mean**2 + numbers.sd**2, rel=1e-12)
    assert numbers.p95 == pytest.approx(np.percentile(np.abs(values), 95))
    assert numbers.median == pytest.approx(np.median(np.abs(values)))


def test_a_small_spread_far_from_zero_keeps_its_digits():
    values = 1e6 + np.array([-1e-3, 1e-3] * 500)
    assert statistics(values).sd == pytest.approx(1e-3, rel=1e-6)


@pytest.mark.parametrize("values", [[], [np.nan, np.nan]])
def test_no_sample_no_numbers(values):
    numbers = statistics(np.array(values, dtype=np.float64))
    assert numbers.count == 0
    assert np.isnan(numbers.rmse)
    assert np.isnan(numbers.max)
