"""The two real logs convert with no options at all, and what comes out is what was measured."""

from pathlib import Path

import numpy as np
import pytest

from attlog.ingest import FORMATS, recognize, serial_csv
from attlog.schemas import Ingested, Source
from attlog.schemas.unified import vectors

G = 9.80665


def ingested(path: Path) -> Ingested:
    return serial_csv.read(Source.from_path(path))


def rate_hz(time_ns: np.ndarray) -> float:
    return float((len(time_ns) - 1) / (time_ns[-1] - time_ns[0]) * 1e9)


@pytest.mark.parametrize("name", ["ximu3_100hz.csv", "pms67_54hz.csv"])
def test_real_logs_are_recognised_as_csv_and_as_nothing_before(logs: Path, name: str) -> None:
    head = (logs / name).read_bytes()[:65536]
    assert recognize(head, name).name == "csv"
    assert list(FORMATS)[-1] == "csv"


@pytest.mark.parametrize(
    "name", ["copter_radio_2015.tlog", "plane_crash_3imu.bin", "px4_flight.ulg", "bagel_part_0.mcap"]
)
def test_other_logs_are_no_csv(logs: Path, name: str) -> None:
    assert not serial_csv.recognizes((logs / name).read_bytes()[:65536])


def test_ximu3_needs_no_guess(logs: Path) -> None:
    result = ingested(logs / "ximu3_100hz.csv")
    imu, mag = result.columns
    assert result.findings == ()
    assert (imu.channel.topic, mag.channel.topic) == ("/imu0/data_raw", "/mag0/field")
    assert len(imu) == 13514
    assert dict(result.completeness.dropped) == {"header": 1}
    assert result.completeness.complete
    assert imu.channel.metadata["frame"] == "sensor"


def test_ximu3_rates_ranges_and_gravity(logs: Path) -> None:
    result = ingested(logs / "ximu3_100hz.csv")
    imu, mag = result.columns
    assert rate_hz(imu.time_ns) == pytest.approx(99.85, abs=0.01)
    steps = np.diff(imu.time_ns) * 1e-9
    assert pytest.approx(steps.min(), abs=1e-4) == 0.0076
    assert pytest.approx(steps.max(), abs=1e-3) == 0.030
    force, rate = vectors(imu.data, "linear_acceleration"), vectors(imu.data, "angular_velocity")
    still = np.linalg.norm(rate, axis=1) < np.radians(1.0)
    assert np.median(np.linalg.norm(force[still], axis=1)) == pytest.approx(G, rel=0.01)
    assert np.degrees(np.abs(rate).max()) == pytest.approx(365.3, abs=0.1)
    # The magnetometer is read at about 20 Hz, and printed with every line.
    assert rate_hz(mag.time_ns) == pytest.approx(19.72, abs=0.05)
    assert np.median(np.linalg.norm(vectors(mag.data, "magnetic_field"), axis=1)) == pytest.approx(43.5e-6, rel=0.1)


def test_ximu3_every_value_is_the_printed_one(logs: Path) -> None:
    printed = np.loadtxt(logs / "ximu3_100hz.csv", delimiter=",", skiprows=1)
    imu, _ = ingested(logs / "ximu3_100hz.csv").columns
    np.testing.assert_array_equal(imu.time_ns, np.rint(printed[:, 0] * 1e9).astype(np.int64))
    np.testing.assert_allclose(vectors(imu.data, "angular_velocity"), np.radians(printed[:, 1:4]), rtol=1e-15)
    np.testing.assert_allclose(vectors(imu.data, "linear_acceleration"), printed[:, 4:7] * G, rtol=1e-15)


def test_pms67_units_are_guessed_and_told(logs: Path) -> None:
    result = ingested(logs / "pms67_54hz.csv")
    (imu,) = result.columns
    assert len(imu) == 2000
    assert rate_hz(imu.time_ns) == pytest.approx(54.14, abs=0.01)
    assert imu.time_ns[1] - imu.time_ns[0] == 197_172  # the first interval is 0.2 ms
    told = " / ".join(finding.advice for finding in result.findings)
    assert "time: guessed s" in told
    assert "accelerometer: guessed g" in told
    assert "gyroscope: guessed deg/s" in told
    assert [key for key in result.metadata["csv"] if key.startswith("guess")] == ["guess.1", "guess.2", "guess.3"]


def test_pms67_ranges_and_gravity(logs: Path) -> None:
    (imu,) = ingested(logs / "pms67_54hz.csv").columns
    force, rate = vectors(imu.data, "linear_acceleration"), vectors(imu.data, "angular_velocity")
    assert np.degrees(np.abs(rate).max()) == pytest.approx(250.1, abs=0.1)  # clipped
    still = np.linalg.norm(rate - np.median(rate, axis=0), axis=1) < np.radians(3.0)
    # This accelerometer reads 0.85 g at rest: it was never calibrated.
    assert np.median(np.linalg.norm(force[still], axis=1)) / G == pytest.approx(0.86, abs=0.03)
