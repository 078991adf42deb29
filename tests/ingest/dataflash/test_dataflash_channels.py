"""Unified channels of old and new logs: instances, frames, trim, and each sample's own time."""

from typing import Any

import numpy as np
import pytest

from attlog.geometry.frames import orientation_from_rpy_ned
from attlog.geometry.quaternions import angle_rad, conjugate, multiply
from attlog.schemas import Kind
from attlog.schemas.unified import quaternions, vectors

IMU = ("Qffffff", "TimeUS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ")
MAG = ("Qhhh", "TimeUS,MagX,MagY,MagZ")
VALUES = (0.1, -0.2, 0.3, 1.0, -2.0, -9.8)


def unified(ingested: Any) -> dict[str, Any]:
    return {c.channel.topic: c for c in ingested.columns if not c.channel.topic.startswith("/dataflash/")}


def angle_deg(orientation: Any, *rpy_deg: float) -> Any:
    return np.degrees(angle_rad(multiply(conjugate(orientation_from_rpy_ned(np.radians(rpy_deg))), orientation)))


def test_old_names_number_the_sensors(writer: Any, ingest: Any) -> None:
    log = writer()
    for number, suffix in enumerate(("", "2", "3"), 1):
        log.define(number, f"IMU{suffix}", *IMU)
        log.define(number + 10, f"MAG{suffix}", *MAG)
        log.record(f"IMU{suffix}", 1000, *VALUES)
        log.record(f"MAG{suffix}", 1000, 100 * number, -20, 400)
    channels = unified(ingest(log.binary))
    assert list(channels) == [*(f"/imu{n}/data_raw" for n in range(3)), *(f"/mag{n}/field" for n in range(3))]
    assert channels["/imu2/data_raw"].channel.metadata["source"] == "IMU3"
    assert vectors(channels["/imu0/data_raw"].data, "angular_velocity") == pytest.approx(np.array([[0.1, 0.2, -0.3]]))
    assert vectors(channels["/imu0/data_raw"].data, "linear_acceleration") == pytest.approx(np.array([[1.0, 2.0, 9.8]]))
    assert vectors(channels["/mag1/field"].data, "magnetic_field") == pytest.approx(
        np.array([[200e-7, 20e-7, -400e-7]])
    )


def test_column_i_numbers_the_sensors_without_fmtu(writer: Any, ingest: Any) -> None:
    log = writer()
    log.define(1, "IMU", "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ")
    for k in range(4):
        log.record("IMU", 1000 * k, k % 2, *VALUES)
    ingested = ingest(log.binary)
    assert {topic: len(c) for topic, c in unified(ingested).items()} == {"/imu0/data_raw": 2, "/imu1/data_raw": 2}
    assert "/dataflash/IMU" in {c.channel.topic for c in ingested.columns}


@pytest.mark.parametrize("names", [("ACC1", "GYR1"), ("ACC", "GYR")])
def test_raw_samples_replace_imu_at_their_own_time(names: tuple[str, str], writer: Any, ingest: Any) -> None:
    """The accelerometer runs at another rate: its force is interpolated to the gyroscope's samples."""
    acc, gyr = names
    column, instance = ("I,", (0,)) if acc == "ACC" else ("", ())
    log = writer()
    log.define(1, "IMU", *IMU)
    for number, name, axes in ((2, acc, "AccX,AccY,AccZ"), (3, gyr, "GyrX,GyrY,GyrZ")):
        log.define(number, name, f"Q{'B' if column else ''}Qfff", f"TimeUS,{column}SampleUS,{axes}")
    for k in range(100):
        log.record(gyr, 10_000_500 + 1000 * k, *instance, 10_000_000 + 1000 * k, 0.001 * k, 0.0, 0.0)
        if k % 4 == 0:
            log.record(acc, 10_000_700 + 1000 * k, *instance, 10_000_000 + 1000 * k, 0.1 * k, 0.0, -9.8)
        if k % 10 == 0:
            log.record("IMU", 10_000_000 + 1000 * k, *VALUES)
    channels = unified(ingest(log.binary))
    imu = channels["/imu0/data_raw"]
    assert imu.channel.metadata["source"] == f"{gyr}+{acc}"
    assert len(imu) == 97
    assert imu.time_ns.tolist() == [10**10 + 10**6 * k for k in range(97)]
    assert vectors(imu.data, "linear_acceleration")[:, 0] == pytest.approx(0.1 * np.arange(97), abs=1e-5)
    assert vectors(imu.data, "angular_velocity")[:, 0] == pytest.approx(0.001 * np.arange(97), abs=1e-6)


def test_a_few_raw_samples_do_not_replace_a_flight(writer: Any, ingest: Any) -> None:
    log = writer()
    log.define(1, "IMU", *IMU)
    log.define(2, "ACC1", "QQfff", "TimeUS,SampleUS,AccX,AccY,AccZ")
    log.define(3, "GYR1", "QQfff", "TimeUS,SampleUS,GyrX,GyrY,GyrZ")
    for k in range(50):
        log.record("IMU", 1000 * k, *VALUES)
    log.record("ACC1", 50_000, 50_000, 0.0, 0.0, 0.0)
    log.record("GYR1", 50_000, 50_000, 0.0, 0.0, 0.0)
    assert len(unified(ingest(log.binary))["/imu0/data_raw"]) == 50


def test_a_magnetometer_sample_has_the_time_of_its_measurement(writer: Any, ingest: Any) -> None:
    """S counts microseconds in 32 bits: it wraps after 71 minutes; 0 says nothing."""
    log = writer()
    log.define(1, "MAG", "QhhhI", "TimeUS,MagX,MagY,MagZ,S")
    start = 2**32 - 50_000
    for k, age in enumerate((2000, 3000, 4000)):
        log.record("MAG", start + 40_000 * k, k, 0, 0, (start + 40_000 * k - age) % 2**32)
    log.record("MAG", start + 120_000, 3, 0, 0, 0)
    stamps = unified(ingest(log.binary))["/mag0/field"].time_ns
    expected = [start - 2000, start + 40_000 - 3000, start + 80_000 - 4000, start + 120_000]
    assert stamps.tolist() == [1000 * value for value in expected]


def test_fixes_are_degrees_and_metres_where_there_was_one(writer: Any, ingest: Any) -> None:
    log = writer()
    for number, name in ((1, "GPS"), (2, "GPS2")):
        log.define(number, name, "QBIHLLe", "TimeUS,Status,GMS,GWk,Lat,Lng,Alt")
    log.record("GPS", 1000, 1, 0, 0, 0, 0, 0)
    log.record("GPS", 2000, 3, 1000, 2200, 473_123_456, -85_000_000, 43_012)
    log.record("GPS2", 3000, 6, 1000, 2200, 473_123_456, -85_000_000, 43_012)
    channels = unified(ingest(log.binary))
    fix = channels["/gnss0/fix"].data
    assert (fix["latitude"].tolist(), fix["longitude"].tolist(), fix["altitude"].tolist()) == (
        [47.3123456],
        [-8.5],
        [430.12],
    )
    assert fix["status"]["status"].tolist() == [0]
    assert channels["/gnss1/fix"].data["status"]["status"].tolist() == [2]


def attitudes(log: Any) -> None:
    log.define(1, "PARM", "QNf", "TimeUS,Name,Value")
    log.define(2, "ATT", "QccccCC", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw")
    log.define(3, "NKF1", "QccC", "TimeUS,Roll,Pitch,Yaw")
    log.define(4, "XKQ1", "Qffff", "TimeUS,Q1,Q2,Q3,Q4")


def test_the_trim_is_taken_out_of_att_and_nkf1(writer: Any, ingest: Any) -> None:
    """ATT of DCM is R R(trim)^T; NKF1 is roll and pitch less the trim; XKQ has no trim in it."""
    log = writer()
    attitudes(log)
    log.record("PARM", 1, b"AHRS_TRIM_X", np.radians(2.0))
    log.record("PARM", 1, b"AHRS_TRIM_Y", np.radians(-7.0))
    log.record("PARM", 1, b"AHRS_TRIM_Z", 0.0)
    log.record("ATT", 1000, 0, -200, 0, 700, 0, 9000)
    log.record("NKF1", 1000, 1800, 1200, 9000)
    log.record("XKQ1", 1000, np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))
    ingested = ingest(log.binary)
    channels = unified(ingested)
    att, nkf, xkq = (channels[f"/onboard/{name}/attitude"] for name in ("att", "nkf1", "xkq1"))
    assert angle_deg(quaternions(xkq.data), 0, 0, 90)[0] < 1e-4
    assert angle_deg(quaternions(nkf.data), 20, 5, 90)[0] < 1e-4
    # R(logged) R(trim): turns about roll and pitch do not commute, hence a quarter of a degree from level.
    assert angle_deg(quaternions(att.data), 0, 0, 90)[0] < 0.3
    assert np.allclose([float(word) for word in att.channel.metadata["trim_rad"].split()], np.radians([2, -7, 0]))
    assert att.channel.texts["child_frame_id"] == "onboard_att"
    assert not ingested.findings


def test_a_trim_set_in_flight_holds_from_there_on(writer: Any, ingest: Any) -> None:
    log = writer()
    attitudes(log)
    log.record("PARM", 1, b"AHRS_TRIM_X", 0.0)
    log.record("PARM", 1, b"AHRS_TRIM_Y", 0.0)
    log.record("ATT", 1000, 0, 0, 0, 0, 0, 9000)
    log.record("PARM", 1500, b"AHRS_TRIM_Y", np.radians(5.0))
    log.record("ATT", 2000, 0, 0, 0, 0, 0, 9000)
    att = unified(ingest(log.binary))["/onboard/att/attitude"]
    assert att.channel.metadata["trim_changed"] == "true"
    assert att.data["rpy_ned_deg"][:, 1] == pytest.approx([0.0, 5.0], abs=1e-5)


def test_without_parameters_the_trim_is_unknown_and_said_to_be(writer: Any, ingest: Any) -> None:
    log = writer()
    attitudes(log)
    log.record("ATT", 1000, 0, 1000, 0, 500, 0, 9000)
    ingested = ingest(log.binary)
    att = unified(ingested)["/onboard/att/attitude"]
    assert att.channel.metadata["trim"] == "unknown"
    assert angle_deg(quaternions(att.data), 10, 5, 90)[0] < 1e-4
    assert [(f.kind, f.topic) for f in ingested.findings] == [(Kind.TRIM, "/onboard/att/attitude")]


@pytest.mark.parametrize(("aekf", "rotated"), [(0, True), (2, False), (3, False), (10, True)])
def test_att_has_the_trim_as_the_active_filter_puts_it(aekf: int, rotated: bool, writer: Any, ingest: Any) -> None:
    """An EKF subtracts it from roll and pitch, the others turn by it: at 40 degrees of bank that is not the same."""
    log = writer()
    attitudes(log)
    log.define(5, "ATT", "QfffB", "TimeUS,Roll,Pitch,Yaw,AEKF")
    for name, value in ((b"AHRS_TRIM_X", 0.0), (b"AHRS_TRIM_Y", np.radians(-7.0)), (b"AHRS_EKF_TYPE", 3.0)):
        log.record("PARM", 1, name, value)
    log.record("ATT", 1000, 40.0, 12.0, 90.0, aekf)
    q = quaternions(unified(ingest(log.binary))["/onboard/att/attitude"].data)
    assert bool(angle_deg(q, 40, 5, 90)[0] < 1e-4) is not rotated
    logged, trim = orientation_from_rpy_ned(np.radians([40, 12, 90])), orientation_from_rpy_ned(np.radians([0, -7, 0]))
    body_turn = multiply(conjugate(orientation_from_rpy_ned([0.0, 0.0, 0.0])), trim)
    assert bool(np.degrees(angle_rad(multiply(conjugate(multiply(logged, body_turn)), q)))[0] < 1e-4) is rotated


@pytest.mark.parametrize("quaternion", [True, False])
def test_sim_is_the_reference_by_quaternion_else_by_angles(quaternion: bool, writer: Any, ingest: Any) -> None:
    log = writer()
    more = ("ffff", ",Q1,Q2,Q3,Q4") if quaternion else ("", "")
    log.define(1, "SIM", f"QccC{more[0]}", f"TimeUS,Roll,Pitch,Yaw{more[1]}")
    half = np.radians(30.004) / 2
    log.record("SIM", 1000, 3000, 0, 0, *((np.cos(half), np.sin(half), 0.0, 0.0) if quaternion else ()))
    reference = unified(ingest(log.binary))["/reference/attitude"]
    assert angle_deg(quaternions(reference.data), 30.004 if quaternion else 30.0, 0, 0)[0] < 1e-4
    assert reference.channel.texts["child_frame_id"] == "reference"


def test_cores_are_apart_with_and_without_fmtu(writer: Any, ingest: Any) -> None:
    log = writer()
    log.define(1, "XKQ", "QBffff", "TimeUS,C,Q1,Q2,Q3,Q4")
    for core in (0, 1):
        log.record("XKQ", 1000, core, 1.0, 0.0, 0.0, 0.0)
    assert list(unified(ingest(log.binary))) == ["/onboard/xkq0/attitude", "/onboard/xkq1/attitude"]
