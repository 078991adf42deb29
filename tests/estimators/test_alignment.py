"""First attitude and bias."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from attlog.estimators.alignment import _quaternion, align, heading_of, triad
from attlog.estimators.inputs import Inputs, prepare
from attlog.estimators.parameters import MargParameters
from attlog.geometry import frames, quaternions
from attlog.schemas.recording import Declination, Recording


def start_of(recording: Recording, **options: Any) -> Any:
    inputs = prepare(recording, MargParameters(), mag=True)
    return align(inputs, inputs.runs[0], **options)


def test_level_and_north_is_a_quarter_turn_in_enu() -> None:
    rotation, seen = triad(np.array([0.0, 0.0, 1.0]), np.array([20.0, 0.0, -40.0]), 0.0, 0.0)
    assert seen
    np.testing.assert_allclose(rotation, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)
    np.testing.assert_allclose(frames.rpy_ned_deg(quaternions.from_matrix(rotation)), [0, 0, 0], atol=1e-12)


@pytest.mark.parametrize("declination", [0.0, 12.0, -170.0])
def test_any_attitude_is_found_with_its_declination(declination: float) -> None:
    for q in Rotation.random(20, random_state=1).as_quat():
        up = quaternions.rotate(quaternions.conjugate(q), np.array([0.0, 0.0, 1.0]))
        north = np.array([math.sin(math.radians(declination)), math.cos(math.radians(declination)), -2.0])
        field = quaternions.rotate(quaternions.conjugate(q), north)
        rotation, _ = triad(up, field, 0.0, math.radians(declination))
        np.testing.assert_allclose(rotation, Rotation.from_quat(q).as_matrix(), atol=1e-14)


def test_without_a_field_the_heading_is_the_one_asked_for() -> None:
    for pitch in (-0.5, 0.0, 0.5):
        q = frames.orientation_from_rpy_ned(np.array([[0.3, pitch, 1.1]]))[0]
        up = quaternions.rotate(quaternions.conjugate(q), np.array([0.0, 0.0, 1.0]))
        rotation, seen = triad(up, None, 1.1, 0.3)
        assert not seen
        np.testing.assert_allclose(rotation, Rotation.from_quat(q).as_matrix(), atol=1e-14)
        assert heading_of(tuple(quaternions.from_matrix(rotation))) == pytest.approx(1.1)


@pytest.mark.parametrize("up_x", [1.0, -1.0])
def test_a_vertical_nose_or_field_still_gives_a_rotation(up_x: float) -> None:
    rotation, seen = triad(np.array([up_x, 0.0, 0.0]), np.array([-3.0 * up_x, 0.0, 0.0]), 0.0, 0.0)
    assert not seen
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(rotation) == pytest.approx(1.0)


def still(t: np.ndarray) -> np.ndarray:
    return np.tile(frames.orientation_from_rpy_ned(np.array([[0.1, -0.2, 0.7]])), (len(t), 1))


def test_rest_shows_the_bias(simulated: Any) -> None:
    bias = (0.01, -0.02, 0.015)
    run = simulated(attitude=still, seconds=3.0, bias=bias, gyro_sd=0.002, acc_sd=0.02, mag_sd=2e-7)
    start = start_of(run.recording)
    np.testing.assert_allclose(start.bias, bias, atol=4 * start.bias_sigma)
    assert start.bias_sigma < 0.002
    assert (
        np.degrees(quaternions.angle_rad(quaternions.multiply(start.orientation, quaternions.conjugate(run.truth[0]))))
        < 1
    )


def test_a_slow_turn_is_not_taken_for_a_bias(simulated: Any) -> None:
    for axis in np.eye(3):
        turn = lambda t, axis=axis: quaternions.from_rotation_vector(0.04 * t[:, None] * axis)  # noqa: E731
        run = simulated(attitude=turn, seconds=3.0)
        assert math.isnan(start_of(run.recording).bias_sigma)


def test_turning_and_shocks_do_no_harm(simulated: Any) -> None:
    run = simulated(seconds=5.0)
    imu = run.recording.imu[0]
    force = imu.specific_force.copy()
    force[5:45:6] += np.array([40.0, -60.0, 30.0])
    shaken = dataclasses.replace(run.recording, imu={0: dataclasses.replace(imu, specific_force=force)})
    start = start_of(shaken)
    error = quaternions.angle_rad(quaternions.multiply(start.orientation, quaternions.conjugate(run.truth[0])))
    assert np.degrees(error) < 0.5


def test_a_late_magnetometer_is_waited_for(simulated: Any) -> None:
    run = simulated(seconds=8.0)
    mag = run.recording.mag[0]
    late = dataclasses.replace(mag, time_ns=mag.time_ns[350::100], field=mag.field[350::100])
    start = start_of(dataclasses.replace(run.recording, mag={0: late}))
    error = quaternions.angle_rad(quaternions.multiply(start.orientation, quaternions.conjugate(run.truth[0])))
    assert np.degrees(error) < 0.5
    assert start.heading_sigma < 1.0


def test_declination_turns_the_first_heading(simulated: Any) -> None:
    run = simulated(seconds=3.0)
    east = dataclasses.replace(run.recording, declination=Declination(10.0, "test"))
    turned = frames.rpy_ned_deg(np.array(start_of(east).orientation)) - frames.rpy_ned_deg(run.truth[0])
    np.testing.assert_allclose(turned, [0, 0, 10], atol=0.1)


def test_inputs_of_one_sample_align(simulated: Any) -> None:
    run = simulated(t=np.array([0.0]))
    inputs: Inputs = prepare(run.recording, MargParameters(), mag=True)
    start = align(inputs, inputs.runs[0])
    assert np.isfinite(start.orientation).all()


def test_quaternions_of_matrices_are_scipys() -> None:
    for rotation in [
        *Rotation.random(50, random_state=2),
        *Rotation.from_euler("XYZ", np.pi * np.eye(3)),
        Rotation.identity(),
    ]:
        q = np.array(_quaternion(rotation.as_matrix()))
        expected = rotation.as_quat()
        assert min(np.abs(q - expected).max(), np.abs(q + expected).max()) < 1e-15
