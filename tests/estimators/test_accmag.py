"""Each sample by itself."""

import dataclasses
from typing import Any

import numpy as np

from attlog import estimators
from attlog.schemas.estimate import Status


def test_without_noise_it_is_the_truth(simulated: Any) -> None:
    run = simulated(seconds=10.0)
    assert run.error_deg(estimators.estimate(run.recording, "accmag").orientation).max() < 1e-5


def test_a_slower_magnetometer_is_interpolated(simulated: Any) -> None:
    run = simulated(seconds=10.0, mag_hz=20.0)
    estimate = estimators.estimate(run.recording, "accmag")
    assert run.error_deg(estimate.orientation)[:990].max() < 0.2


def test_what_no_frame_fits_is_held_and_marked(simulated: Any) -> None:
    run = simulated(seconds=5.0)
    imu, mag = run.recording.imu[0], run.recording.mag[0]
    force = imu.specific_force.copy()
    force[100:110] = 0.0
    force[200] = mag.field[200] * -1e5
    broken = dataclasses.replace(run.recording, imu={0: dataclasses.replace(imu, specific_force=force)})
    estimate = estimators.estimate(broken, "accmag")
    np.testing.assert_array_equal(np.flatnonzero(estimate.status & Status.COASTING), [*range(100, 110), 200])
    np.testing.assert_array_equal(estimate.orientation[100:110], np.tile(estimate.orientation[99], (10, 1)))
    assert np.isfinite(estimate.orientation).all()


def test_a_pause_of_the_magnetometer_is_marked(simulated: Any) -> None:
    run = simulated(seconds=10.0)
    mag = run.recording.mag[0]
    keep = np.ones(1000, dtype=bool)
    keep[300:500] = False
    part = dataclasses.replace(mag, time_ns=mag.time_ns[keep], field=mag.field[keep])
    estimate = estimators.estimate(dataclasses.replace(run.recording, mag={0: part}), "accmag")
    missing = (estimate.status & Status.MAGNETOMETER_MISSING) > 0
    assert missing[301:499].all()
    assert not missing[:299].any()
    assert not missing[501:].any()
