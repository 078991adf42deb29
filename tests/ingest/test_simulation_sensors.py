"""Sensor models: each fault is the size that it is said to be."""

import dataclasses

import numpy as np
import pytest

from attlog.geometry.quaternions import conjugate, multiply, to_rotation_vector
from attlog.ingest.simulation.autopilot import Autopilot
from attlog.ingest.simulation.sensors import Disturbance, Sampling, Triad, Vibration, measured


def random():
    return np.random.default_rng(3)


def read(triad, truth=(0.0, 0.0, 0.0), count=20_000, interval_s=0.01):
    time_s = np.arange(count) * interval_s
    return triad.measure(np.tile(np.array(truth, dtype=float), (count, 1)), time_s, interval_s, random())


def test_an_ideal_triad_tells_the_truth():
    np.testing.assert_array_equal(read(Triad(), (1.0, -2.0, 3.0), 5), np.tile([1.0, -2.0, 3.0], (5, 1)))


def test_noise_is_a_density():
    for interval_s in (0.01, 0.0025):
        noise = read(Triad(noise_density=0.02), interval_s=interval_s)
        np.testing.assert_allclose(noise.std(axis=0), 0.02 / np.sqrt(interval_s), rtol=0.03)


def test_bias_wanders_with_the_square_root_of_time():
    many = np.array(
        [
            Triad(bias_walk=0.1).measure(np.zeros((101, 3)), np.arange(101) * 1.0, 1.0, np.random.default_rng(k))[-1]
            for k in range(500)
        ]
    )
    np.testing.assert_allclose(many.std(axis=0), 0.1 * np.sqrt(100.0), rtol=0.12)


def test_bias_matrix_quantum_and_limit():
    mixing = ((1.0, 0.5, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 1.0))
    triad = Triad(bias=(0.1, 0.0, 0.0), matrix=mixing, quantum=0.25, limit=3.0)
    np.testing.assert_allclose(read(triad, (1.0, 1.0, -9.0), 2), np.tile([1.5, 2.0, -3.0], (2, 1)))


def test_sampling_rate_jitter_and_loss():
    even = Sampling(50.0).instants(10.0, random())
    np.testing.assert_allclose(even, np.arange(501) / 50.0)
    rough = Sampling(50.0, jitter_s=0.002, lost=0.1).instants(200.0, random())
    assert np.all(np.diff(rough) > 0)
    assert len(rough) == pytest.approx(0.9 * 10_001, rel=0.01)
    assert np.std(rough * 50.0 - np.round(rough * 50.0)) / 50.0 == pytest.approx(0.002, rel=0.05)
    assert np.all(np.diff(Sampling(50.0, jitter_s=1.0).instants(200.0, random())) > 0)


def test_delay_reads_the_past():
    stamps = np.arange(100) * 0.01
    readings = measured(Sampling(100.0, delay_s=0.03), Triad(), lambda t: np.stack([t, t, t], -1), stamps, random())
    np.testing.assert_allclose(readings[:, 0], stamps - 0.03)


def test_vibration_follows_activity():
    time_s = np.linspace(0, 1, 10_000)
    shaken = Vibration(87.0, (1.0, 0.0, 2.0)).at(time_s, (time_s > 0.5).astype(float), 0.3)
    assert np.abs(shaken[time_s <= 0.5]).max() == 0.0
    np.testing.assert_allclose(shaken[time_s > 0.5].std(axis=0), [np.sqrt(0.5), 0.0, np.sqrt(2.0)], rtol=0.02)


def test_disturbance_comes_and_goes():
    field = Disturbance(10.0, 20.0, (4e-6, 0.0, 0.0)).at(np.array([9.0, 10.0, 10.5, 11.0, 15.0, 19.5, 20.0, 21.0]))
    np.testing.assert_allclose(field[:, 0], 4e-6 * np.array([0, 0, 0.5, 1, 1, 0.5, 0, 0]), atol=1e-20)


def test_the_autopilots_error_has_its_size_and_wanders_slowly():
    pilot = Autopilot(attitude_hz=10.0, tilt_sigma_deg=0.5, heading_sigma_deg=2.0, correlation_s=5.0)
    truth = np.tile([0.0, 0.0, 0.0, 1.0], (100_000, 1))
    error = np.degrees(to_rotation_vector(multiply(pilot.estimate(truth, 0.1, random()), conjugate(truth))))
    np.testing.assert_allclose(error.std(axis=0), [0.5, 0.5, 2.0], rtol=0.06)
    one_later = np.sum(error[1:, 2] * error[:-1, 2]) / np.sum(error[:, 2] ** 2)
    assert one_later == pytest.approx(np.exp(-0.1 / 5.0), abs=0.003)
    steady = dataclasses.replace(pilot, tilt_sigma_deg=0.0, heading_sigma_deg=0.0)
    np.testing.assert_allclose(steady.estimate(truth[:5], 0.1, random()), truth[:5])
