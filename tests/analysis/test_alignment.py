"""Constant rotations: recovered exactly, removed exactly, sensible where the motion does not show them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from attlog.analysis.alignment import Alignment, constant_rotation, wrap_deg
from attlog.geometry.frames import turn_heading

ANGLE = st.floats(-np.pi, np.pi)
VECTOR = st.tuples(*[st.floats(-2.0, 2.0)] * 3)


def motion(seed, count=80):
    rng = np.random.default_rng(seed)
    angles = np.cumsum(rng.normal(0, 0.3, (count, 3)), axis=0)
    return Rotation.from_euler("zyx", angles)


def residual_deg(found, estimate, reference):
    left = Rotation.from_quat(found.removed_from(estimate)) * Rotation.from_quat(reference).inv()
    return np.degrees(left.magnitude())


@settings(deadline=None, max_examples=100)
@given(seed=st.integers(0, 2**32 - 1), angle=ANGLE)
def test_a_constant_yaw_is_recovered(seed, angle):
    reference = motion(seed).as_quat()
    found = constant_rotation(Alignment.YAW, turn_heading(reference, angle), reference)
    assert abs(float(wrap_deg(found.heading_deg - np.degrees(angle)))) < 1e-9
    assert residual_deg(found, turn_heading(reference, angle), reference).max() < 1e-6


@settings(deadline=None, max_examples=100)
@given(seed=st.integers(0, 2**32 - 1), world=VECTOR, body=VECTOR, signs=st.integers(0, 2**32 - 1))
def test_world_and_body_rotations_are_recovered(seed, world, body, signs):
    reference = motion(seed)
    w, b = Rotation.from_rotvec(world), Rotation.from_rotvec(body)
    estimate = (w * reference * b).as_quat() * np.random.default_rng(signs).choice([-1.0, 1.0], (80, 1))
    found = constant_rotation(Alignment.FULL, estimate, reference.as_quat())
    assert residual_deg(found, estimate, reference.as_quat()).max() < 1e-6
    assert (Rotation.from_quat(found.world) * w.inv()).magnitude() < 1e-7
    assert (Rotation.from_quat(found.body) * b.inv()).magnitude() < 1e-7


@pytest.mark.parametrize("seed", range(5))
def test_full_minimises_what_it_says(seed):
    """No neighbour has a smaller sum of sin^2(a/2), by a numerical optimiser that knows nothing of SO(4)."""
    rng = np.random.default_rng(seed)
    reference = motion(seed)
    true = Rotation.from_rotvec(rng.normal(0, 1, 3)), Rotation.from_rotvec(rng.normal(0, 1, 3))
    noise = Rotation.from_rotvec(rng.normal(0, 0.3, (80, 3)))
    estimate = true[0] * reference * true[1] * noise
    found = constant_rotation(Alignment.FULL, estimate.as_quat(), reference.as_quat())

    def cost(x):
        w, b = Rotation.from_quat(found.world), Rotation.from_quat(found.body)
        left = (Rotation.from_rotvec(x[:3]) * w).inv() * estimate * (b * Rotation.from_rotvec(x[3:])).inv()
        return np.sum(np.sin((left * reference.inv()).magnitude() / 2) ** 2)

    best = minimize(cost, np.zeros(6), method="Nelder-Mead", options={"xatol": 1e-7, "fatol": 1e-12, "maxfev": 4000})
    assert cost(np.zeros(6)) <= best.fun + 1e-9


@pytest.mark.parametrize("seed", range(5))
def test_yaw_minimises_what_it_says(seed):
    reference = motion(seed)
    noise = Rotation.from_rotvec(np.random.default_rng(seed).normal(0, 0.5, (80, 3)))
    estimate = (reference * noise).as_quat()
    found = constant_rotation(Alignment.YAW, estimate, reference.as_quat())

    def cost(turn):
        return np.sum(
            np.sin(np.radians(residual_deg(found, turn_heading(estimate, turn), reference.as_quat())) / 2) ** 2
        )

    assert cost(0.0) <= min(cost(turn) for turn in (-1e-3, 1e-3, -0.1, 0.1, 1.0, 3.0))


def test_at_rest_the_smallest_rotations_are_taken():
    """One attitude cannot tell world from body: half the turn each is the least, and the residual is none."""
    reference = np.tile([0.0, 0, 0, 1], (50, 1))
    estimate = np.tile(Rotation.from_rotvec([0, 0, 0.4]).as_quat(), (50, 1))
    found = constant_rotation(Alignment.FULL, estimate, reference)
    assert residual_deg(found, estimate, reference).max() < 1e-6
    np.testing.assert_allclose(found.world_deg + found.body_deg, [0, 0, np.degrees(0.4)], atol=1e-6)
    assert np.linalg.norm(found.world_deg) < 23.0
    assert np.linalg.norm(found.body_deg) < 23.0


def test_rotation_about_one_axis_leaves_no_residual():
    turn = Rotation.from_rotvec(np.linspace(0, 12, 200)[:, None] * [0, 0, 1.0])
    w, b = Rotation.from_rotvec([0.1, -0.2, 0.3]), Rotation.from_rotvec([-0.2, 0.3, 0.5])
    estimate = (w * turn * b).as_quat()
    found = constant_rotation(Alignment.FULL, estimate, turn.as_quat())
    assert residual_deg(found, estimate, turn.as_quat()).max() < 1e-4


def test_nothing_to_align_is_no_rotation():
    for kind in Alignment:
        found = constant_rotation(kind, np.empty((0, 4)), np.empty((0, 4)))
        assert found.heading_deg == 0.0
        np.testing.assert_array_equal(found.body_deg, 0.0)
