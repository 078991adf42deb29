"""Motions with a known attitude, and the public logs that the defaults are judged on."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from attlog.geometry import frames, quaternions
from attlog.schemas.recording import Attitude, Declination, Imu, Magnetometer, Recording

Floats = NDArray[np.float64]
GRAVITY = 9.80665
FIELD = np.array([0.0, 20e-6, -40e-6])
"""World ENU: 20 uT north, 40 uT down, no declination."""


@dataclass(frozen=True, eq=False)
class Run:
    """A recording and its true attitude at the IMU's stamps."""

    recording: Recording
    truth: Floats
    bias: Floats

    def error_deg(self, orientation: Floats) -> Floats:
        """Angle between an estimate (n, 4) and the truth, (n,)."""
        return np.degrees(quaternions.angle_rad(quaternions.multiply(orientation, quaternions.conjugate(self.truth))))


def attitude_at(t: Floats) -> Floats:
    """A lively but smooth motion: roll and pitch to 30 degrees, yaw through full turns."""
    roll = 0.5 * np.sin(0.9 * t) + 0.1 * np.sin(3.1 * t + 1.0)
    pitch = 0.4 * np.sin(0.7 * t + 0.5) + 0.1 * np.sin(2.3 * t)
    yaw = 0.3 * t + 0.5 * np.sin(0.4 * t)
    return frames.orientation_from_rpy_ned(np.stack([roll, pitch, yaw], axis=1))


def rate_at(t: Floats, attitude: Callable[[Floats], Floats] = attitude_at) -> Floats:
    """Body rate by central difference, to 1e-9 rad/s."""
    h = 1e-5
    return quaternions.to_rotation_vector(
        quaternions.multiply(quaternions.conjugate(attitude(t - h)), attitude(t + h))
    ) / (2 * h)


def simulate(
    *,
    t: Floats | None = None,
    hz: float = 100.0,
    seconds: float = 40.0,
    mag_hz: float | None = None,
    bias: tuple[float, float, float] = (0.0, 0.0, 0.0),
    gyro_sd: float = 0.0,
    acc_sd: float = 0.0,
    mag_sd: float = 0.0,
    seed: int = 0,
    attitude: Callable[[Floats], Floats] = attitude_at,
) -> Run:
    """Rotation without acceleration; standard deviations per sample in rad/s, m/s^2 and tesla."""
    stamps = np.arange(0.0, seconds, 1.0 / hz) if t is None else t
    rng = np.random.default_rng(seed)
    q = attitude(stamps)
    back = quaternions.conjugate(q)
    rate = rate_at(stamps, attitude) + np.array(bias) + gyro_sd * rng.standard_normal((len(stamps), 3))
    force = quaternions.rotate(back, np.array([0.0, 0.0, GRAVITY])) + acc_sd * rng.standard_normal((len(stamps), 3))
    at = stamps if mag_hz is None else np.arange(stamps[0], stamps[-1], 1.0 / mag_hz)
    field = quaternions.rotate(quaternions.conjugate(attitude(at)), FIELD)
    field = field + mag_sd * rng.standard_normal((len(at), 3))
    return Run(record(stamps, rate, force, at, field), q, np.array(bias))


def record(t: Floats, rate: Floats, force: Floats, mag_t: Floats, field: Floats) -> Recording:
    """A recording with declination 0; stamps in s."""
    return Recording(
        imu={0: Imu(nanoseconds(t), rate, force)},
        mag={0: Magnetometer(nanoseconds(mag_t), field)},
        declination=Declination(0.0, "test"),
    )


def nanoseconds(t: Floats) -> NDArray[np.int64]:
    return np.round(t * 1e9).astype(np.int64) + 1_700_000_000_000_000_000


@pytest.fixture(scope="session")
def simulated() -> Callable[..., Run]:
    """`simulate`, for tests that shape their own run."""
    return simulate


@pytest.fixture(scope="session")
def recorded() -> Callable[..., Recording]:
    """`record`."""
    return record


@dataclass(frozen=True, eq=False)
class Trial:
    """A BROAD trial: the recording with motion capture as the reference, and where it counts."""

    recording: Recording
    moving: NDArray[np.bool_]
    hz: float


@pytest.fixture(scope="session")
def broad(shared: Path) -> dict[str, Trial]:
    """BROAD trials (Laidig et al. 2021, doi:10.3390/data6070072) by their number."""
    from scipy.io import loadmat

    trials = {}
    for path in sorted((shared / "data" / "broad").glob("*.mat")):
        data = loadmat(path, squeeze_me=True)
        hz = float(data["sampling_rate"])
        time_ns = np.round(np.arange(len(data["imu_gyr"])) * (1e9 / hz)).astype(np.int64)
        recording = Recording(
            imu={0: Imu(time_ns, data["imu_gyr"], data["imu_acc"])},
            mag={0: Magnetometer(time_ns, data["imu_mag"] * 1e-6)},
            reference=Attitude(time_ns, data["opt_quat"][:, [1, 2, 3, 0]], "motion capture"),
            declination=Declination(0.0, "magnetic reference frame"),
        )
        trials[path.name[:2]] = Trial(recording, data["movement"].astype(bool), hz)
    return trials


@pytest.fixture(scope="session")
def copter(logs: Path) -> Recording:
    """copter_sitl_truth.BIN as pymavlink reads it, SIM as the reference."""
    from pymavlink import mavutil

    rows: dict[str, list[list[float]]] = {"IMU": [], "MAG": [], "SIM": []}
    fields = {
        "IMU": ("TimeUS", "GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ"),
        "MAG": ("TimeUS", "MagX", "MagY", "MagZ"),
        "SIM": ("TimeUS", "Roll", "Pitch", "Yaw"),
    }
    log = mavutil.mavlink_connection(str(logs / "copter_sitl_truth.BIN"))
    declination = 0.0
    while (message := log.recv_match(type=[*rows, "PARM"])) is not None:
        kind = message.get_type()
        if kind == "PARM":
            declination = message.Value if message.Name == "COMPASS_DEC" else declination
        elif getattr(message, "I", 0) == 0:
            rows[kind].append([getattr(message, name) for name in fields[kind]])
    imu, mag, sim = (np.array(rows[kind], dtype=np.float64) for kind in rows)
    to_ns = lambda table: (table[:, 0] * 1000).astype(np.int64)  # noqa: E731
    truth = frames.orientation_from_rpy_ned(np.radians(sim[:, 1:]))
    return Recording(
        imu={0: Imu(to_ns(imu), frames.flu_from_frd(imu[:, 1:4]), frames.flu_from_frd(imu[:, 4:]))},
        mag={0: Magnetometer(to_ns(mag), frames.flu_from_frd(mag[:, 1:]) * 1e-7)},
        reference=Attitude(to_ns(sim), truth, "SIM"),
        declination=Declination(float(np.degrees(declination)), "COMPASS_DEC"),
    )
