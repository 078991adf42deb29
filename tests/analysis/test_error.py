"""attitude_error against scipy, hand-solved cases and identities."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from attlog.analysis import Alignment, attitude_error, default_alignment
from attlog.geometry.frames import orientation_from_rpy_ned, rpy_ned_deg, turn_heading
from attlog.schemas import Attitude, UsageError

MS = 1_000_000


def times(count, interval_ms=100):
    return np.arange(count, dtype=np.int64) * interval_ms * MS


def attitude(time_ns, orientation, name="estimate", **metadata):
    topic = "/reference/attitude" if name == "truth" else f"/estimate/{name}/attitude"
    return Attitude(np.asarray(time_ns), np.asarray(orientation, dtype=np.float64), name, topic, metadata)


def from_deg(*rpy):
    return orientation_from_rpy_ned(np.radians(np.array(rpy, dtype=np.float64)))


def wander(count, seed=0, step=0.2):
    """A random walk on the rotations: quaternions (count, 4)."""
    steps = Rotation.from_rotvec(np.random.default_rng(seed).normal(0.0, step, (count, 3)))
    total, walk = Rotation.random(rng=np.random.default_rng(seed)), []
    for one in steps:
        total = total * one
        walk.append(total.as_quat())
    return np.array(walk)


def test_constant_offsets_are_read_back():
    reference = attitude(times(4), from_deg([0, 0, 0], [10, 5, 170], [-30, 20, 90], [3, -4, -179]), "truth")
    offset = np.array([1.0, -2.0, 3.0])
    estimate = attitude(times(4), orientation_from_rpy_ned(np.radians(rpy_ned_deg(reference.orientation) + offset)))
    error = attitude_error(estimate, reference)
    np.testing.assert_allclose(error.degrees[:, 3:], np.tile(offset, (4, 1)), atol=1e-9)
    assert error.counts.counted == 4
    assert error.statistics["yaw"].mean == pytest.approx(3.0)
    assert error.statistics["yaw"].sd == pytest.approx(0.0, abs=1e-9)
    assert error.statistics["pitch"].rmse == pytest.approx(2.0)


def test_heading_error_of_a_tilted_body_is_pure_heading():
    reference = attitude(times(3), from_deg([60, 40, 10], [-120, -70, 200], [0, 0, 0]), "truth")
    estimate = attitude(times(3), turn_heading(reference.orientation, np.radians([25.0, 25.0, -25.0])))
    error = attitude_error(estimate, reference)
    np.testing.assert_allclose(error["heading"], [25, 25, -25], atol=1e-9)
    np.testing.assert_allclose(error["yaw"], [25, 25, -25], atol=1e-9)
    np.testing.assert_allclose(error["total"], 25, atol=1e-9)
    np.testing.assert_allclose(error["inclination"], 0, atol=1e-6)


def test_inclination_is_the_angle_between_the_verticals():
    reference = attitude(times(200), wander(200, 1), "truth")
    estimate = attitude(times(200), wander(200, 2))
    error = attitude_error(estimate, reference)
    up = [Rotation.from_quat(each.orientation).inv().apply([0, 0, 1]) for each in (estimate, reference)]
    between = np.degrees(np.arccos(np.clip(np.sum(up[0] * up[1], axis=1), -1, 1)))
    np.testing.assert_allclose(error["inclination"], between, atol=1e-6)
    turn = Rotation.from_quat(estimate.orientation) * Rotation.from_quat(reference.orientation).inv()
    np.testing.assert_allclose(error["total"], np.degrees(turn.magnitude()), atol=1e-9)
    e = turn.as_quat()
    np.testing.assert_allclose(error["inclination"], np.degrees(2 * np.arccos(np.hypot(e[:, 2], e[:, 3]))), atol=1e-6)


def test_yaw_and_heading_wrap():
    reference = attitude(times(4), from_deg([0, 0, 179], [0, 0, -179], [0, 0, 0], [0, 0, 90]), "truth")
    estimate = attitude(times(4), from_deg([0, 0, -179], [0, 0, 179], [0, 0, 180], [0, 0, -90]))
    error = attitude_error(estimate, reference)
    np.testing.assert_allclose(error["yaw"], [2, -2, 180, 180], atol=1e-9)
    np.testing.assert_allclose(error["heading"][:2], [2, -2], atol=1e-9)
    np.testing.assert_allclose(np.abs(error["heading"][2:]), 180, atol=1e-9)


def test_reference_is_interpolated_as_scipy_does():
    reference = attitude(times(50), wander(50), "truth")
    at_ns = np.sort(np.random.default_rng(0).integers(0, 4900 * MS, 300))
    estimate = attitude(at_ns, np.tile([0.0, 0, 0, 1], (300, 1)))
    error = attitude_error(estimate, reference)
    between = Slerp(reference.time_ns, Rotation.from_quat(reference.orientation))(at_ns)
    np.testing.assert_allclose(error["total"], np.degrees(between.magnitude()), atol=1e-7)
    assert error.counts.counted == 300


def test_no_bridge_over_gaps_and_no_extrapolation():
    ref_ms = np.array([0, 100, 200, 300, 550, 650, 750, 1001, 1101, 1201])
    reference = attitude(ref_ms * MS, np.tile([0.0, 0, 0, 1], (10, 1)), "truth")
    at_ms = np.array([-1, 0, 300, 301, 425, 750, 751, 1000, 1001, 1201, 1202])
    error = attitude_error(attitude(at_ms * MS, np.tile([0.0, 0, 0, 1], (11, 1))), reference)
    # 250 ms are exactly 2.5 intervals, 251 ms are more; a sample's own stamp counts on either side of a gap.
    bridged = np.array([False, True, True, True, True, True, False, False, True, True, False])
    np.testing.assert_array_equal(error.counted, bridged)
    np.testing.assert_array_equal(np.isfinite(error["total"]), bridged)
    assert error.counts.without_reference == 4


@pytest.mark.parametrize("samples", [0, 1])
def test_a_reference_of_one_or_no_sample(samples):
    reference = attitude(times(samples), np.tile([0.0, 0, 0, 1], (samples, 1)), "truth")
    error = attitude_error(attitude(times(3), wander(3)), reference)
    assert error.counts.counted == samples
    assert error.counts.without_reference == 3 - samples


def test_unsorted_repeated_and_missing_reference_samples():
    q = wander(6)
    whole = attitude(times(6), q, "truth")
    order = [3, 0, 1, 5, 4, 2, 3]
    mixed = attitude(times(6)[order], q[order], "truth")
    estimate = attitude(times(9, 60), wander(9, 3))
    np.testing.assert_allclose(
        attitude_error(estimate, mixed).degrees, attitude_error(estimate, whole).degrees, atol=1e-9
    )
    holed = q.copy()
    holed[2] = np.nan
    bridged = attitude_error(estimate, attitude(times(6), holed, "truth"))
    without = attitude_error(estimate, attitude(np.delete(times(6), 2), np.delete(q, 2, 0), "truth"))
    np.testing.assert_allclose(bridged.degrees, without.degrees, atol=1e-12)


def test_near_the_vertical_euler_angles_are_drawn_but_not_counted():
    reference = attitude(times(4), from_deg([0, 84.9, 0], [0, 85.1, 0], [0, -86, 0], [0, 10, 0]), "truth")
    estimate = attitude(times(4), from_deg([1, 84.9, 0], [1, 85.1, 0], [1, -86, 0], [1, 10, 0]))
    error = attitude_error(estimate, reference)
    np.testing.assert_array_equal(error.euler_counted, [True, False, False, True])
    assert error.counted.all()
    np.testing.assert_allclose(error["roll"], 1, atol=1e-9)
    assert error.statistics["roll"].count == 2
    assert error.statistics["total"].count == 4
    assert error.counts.near_vertical == 2


def test_missing_estimates_spans_and_limits_are_counted():
    q = from_deg(*[[0, 0, 0]] * 10)
    estimate_q = from_deg(*[[0, 0, k] for k in range(10)])
    estimate_q[4] = np.nan
    reference = attitude(times(10), q, "truth")
    error = attitude_error(
        attitude(times(10), estimate_q),
        reference,
        exclude=[(200 * MS, 400 * MS)],
        start_ns=100 * MS,
        end_ns=900 * MS,
    )
    assert dataclasses.asdict(error.counts) == {
        "samples": 8,
        "counted": 5,
        "not_finite": 1,
        "without_reference": 0,
        "excluded": 2,
        "near_vertical": 0,
    }
    np.testing.assert_allclose(error["yaw"][[1, 2]], [2, 3], atol=1e-9)
    assert np.isnan(error["yaw"][3])
    assert error.statistics["yaw"].mean == pytest.approx(np.mean([1, 5, 6, 7, 8]))


def test_nothing_in_common_gives_no_numbers():
    reference = attitude(times(5), wander(5), "truth")
    error = attitude_error(attitude(times(5) + 10**12, wander(5)), reference, alignment="full")
    assert error.counts.counted == 0
    assert error.statistics["total"].count == 0
    assert np.isnan(error.statistics["total"].rmse)


def test_arbitrary_north_loses_its_yaw_and_says_so():
    truth = attitude(times(50), wander(50), "truth")
    turned = turn_heading(truth.orientation, np.radians(37.0))
    estimate = attitude(times(50), turned, north="arbitrary")
    assert default_alignment(estimate, truth) is Alignment.YAW
    error = attitude_error(estimate, truth)
    assert error.removed.heading_deg == pytest.approx(37.0)
    np.testing.assert_allclose(error["total"], 0, atol=1e-6)
    kept = attitude_error(attitude(times(50), turned, north="true"), truth)
    np.testing.assert_allclose(kept["heading"], 37, atol=1e-9)


def test_wrong_options_are_named():
    both = attitude(times(3), wander(3))
    with pytest.raises(UsageError, match="none, yaw, full"):
        attitude_error(both, both, alignment="sideways")
    with pytest.raises(UsageError, match="ends before it starts"):
        attitude_error(both, both, exclude=[(5, 3)])


@settings(deadline=None, max_examples=60)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_error_belongs_to_world_and_pair(seed):
    """A turn of the body leaves E alone; a turn of the world about up leaves the components alone; swapping: minus."""
    estimate, reference = attitude(times(20), wander(20, seed)), attitude(times(20), wander(20, seed + 1), "truth")
    error = attitude_error(estimate, reference).degrees[:, :3]
    turn = Rotation.random(rng=np.random.default_rng(seed))
    turned = [attitude(a.time_ns, (Rotation.from_quat(a.orientation) * turn).as_quat()) for a in (estimate, reference)]
    np.testing.assert_allclose(attitude_error(*turned).degrees[:, :3], error, atol=1e-6)
    about_up = [attitude(a.time_ns, turn_heading(a.orientation, 1.0)) for a in (estimate, reference)]
    np.testing.assert_allclose(attitude_error(*about_up).degrees[:, :3], error, atol=1e-6)
    swapped = attitude_error(reference, estimate).degrees[:, :3]
    np.testing.assert_allclose(swapped[:, :2], error[:, :2], atol=1e-6)
    np.testing.assert_allclose((swapped[:, 2] + error[:, 2] + 180) % 360, 180, atol=1e-6)


@settings(deadline=None, max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), sign=st.lists(st.booleans(), min_size=20, max_size=20))
def test_a_quaternions_sign_means_nothing(seed, sign):
    q = wander(20, seed)
    flipped = np.where(np.array(sign)[:, np.newaxis], -q, q)
    reference = attitude(times(20), wander(20, seed + 1), "truth")
    for alignment in Alignment:
        plain = attitude_error(attitude(times(20), q), reference, alignment=alignment)
        other = attitude_error(attitude(times(20), flipped), reference, alignment=alignment)
        np.testing.assert_allclose(other.degrees, plain.degrees, atol=1e-6)
