"""Defaults on public data: a simulated flight with its truth, and BROAD beside VQF."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from attlog import estimators
from attlog.geometry import frames, quaternions
from attlog.schemas.recording import Recording

Floats = NDArray[np.float64]


@pytest.mark.parametrize(("name", "bounds"), [("ecf", (0.8, 2.3, 2.0)), ("ekf9", (0.8, 1.5, 2.0))])
def test_copter_against_its_truth(copter: Recording, name: str, bounds: tuple[float, float, float]) -> None:
    estimate = estimators.estimate(copter, name)
    truth = copter.reference
    assert truth is not None
    q = quaternions.slerp(estimate.time_ns, estimate.orientation, truth.time_ns)
    difference = frames.rpy_ned_deg(q) - frames.rpy_ned_deg(truth.orientation)
    difference = (difference + 180.0) % 360.0 - 180.0
    later = (truth.time_ns > truth.time_ns[0] + 5_000_000_000) & np.isfinite(difference).all(axis=1)
    rmse = np.sqrt(np.mean(difference[later] ** 2, axis=0))
    assert (rmse < bounds).all(), rmse


def broad_errors(orientation: Floats, trial: Any) -> tuple[float, float]:
    """RMS of total and inclination error in degrees, where the trial counts."""
    truth = trial.recording.reference.orientation
    keep = trial.moving & np.isfinite(truth).all(axis=1)
    e = quaternions.multiply(orientation[keep], quaternions.conjugate(truth[keep]))
    total = 2 * np.arccos(np.clip(np.abs(e[:, 3]), 0, 1))
    inclination = 2 * np.arccos(np.clip(np.hypot(e[:, 3], e[:, 2]), 0, 1))
    return tuple(float(np.degrees(np.sqrt(np.mean(angle**2)))) for angle in (total, inclination))  # type: ignore[return-value]


@pytest.fixture(scope="module")
def by_vqf(broad: dict[str, Any]) -> dict[str, tuple[float, float]]:
    vqf = pytest.importorskip("vqf")
    results = {}
    for number, trial in broad.items():
        imu, mag = trial.recording.imu[0], trial.recording.mag[0]
        arrays = (np.ascontiguousarray(a) for a in (imu.angular_velocity, imu.specific_force, mag.field * 1e6))
        out = vqf.VQF(1.0 / trial.hz).updateBatch(*arrays)
        results[number] = broad_errors(out["quat9D"][:, [1, 2, 3, 0]], trial)
    return results


def test_ekf9_is_no_worse_than_vqf_on_broad(broad: dict[str, Any], by_vqf: dict[str, tuple[float, float]]) -> None:
    ours = {
        n: broad_errors(estimators.estimate(trial.recording, "ekf9").orientation, trial) for n, trial in broad.items()
    }
    assert np.mean([e[0] for e in ours.values()]) < np.mean([e[0] for e in by_vqf.values()])
    for number, (total, inclination) in ours.items():
        assert total < 1.5 * by_vqf[number][0] + 0.5, number
        assert inclination < 1.5 * by_vqf[number][1] + 0.5, number


def test_ecf_stays_sane_on_broad(broad: dict[str, Any]) -> None:
    for number, trial in broad.items():
        total, inclination = broad_errors(estimators.estimate(trial.recording, "ecf").orientation, trial)
        undisturbed = int(number) <= 23
        assert total < (5.0 if undisturbed else 12.0), number
        assert inclination < (2.0 if undisturbed else 6.0), number
