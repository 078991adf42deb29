"""The EKF against a dense textbook filter, numerical derivatives and its own sigma."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from attlog import estimators
from attlog.estimators import ekf_kernel
from attlog.geometry import frames, quaternions

PLAIN = "gyro_lag_s=0,scale_error=0,rate_error=0,acc_motion=0"
"""White noise of the densities given and nothing else: what the Monte Carlo simulates."""
CONSTANTS = ekf_kernel.Constants(
    **dict.fromkeys(ekf_kernel.Constants._fields, 0.0) | {"gyro": 1e-4, "bias_walk": 1e-6, "north": (0.0, 1.0)}  # type: ignore[arg-type]
)


def dense(a: Any, x: Any, b: Any) -> np.ndarray:
    A = np.array([[a[0], a[1], a[2]], [a[1], a[3], a[4]], [a[2], a[4], a[5]]])
    B = np.array([[b[0], b[1], b[2]], [b[1], b[3], b[4]], [b[2], b[4], b[5]]])
    X = np.reshape(x, (3, 3))
    return np.block([[A, X], [X.T, B]])


def packed(P: np.ndarray) -> Any:
    upper = np.triu_indices(3)
    return tuple(P[:3, :3][upper]), tuple(P[:3, 3:].ravel()), tuple(P[3:, 3:][upper])


def random_covariance(seed: int) -> np.ndarray:
    root = np.random.default_rng(seed).standard_normal((6, 6)) * np.array([1, 1, 1, 0.1, 0.1, 0.1])[:, None]
    return root @ root.T


def test_prediction_is_the_textbooks_with_a_numerical_jacobian() -> None:
    rng = np.random.default_rng(2)
    q, b, w, dt = Rotation.random(random_state=3), 0.1 * rng.standard_normal(3), rng.standard_normal(3), 1e-3

    def moved(error: np.ndarray) -> np.ndarray:
        """How an error (world attitude, bias) before the step looks after it."""
        nominal = q * Rotation.from_rotvec((w - b) * dt)
        true = Rotation.from_rotvec(error[:3]) * q * Rotation.from_rotvec((w - b - error[3:]) * dt)
        return np.concatenate([(true * nominal.inv()).as_rotvec(), error[3:]])

    h = 1e-6
    F = np.stack([(moved(h * e) - moved(-h * e)) / (2 * h) for e in np.eye(6)], axis=1)
    R = (q * Rotation.from_rotvec((w - b) * dt)).as_matrix()
    np.testing.assert_allclose(F, np.block([[np.eye(3), -R * dt], [np.zeros((3, 3)), np.eye(3)]]), atol=3e-6)
    P = random_covariance(1)
    Q = np.diag([1e-4 * dt] * 3 + [1e-6 * dt] * 3)
    got = ekf_kernel.predict(CONSTANTS, packed(P), tuple(R.ravel()), 0.0, dt)
    F = np.block([[np.eye(3), -R * dt], [np.zeros((3, 3)), np.eye(3)]])
    np.testing.assert_allclose(dense(*got), F @ P @ F.T + Q, rtol=1e-12, atol=1e-12)


def test_measurement_rows_are_unit_rows() -> None:
    q = Rotation.random(random_state=7)
    up, north = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])

    def measured(error: np.ndarray) -> np.ndarray:
        true = Rotation.from_rotvec(error) * q
        force, field = q.apply(true.inv().apply(up)), q.apply(true.inv().apply(north))
        return np.array([force[1], -force[0], np.arctan2(field[0], field[1])])

    h = 1e-6
    H = np.stack([(measured(h * e) - measured(-h * e)) / (2 * h) for e in np.eye(3)], axis=1)
    np.testing.assert_allclose(H, np.eye(3), atol=1e-9)


def test_conditioning_is_the_textbooks() -> None:
    P, noise, z = random_covariance(4), 0.3, 0.7
    a, x, _ = packed(P)
    row = (a[1], a[3], a[4], x[3], x[4], x[5])
    got, d = ekf_kernel.condition(packed(P), row, a[3] + noise, z, (0.0,) * 6)
    H = np.eye(6)[1:2]
    K = P @ H.T / (P[1, 1] + noise)
    np.testing.assert_allclose(d, K[:, 0] * z, rtol=1e-13)
    np.testing.assert_allclose(dense(*got), P - K @ H @ P, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("y", [0.0, 1e-9, 0.01, -0.049, 0.051, 1.0, -20.0])
@pytest.mark.parametrize("x", [1.0, 0.5, -1.0, 0.0])
def test_angle_is_atan2(y: float, x: float) -> None:
    if x or y:
        assert ekf_kernel.angle(y, x) == pytest.approx(np.arctan2(y, x), abs=2e-13)


def one_error(simulated: Any, seed: int, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    hz, seconds = 100.0, 60.0
    gyro, acc, heading, bias_sd = 0.005, 0.05, 0.02, 0.01
    rng = np.random.default_rng(seed)
    run = simulated(
        hz=hz,
        seconds=seconds,
        bias=tuple(bias_sd * rng.standard_normal(3)),
        gyro_sd=gyro * np.sqrt(hz),
        acc_sd=acc * np.sqrt(hz),
        mag_sd=heading * np.sqrt(hz) * 20e-6,
        seed=seed,
    )
    options = f"{PLAIN},gyro_noise={gyro},bias_walk=0,bias_sigma={bias_sd},acc_noise={acc}"
    if name == "ekf9":
        options += f",mag_noise={heading},mag_excess=0"
    estimate = estimators.estimate(run.recording, f"{name}:{options}")
    error = quaternions.to_rotation_vector(quaternions.multiply(quaternions.conjugate(estimate.orientation), run.truth))
    rows = np.arange(1000, 6000, 250)
    P = estimate.state_covariance[rows].reshape(-1, 6, 6)
    e = np.concatenate([error, run.bias - estimate.gyro_bias], axis=1)[rows]
    rpy = frames.rpy_ned_deg(estimate.orientation) - frames.rpy_ned_deg(run.truth)
    return e, P, ((rpy + 180) % 360 - 180)[rows] / estimate.rpy_sigma_deg[rows]


def test_errors_fit_their_sigma(simulated: Any) -> None:
    nees, attitude, rpy = [], [], []
    for seed in range(25):
        e, P, angles = one_error(simulated, seed, "ekf9")
        nees.append(np.einsum("ni,ni->n", e, np.linalg.solve(P, e[..., None])[..., 0]))
        attitude.append(np.einsum("ni,ni->n", e[:, :3], np.linalg.solve(P[:, :3, :3], e[:, :3, None])[..., 0]))
        rpy.append(angles)
    assert 4.5 < np.mean(nees) < 8.0
    assert 2.3 < np.mean(attitude) < 4.0
    sigma = np.sqrt(np.mean(np.square(rpy), axis=(0, 1)))
    assert ((sigma > 0.8) & (sigma < 1.25)).all(), sigma


def test_tilt_and_its_bias_fit_their_sigma_without_magnetometer(simulated: Any) -> None:
    angles = np.array([one_error(simulated, seed, "ekf6")[2] for seed in range(25)])
    sigma = np.sqrt(np.mean(np.square(angles[..., :2]), axis=(0, 1)))
    assert ((sigma > 0.8) & (sigma < 1.25)).all(), sigma


def test_innovations_fit_their_covariance(simulated: Any) -> None:
    gyro, acc, heading, hz = 0.005, 0.05, 0.02, 100.0
    run = simulated(
        gyro_sd=gyro * np.sqrt(hz),
        acc_sd=acc * np.sqrt(hz),
        mag_sd=heading * np.sqrt(hz) * 20e-6,
        seconds=60.0,
        mag_hz=25.0,
    )
    options = f"{PLAIN},gyro_noise={gyro},acc_noise={acc},mag_noise={heading * 2},mag_excess=0"
    estimate = estimators.estimate(run.recording, f"ekf9:{options}")
    assert estimate.innovation_names == ("tilt_east", "tilt_north", "heading")
    S = estimate.innovation_covariance.reshape(-1, 3, 3)
    assert np.isnan(estimate.innovation[0]).all()
    measured = np.isfinite(estimate.innovation[:, 2])
    assert 0.24 < measured.mean() < 0.26
    assert np.isnan(S[~measured, 2, 2]).all()
    assert np.isfinite(S[1:, :2, :2]).all()
    tilt = estimate.innovation[1000:, :2] / np.sqrt(S[1000:, [0, 1], [0, 1]])
    assert np.sqrt(np.mean(tilt**2)) == pytest.approx(1.0, abs=0.05)


def test_what_it_writes_agrees_with_itself(simulated: Any) -> None:
    run = simulated(seconds=20.0, gyro_sd=0.01, acc_sd=0.1, mag_sd=1e-6)
    e = estimators.estimate(run.recording, "ekf9")
    full = e.state_covariance.reshape(-1, 6, 6)
    np.testing.assert_array_equal(full, full.transpose(0, 2, 1))
    np.testing.assert_array_equal(full[:, :3, :3].reshape(-1, 9), e.attitude_covariance)
    np.testing.assert_allclose(np.sqrt(full[:, [3, 4, 5], [3, 4, 5]]), e.bias_sigma, rtol=1e-6)
    np.testing.assert_array_equal(e.state[:, 3:], e.gyro_bias)
    assert (np.linalg.eigvalsh(full) > 0).all()
    assert e.state_names[:1] == ("attitude_error_x",)
    assert len(e.state_names) == e.state.shape[1] == 6
    # Roll, pitch and yaw sigma by propagating the right error numerically.
    rows = np.arange(500, 2000, 100)
    h = 1e-5
    J = np.stack(
        [
            np.radians(
                frames.rpy_ned_deg(
                    quaternions.multiply(e.orientation[rows], quaternions.from_rotation_vector(h * axis))
                )
                - frames.rpy_ned_deg(
                    quaternions.multiply(e.orientation[rows], quaternions.from_rotation_vector(-h * axis))
                )
            )
            / (2 * h)
            for axis in np.eye(3)
        ],
        axis=2,
    )
    P = full[rows, :3, :3]
    expected = np.degrees(np.sqrt(np.einsum("nij,njk,nik->ni", J, P, J)))
    np.testing.assert_allclose(e.rpy_sigma_deg[rows], expected, rtol=1e-4)


def test_ekf6_has_two_innovations_and_an_arbitrary_heading(simulated: Any) -> None:
    e = estimators.estimate(simulated(seconds=10.0).recording, "ekf6")
    assert e.innovation.shape == (1000, 2)
    assert e.innovation_covariance.shape == (1000, 4)
    assert e.inputs == ("/imu0/data_raw",)
    np.testing.assert_allclose(frames.rpy_ned_deg(e.orientation)[0, 2], 0.0, atol=0.01)


def test_it_recovers_from_a_field_that_lied_at_the_start(simulated: Any) -> None:
    run = simulated(seconds=120.0, mag_hz=20.0)
    mag = run.recording.mag[0]
    field = mag.field.copy()
    field[:60] = quaternions.rotate(quaternions.from_rotation_vector([0.3, 0.5, 1.5]), field[:60])
    recording = dataclasses.replace(run.recording, mag={0: dataclasses.replace(mag, field=field)})
    error = run.error_deg(estimators.estimate(recording, "ekf9").orientation)
    assert error[100] > 20.0
    assert error[-2000:].max() < 8.0
