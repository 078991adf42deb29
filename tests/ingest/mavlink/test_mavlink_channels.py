"""Units, frames, instances, vehicles, notes and parameters of the unified channels, by hand-made messages."""

import struct
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from attlog.schemas import PROFILES, InputError, Kind, Severity, UsageError
from attlog.schemas.unified import quaternions, vectors

GRAVITY = 9.80665
ARDUPILOT, PX4 = 3, 12


@pytest.fixture
def log(tape: Any, messages: Any) -> Any:
    """A tape that begins with an ArduPilot's HEARTBEAT."""
    made = tape()
    made.send(0, messages.MAVLink_heartbeat_message(2, ARDUPILOT, 81, 0, 3, 3))
    return made


def raw_imu(messages: Any, own_us: int = 1_000_000, **fields: int) -> Any:
    """RAW_IMU of a level vehicle that turns right and down about its axes by 100, 200, 300 units."""
    return messages.MAVLink_raw_imu_message(own_us, 10, 20, -1000, 100, 200, 300, 200, -50, 400, **fields)


def test_raw_imu_of_an_ardupilot(log: Any, messages: Any, tape: Any) -> None:
    """Milli-g, mrad/s and milligauss, forward right down, become SI, forward left up."""
    log.send(1, raw_imu(messages))
    ingested = log.read()
    imu, mag = (tape.channel(ingested, t) for t in ("/imu0/data_raw", "/mag0/field"))
    assert vectors(imu.data, "linear_acceleration")[0] == pytest.approx([0.01 * GRAVITY, -0.02 * GRAVITY, GRAVITY])
    assert vectors(imu.data, "angular_velocity")[0] == pytest.approx([0.1, -0.2, -0.3])
    assert vectors(mag.data, "magnetic_field")[0] == pytest.approx([200e-7, 50e-7, -400e-7])
    assert imu.channel.metadata["source"] == "RAW_IMU"
    assert imu.channel.texts["header.frame_id"] == "base_link"
    assert imu.data["orientation_covariance"][0, 0] == -1


def test_counts_need_a_sensor(tape: Any, messages: Any) -> None:
    log = tape()
    log.send(0, messages.MAVLink_heartbeat_message(2, PX4, 81, 0, 3, 3))
    log.send(1, raw_imu(messages))
    with pytest.raises(InputError, match=r"tape\.tlog: RAW_IMU of system 1 .*--sensor mpu9250"):
        log.read()
    ingested = log.read(sensor=PROFILES["mpu9250"])
    imu, mag = (tape.channel(ingested, t) for t in ("/imu0/data_raw", "/mag0/field"))
    assert vectors(imu.data, "linear_acceleration")[0, 2] == pytest.approx(1000 / 16384 * GRAVITY)
    assert vectors(imu.data, "angular_velocity")[0] == pytest.approx(np.radians([100, -200, -300]) / 131)
    assert vectors(mag.data, "magnetic_field")[0] == pytest.approx(np.array([-50, -200, 400]) * 0.15e-6)


def test_an_ardupilot_without_heartbeat(tape: Any, messages: Any) -> None:
    """Only ArduPilots send HWSTATUS."""
    log = tape()
    log.send(0, messages.MAVLink_hwstatus_message(5000, 0))
    log.send(1, raw_imu(messages))
    imu = tape.channel(log.read(), "/imu0/data_raw")
    assert vectors(imu.data, "linear_acceleration")[0, 2] == pytest.approx(GRAVITY)


def test_own_times_that_are_not_set(log: Any, messages: Any, tape: Any) -> None:
    log.send(1, messages.MAVLink_attitude_message(1000, 0, 0, 0, 0, 0, 0))
    log.send(2, raw_imu(messages, 0))
    imu = tape.channel(log.read(), "/imu0/data_raw")
    assert imu.channel.metadata["stamped_by"] == "arrival"
    assert (imu.time_ns[0] // 1000 - log.start_us) / 1e6 == pytest.approx(2)


def test_scaled_imu_stands_in_for_counts(tape: Any, messages: Any) -> None:
    log = tape()
    log.send(1, raw_imu(messages))
    log.send(1, messages.MAVLink_scaled_imu_message(1000, 0, 0, -1000, 0, 0, 0, 1, 2, 3))
    ingested = log.read()
    assert tape.channel(ingested, "/imu0/data_raw").channel.metadata["source"] == "SCALED_IMU"
    assert Kind.UNITS in [f.kind for f in ingested.findings]


def test_instances(log: Any, messages: Any, tape: Any) -> None:
    """RAW_IMU keeps SCALED_IMU off instance 0; what is always zero is no sensor."""
    log.send(1, raw_imu(messages))
    log.send(1, messages.MAVLink_scaled_imu_message(1000, 0, 0, -999, 0, 0, 0, 1, 2, 3))
    log.send(1, messages.MAVLink_scaled_imu2_message(1000, 0, 0, -998, 0, 0, 0, 0, 0, 0))
    log.send(1, messages.MAVLink_scaled_imu3_message(1000, 0, 0, 0, 0, 0, 0, 1, 2, 3))
    ingested = log.read()
    assert sorted(tape.topics(ingested)) == ["/imu0/data_raw", "/imu1/data_raw", "/mag0/field", "/mag2/field"]
    assert vectors(tape.channel(ingested, "/imu1/data_raw").data, "linear_acceleration")[0, 2] > 0.99 * GRAVITY


def test_instances_by_id(log: Any, messages: Any, tape: Any) -> None:
    for number in range(6):
        log.send(1, raw_imu(messages, 1_000_000 + number, id=number % 3))
    log.send(1, messages.MAVLink_scaled_imu2_message(1000, 0, 0, -998, 0, 0, 0, 1, 1, 1))
    ingested = log.read()
    assert [len(tape.channel(ingested, f"/imu{n}/data_raw")) for n in range(3)] == [2, 2, 2]
    assert tape.channel(ingested, "/imu1/data_raw").channel.metadata["source"] == "RAW_IMU"


def test_highres_imu(tape: Any, messages: Any) -> None:
    """SI and gauss; the magnetometer's rows are those that fields_updated names."""
    log = tape()
    for number in range(4):
        updated = 0x3F | (0x1C0 if number % 2 else 0)
        values = (1.0, 2.0, -9.8, 0.1, 0.2, 0.3, 0.2, 0.0, 0.4, 1000, 0, 0, 20)
        log.send(1, messages.MAVLink_highres_imu_message(1_000_000 + 1000 * number, *values, updated))
    log.send(2, messages.MAVLink_highres_imu_message(1_005_000, *([float("nan")] * 13), 0x3F))
    ingested = log.read()
    imu, mag = (tape.channel(ingested, t) for t in ("/imu0/data_raw", "/mag0/field"))
    assert (len(imu), len(mag)) == (4, 2)
    assert vectors(imu.data, "linear_acceleration")[0] == pytest.approx([1, -2, 9.8])
    assert vectors(mag.data, "magnetic_field")[0] == pytest.approx([0.2e-4, 0, -0.4e-4])


def test_fixes(log: Any, messages: Any, tape: Any) -> None:
    for number, fix_type in enumerate((0, 1, 2, 3, 4, 6)):
        fix = (fix_type, -353632621, 1491652374, 584090, 121, 200, 0, 0, 10)
        log.send(number, messages.MAVLink_gps_raw_int_message(1_000_000 * number, *fix))
        log.send(number, messages.MAVLink_gps2_raw_message(1_000_000 * number, *fix, 0, 0, alt_ellipsoid=603_000))
    ingested = log.read()
    fix = tape.channel(ingested, "/gnss0/fix")
    assert fix.data["status"]["status"].tolist() == [0, 0, 1, 2]
    assert (fix.data["latitude"][0], fix.data["longitude"][0]) == pytest.approx((-35.3632621, 149.1652374))
    assert fix.data["altitude"][0] == pytest.approx(584.09)
    assert fix.channel.metadata["altitude"] == "mean sea level"
    assert tape.channel(ingested, "/gnss1/fix").data["altitude"][0] == pytest.approx(603)


def parameter(messages: Any, name: str, value: float, kind: int = 9) -> Any:
    """PARAM_VALUE."""
    return messages.MAVLink_param_value_message(name.encode(), value, kind, 10, 0)


ANGLES = np.array([0.3, -0.4, 2.5])


def test_attitudes_without_trim(log: Any, messages: Any, tape: Any) -> None:
    for name in ("AHRS_TRIM_X", "AHRS_TRIM_Y"):
        log.send(0, parameter(messages, name, 0.0), component=190)
    w, x, y, z = Rotation.from_euler("ZYX", ANGLES[::-1]).as_quat()[[3, 0, 1, 2]]
    log.send(1, messages.MAVLink_attitude_message(1000, *ANGLES, 0, 0, 0))
    log.send(1, messages.MAVLink_attitude_quaternion_message(1000, w, x, y, z, 0, 0, 0))
    log.send(1, messages.MAVLink_ahrs2_message(*ANGLES, 0, 0, 0))
    log.send(1, messages.MAVLink_ahrs3_message(*ANGLES, 0, 0, 0, 0, 0, 0, 0))
    ingested = log.read()
    for source in ("attitude", "attitude_quaternion", "ahrs2", "ahrs3"):
        found = tape.channel(ingested, f"/onboard/{source}/attitude")
        assert found.data["rpy_ned_deg"][0] == pytest.approx(np.degrees(ANGLES), abs=1e-4)
        assert found.channel.texts["child_frame_id"] == f"onboard_{source}"
        assert found.channel.metadata["trim_rad"] == "0 0"


@pytest.mark.parametrize("ekf_type", [0, 3])
def test_trim_is_turned_back(log: Any, messages: Any, tape: Any, ekf_type: int) -> None:
    """DCM sends R_board R(trim)^T, the EKFs Euler angles less the trim; what comes back is the board's attitude."""
    trim = np.array([0.02, -0.1234])
    turned = Rotation.from_euler("ZYX", ANGLES[::-1]) * Rotation.from_euler("ZYX", [0, *trim[::-1]]).inv()
    dcm, ekf = turned.as_euler("ZYX")[::-1], ANGLES - [*trim, 0]
    for name, value in zip(("AHRS_TRIM_X", "AHRS_TRIM_Y", "AHRS_EKF_TYPE"), (*trim, ekf_type), strict=True):
        log.send(0, parameter(messages, name, value))
    log.send(1, messages.MAVLink_attitude_message(1000, *(ekf if ekf_type else dcm), 0, 0, 0))
    log.send(1, messages.MAVLink_ahrs2_message(*(dcm if ekf_type else ekf), 0, 0, 0))
    log.send(1, messages.MAVLink_attitude_quaternion_message(1000, *turned.as_quat()[[3, 0, 1, 2]], 0, 0, 0))
    ingested = log.read()
    for source in ("attitude", "ahrs2", "attitude_quaternion"):
        found = tape.channel(ingested, f"/onboard/{source}/attitude")
        assert found.data["rpy_ned_deg"][0] == pytest.approx(np.degrees(ANGLES), abs=1e-4)
        assert [float(value) for value in found.channel.metadata["trim_rad"].split()] == pytest.approx(trim)


def test_unknown_trim_is_a_finding(log: Any, messages: Any, tape: Any) -> None:
    log.send(1, messages.MAVLink_attitude_message(1000, *ANGLES, 0, 0, 0))
    ingested = log.read()
    assert tape.channel(ingested, "/onboard/attitude/attitude").channel.metadata["trim"] == "unknown"
    assert [f.kind for f in ingested.findings] == [Kind.TRIM]


def test_the_reference(log: Any, messages: Any, tape: Any) -> None:
    """One source, the best there is; q1 to q4 and the array are w x y z."""
    w, x, y, z = Rotation.from_euler("ZYX", ANGLES[::-1]).as_quat()[[3, 0, 1, 2]]
    more = [
        ("SIMSTATE", messages.MAVLink_simstate_message(*ANGLES, 0, 0, 0, 0, 0, 0, 0, 0)),
        ("SIM_STATE", messages.MAVLink_sim_state_message(w, x, y, z, *([0] * 17))),
        ("HIL_STATE_QUATERNION", messages.MAVLink_hil_state_quaternion_message(1_000_000, [w, x, y, z], *([0] * 14))),
    ]
    for name, message in more:
        log.send(1, message)
        reference = tape.channel(log.read(), "/reference/attitude")
        assert reference.channel.metadata["source"] == name
        assert reference.data["rpy_ned_deg"][0] == pytest.approx(np.degrees(ANGLES), abs=1e-4)
        assert np.linalg.norm(quaternions(reference.data)[0]) == pytest.approx(1)


def test_level_and_north(log: Any, messages: Any, tape: Any) -> None:
    """A level vehicle that points north: its forward axis is ENU's y."""
    log.send(1, messages.MAVLink_simstate_message(*([0] * 11)))
    x, y, z, w = quaternions(tape.channel(log.read(), "/reference/attitude").data)[0]
    assert Rotation.from_quat([x, y, z, w]).apply([1, 0, 0]) == pytest.approx([0, 1, 0])


def two_vehicles(tape: Any, messages: Any) -> Any:
    """System 51 has more IMU samples than system 7; 255 is a ground station, 9 a camera with an IMU."""
    log = tape()
    for system, samples, autopilot in ((7, 3, 3), (51, 6, 3), (9, 20, 8), (255, 0, 8)):
        log.send(0, messages.MAVLink_heartbeat_message(2, autopilot, 81, 0, 3, 3), system=system)
        for number in range(samples):
            scaled = messages.MAVLink_scaled_imu_message(1000 + number, 0, 0, -1000, 0, 0, 0, 0, 0, 0)
            log.send(0.1 * number, scaled, system=system)
    return log


def test_several_vehicles(tape: Any, messages: Any) -> None:
    log = two_vehicles(tape, messages)
    ingested = log.read()
    assert ingested.vehicle["sysid"] == "51"
    assert tape.topics(ingested) == ["/imu0/data_raw", "/vehicle7/imu0/data_raw", "/vehicle9/imu0/data_raw"]
    assert tape.channel(ingested, "/vehicle7/imu0/data_raw").channel.texts["header.frame_id"] == "vehicle7/base_link"
    assert [s.vehicle for s in ingested.segments] == ["51", "7", "9"]
    assert ingested.metadata["vehicle7"]["autopilot"] == "ArduPilot"


def test_the_vehicle_that_was_asked_for(tape: Any, messages: Any) -> None:
    log = two_vehicles(tape, messages)
    assert log.read(vehicle=7).vehicle["sysid"] == "7"
    assert "/vehicle51/imu0/data_raw" in tape.topics(log.read(vehicle="all"))
    with pytest.raises(UsageError, match="7, 9, 51, 255"):
        log.read(vehicle=3)


def test_the_autopilots_messages_count(log: Any, messages: Any, tape: Any) -> None:
    """A gimbal of the same system has an IMU too: one topic never has two sources."""
    for number in range(5):
        log.send(1, raw_imu(messages, 1_000_000 + 1000 * number), component=154)
    log.send(1, raw_imu(messages, 1_000_000))
    assert len(tape.channel(log.read(), "/imu0/data_raw")) == 1


def test_notes(log: Any, messages: Any, tape: Any) -> None:
    log.send(1, messages.MAVLink_statustext_message(4, b"Low battery"))
    log.send(2, messages.MAVLink_statustext_message(2, b"x" * 50, id=9, chunk_seq=0))
    log.send(2, messages.MAVLink_statustext_message(2, b"y" * 10, id=9, chunk_seq=1))
    log.send(3, messages.MAVLink_heartbeat_message(2, ARDUPILOT, 81 | 128, 5, 3, 3))
    log.send(4, messages.MAVLink_heartbeat_message(2, ARDUPILOT, 81, 5, 3, 3))
    log.send(5, messages.MAVLink_statustext_message(6, b"from the ground"), system=255)
    log.send(6, raw_imu(messages))
    assert [(n.severity, n.name, n.text) for n in log.read().notes] == [
        (Severity.INFO, "mode", "mode STABILIZE"),
        (Severity.WARN, "STATUSTEXT", "Low battery"),
        (Severity.ERROR, "STATUSTEXT", "x" * 50 + "y" * 10),
        (Severity.INFO, "arming", "armed"),
        (Severity.INFO, "mode", "mode LOITER"),
        (Severity.INFO, "arming", "disarmed"),
        (Severity.INFO, "system 255 STATUSTEXT", "from the ground"),
    ]


def test_severities_of_old_ardupilots(log: Any, messages: Any) -> None:
    """Before 2015's end 1 was low and 3 high; the banner at the start tells."""
    log.send(1, messages.MAVLink_statustext_message(1, b"GROUND START"), version=1)
    log.send(2, messages.MAVLink_statustext_message(3, b"Low Battery!"), version=1)
    texts = [n for n in log.read().notes if n.name == "STATUSTEXT"]
    assert [n.severity for n in texts] == [Severity.INFO, Severity.ERROR]


def test_parameters(log: Any, messages: Any) -> None:
    log.send(1, parameter(messages, "COMPASS_DEC", 0.2), component=190)
    log.send(2, parameter(messages, "A_SIXTEEN_LETTER", 1.0))
    log.send(3, parameter(messages, "A_SIXTEEN_LETTER", 2.5))
    log.send(4, parameter(messages, "COMPASS_DEC", 0.1))
    log.send(5, parameter(messages, "COMPASS_DEC", 0.3), component=190)
    found = log.read().parameters
    assert found == pytest.approx({"A_SIXTEEN_LETTER": 2.5, "COMPASS_DEC": 0.1}, abs=1e-6)


def test_parameters_of_a_px4_are_bytes(tape: Any, messages: Any) -> None:
    log = tape()
    log.send(0, messages.MAVLink_heartbeat_message(2, PX4, 81, 0, 3, 3))
    log.send(1, parameter(messages, "SYS_AUTOSTART", struct.unpack("<f", struct.pack("<i", 4001))[0], kind=6))
    log.send(1, parameter(messages, "BAT_V_EMPTY", 3.5))
    assert log.read().parameters == {"BAT_V_EMPTY": 3.5, "SYS_AUTOSTART": 4001.0}


def test_the_vehicle(log: Any, messages: Any) -> None:
    log.send(1, messages.MAVLink_statustext_message(6, b"ArduCopter V4.5.7 (2a3dc4b7)"))
    assert log.read().vehicle == {
        "sysid": "1",
        "component": "1",
        "autopilot": "ArduPilot",
        "type": "quadrotor",
        "firmware": "ArduCopter V4.5.7 (2a3dc4b7)",
    }
    version = 4 << 24 | 6 << 16 | 1 << 8 | 255
    log.send(2, messages.MAVLink_autopilot_version_message(0, version, 0, 0, 0, *([[0] * 8] * 3), 0, 0, 0))
    assert log.read().vehicle["firmware"] == "4.6.1"
