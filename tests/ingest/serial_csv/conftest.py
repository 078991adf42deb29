"""A motion that is known, printed as loggers print it, and read back."""

from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from attlog.geometry.quaternions import conjugate, from_rotation_vector, multiply, rotate
from attlog.ingest import serial_csv
from attlog.schemas import Columns, CsvOptions, Ingested, IngestOptions, SensorProfile, Source
from attlog.schemas.unified import quaternions, vectors

G = 9.80665


@dataclass(frozen=True, eq=False)
class Read:
    """What came out of a file."""

    whole: Ingested

    def __getitem__(self, topic: str) -> Columns:
        return {columns.channel.topic: columns for columns in self.whole.columns}[topic]

    @property
    def topics(self) -> list[str]:
        return [columns.channel.topic for columns in self.whole.columns]

    @property
    def dropped(self) -> dict[str, int]:
        return dict(self.whole.completeness.dropped)

    @property
    def guesses(self) -> list[str]:
        return [finding.advice for finding in self.whole.findings if finding.kind == "units"]

    def time_ns(self, topic: str = "/imu0/data_raw") -> list[int]:
        return [int(value) for value in self[topic].time_ns]

    def rate(self, topic: str = "/imu0/data_raw") -> np.ndarray:
        return vectors(self[topic].data, "angular_velocity")

    def force(self, topic: str = "/imu0/data_raw") -> np.ndarray:
        return vectors(self[topic].data, "linear_acceleration")

    def field(self, topic: str = "/mag0/field") -> np.ndarray:
        return vectors(self[topic].data, "magnetic_field")

    def attitude(self, topic: str = "/reference/attitude") -> np.ndarray:
        return quaternions(self[topic].data)


@pytest.fixture(scope="session")
def read() -> Callable[..., Read]:
    """``read(text_or_bytes, name=…, sensor=…, **CsvOptions)``."""

    def call(text: str | bytes, name: str = "log.csv", sensor: SensorProfile | None = None, **said: Any) -> Read:
        data = np.frombuffer(text.encode() if isinstance(text, str) else text, np.uint8)
        return Read(serial_csv.read(Source(name, data), IngestOptions(sensor=sensor, csv=CsvOptions(**said))))

    return call


@pytest.fixture(scope="session")
def motion() -> SimpleNamespace:
    """20 s at 100 Hz: time_s (n,), rate (n, 3) rad/s, force (n, 3) m/s^2, field (n, 3) T, q (n, 4) FLU to ENU."""
    rng = np.random.default_rng(7)
    time_s = np.arange(2000) * 0.01
    phase, frequency = np.array([0.3, 1.1, 2.0]), np.array([0.31, 0.47, 0.23])
    rate = 0.8 * np.sin(2 * np.pi * frequency * time_s[:, np.newaxis] + phase)
    q = np.zeros((len(time_s), 4))
    q[0] = [0.0, 0.0, 0.0, 1.0]
    for k in range(len(time_s) - 1):
        q[k + 1] = multiply(q[k], from_rotation_vector(0.5 * (rate[k] + rate[k + 1]) * 0.01))
    force = rotate(conjugate(q), [0.0, 0.0, G]) + rng.normal(0, 0.05, (len(time_s), 3))
    field = rotate(conjugate(q), [0.0, 20e-6, -44e-6]) + rng.normal(0, 0.2e-6, (len(time_s), 3))
    return SimpleNamespace(time_s=time_s, rate=rate, force=force, field=field, q=q, n=len(time_s))


@pytest.fixture(scope="session")
def table() -> Callable[..., str]:
    """``table(header, *columns, sep=",", end="\\n")``: columns (n,) or (n, k) as text."""

    def call(header: str | None, *columns: np.ndarray, sep: str = ",", end: str = "\n", form: str = "%.12g") -> str:
        values = np.column_stack([np.asarray(column) for column in columns])
        lines = [sep.join(form % value for value in row) for row in values]
        return end.join([*([header] if header is not None else []), *lines, ""])

    return call
