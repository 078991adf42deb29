"""Quaternions and frames against scipy, and by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation, Slerp

from attlog.geometry import frames, quaternions

angle = st.floats(-np.pi, np.pi)
rpy = st.tuples(angle, st.floats(-1.5, 1.5), angle).map(np.array)
unit = arrays(np.float64, 4, elements=st.floats(-1, 1)).filter(lambda q: np.linalg.norm(q) > 0.1)
vector = arrays(np.float64, 3, elements=st.floats(-10, 10))

ENU_FROM_NED = Rotation.from_matrix([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
FLU_FROM_FRD = Rotation.from_matrix(np.diag([1, -1, -1]))


def same(a: np.ndarray, b: Rotation) -> bool:
    return bool(np.all((Rotation.from_quat(a).inv() * b).magnitude() < 1e-9))


@given(unit, unit, vector)
def test_multiply_and_rotate_are_scipys(a: np.ndarray, b: np.ndarray, v: np.ndarray) -> None:
    a, b = quaternions.normalize(a), quaternions.normalize(b)
    assert same(quaternions.multiply(a, b), Rotation.from_quat(a) * Rotation.from_quat(b))
    np.testing.assert_allclose(quaternions.rotate(a, v), Rotation.from_quat(a).apply(v), atol=1e-9)
    np.testing.assert_allclose(quaternions.to_matrix(a), Rotation.from_quat(a).as_matrix(), atol=1e-12)
    assert same(quaternions.from_matrix(quaternions.to_matrix(a)), Rotation.from_quat(a))


@given(vector)
def test_exp_and_log(v: np.ndarray) -> None:
    q = quaternions.from_rotation_vector(v)
    assert same(q, Rotation.from_rotvec(v))
    back = quaternions.to_rotation_vector(q)
    assert same(quaternions.from_rotation_vector(back), Rotation.from_rotvec(v))
    assert np.linalg.norm(back) == pytest.approx(float(quaternions.angle_rad(q)), abs=1e-9)


@given(rpy)
def test_euler_angles_are_those_of_ned_and_frd(angles: np.ndarray) -> None:
    q = frames.orientation_from_rpy_ned(angles)
    ned_from_frd = Rotation.from_euler("ZYX", angles[::-1])
    assert same(q, ENU_FROM_NED * ned_from_frd * FLU_FROM_FRD.inv())
    assert same(frames.ned_frd_from_enu_flu(q), ned_from_frd)
    again = frames.orientation_from_rpy_ned(np.radians(frames.rpy_ned_deg(q)))
    assert same(again, Rotation.from_quat(q))


def test_attitudes_by_hand() -> None:
    level_east = np.array([0.0, 0.0, 0.0, 1.0])  # body axes along east, north, up
    np.testing.assert_allclose(frames.rpy_ned_deg(level_east), [0, 0, 90], atol=1e-12)
    nose_up = Rotation.from_rotvec([0, -np.pi / 6, 0]).as_quat()  # about the left axis, backward
    np.testing.assert_allclose(frames.rpy_ned_deg(nose_up), [0, 30, 90], atol=1e-9)
    right_wing_down = Rotation.from_rotvec([np.pi / 6, 0, 0]).as_quat()
    np.testing.assert_allclose(frames.rpy_ned_deg(right_wing_down), [30, 0, 90], atol=1e-9)


def test_yaw_is_in_the_half_open_turn() -> None:
    south = frames.orientation_from_rpy_ned(np.array([[0, 0, np.pi], [0, 0, -np.pi]]))
    np.testing.assert_allclose(frames.rpy_ned_deg(south)[:, 2], 180.0)


@given(rpy, st.floats(-3, 3))
def test_turning_the_heading_adds_to_yaw_alone(angles: np.ndarray, turn: float) -> None:
    before = frames.rpy_ned_deg(frames.orientation_from_rpy_ned(angles))
    after = frames.rpy_ned_deg(frames.turn_heading(frames.orientation_from_rpy_ned(angles), turn))
    np.testing.assert_allclose(after[:2], before[:2], atol=1e-6)
    assert (after[2] - before[2] - np.degrees(turn) + 180) % 360 == pytest.approx(180, abs=1e-6)


@given(vector)
def test_frame_changes_of_vectors(v: np.ndarray) -> None:
    np.testing.assert_allclose(frames.enu_from_ned(v), ENU_FROM_NED.apply(v), atol=1e-12)
    np.testing.assert_allclose(frames.flu_from_frd(v), FLU_FROM_FRD.apply(v), atol=1e-12)


def test_slerp_is_scipys_and_never_leaves_the_data() -> None:
    rng = np.random.default_rng(4)
    stamps = np.sort(rng.choice(10_000, 50, replace=False)).astype(np.int64)
    turns = Rotation.random(50, random_state=5)
    at = np.linspace(stamps[0], stamps[-1], 400).astype(np.int64)
    assert same(quaternions.slerp(stamps, turns.as_quat(), at), Slerp(stamps, turns)(at))
    outside = quaternions.slerp(stamps, turns.as_quat(), np.array([stamps[0] - 1, stamps[-1] + 1]))
    assert np.isnan(outside).all()


@pytest.mark.parametrize("count", [0, 1])
def test_slerp_of_almost_nothing(count: int) -> None:
    q = np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))
    found = quaternions.slerp(np.arange(count, dtype=np.int64), q, np.array([0, 1], dtype=np.int64))
    assert np.isfinite(found[:, 0]).tolist() == [count == 1, False]
