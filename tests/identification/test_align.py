"""Clock offset and drift: known ones are found, within their own sigma; where nothing moves there is an error."""

import dataclasses
from functools import lru_cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from attlog import identification
from attlog.geometry.quaternions import from_rotation_vector, multiply
from attlog.identification.coarse import candidates
from attlog.ingest.simulation import SimulatedRun, simulate
from attlog.schemas import Attitude, Imu, InputError
from attlog.schemas.clock import ClockAlignment, alignment_record, parse_alignments

OFFSET_NS = 137_000_000
DRIFT = 50e-6


@lru_cache
def _flown(seed: int) -> SimulatedRun:
    return simulate("flight", seed)


def _on_another_clock(time_ns: np.ndarray, zero_ns: int, ahead_ns: int = 0) -> np.ndarray:
    """Stamps s of a clock for which the truth is s + 0.137 s + 50e-6 (s - zero)."""
    return np.round((time_ns - OFFSET_NS - zero_ns) / (1.0 + DRIFT)).astype(np.int64) + zero_ns + ahead_ns


def _align(imu: Imu, other: Attitude | Imu, **options: bool) -> ClockAlignment:
    turning = identification.from_imu(other) if isinstance(other, Imu) else identification.from_attitude(other)
    return identification.align(identification.from_imu(imu), turning, clock="/r", sensor_name="/i", **options)


def _errors(found: ClockAlignment, zero_ns: int, ahead_ns: int = 0) -> tuple[float, float]:
    """Errors of offset and drift in their own sigmas."""
    true_s = 0.137 + DRIFT * (found.epoch_ns - zero_ns - ahead_ns) * 1e-9
    offset = ((found.offset_ns + ahead_ns) * 1e-9 - true_s) / found.offset_sigma_s
    return offset, (found.drift_ppm - DRIFT * 1e6) / found.drift_sigma_ppm


def _references(run: SimulatedRun, seed: int) -> dict[str, tuple[Attitude, int]]:
    """References on a clock that is off by 0.137 s and 50 ppm: name -> attitude and what was added besides."""
    truth, random = run.reference, np.random.default_rng(seed)
    zero = int(truth.time_ns[0])
    mounted = multiply(truth.orientation, Rotation.random(random_state=seed).as_quat())
    shaken = multiply(mounted, from_rotation_vector(random.normal(0.0, np.radians(0.3), (len(mounted), 3))))
    stamps = _on_another_clock(truth.time_ns, zero)
    part = slice(900, 3200)
    boot = -(10**18)
    return {
        "truth": (dataclasses.replace(truth, time_ns=stamps), 0),
        "mounted askew, 0.3 deg of noise": (dataclasses.replace(truth, time_ns=stamps, orientation=shaken), 0),
        "the autopilot's": (
            dataclasses.replace(run.onboard, time_ns=_on_another_clock(run.onboard.time_ns, zero)),
            0,
        ),
        "a part, since boot": (
            dataclasses.replace(truth, time_ns=stamps[part] + boot, orientation=truth.orientation[part]),
            boot,
        ),
    }


@pytest.mark.parametrize("name", ["truth", "mounted askew, 0.3 deg of noise", "the autopilot's", "a part, since boot"])
def test_a_known_offset_and_drift_are_found_within_their_sigmas(name: str) -> None:
    errors = []
    for seed in range(8):
        run = _flown(seed)
        reference, ahead = _references(run, seed)[name]
        found = _align(run.imu, reference)
        errors.append(_errors(found, int(run.reference.time_ns[0]), ahead))
        assert found.offset_sigma_s < 5e-4
        assert found.drift_sigma_ppm < 20.0
    assert np.abs(errors).max() < 3.5, errors
    # Of 8 errors over their sigmas, the mean square is between 0.17 and 2.5 in 99 of 100 cases if the sigmas are right.
    assert (np.mean(np.square(errors), axis=0) > 0.15).all(), errors
    assert (np.mean(np.square(errors), axis=0) < 3.0).all(), errors


def test_two_gyros_with_different_rates() -> None:
    run = _flown(1)
    zero = int(run.imu.time_ns[0])
    half = slice(None, None, 2)
    other = Imu(
        _on_another_clock(run.imu.time_ns[half], zero),
        run.imu.angular_velocity[half] @ Rotation.from_euler("xyz", [0.1, -0.4, 2.0]).as_matrix(),
        run.imu.specific_force[half],
    )
    found = _align(run.imu, other)
    true_s = 0.137 + DRIFT * (found.epoch_ns - zero) * 1e-9
    assert abs(found.offset_s - true_s) < 1e-4
    assert abs(found.drift_ppm - 50.0) < 5.0


def test_without_drift_it_is_zero() -> None:
    run = _flown(0)
    shifted = dataclasses.replace(run.reference, time_ns=run.reference.time_ns - OFFSET_NS)
    found = _align(run.imu, shifted, drift=False)
    assert (found.drift_ppm, found.drift_sigma_ppm) == (0.0, 0.0)
    assert abs(found.offset_s - 0.137) < 3.5 * found.offset_sigma_s


def test_gaps_and_shocks_do_little_harm() -> None:
    run = _flown(2)
    keep = np.ones(len(run.imu.time_ns), dtype=bool)
    keep[1500:1700] = keep[3000:3040] = False
    rate = run.imu.angular_velocity.copy()
    rate[2000:2005] += 30.0
    rate[2500] = np.nan
    imu = Imu(run.imu.time_ns[keep], rate[keep], run.imu.specific_force[keep])
    reference, _ = _references(run, 2)["truth"]
    found = _align(imu, reference)
    offset, drift = _errors(found, int(run.reference.time_ns[0]))
    assert abs(offset) < 4.0
    assert abs(drift) < 4.0
    assert found.offset_sigma_s < 1e-4


def test_at_rest_there_is_nothing_to_align_on() -> None:
    run = _flown(0)
    rest = slice(0, 500)
    imu = Imu(run.imu.time_ns[rest], run.imu.angular_velocity[rest], run.imu.specific_force[rest])
    truth = run.reference
    still = Attitude(truth.time_ns[rest], truth.orientation[rest], "reference")
    with pytest.raises(InputError, match="no motion"):
        _align(imu, still)


def test_another_flight_does_not_fit() -> None:
    run, other = _flown(0), _flown(5)
    backward = Attitude(other.reference.time_ns, other.reference.orientation[::-1].copy(), "reference")
    with pytest.raises(InputError, match="do not agree"):
        _align(run.imu, backward)


def test_a_motion_that_repeats_itself_is_ambiguous() -> None:
    time_s = np.arange(0.0, 60.0, 0.02)
    angle = 0.5 * np.sin(2 * np.pi * time_s / 5.0)
    rate = 0.5 * 2 * np.pi / 5.0 * np.cos(2 * np.pi * time_s / 5.0)
    axis = np.array([0.6, 0.0, 0.8])
    time_ns = np.round(time_s * 1e9).astype(np.int64)
    random = np.random.default_rng(0)
    imu = Imu(time_ns, rate[:, None] * axis + random.normal(0.0, 0.01, (len(time_s), 3)), np.zeros((len(time_s), 3)))
    attitude = Attitude(time_ns, from_rotation_vector(angle[:, None] * axis), "r")
    with pytest.raises(InputError, match="repeats itself"):
        _align(imu, attitude)


def test_too_few_samples() -> None:
    imu = Imu(np.arange(5) * 10**9, np.zeros((5, 3)), np.zeros((5, 3)))
    with pytest.raises(InputError, match="fewer than"):
        _align(imu, imu)


def test_the_coarse_lag_is_that_of_numpys_correlation() -> None:
    run = _flown(0)
    a, b = identification.from_imu(run.imu), identification.from_attitude(run.reference)
    shifted = dataclasses.replace(b, time_ns=b.time_ns[300:], angle=b.angle[300:], rate=b.rate[300:], run=b.run[300:])
    (lag, correlation), *_ = candidates(a, shifted)
    x = np.linalg.norm(run.imu.angular_velocity, axis=1)
    y = np.linalg.norm(shifted.rate, axis=1)
    best = int(np.argmax(np.correlate(x - x.mean(), y - y.mean(), "full"))) - (len(y) - 1)
    assert abs(lag - 0.02 * best) < 0.02
    assert correlation > 0.99


def test_the_angle_of_an_attitude_is_the_gyros() -> None:
    time_s = np.arange(0.0, 10.0, 0.01)
    time_ns = np.round(time_s * 1e9).astype(np.int64)
    rate = np.array([0.3, -0.2, 0.5])
    attitude = Attitude(time_ns, from_rotation_vector(time_s[:, None] * rate), "r")
    turning = identification.from_attitude(attitude)
    assert np.abs(turning.angle - time_s[:, None] * rate).max() < 1e-12
    between, run = turning.at(int(time_ns[0]), np.array([1.2345, -1.0, 11.0]))
    assert np.abs(between[0] - 1.2345 * rate).max() < 1e-12
    assert run.tolist() == [0, -1, -1]


def test_the_record_reads_back_and_shifts_stamps() -> None:
    one = ClockAlignment("/r", "/i", 10**18, -1_500_000_000, 1e-4, 50.0, 0.5, 0.99, 100, 0.02, "abc", "attlog")
    record = alignment_record({"/r": one})
    assert parse_alignments(record | {"junk": "{", "more": '{"a": 1}'}) == {"/r": one}
    stamps = np.array([10**18, 10**18 + 10**9])
    assert one.applied(stamps).tolist() == [10**18 - 1_500_000_000, 10**18 - 500_000_000 + 50_000]
    assert "- 1.50000 s" in one.in_words()
