"""Integration: exact where it can be, second order where it cannot."""

from typing import Any

import numpy as np

from attlog import estimators
from attlog.geometry import frames, quaternions
from attlog.schemas.estimate import North

HEADING = np.array([0.0, 0.0, 0.4])


def spin(t: np.ndarray) -> np.ndarray:
    """A constant body rate from a tilted start."""
    first = frames.orientation_from_rpy_ned(np.array([0.2, -0.1, 0.5]))
    return quaternions.multiply(first, quaternions.from_rotation_vector(t[:, None] * np.array([1.0, -2.0, 1.5])))


def test_a_constant_rate_is_exact(simulated: Any) -> None:
    uneven = np.cumsum(np.random.default_rng(3).uniform(0.001, 0.019, 3000))
    run = simulated(t=uneven, attitude=spin)
    estimate = estimators.estimate(run.recording, "gyro")
    first = run.error_deg(estimate.orientation)[0]
    assert np.abs(run.error_deg(estimate.orientation) - first).max() < 1e-4
    np.testing.assert_allclose(estimate.angular_velocity, np.tile([1.0, -2.0, 1.5], (3000, 1)), atol=1e-8)
    assert np.isnan(estimate.attitude_covariance).all()


def test_halving_the_interval_quarters_the_error(simulated: Any) -> None:
    ends = []
    for hz in (25.0, 50.0, 100.0):
        run = simulated(hz=hz, seconds=20.0)
        estimate = estimators.estimate(run.recording, "gyro:gyro_lag_s=0")
        # What the alignment missed is the same at every rate.
        first = quaternions.multiply(quaternions.conjugate(estimate.orientation[0]), run.truth[0])
        ends.append(run.error_deg(quaternions.multiply(estimate.orientation, first)).max())
    assert ends[1] < ends[0] / 3.0
    assert ends[2] < ends[1] / 3.0


def test_a_known_lag_is_made_up_for(simulated: Any) -> None:
    lag = 0.004
    stamps = np.arange(0.0, 20.0, 0.01)
    run = simulated(t=stamps)
    late = simulated(t=stamps - lag).recording.imu[0].angular_velocity
    imu = run.recording.imu[0]
    object.__setattr__(imu, "angular_velocity", late)
    errors = {
        s: run.error_deg(estimators.estimate(run.recording, f"gyro:gyro_lag_s={s}").orientation)[200:].mean()
        for s in (0.0, lag)
    }
    assert errors[lag] < 0.5 * errors[0.0]


def test_without_magnetometer_it_starts_north(simulated: Any) -> None:
    run = simulated(seconds=3.0)
    estimate = estimators.estimate(run.recording, "gyro:mag=none")
    assert estimate.north is North.ARBITRARY
    np.testing.assert_allclose(frames.rpy_ned_deg(estimate.orientation)[0, 2], 0.0, atol=0.01)
    tilt = frames.rpy_ned_deg(estimate.orientation)[:, :2] - frames.rpy_ned_deg(run.truth)[:, :2]
    assert np.abs(tilt).max() < 0.3
