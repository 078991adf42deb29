"""ECF and 9-axis EKF against vqf's C++ updateBatch: samples per CPU-second of one long MARG log, all at full rate.

Ours is the whole `estimate` call: checks, alignment, covariances and every field of the result.
"""

import time
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from attlog import estimators
from attlog.geometry import quaternions
from attlog.schemas.recording import Declination, Imu, Magnetometer, Recording

from .row import Row

SAMPLES = 500_000
HZ = 250.0
ROUNDS = 7
TARGETS = {"ecf": 8.0, "ekf9": 1.0}

Floats = NDArray[np.float64]


def rows() -> Iterator[Row]:
    """One row an estimator. Ours and the peer's runs alternate; the median of each counts."""
    import vqf

    rate, force, field = motion()
    time_ns = (np.arange(SAMPLES) * (1e9 / HZ)).astype(np.int64)
    recording = Recording(
        imu={0: Imu(time_ns, rate, force)},
        mag={0: Magnetometer(time_ns, field)},
        declination=Declination(0.0, "benchmark"),
    )
    for name, target in TARGETS.items():
        estimators.estimate(recording, name)
        ours, peers = [], []
        for _ in range(ROUNDS):
            start = time.process_time()
            estimators.estimate(recording, name)
            ours.append(time.process_time() - start)
            start = time.process_time()
            vqf.VQF(1.0 / HZ).updateBatch(rate, force, field)
            peers.append(time.process_time() - start)
        million = SAMPLES / float(np.median(ours)) / 1e6
        work = f"{name}: {million:.1f} M samples per CPU-second"
        yield Row(work, "vqf C++ updateBatch", float(np.median(peers) / np.median(ours)), target)


def motion() -> tuple[Floats, Floats, Floats]:
    """Rates, forces and fields of a hand-held sort of motion with noise, each (n, 3), reproducible."""
    rng = np.random.default_rng(1)
    t = np.arange(SAMPLES) / HZ
    angles = np.stack([np.sin(1.1 * t), 0.7 * np.sin(0.7 * t + 1.0), 0.2 * t], axis=1)
    q = quaternions.from_rotation_vector(np.array([0.0, 0.0, 1.0]) * angles[:, 2:])
    q = quaternions.multiply(q, quaternions.from_rotation_vector(np.array([1.0, 0.0, 0.0]) * angles[:, :1]))
    q = quaternions.multiply(q, quaternions.from_rotation_vector(np.array([0.0, 1.0, 0.0]) * angles[:, 1:2]))
    steps = quaternions.to_rotation_vector(quaternions.multiply(quaternions.conjugate(q[:-1]), q[1:])) * HZ
    rate = np.concatenate([steps[:1], steps]) + 0.003 * rng.standard_normal((SAMPLES, 3))
    back = quaternions.conjugate(q)
    force = quaternions.rotate(back, np.array([0.0, 0.0, 9.80665])) + 0.3 * rng.standard_normal((SAMPLES, 3))
    field = quaternions.rotate(back, np.array([0.0, 20e-6, -40e-6])) + 3e-7 * rng.standard_normal((SAMPLES, 3))
    return rate, force, field
