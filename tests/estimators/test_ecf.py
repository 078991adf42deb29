"""The explicit complementary filter: its equations, its time constants, its care in flight."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from attlog import estimators
from attlog.geometry import frames, quaternions
from attlog.schemas.estimate import Status

PLAIN = "gate=inf,mag_gate=inf,heading_only=no,ki_start=0,start_gain=0"
"""The filter as its paper has it."""


def test_it_is_the_papers_recursion_step_by_step(simulated: Any) -> None:
    run = simulated(seconds=3.0, gyro_sd=0.1, acc_sd=0.5, mag_sd=2e-6)
    kp, ki, k2, k3 = 1.0, 0.127, 6.78, 3.54
    estimate = estimators.estimate(run.recording, f"ecf:{PLAIN},kp={kp},ki={ki},k_acc={k2},k_mag={k3}")
    imu, mag = run.recording.imu[0], run.recording.mag[0]
    R = Rotation.from_quat(estimate.orientation[0]).as_matrix()
    start = frames_of_start(run.recording)
    b, m0 = start.bias, np.array(start.field) / np.linalg.norm(start.field)
    for k in range(1, 300):
        dt = (imu.time_ns[k] - imu.time_ns[k - 1]) * 1e-9
        f, m = imu.specific_force[k], mag.field[k]
        w = k2 * np.cross(f / np.linalg.norm(f), R.T @ [0, 0, 1]) + k3 * np.cross(m / np.linalg.norm(m), R.T @ m0)
        R = R @ Rotation.from_rotvec((imu.angular_velocity[k] - b + kp * w) * dt).as_matrix()
        b = b - ki * w * dt
    np.testing.assert_allclose(Rotation.from_quat(estimate.orientation[299]).as_matrix(), R, atol=1e-12)
    np.testing.assert_allclose(estimate.gyro_bias[299], b, atol=1e-13)


def frames_of_start(recording: Any) -> Any:
    from attlog.estimators.alignment import align
    from attlog.estimators.inputs import prepare
    from attlog.estimators.parameters import MargParameters

    inputs = prepare(recording, MargParameters(), mag=True)
    return align(inputs, inputs.runs[0])


def still(t: np.ndarray) -> np.ndarray:
    return np.tile(frames.orientation_from_rpy_ned(np.array([[0.1, -0.2, 0.7]])), (len(t), 1))


@pytest.mark.parametrize("name", ["ecf", "ekf9"])
def test_at_rest_it_stays_where_it_began(simulated: Any, name: str) -> None:
    run = simulated(attitude=still, seconds=30.0)
    assert run.error_deg(estimators.estimate(run.recording, name).orientation).max() < 1e-6


@pytest.mark.parametrize("mag_hz", [None, 10.0, 3.0])
def test_a_turned_field_is_followed_at_the_gains_rate(simulated: Any, mag_hz: float | None) -> None:
    run = simulated(attitude=still, seconds=60.0, mag_hz=mag_hz)
    mag = run.recording.mag[0]
    later = mag.time_ns >= run.recording.imu[0].time_ns[1000]
    turned = mag.field.copy()
    body = quaternions.conjugate(run.truth[0])
    east = quaternions.rotate(
        quaternions.from_rotation_vector([0, 0, -0.1]), quaternions.rotate(run.truth[0], mag.field[0])
    )
    turned[later] = quaternions.rotate(body, east)
    recording = dataclasses.replace(run.recording, mag={0: dataclasses.replace(mag, field=turned)})
    estimate = estimators.estimate(recording, "ecf:ki=0,k_mag=0.1")
    yaw = np.radians(frames.rpy_ned_deg(estimate.orientation)[:, 2] - frames.rpy_ned_deg(run.truth)[:, 2])
    # A field turned by 0.1 rad to the east is a heading that seems 0.1 rad to the west. The gain is per cos(dip).
    rate = 0.1
    assert yaw[1000 + 1000] == pytest.approx(-0.1 * (1 - math.exp(-rate * 10.0)), rel=0.04)
    tilt = frames.rpy_ned_deg(estimate.orientation)[:, :2] - frames.rpy_ned_deg(run.truth)[:, :2]
    assert np.abs(tilt).max() < 1e-6


@pytest.mark.parametrize(("name", "close"), [("ecf", 0.006), ("ekf9", 0.0005)])
def test_the_bias_is_found(simulated: Any, name: str, close: float) -> None:
    run = simulated(seconds=200.0, bias=(0.02, -0.015, 0.01), gyro_sd=0.005, acc_sd=0.05, mag_sd=3e-7)
    estimate = estimators.estimate(run.recording, name)
    np.testing.assert_allclose(estimate.gyro_bias[-1], run.bias, atol=close)
    assert run.error_deg(estimate.orientation)[5000:].max() < 2.0
    np.testing.assert_allclose(
        estimate.angular_velocity[5000:], run.recording.imu[0].angular_velocity[5000:] - run.bias, atol=0.02
    )


@pytest.mark.parametrize(("name", "limit"), [("ecf", 4.0), ("ekf9", 3.0), ("ekf6", 3.0)])
def test_a_long_acceleration_tilts_it_little(simulated: Any, name: str, limit: float) -> None:
    run = simulated(attitude=still, seconds=60.0)
    imu = run.recording.imu[0]
    force = imu.specific_force.copy()
    force[2000:2300] += quaternions.rotate(quaternions.conjugate(run.truth[0]), np.array([8.0, 0.0, 0.0]))
    pushed = dataclasses.replace(run.recording, imu={0: dataclasses.replace(imu, specific_force=force)})
    estimate = estimators.estimate(pushed, name)
    tilt = frames.rpy_ned_deg(estimate.orientation)[:, :2] - frames.rpy_ned_deg(run.truth)[:, :2]
    assert np.abs(tilt).max() < limit
    assert (estimate.status[2200:2300] & Status.ACCELEROMETER_REJECTED).all()
    assert not (estimate.status[:2000] & Status.ACCELEROMETER_REJECTED).any()


@pytest.mark.parametrize("name", ["ecf", "ekf9"])
def test_a_magnet_passing_by_is_rejected(simulated: Any, name: str) -> None:
    run = simulated(attitude=still, seconds=60.0, mag_hz=20.0)
    mag = run.recording.mag[0]
    field = mag.field.copy()
    field[400:500] += np.array([30e-6, 10e-6, 5e-6])
    near = dataclasses.replace(run.recording, mag={0: dataclasses.replace(mag, field=field)})
    estimate = estimators.estimate(near, name)
    yaw = frames.rpy_ned_deg(estimate.orientation)[:, 2] - frames.rpy_ned_deg(run.truth)[:, 2]
    assert np.abs(yaw).max() < 2.0
    assert (estimate.status[2001:2495] & Status.MAGNETOMETER_REJECTED).sum() > 90
    assert not (estimate.status[:2000] & Status.MAGNETOMETER_REJECTED).any()


@pytest.mark.parametrize("name", ["ecf", "ekf9", "gyro", "ekf6", "accmag"])
def test_the_same_inputs_give_the_same_bytes(simulated: Any, name: str) -> None:
    recording = simulated(seconds=10.0, gyro_sd=0.01, acc_sd=0.1, mag_sd=1e-6).recording
    first, second = (estimators.estimate(recording, name) for _ in range(2))
    for field in dataclasses.fields(first):
        one, two = getattr(first, field.name), getattr(second, field.name)
        if isinstance(one, np.ndarray):
            assert one.tobytes() == two.tobytes(), field.name
        else:
            assert one == two


@pytest.mark.parametrize("name", ["ecf", "ekf9", "ekf6"])
def test_sampling_does_not_matter(simulated: Any, name: str) -> None:
    rng = np.random.default_rng(5)
    even = np.arange(0.0, 60.0, 0.005)
    jittered = np.sort(rng.choice(even[1:], 6000, replace=False))
    errors = []
    for stamps in (even, jittered):
        run = simulated(t=stamps, bias=(0.01, 0.0, -0.01))
        estimate = estimators.estimate(run.recording, name)
        tilt = (frames.rpy_ned_deg(estimate.orientation) - frames.rpy_ned_deg(run.truth))[:, :2]
        errors.append(np.sqrt(np.mean(tilt[len(stamps) // 2 :] ** 2)))
    assert errors[0] < 0.7
    assert errors[1] < 1.1 * errors[0] + 0.1
