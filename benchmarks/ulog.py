"""ULog to columns against pyulog, on a real flight and on a longer synthetic one."""

import os
import struct
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .row import Row, cpu_seconds

TARGET = 4.0
SECONDS = 600
START_US = 100_000_000
REAL_LOG = Path(os.environ.get("ATTLOG_SHARED", Path(__file__).parents[2] / "shared")) / "data/logs/px4_flight.ulg"

TOPICS = (
    (
        "sensor_combined",
        250,
        "float[3] gyro_rad;float gyro_integral_dt;int32_t accelerometer_timestamp_relative;float[3] accelerometer_m_s2;"
        "float accelerometer_integral_dt;int32_t magnetometer_timestamp_relative;float[3] magnetometer_ga;",
        52,
    ),
    ("vehicle_attitude", 100, "float rollspeed;float pitchspeed;float yawspeed;float[4] q;", 28),
    ("vehicle_rates_setpoint", 250, "float[3] rates;float thrust;", 16),
    ("actuator_outputs", 100, "uint32_t noutputs;float[16] output;", 68),
    ("estimator_status", 20, "float[24] states;float[28] covariances;float[10] innovations;", 248),
    ("vehicle_local_position", 50, "float[30] values;uint8_t[6] flags;", 126),
    ("battery_status", 5, "float[8] values;uint8_t[12] flags;", 44),
    ("ekf2_timestamps", 250, "int16_t[6] relative;", 12),
)
"""Name, rate in Hz, fields behind the timestamp, their bytes: what PX4 logs by default, in its proportions."""


def rows() -> Iterator[Row]:
    """A row for each log; the real one only where it is."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "synthetic.ulg"
        path.write_bytes(synthetic(SECONDS))
        for log in (REAL_LOG, path):
            if log.is_file():
                yield _row(log)


def _row(log: Path) -> Row:
    read(log)  # compiles the kernels
    ratio = cpu_seconds(partial(iterate, log), 3) / cpu_seconds(partial(read, log), 7)
    return Row(f"ULog to columns, {log.name}, {log.stat().st_size / 1e6:.0f} MB", "pyulog", ratio, TARGET)


def read(path: Path) -> object:
    """What attlog does: unified channels, every topic, texts and parameters."""
    from attlog.ingest import ulog
    from attlog.schemas import Source

    return ulog.read(Source.from_path(path))


def iterate(path: Path) -> object:
    """What the peer does: every topic to arrays."""
    import pyulog  # type: ignore[import-untyped]

    return pyulog.ULog(str(path))


def synthetic(seconds: int) -> bytes:
    """A log of the topics above, their messages in order of time."""
    head = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", START_US)
    head += b"".join(_message("F", f"{name}:uint64_t timestamp;{fields}".encode()) for name, _, fields, _ in TOPICS)
    head += b"".join(_message("P", b"\x0efloat PARAM%03d" % i + struct.pack("<f", i)) for i in range(800))
    head += b"".join(
        _message("A", struct.pack("<BH", 0, number) + name.encode()) for number, (name, *_) in enumerate(TOPICS)
    )
    tables = [_table(number, rate, size, seconds) for number, (_, rate, _, size) in enumerate(TOPICS)]
    return head + _interleaved(tables)


def _message(letter: str, payload: bytes) -> bytes:
    return struct.pack("<HB", len(payload), ord(letter)) + payload


def _table(number: int, rate: int, size: int, seconds: int) -> NDArray[np.void]:
    rng = np.random.default_rng(number)
    dtype = [("size", "<u2"), ("letter", "u1"), ("number", "<u2"), ("timestamp", "<u8"), ("values", "u1", (size,))]
    table = np.zeros(rate * seconds, dtype)
    table["size"], table["letter"], table["number"] = 2 + 8 + size, ord("D"), number
    table["timestamp"] = START_US + number + np.arange(len(table)) * (1_000_000 // rate)
    # Bytes below 63 are floats of a moderate size.
    table["values"] = rng.integers(0, 63, (len(table), size), dtype=np.uint8)
    return table


def _interleaved(tables: list[NDArray[np.void]]) -> bytes:
    times = np.concatenate([table["timestamp"] for table in tables])
    sizes = np.concatenate([np.full(len(table), table.itemsize) for table in tables])
    order = np.argsort(times, kind="stable")
    places = np.empty(len(times), np.int64)
    places[order] = np.cumsum(sizes[order]) - sizes[order]
    content = np.zeros(int(sizes.sum()), np.uint8)
    begin = 0
    for table in tables:
        size = table.itemsize
        at = places[begin : begin + len(table)]
        np.ndarray((len(content) - size + 1,), f"V{size}", content.data, strides=(1,))[at] = table.view(f"V{size}")
        begin += len(table)
    return content.tobytes()
