"""Where interpolation is allowed."""

import numpy as np

from attlog.signals.interpolation import covered, median_interval_ns


def test_between_samples_but_not_across_gaps_or_beyond_the_ends():
    stamps = np.array([0, 10, 20, 46, 56, 66])
    at = np.array([-1, 0, 5, 20, 21, 45, 46, 66, 67])
    np.testing.assert_array_equal(covered(stamps, at), [False, True, True, True, False, False, True, True, False])
    np.testing.assert_array_equal(covered(stamps, at, gap_intervals=2.6), [False, *[True] * 7, False])


def test_few_samples():
    at = np.array([4, 5, 6])
    np.testing.assert_array_equal(covered(np.array([], dtype=np.int64), at), [False] * 3)
    np.testing.assert_array_equal(covered(np.array([5]), at), [False, True, False])
    assert np.isnan(median_interval_ns(np.array([5])))
    assert median_interval_ns(np.array([0, 10, 20, 50])) == 10.0
