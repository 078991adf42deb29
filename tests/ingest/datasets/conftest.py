"""Data sets built from their published descriptions, out of a motion that is known."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from attlog.geometry.quaternions import conjugate, from_rotation_vector, multiply, rotate

G = 9.80665


@pytest.fixture(scope="session")
def motion() -> SimpleNamespace:
    """30 s at 200 Hz: time_ns (n,), rate (n, 3) rad/s, force (n, 3) m/s^2, field (n, 3) T, q (n, 4) FLU to ENU."""
    rng = np.random.default_rng(11)
    time_s = np.arange(6000) * 0.005
    rate = np.sin(2 * np.pi * np.array([0.31, 0.47, 0.23]) * time_s[:, np.newaxis] + np.array([0.3, 1.1, 2.0]))
    q = np.zeros((len(time_s), 4))
    q[0] = from_rotation_vector([0.02, -0.03, 0.4])
    for k in range(len(time_s) - 1):
        q[k + 1] = multiply(q[k], from_rotation_vector(0.5 * (rate[k] + rate[k + 1]) * 0.005))
    force = rotate(conjugate(q), [0.0, 0.0, G]) + rng.normal(0, 0.02, (len(time_s), 3))
    field = rotate(conjugate(q), [0.0, 20e-6, -44e-6])
    time_ns = np.arange(6000) * 5_000_000
    return SimpleNamespace(time_ns=time_ns, time_s=time_s, rate=rate, force=force, field=field, q=q, n=len(time_s))


@pytest.fixture(scope="session")
def broad(shared: Path) -> Path:
    """The eight trials of BROAD."""
    return shared / "data" / "broad"
