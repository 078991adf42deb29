"""A telemetry log of 500,000 frames with damage, to columns, against pymavlink's ``recv_msg``."""

import random
import struct
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as dialect

from attlog.ingest import mavlink
from attlog.schemas import IngestOptions, Source

from .row import Row, cpu_seconds

FRAMES = 500_000
PEER_SHARE = 10  # pymavlink reads the first tenth, and its time is scaled by frames
TARGET = 80.0
START_US = 1_760_000_000_000_000
FLIPPED, CUT, GARBAGE = 0.005, 0.001, 0.001


def rows() -> Iterator[Row]:
    """One row."""
    log, sent = synthetic(FRAMES)
    source = Source("synthetic.tlog", np.frombuffer(log, np.uint8))
    whole = mavlink.read(source, IngestOptions())  # compiles the kernels
    assert whole.completeness.messages >= 0.98 * sent
    ours = cpu_seconds(lambda: mavlink.read(source, IngestOptions()), 5)
    with tempfile.TemporaryDirectory() as folder:
        part = Path(folder) / "part.tlog"
        part.write_bytes(log[: len(log) // PEER_SHARE])
        read = 0

        def peer() -> None:
            nonlocal read
            read = sum(1 for _ in iter(connection(part).recv_msg, None))

        theirs = cpu_seconds(peer, 3) - cpu_seconds(lambda: connection(part), 3)
    frames = whole.completeness.messages + len(whole.completeness.dropped)
    work = f"tlog to columns (synthetic, {FRAMES // 1000} k frames with damage, {len(log) / 1e6:.0f} MB)"
    yield Row(work, f"pymavlink recv_msg (first tenth, {read} frames)", theirs / read * frames / ours, TARGET)


def connection(path: Path) -> mavutil.mavmmaplog:
    """pymavlink's reader of telemetry logs."""
    return mavutil.mavlink_connection(str(path), dialect="ardupilotmega")


def synthetic(count: int, seed: int = 1) -> tuple[bytes, int]:
    """A log in which bytes are flipped, frames cut and garbage strewn in, and how many frames are whole."""
    chance = random.Random(seed)
    link = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    parts: list[bytes] = []
    whole = 0
    for number, message in zip(range(count), messages(chance), strict=False):
        frame = bytearray(message.pack(link, force_mavlink1=number % 3 == 0 and message.id < 256))
        link.seq = (link.seq + 1) % 256
        fate = chance.random()
        if fate < FLIPPED:
            frame[chance.randrange(len(frame))] ^= 1 << chance.randrange(8)
        elif fate < FLIPPED + CUT:
            del frame[chance.randrange(1, len(frame)) :]
        else:
            whole += 1
        if chance.random() < GARBAGE:
            parts.append(chance.randbytes(chance.randrange(1, 60)))
        parts.append(struct.pack(">Q", START_US + 1000 * number + chance.randrange(20_000)) + frame)
    return b"".join(parts), whole


def messages(chance: random.Random) -> Iterator[dialect.MAVLink_message]:
    """What an ArduPilot copter streams over a radio, each message in turn, a millisecond a message."""
    milliseconds = 5000

    def number() -> int:
        return chance.randrange(-1000, 1000)

    def angle() -> float:
        return chance.uniform(-1.5, 1.5)

    while True:
        for make in MAKE.values():
            milliseconds += 1
            yield make(milliseconds, number, angle)


MAKE: dict[str, Callable[[int, Callable[[], int], Callable[[], float]], Any]] = {
    "HEARTBEAT": lambda t, n, a: dialect.MAVLink_heartbeat_message(2, 3, 81, 0, 3, 3),
    "RAW_IMU": lambda t, n, a: dialect.MAVLink_raw_imu_message(
        1000 * t, n(), n(), n(), n(), n(), n(), n(), n(), n(), 0, 2500
    ),
    "SCALED_IMU2": lambda t, n, a: dialect.MAVLink_scaled_imu2_message(
        t, n(), n(), n(), n(), n(), n(), n(), n(), n(), 2500
    ),
    "ATTITUDE": lambda t, n, a: dialect.MAVLink_attitude_message(t, a(), a(), a(), a(), a(), a()),
    "AHRS2": lambda t, n, a: dialect.MAVLink_ahrs2_message(a(), a(), a(), 10.0, -353632621, 1491652374),
    "VFR_HUD": lambda t, n, a: dialect.MAVLink_vfr_hud_message(a(), a(), 90, 50, a(), a()),
    "SERVO_OUTPUT_RAW": lambda t, n, a: dialect.MAVLink_servo_output_raw_message(
        1000 * t % 2**32, 0, *([1500] * 8), *([0] * 8)
    ),
    "RC_CHANNELS": lambda t, n, a: dialect.MAVLink_rc_channels_message(t, 16, *([1500] * 18), 200),
    "GLOBAL_POSITION_INT": lambda t, n, a: dialect.MAVLink_global_position_int_message(
        t, -353632621, 1491652374, 584000, 1000, n(), n(), n(), 9000
    ),
    "VIBRATION": lambda t, n, a: dialect.MAVLink_vibration_message(1000 * t, a(), a(), a(), 0, 0, 0),
    "GPS_RAW_INT": lambda t, n, a: dialect.MAVLink_gps_raw_int_message(
        1000 * t - 100, 3, -353632621, 1491652374, 584000, 121, 200, 0, 9000, 10
    ),
    "SYS_STATUS": lambda t, n, a: dialect.MAVLink_sys_status_message(1, 1, 1, 200, 12000, n(), 90, 0, 0, 0, 0, 0, 0),
    "NAV_CONTROLLER_OUTPUT": lambda t, n, a: dialect.MAVLink_nav_controller_output_message(
        a(), a(), n(), n(), 10, a(), a(), a()
    ),
    "LOCAL_POSITION_NED": lambda t, n, a: dialect.MAVLink_local_position_ned_message(t, a(), a(), a(), a(), a(), a()),
    "SYSTEM_TIME": lambda t, n, a: dialect.MAVLink_system_time_message(START_US + 1000 * t, t),
    "EKF_STATUS_REPORT": lambda t, n, a: dialect.MAVLink_ekf_status_report_message(831, a(), a(), a(), a(), a()),
    "PARAM_VALUE": lambda t, n, a: dialect.MAVLink_param_value_message(b"PARAM_%d" % (t % 900), a(), 9, 900, t % 900),
    "SCALED_PRESSURE": lambda t, n, a: dialect.MAVLink_scaled_pressure_message(t, 945.0, a(), 2500),
    "POWER_STATUS": lambda t, n, a: dialect.MAVLink_power_status_message(5000, 0, 0),
    "MEMINFO": lambda t, n, a: dialect.MAVLink_meminfo_message(0, 65535, 131072),
    "MISSION_CURRENT": lambda t, n, a: dialect.MAVLink_mission_current_message(1),
}
