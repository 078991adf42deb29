"""The gate: what is used, what is left out, where a run breaks, and what is said about it."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from attlog import estimators
from attlog.estimators.inputs import MAX_FINDINGS, prepare
from attlog.estimators.parameters import MargParameters
from attlog.schemas.errors import InputError, MissingSensorError
from attlog.schemas.estimate import North, Status
from attlog.schemas.finding import Kind, Severity
from attlog.schemas.recording import Recording, Segment

ALL = ("gyro", "accmag", "ecf", "ekf9", "ekf6")


def without(recording: Recording, keep: np.ndarray) -> Recording:
    imu = recording.imu[0]
    part = dataclasses.replace(
        imu,
        time_ns=imu.time_ns[keep],
        angular_velocity=imu.angular_velocity[keep],
        specific_force=imu.specific_force[keep],
    )
    return dataclasses.replace(recording, imu={0: part})


def test_missing_sensors_are_named(simulated: Any) -> None:
    recording = simulated(seconds=2.0).recording
    with pytest.raises(MissingSensorError, match="no IMU 1; the recording has imu 0"):
        estimators.estimate(recording, "ecf:imu=1")
    with pytest.raises(MissingSensorError, match="no magnetometer 3; the recording has mag 0"):
        estimators.estimate(recording, "ekf9:mag=3")
    with pytest.raises(MissingSensorError, match="mag=none was asked for"):
        estimators.estimate(recording, "accmag:mag=none")
    with pytest.raises(MissingSensorError, match="the recording has no mag"):
        estimators.estimate(dataclasses.replace(recording, mag={}), "ekf9")
    empty = without(recording, np.zeros(200, dtype=bool))
    with pytest.raises(MissingSensorError, match="no usable sample"):
        estimators.estimate(empty, "gyro")


def test_shapes_that_do_not_fit_are_refused(simulated: Any) -> None:
    recording = simulated(seconds=2.0).recording
    imu = dataclasses.replace(recording.imu[0], specific_force=recording.imu[0].specific_force[:-1])
    with pytest.raises(InputError, match="do not match"):
        estimators.estimate(dataclasses.replace(recording, imu={0: imu}), "ecf")
    flat = dataclasses.replace(recording.imu[0], specific_force=recording.imu[0].specific_force[:, :2])
    with pytest.raises(InputError, match=r"not \(n, 3\)"):
        estimators.estimate(dataclasses.replace(recording, imu={0: flat}), "ecf")


@pytest.mark.parametrize("name", ALL)
def test_bad_samples_are_skipped_and_counted(simulated: Any, name: str) -> None:
    run = simulated(seconds=20.0)
    imu, mag = run.recording.imu[0], run.recording.mag[0]
    rate, force, field = imu.angular_velocity.copy(), imu.specific_force.copy(), mag.field.copy()
    rate[500:503, 1], force[900, 2], field[700:705], field[800] = np.nan, np.inf, np.nan, 0.0
    broken = dataclasses.replace(
        run.recording,
        imu={0: dataclasses.replace(imu, angular_velocity=rate, specific_force=force)},
        mag={0: dataclasses.replace(mag, field=field)},
    )
    estimate = estimators.estimate(broken, name)
    kept = np.ones(len(imu.time_ns), dtype=bool)
    kept[500:503] = kept[900] = False
    np.testing.assert_array_equal(estimate.time_ns, imu.time_ns[kept])
    assert np.isfinite(estimate.orientation).all()
    error = dataclasses.replace(run, truth=run.truth[kept]).error_deg(estimate.orientation)
    assert np.median(error) < 3.0
    skipped = {finding.topic: finding.value for finding in estimate.findings if finding.kind is Kind.SKIPPED}
    assert skipped["/imu0/data_raw"] == 4.0
    if name != "ekf6":
        assert skipped["/mag0/field"] == 6.0


@pytest.mark.parametrize("name", ALL)
def test_a_gap_restarts_with_a_finding(simulated: Any, name: str) -> None:
    run = simulated(seconds=30.0, bias=(0.005, -0.004, 0.003))
    keep = np.ones(3000, dtype=bool)
    keep[1500:1650] = False
    estimate = estimators.estimate(without(run.recording, keep), name)
    (gap,) = (finding for finding in estimate.findings if finding.kind is Kind.GAP)
    assert gap.value == pytest.approx(1.51)
    assert gap.time_ns == run.recording.imu[0].time_ns[1499]
    assert gap.end_ns == run.recording.imu[0].time_ns[1650]
    assert gap.severity is Severity.WARN
    restarts = np.flatnonzero(estimate.status & Status.RESTART)
    np.testing.assert_array_equal(restarts, [0, 1500])
    if name in ("ecf", "ekf9", "gyro", "accmag"):
        error = dataclasses.replace(run, truth=run.truth[keep]).error_deg(estimate.orientation)
        assert error[1500:1600].max() < 2.0
    if name in ("ecf", "ekf9"):
        np.testing.assert_allclose(estimate.gyro_bias[1500], estimate.gyro_bias[1499], atol=2e-4)


def test_a_short_gap_is_bridged_and_marked(simulated: Any) -> None:
    run = simulated(seconds=30.0)
    keep = np.ones(3000, dtype=bool)
    keep[1500:1510] = False
    estimate = estimators.estimate(without(run.recording, keep), "ekf9")
    (bridged,) = (finding for finding in estimate.findings if finding.kind is Kind.GAP)
    assert bridged.severity is Severity.INFO
    assert bridged.value == pytest.approx(0.11)
    np.testing.assert_array_equal(np.flatnonzero(estimate.status & Status.COASTING), [1500])
    wide = estimators.estimate(without(run.recording, keep), "ekf9:max_gap_s=0.1")
    np.testing.assert_array_equal(np.flatnonzero(wide.status & Status.RESTART), [0, 1500])


def test_many_gaps_do_not_drown_the_log(simulated: Any) -> None:
    run = simulated(seconds=80.0, hz=50.0)
    keep = np.arange(4000) % 40 < 10
    estimate = estimators.estimate(without(run.recording, keep), "gyro")
    gaps = [finding for finding in estimate.findings if finding.kind is Kind.GAP]
    assert len(gaps) == MAX_FINDINGS + 1
    assert gaps[-1].value == 99 - MAX_FINDINGS


def test_segments_start_afresh(simulated: Any) -> None:
    run = simulated(seconds=20.0)
    times = run.recording.imu[0].time_ns
    segments = (
        Segment("1", 0, int(times[0]), int(times[999]), 0, "start"),
        Segment("1", 1, int(times[1000]), int(times[-1]), 0, "reboot"),
    )
    inputs = prepare(dataclasses.replace(run.recording, segments=segments), MargParameters(), mag=True)
    assert [(part.first, part.last, part.fresh) for part in inputs.runs] == [(0, 1000, True), (1000, 2000, True)]


@pytest.mark.parametrize("name", ALL)
def test_below_ten_hertz_nothing_is_to_be_trusted(simulated: Any, name: str) -> None:
    slow = estimators.estimate(simulated(hz=9.9, seconds=40.0).recording, name)
    assert (slow.status & Status.LOW_RATE).all()
    (finding,) = (finding for finding in slow.findings if finding.kind is Kind.LOW_RATE)
    assert finding.severity is Severity.ERROR
    assert finding.value == pytest.approx(9.9, abs=0.01)
    fast = estimators.estimate(simulated(hz=10.0, seconds=40.0).recording, name)
    assert not (fast.status & Status.LOW_RATE).any()


def test_without_magnetometer_the_heading_is_arbitrary(simulated: Any) -> None:
    run = simulated(seconds=10.0)
    bare = dataclasses.replace(run.recording, mag={})
    for name in ("ecf", "gyro", "ekf6"):
        estimate = estimators.estimate(bare, name)
        assert estimate.north is North.ARBITRARY
        assert estimate.inputs == ("/imu0/data_raw",)
    assert (estimators.estimate(bare, "ecf").status & Status.MAGNETOMETER_MISSING).all()
    assert not (estimators.estimate(run.recording, "ecf").status & Status.MAGNETOMETER_MISSING).any()


def test_another_magnetometer_is_pointed_out(simulated: Any) -> None:
    recording = simulated(seconds=4.0).recording
    other = dataclasses.replace(recording, mag={2: recording.mag[0]})
    estimate = estimators.estimate(other, "ecf")
    assert any("mag=2" in finding.advice for finding in estimate.findings)
    assert estimators.estimate(other, "ecf:mag=2").north is North.TRUE


def test_an_unknown_declination_means_magnetic_north(simulated: Any) -> None:
    recording = dataclasses.replace(simulated(seconds=4.0).recording, declination=None)
    assert estimators.estimate(recording, "ekf9").north is North.MAGNETIC


def test_unsorted_stamps_are_sorted(simulated: Any) -> None:
    run = simulated(seconds=10.0)
    order = np.arange(1000)
    order[300], order[301] = 301, 300
    shuffled = estimators.estimate(without(run.recording, order), "ekf9")
    np.testing.assert_array_equal(shuffled.orientation, estimators.estimate(run.recording, "ekf9").orientation)


@pytest.mark.parametrize("name", ALL)
def test_repeated_stamps_stay_finite(simulated: Any, name: str) -> None:
    run = simulated(seconds=5.0)
    twice = without(run.recording, np.repeat(np.arange(500), 2))
    estimate = estimators.estimate(twice, name)
    assert np.isfinite(estimate.orientation).all()
    assert dataclasses.replace(run, truth=np.repeat(run.truth, 2, axis=0)).error_deg(estimate.orientation).max() < 5.0


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_handful_of_samples_is_enough(simulated: Any, name: str, count: int) -> None:
    run = simulated(t=np.arange(count) * 0.01)
    estimate = estimators.estimate(run.recording, name)
    assert run.error_deg(estimate.orientation).max() < 2.0


@pytest.mark.parametrize("name", ALL)
def test_damaged_values_never_escape(simulated: Any, name: str) -> None:
    rng = np.random.default_rng(8)
    for _ in range(40):
        run = simulated(seconds=2.0)
        imu, mag = run.recording.imu[0], run.recording.mag[0]
        arrays = [imu.angular_velocity.copy(), imu.specific_force.copy(), mag.field.copy()]
        for array in arrays:
            rows = rng.integers(0, len(array), 20)
            array[rows] *= 10.0 ** rng.integers(-300, 300, 20)[:, None]
        damaged = dataclasses.replace(
            run.recording,
            imu={0: dataclasses.replace(imu, angular_velocity=arrays[0], specific_force=arrays[1])},
            mag={0: dataclasses.replace(mag, field=arrays[2])},
        )
        q = estimators.estimate(damaged, name).orientation
        np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1.0, atol=1e-9)
