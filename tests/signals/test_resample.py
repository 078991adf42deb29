"""Resampling against numpy, and its ends."""

import numpy as np

from attlog.signals.resample import linear, linear_angle, nearest


def test_linear_is_numpys() -> None:
    random = np.random.default_rng(0)
    stamps = np.cumsum(random.integers(1, 1000, 200))
    values = random.normal(size=200)
    at = np.sort(random.integers(stamps[0], stamps[-1], 500))
    assert np.abs(linear(stamps, values, at) - np.interp(at, stamps, values)).max() < 1e-12
    assert (linear(stamps, values, stamps) == values).all()
    assert (linear(stamps, np.stack([values, -values], axis=1), stamps)[:, 1] == -values).all()


def test_an_infinite_neighbour_does_not_spoil_a_sample() -> None:
    stamps = np.array([0, 10, 20])
    assert linear(stamps, np.array([1.0, np.inf, np.nan]), np.array([0, 10]))[0] == 1.0


def test_angles_take_the_short_way() -> None:
    stamps = np.array([0, 10])
    assert linear_angle(stamps, np.array([170.0, -170.0]), np.array([0, 5, 6, 10]), 360.0).tolist() == [
        170.0,
        180.0,
        -178.0,
        -170.0,
    ]


def test_nearest_takes_the_earlier_of_two() -> None:
    assert nearest(np.array([0, 10, 20]), np.array([-5, 4, 5, 6, 14, 25])).tolist() == [0, 0, 0, 1, 1, 2]
    assert nearest(np.array([7]), np.array([0, 9])).tolist() == [0, 0]
