"""The simulated truth is a motion: its parts are each other's derivatives, and at rest the sensors say so."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from attlog.geometry.frames import rpy_ned_deg
from attlog.geometry.quaternions import conjugate, multiply, rotate, to_rotation_vector
from attlog.ingest.simulation import SCENARIOS
from attlog.ingest.simulation.motion import GRAVITY
from attlog.ingest.simulation.place import Place
from attlog.ingest.simulation.profiles import held


@pytest.fixture(scope="module", params=list(SCENARIOS))
def path(request):
    return SCENARIOS[request.param].trajectory.drawn(np.random.default_rng(7))


def differenced(function, time_s, h):
    """First derivative, error of the order h^6."""
    weights = {1: 3 / 4, 2: -3 / 20, 3: 1 / 60}
    return sum(w * (function(time_s + k * h) - function(time_s - k * h)) for k, w in weights.items()) / h


def test_the_attitudes_derivative_is_the_body_rate(path):
    time_s = np.arange(0.0, path.duration_s, 0.0137)
    motion = path.at(time_s)

    def turned(at_s):
        return to_rotation_vector(multiply(conjugate(motion.orientation), path.at(at_s).orientation))

    np.testing.assert_allclose(differenced(turned, time_s, 1e-4), motion.angular_velocity, atol=1e-9, rtol=0)


def test_velocity_and_acceleration_are_derivatives(path):
    time_s = np.arange(0.1, path.duration_s - 0.1, 0.0137)
    motion = path.at(time_s)
    np.testing.assert_allclose(differenced(lambda t: path.at(t).velocity, time_s, 1e-3), motion.acceleration, atol=1e-8)
    np.testing.assert_allclose(differenced(lambda t: path.at(t).position, time_s, 1e-2), motion.velocity, atol=1e-5)


def test_attitudes_are_rotations(path):
    motion = path.at(np.linspace(0.0, path.duration_s, 500))
    np.testing.assert_allclose(np.linalg.norm(motion.orientation, axis=1), 1.0, atol=1e-12)


def test_at_rest_force_and_field_turn_back_to_constants():
    scenario = SCENARIOS["flight"]
    path = scenario.trajectory.drawn(np.random.default_rng(0))
    motion = path.at(np.linspace(0.0, 8.0, 100))
    assert np.abs(motion.angular_velocity).max() == 0.0
    assert np.abs(motion.velocity).max() == 0.0
    force = rotate(motion.orientation, motion.specific_force)
    np.testing.assert_allclose(force, np.tile([0, 0, GRAVITY], (100, 1)), atol=1e-12)
    field = rotate(motion.orientation, motion.in_body(scenario.place.field_enu))
    np.testing.assert_allclose(field, np.tile(scenario.place.field_enu, (100, 1)), atol=1e-18)
    assert np.linalg.norm(rpy_ned_deg(motion.orientation[0])[:2]) > 1.0  # a slope, so that tilt is there to be found


def test_specific_force_obeys_newton():
    """Turned into the world and freed of gravity it is the acceleration, also in flight; rotors push along body z."""
    path = SCENARIOS["flight"].trajectory.drawn(np.random.default_rng(0))
    motion = path.at(np.linspace(20.0, 80.0, 1000))
    world = Rotation.from_quat(motion.orientation).apply(motion.specific_force) - [0, 0, GRAVITY]
    np.testing.assert_allclose(world, motion.acceleration, atol=1e-12)
    across = np.linalg.norm(motion.specific_force[:, :2], axis=1)
    air = np.linalg.norm(motion.velocity - path.wind, axis=1)
    assert np.all(across <= path.drag * air + 1e-9)


def test_the_flight_banks_and_travels():
    path = SCENARIOS["flight"].trajectory.drawn(np.random.default_rng(0))
    motion = path.at(np.linspace(0.0, path.duration_s, 2000))
    rpy = rpy_ned_deg(motion.orientation)
    assert np.abs(rpy[:, :2]).max() > 20.0
    assert np.abs(rpy[:, :2]).max() < 60.0
    assert np.ptp(rpy[:, 2]) > 300.0
    assert np.linalg.norm(motion.velocity, axis=1).max() > 7.0
    assert motion.position[:, 2].min() > -0.3
    assert np.linalg.norm(motion.velocity[-1]) == 0.0


def test_profiles_hold_blend_and_keep_their_integral():
    profile = held(np.array([10.0, 5.0, 10.0]), np.array([0.0, 2.0, 0.0]), 0.5)
    assert profile(np.array([0.0, 5.0, 12.5, 20.0])) == pytest.approx([0.0, 0.0, 2.0, 0.0], abs=1e-15)
    time_s = np.linspace(0.0, 25.0, 1001)
    assert profile(time_s).min() >= -1e-15
    assert profile(time_s).max() <= 2.0 + 1e-15
    assert profile.integral()(np.array([25.0]))[0] == pytest.approx(10.0)
    assert profile.integral()(np.array([0.0]))[0] == 0.0
    np.testing.assert_allclose(
        differenced(profile.integral(), time_s[40:-40], 1e-3), profile(time_s[40:-40]), atol=1e-9
    )


def test_places_field_and_degrees():
    place = Place(47.6, -122.3, 50.0, 14.9, 68.77, 52.64e-6)
    east, north, up = place.field_enu
    assert np.degrees(np.arctan2(east, north)) == pytest.approx(14.9)
    assert np.degrees(np.arctan2(-up, np.hypot(east, north))) == pytest.approx(68.77)
    assert np.linalg.norm(place.field_enu) == pytest.approx(52.64e-6)
    moved = place.geodetic(np.array([[0.0, 0, 0], [100.0, 200.0, 7.0]]))
    assert moved[0] == pytest.approx([47.6, -122.3, 50.0])
    # One degree at 47.6 degrees north: 111.18 km of latitude, 75.20 km of longitude (WGS 84).
    assert (moved[1] - moved[0]) * [111180.0, 75200.0, 1.0] == pytest.approx([200.0, 100.0, 7.0], rel=1e-3)
