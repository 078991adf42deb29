"""A run as the telemetry log that a ground station would have kept of an ArduCopter: MAVLink 2 with arrival stamps.

RAW_IMU as ArduPilot sends it: milli-g, mrad/s and milligauss in whole numbers, body FRD. The truth is in
HIL_STATE_QUATERNION; the autopilot's own attitude, after AHRS_TRIM, in ATTITUDE. Nothing here is on a hot path: the
messages are packed one by one, by pymavlink.
"""

import os
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from ...geometry.frames import (
    enu_flu_from_ned_frd,
    frd_from_flu,
    ned_frd_from_enu_flu,
    ned_from_enu,
    orientation_from_rpy_ned,
    rpy_ned_deg,
)
from ...geometry.quaternions import conjugate, multiply
from ...schemas.errors import StorageError
from .motion import GRAVITY, Floats
from .run import SimulatedRun

Timed = tuple[int, Any]
"""UTC in ns at which a message is sent, and the message."""

MILLI_G: Final = GRAVITY * 1e-3
MILLIGAUSS: Final = 1e-7
SYSTEM, COMPONENT = 1, 1
PARAMETERS_AT_S: Final = 1.0
UNKNOWN: Final = 65535
LINK_DELAY_S: Final = 0.002
LINK_JITTER_S: Final = 0.004
"""Mean of what comes on top of the delay, exponentially distributed: links only delay."""


def write_tlog(run: SimulatedRun, path: str | Path, *, force: bool = False) -> None:
    """Write `tlog_bytes` beside ``path`` and rename it; StorageError where it exists or cannot be written."""
    target = Path(path)
    if target.exists() and not force:
        raise StorageError(f"{target}: exists already; give another name or --force")
    beside = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        beside.write_bytes(tlog_bytes(run))
        os.replace(beside, target)
    except OSError as error:
        raise StorageError(f"{target}: cannot be written: {error.strerror or error}") from error
    finally:
        beside.unlink(missing_ok=True)


def tlog_bytes(run: SimulatedRun) -> bytes:
    """Every message after the big-endian microseconds of its arrival; the same run gives the same bytes."""
    sources = (_heartbeats, _system_time, _parameters, _remarks, _fixes, _truth, _attitude, _raw_imu)
    sent = sorted((timed for source in sources for timed in source(run)), key=lambda timed: timed[0])
    link = mavlink.MAVLink(None, srcSystem=SYSTEM, srcComponent=COMPONENT)
    parts = []
    for arrival_us, (_, message) in zip(_arrivals_us(run, [at for at, _ in sent]), sent, strict=True):
        parts.append(struct.pack(">Q", arrival_us) + message.pack(link))
        link.seq = (link.seq + 1) % 256
    return b"".join(parts)


def _arrivals_us(run: SimulatedRun, sent_ns: list[int]) -> list[int]:
    delay = np.random.default_rng([run.seed, SYSTEM]).exponential(LINK_JITTER_S, len(sent_ns)) + LINK_DELAY_S
    arrival = np.array(sent_ns) // 1000 + np.round(delay * 1e6).astype(np.int64)
    return [int(stamp) for stamp in np.maximum.accumulate(arrival)]


def _boot_ns(run: SimulatedRun) -> int:
    return run.scenario.start_ns - round(run.scenario.boot_s * 1e9)


def _boot_us(run: SimulatedRun, stamps_ns: NDArray[np.int64]) -> list[int]:
    return [int(stamp) for stamp in (stamps_ns - _boot_ns(run)) // 1000]


def _boot_ms(run: SimulatedRun, stamps_ns: NDArray[np.int64]) -> list[int]:
    return [stamp // 1000 for stamp in _boot_us(run, stamps_ns)]


def _whole(values: Floats, bits: int = 16) -> list[list[int]]:
    """Rows (n, k) as whole numbers that a signed field holds; what does not fit saturates."""
    limit = 2 ** (bits - 1) - 1
    rows: list[list[int]] = np.clip(np.round(values), -limit - 1, limit).astype(np.int64).tolist()
    return rows


def _every_second(run: SimulatedRun) -> NDArray[np.int64]:
    return run.stamps_ns(np.arange(int(run.scenario.trajectory.duration_s) + 1, dtype=np.float64))


def _heartbeats(run: SimulatedRun) -> Iterator[Timed]:
    modes = run.scenario.autopilot.modes
    starts = run.stamps_ns(np.array([mode.time_s for mode in modes]))
    enabled = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mavlink.MAV_MODE_FLAG_STABILIZE_ENABLED
    for stamp in _every_second(run):
        mode = modes[int(np.searchsorted(starts, stamp, side="right")) - 1]
        base = enabled | (mavlink.MAV_MODE_FLAG_SAFETY_ARMED if mode.armed else 0)
        state = mavlink.MAV_STATE_ACTIVE if mode.armed else mavlink.MAV_STATE_STANDBY
        kind, pilot = mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
        yield int(stamp), mavlink.MAVLink_heartbeat_message(kind, pilot, base, mode.number, state, 3)


def _system_time(run: SimulatedRun) -> Iterator[Timed]:
    stamps = _every_second(run)
    known = run.scenario.start_ns + round(run.scenario.sensors.first_fix_s * 1e9)
    for stamp, boot_ms in zip(stamps, _boot_ms(run, stamps), strict=True):
        utc_us = int(stamp) // 1000 if stamp >= known else 0
        yield int(stamp), mavlink.MAVLink_system_time_message(utc_us, boot_ms)


def _parameters(run: SimulatedRun) -> Iterator[Timed]:
    parameters = run.scenario.autopilot.parameters
    stamps = run.stamps_ns(np.array([PARAMETERS_AT_S + 0.02 * index for index in range(len(parameters))]))
    for index, (name, value) in enumerate(parameters.items()):
        kind, count = mavlink.MAV_PARAM_TYPE_REAL32, len(parameters)
        yield int(stamps[index]), mavlink.MAVLink_param_value_message(name.encode(), value, kind, count, index)


def _remarks(run: SimulatedRun) -> Iterator[Timed]:
    remarks = run.scenario.autopilot.remarks
    stamps = run.stamps_ns(np.array([remark.time_s for remark in remarks]))
    for stamp, remark in zip(stamps, remarks, strict=True):
        yield int(stamp), mavlink.MAVLink_statustext_message(remark.severity, remark.text.encode())


def _raw_imu(run: SimulatedRun) -> Iterator[Timed]:
    """Each IMU sample with the magnetometer's last reading."""
    imu, mag = run.imu, run.magnetometer
    last = np.maximum(np.searchsorted(mag.time_ns, imu.time_ns, side="right") - 1, 0)
    acceleration = _whole(frd_from_flu(imu.specific_force) / MILLI_G)
    rate = _whole(frd_from_flu(imu.angular_velocity) * 1e3)
    field = _whole(frd_from_flu(mag.field)[last] / MILLIGAUSS)
    rows = zip(imu.time_ns, _boot_us(run, imu.time_ns), acceleration, rate, field, strict=True)
    for stamp, boot_us, a, w, m in rows:
        yield int(stamp), mavlink.MAVLink_raw_imu_message(boot_us, *a, *w, *m)


def _attitude(run: SimulatedRun) -> Iterator[Timed]:
    onboard = run.onboard
    angles = np.radians(rpy_ned_deg(_trimmed(onboard.orientation, run.scenario.autopilot.trim_rad))).tolist()
    rates = frd_from_flu(run.autopilot.angular_velocity).tolist()
    rows = zip(onboard.time_ns, _boot_ms(run, onboard.time_ns), angles, rates, strict=True)
    for stamp, boot_ms, rpy, w in rows:
        yield int(stamp), mavlink.MAVLink_attitude_message(boot_ms, *rpy, *w)


def _trimmed(orientation: Floats, trim_rad: tuple[float, float]) -> Floats:
    """What ArduPilot logs of its attitude: R_logged = R R(trim)^T, body FRD; `frames.remove_trim` undoes it."""
    trim = ned_frd_from_enu_flu(orientation_from_rpy_ned([*trim_rad, 0.0]))
    return enu_flu_from_ned_frd(multiply(ned_frd_from_enu_flu(orientation), conjugate(trim)))


def _truth(run: SimulatedRun) -> Iterator[Timed]:
    truth = run.truth
    stamps = run.stamps_ns(truth.time_s)
    attitude = ned_frd_from_enu_flu(truth.orientation)[:, [3, 0, 1, 2]].tolist()
    rates = frd_from_flu(truth.angular_velocity).tolist()
    place = _whole(run.scenario.place.geodetic(truth.position) * [1e7, 1e7, 1e3], bits=32)
    velocity = _whole(ned_from_enu(truth.velocity) * 100.0)
    speed = np.round(np.linalg.norm(truth.velocity, axis=-1) * 100.0).astype(np.int64).tolist()
    acceleration = _whole(frd_from_flu(truth.specific_force) / MILLI_G)
    rows = zip(_boot_us(run, stamps), attitude, rates, place, velocity, speed, acceleration, strict=True)
    for stamp, (boot_us, q, w, p, v, s, a) in zip(stamps, rows, strict=True):
        yield int(stamp), mavlink.MAVLink_hil_state_quaternion_message(boot_us, q, *w, *p, *v, s, s, *a)


def _fixes(run: SimulatedRun) -> Iterator[Timed]:
    fix, velocity = run.fix, run.satellites.velocity
    place = np.stack([fix.latitude_deg * 1e7, fix.longitude_deg * 1e7, fix.altitude_m * 1e3], axis=-1)
    speed = np.round(np.hypot(velocity[:, 0], velocity[:, 1]) * 100.0).astype(np.int64).tolist()
    course = np.round(np.degrees(np.arctan2(velocity[:, 0], velocity[:, 1])) * 100.0).astype(np.int64) % 36000
    rows = zip(_boot_us(run, fix.time_ns), _whole(place, bits=32), speed, course.tolist(), run.fixed, strict=True)
    for stamp, (boot_us, p, s, c, valid) in zip(fix.time_ns, rows, strict=True):
        found = (mavlink.GPS_FIX_TYPE_3D_FIX, *p, 80, 110, s, c, 14)
        searching = (mavlink.GPS_FIX_TYPE_NO_FIX, 0, 0, 0, UNKNOWN, UNKNOWN, UNKNOWN, UNKNOWN, 3)
        yield int(stamp), mavlink.MAVLink_gps_raw_int_message(boot_us, *(found if valid else searching))
