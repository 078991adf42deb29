"""Sensors and attitudes as attlog's own channels: units, frames, instances, the samples' own times."""

import numpy as np
import pytest

from attlog.schemas import Ingested
from attlog.schemas.unified import quaternions, vectors

STEP_US = 4000
COUNT = 100
COMBINED = (
    "sensor_combined:uint64_t timestamp;float[3] gyro_rad;uint32_t gyro_integral_dt;"
    "int32_t accelerometer_timestamp_relative;float[3] accelerometer_m_s2;uint32_t accelerometer_integral_dt;"
)
OLD_COMBINED = (
    "sensor_combined:uint64_t timestamp;float[3] gyro_rad;int32_t accelerometer_timestamp_relative;"
    "float[3] accelerometer_m_s2;int32_t magnetometer_timestamp_relative;float[3] magnetometer_ga;"
)
INVALID = 2**31 - 1


def filled(log, number: int, codes: str, rows) -> None:
    for row in rows:
        log.data(number, codes, *row)


def test_sensor_combined(writer, ingest, channels):
    log = writer(1_000_000).format(COMBINED).add(5, "sensor_combined")
    rows = [(1_000_000 + i * STEP_US, 0.1, 0.2, 0.3, 4000, 0, 1.0, 2.0, -9.5, 4000) for i in range(COUNT)]
    filled(log, 5, "Q3fIi3fI", rows)
    imu = channels(ingest(log))["/imu0/data_raw"]
    assert imu.time_ns.tolist() == [row[0] * 1000 for row in rows]
    np.testing.assert_allclose(vectors(imu.data, "angular_velocity")[0], [0.1, -0.2, -0.3], rtol=1e-7)
    assert vectors(imu.data, "linear_acceleration")[-1].tolist() == [1.0, -2.0, 9.5]
    assert imu["orientation_covariance"][0, 0] == -1
    assert imu.channel.metadata["source"] == "sensor_combined"
    assert imu.channel.texts["header.frame_id"] == "base_link"


def test_another_time_of_the_accelerometer(writer, ingest, channels):
    """A specific force that rises by 1 m/s^2 each millisecond, sampled 3 ms before the gyroscope; one is invalid."""
    log = writer(1_000_000).format(COMBINED).add(5, "sensor_combined")
    rows = []
    for i in range(COUNT):
        sampled = i * 4.0 - 3.0
        rows.append((1_000_000 + i * STEP_US, 0, 0, 0, 4000, -3000, sampled, 0, 0, 4000))
    rows[50] = (*rows[50][:5], INVALID, 777.0, 0, 0, 4000)
    filled(log, 5, "Q3fIi3fI", rows)
    imu = channels(ingest(log))["/imu0/data_raw"]
    force = vectors(imu.data, "linear_acceleration")[:, 0]
    np.testing.assert_allclose(force[:-1], np.arange(COUNT - 1) * 4.0, atol=1e-9)
    assert "interpolated" in imu.channel.metadata["specific_force"]


def test_the_magnetometer_in_an_old_sensor_combined(writer, ingest, channels):
    log = writer(1_000_000).format(OLD_COMBINED).add(1, "sensor_combined")
    log.format("vehicle_magnetometer:uint64_t timestamp;float[3] magnetometer_ga;").add(2, "vehicle_magnetometer", 0)
    for i in range(COUNT):
        age = (i % 5) * STEP_US + 700
        delay = INVALID if i < 5 else -age
        log.data(1, "Q3fi3fi3f", 1_000_000 + i * STEP_US, 0, 0, 0, 0, 0, 0, -9.8, delay, 0.25, i // 5, 0.5)
    log.data(2, "Q3f", 1_400_000, 1, 2, 3)
    found = channels(ingest(log))
    mag = found["/mag0/field"]
    assert mag.time_ns.tolist() == [(1_000_000 + i * STEP_US - 700) * 1000 for i in range(5, COUNT, 5)]
    np.testing.assert_allclose(vectors(mag.data, "magnetic_field")[3], [0.25e-4, -4e-4, -0.5e-4], rtol=1e-12)
    assert mag.channel.metadata["repeated"] == str(COUNT - 5 - 19)
    np.testing.assert_allclose(vectors(found["/mag1/field"].data, "magnetic_field"), [[1e-4, -2e-4, -3e-4]])


def test_increments_over_their_intervals(writer, ingest, channels):
    """vehicle_imu 1 at 200 Hz is /imu2, at the sample's own time; vehicle_imu 0 at 2 Hz is passed through only."""
    log = writer(1_000_000).format(
        "vehicle_imu:uint64_t timestamp;uint64_t timestamp_sample;float[3] delta_angle;float[3] delta_velocity;"
        "uint16_t delta_angle_dt;uint16_t delta_velocity_dt;"
    )
    log.add(1, "vehicle_imu", 0).add(2, "vehicle_imu", 1)
    for i in range(COUNT):
        time = 1_000_000 + i * 5000
        if i % 100 == 0:
            log.data(1, "QQ6fHH", time, time, 0, 0, 0, 0, 0, 0, 5000, 5000)
        dt = 0 if i == 10 else 5000
        log.data(2, "QQ6fHH", time, time - 1234, 0.01, 0.02, 0.03, 0, 0, -0.05, dt, 5000)
    found = channels(ingest(log))
    assert [topic for topic in found if topic.startswith("/imu")] == ["/imu2/data_raw"]
    imu = found["/imu2/data_raw"]
    assert len(imu) == COUNT - 1
    assert imu.channel.metadata["left_out"] == "1"
    assert imu.time_ns[0] == (1_000_000 - 1234) * 1000
    np.testing.assert_allclose(vectors(imu.data, "angular_velocity")[0], [2.0, -4.0, -6.0], rtol=1e-6)
    np.testing.assert_allclose(vectors(imu.data, "linear_acceleration")[0], [0, 0, 10.0], rtol=1e-6)


def test_raw_sensors_without_vehicle_imu(writer, ingest, channels):
    log = writer(1_000_000)
    for number, name in ((1, "sensor_gyro"), (2, "sensor_accel"), (3, "sensor_mag")):
        log.format(f"{name}:uint64_t timestamp;uint64_t timestamp_sample;float x;float y;float z;").add(number, name)
    for i in range(COUNT):
        time = 1_000_000 + i * STEP_US
        log.data(2, "QQ3f", time + 1000, time, i, 0, -9.8)
        log.data(1, "QQ3f", time + 2500, time + 2000, 0.5, 0, 0)
        if i % 10 == 0:
            log.data(3, "QQ3f", time, 0, 0.5, 0, 0)
    found = channels(ingest(log))
    imu = found["/imu1/data_raw"]
    assert imu.time_ns.tolist() == [(1_000_000 + i * STEP_US + 2000) * 1000 for i in range(COUNT - 1)]
    np.testing.assert_allclose(vectors(imu.data, "linear_acceleration")[:, 0], np.arange(COUNT - 1) + 0.5)
    assert imu.channel.metadata["source"] == "sensor_gyro+sensor_accel"
    assert len(found["/mag0/field"]) == 10
    assert found["/mag0/field"].channel.metadata["source"] == "sensor_mag"


@pytest.mark.parametrize(
    ("wxyz", "rpy_ned_deg"),
    [
        ((1, 0, 0, 0), (0, 0, 0)),
        ((np.cos(0.25), 0, 0, np.sin(0.25)), (0, 0, np.degrees(0.5))),
        ((np.cos(0.1), np.sin(0.1), 0, 0), (np.degrees(0.2), 0, 0)),
        ((2 * np.cos(0.1), 0, 2 * np.sin(0.1), 0), (0, np.degrees(0.2), 0)),
    ],
)
def test_attitudes(wxyz, rpy_ned_deg, writer, ingest, channels):
    log = writer(1_000_000)
    names = ("vehicle_attitude", "vehicle_attitude_groundtruth", "estimator_attitude")
    for number, name in enumerate(names):
        log.format(f"{name}:uint64_t timestamp;uint64_t timestamp_sample;float[4] q;").add(number, name)
    log.add(3, "estimator_attitude", 2)
    for number in range(4):
        log.data(number, "QQ4f", 1_000_000, 990_000, 0, 0, 0, 0)
        log.data(number, "QQ4f", 1_010_000, 1_009_000, *wxyz)
    found = channels(ingest(log))
    assert {t for t in found if t.endswith("/attitude")} == {
        "/reference/attitude",
        "/onboard/vehicle_attitude/attitude",
        "/onboard/estimator_attitude0/attitude",
        "/onboard/estimator_attitude2/attitude",
    }
    for topic, columns in found.items():
        if topic.endswith("/attitude"):
            assert columns.time_ns.tolist() == [1_009_000_000]
            np.testing.assert_allclose(columns["rpy_ned_deg"][0], rpy_ned_deg, atol=1e-5)
            assert np.linalg.norm(quaternions(columns.data)[0]) == pytest.approx(1.0)
            assert columns.channel.metadata["left_out"] == "1"
    assert found["/reference/attitude"].channel.texts["child_frame_id"] == "reference"
    assert found["/onboard/vehicle_attitude/attitude"].channel.texts["child_frame_id"] == "onboard_vehicle_attitude"


def position(ingested: Ingested, channels, topic: str) -> tuple[float, float, float, int, str]:
    fix = channels(ingested)[topic]
    values = (float(fix[name][0]) for name in ("latitude", "longitude", "altitude"))
    return (*values, int(fix["status"]["status"][0]), fix.channel.metadata["altitude"])


@pytest.mark.parametrize(("fix_type", "status"), [(0, -1), (1, -1), (2, 0), (3, 0), (4, 1), (5, 2), (6, 2), (8, 0)])
def test_receivers_old_and_new(fix_type, status, writer, ingest, channels):
    log = writer(1_000_000).format(
        "vehicle_gps_position:uint64_t timestamp;int32_t lat;int32_t lon;int32_t alt;int32_t alt_ellipsoid;"
        "uint8_t fix_type;"
    )
    log.add(1, "vehicle_gps_position").data(1, "Q4iB", 1_000_000, 473977422, -85455940, 488_123, 535_500, fix_type)
    log.format(
        "sensor_gps:uint64_t timestamp;double latitude_deg;double longitude_deg;double altitude_msl_m;"
        "double altitude_ellipsoid_m;uint8_t fix_type;"
    )
    log.add(2, "sensor_gps", 1).data(2, "Q4dB", 1_000_000, 47.3977422, -8.545594, 488.123, 0.0, fix_type)
    result = ingest(log)
    ellipsoid, sea = "above the WGS 84 ellipsoid", "above mean sea level"
    assert position(result, channels, "/gnss0/fix") == (47.3977422, -8.545594, 535.5, status, ellipsoid)
    assert position(result, channels, "/gnss2/fix") == (47.3977422, -8.545594, 488.123, status, sea)
