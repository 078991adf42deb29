"""Runs: the same seed the same bytes, and what goes into a log comes out of it."""

import dataclasses

import numpy as np
import pytest

from attlog.analysis import attitude_error
from attlog.geometry.frames import enu_flu_from_ned_frd, flu_from_frd, orientation_from_rpy_ned, remove_trim
from attlog.ingest import simulation
from attlog.ingest.simulation.motion import GRAVITY
from attlog.ingest.simulation.tlog import tlog_bytes
from attlog.schemas import Attitude, StorageError, UsageError


@pytest.fixture(scope="module")
def run():
    return simulation.simulate("flight", seed=1)


@pytest.fixture(scope="module")
def messages(run, tmp_path_factory):
    """Message type -> [(arrival in s, message)], as pymavlink reads the tlog."""
    from pymavlink import mavutil

    path = tmp_path_factory.mktemp("tlog") / "run.tlog"
    simulation.write(run, path)
    log = mavutil.mavlink_connection(str(path))
    found = {}
    while (message := log.recv_msg()) is not None:
        found.setdefault(message.get_type(), []).append((message._timestamp, message))
    return found


def rows(messages, kind, *names):
    return np.array([[getattr(message, name) for name in names] for _, message in messages[kind]], dtype=np.float64)


def stamps(run, messages, kind, name, scale):
    boot_ns = run.scenario.start_ns - round(run.scenario.boot_s * 1e9)
    return np.array([getattr(m, name) for _, m in messages[kind]], dtype=np.int64) * scale + boot_ns


def test_same_seed_same_bytes_other_seed_other_noise(run):
    again = simulation.simulate("flight", seed=1)
    assert tlog_bytes(again) == tlog_bytes(run)
    other = simulation.simulate("flight", seed=2)
    assert not np.array_equal(other.imu.specific_force, run.imu.specific_force)
    assert not np.array_equal(other.truth.orientation, run.truth.orientation)


def test_one_sensor_more_or_less_changes_no_others_numbers(run):
    suite = dataclasses.replace(run.scenario.sensors, vibrations=(), disturbances=())
    calm = simulation.run_scenario(dataclasses.replace(run.scenario, sensors=suite), seed=1)
    np.testing.assert_array_equal(calm.imu.angular_velocity, run.imu.angular_velocity)
    np.testing.assert_array_equal(calm.onboard.orientation, run.onboard.orientation)
    assert not np.array_equal(calm.imu.specific_force, run.imu.specific_force)


def test_every_frame_is_valid_and_nothing_is_missing(run, messages):
    assert "BAD_DATA" not in messages
    counts = {kind: len(found) for kind, found in messages.items()}
    assert counts["RAW_IMU"] == len(run.imu.time_ns)
    assert counts["ATTITUDE"] == len(run.onboard.time_ns)
    assert counts["HIL_STATE_QUATERNION"] == len(run.reference.time_ns)
    assert counts["GPS_RAW_INT"] == len(run.fix.time_ns)
    assert {"HEARTBEAT", "SYSTEM_TIME", "PARAM_VALUE", "STATUSTEXT"} <= set(counts)
    seconds = run.scenario.trajectory.duration_s
    assert counts["RAW_IMU"] / seconds == pytest.approx(50.0, rel=0.01)
    assert counts["HEARTBEAT"] == int(seconds) + 1
    size = len(tlog_bytes(run))
    assert size < 1_000_000


def test_raw_imu_holds_the_sensors_in_whole_ardupilot_units(run, messages):
    np.testing.assert_array_equal(stamps(run, messages, "RAW_IMU", "time_usec", 1000), run.imu.time_ns)
    force = flu_from_frd(rows(messages, "RAW_IMU", "xacc", "yacc", "zacc")) * GRAVITY / 1000.0
    np.testing.assert_allclose(force, run.imu.specific_force, atol=0.5001 * GRAVITY / 1000.0)
    rate = flu_from_frd(rows(messages, "RAW_IMU", "xgyro", "ygyro", "zgyro")) * 1e-3
    np.testing.assert_allclose(rate, run.imu.angular_velocity, atol=0.5001e-3)
    field = flu_from_frd(rows(messages, "RAW_IMU", "xmag", "ymag", "zmag")) * 1e-7
    last = np.searchsorted(run.magnetometer.time_ns, run.imu.time_ns, side="right") - 1
    np.testing.assert_allclose(field, run.magnetometer.field[np.maximum(last, 0)], atol=0.5001e-7)


def test_truth_in_hil_state_quaternion(run, messages):
    q = np.array([m.attitude_quaternion for _, m in messages["HIL_STATE_QUATERNION"]])
    orientation = enu_flu_from_ned_frd(q[:, [1, 2, 3, 0]])
    at_ns = stamps(run, messages, "HIL_STATE_QUATERNION", "time_usec", 1000)
    np.testing.assert_array_equal(at_ns, run.reference.time_ns)
    error = attitude_error(Attitude(at_ns, orientation, "read"), run.reference)
    assert error["total"].max() < 1e-4
    rate = flu_from_frd(rows(messages, "HIL_STATE_QUATERNION", "rollspeed", "pitchspeed", "yawspeed"))
    np.testing.assert_allclose(rate, run.truth.angular_velocity, atol=1e-6)
    velocity = rows(messages, "HIL_STATE_QUATERNION", "vy", "vx", "vz") * [0.01, 0.01, -0.01]
    np.testing.assert_allclose(velocity, run.truth.velocity, atol=0.0051)


def test_attitude_is_trimmed_and_a_little_wrong(run, messages):
    rpy = rows(messages, "ATTITUDE", "roll", "pitch", "yaw")
    at_ns = stamps(run, messages, "ATTITUDE", "time_boot_ms", 1_000_000)
    trim = [*run.scenario.autopilot.trim_rad, 0.0]
    logged = orientation_from_rpy_ned(rpy)
    error = attitude_error(Attitude(at_ns, remove_trim(logged, trim), "attitude"), run.onboard)
    assert error["total"].max() < 1e-3
    against_truth = attitude_error(run.onboard, run.reference).statistics
    assert 0.2 < against_truth["inclination"].rmse < 1.5
    assert 0.3 < against_truth["heading"].rmse < 4.0
    as_logged = attitude_error(Attitude(at_ns, logged, "attitude"), run.reference).statistics
    assert as_logged["inclination"].rmse > against_truth["inclination"].rmse


def test_parameters_modes_texts_and_time(run, messages):
    parameters = {m.param_id: m.param_value for _, m in messages["PARAM_VALUE"]}
    assert np.degrees(parameters["COMPASS_DEC"]) == pytest.approx(11.53, abs=1e-5)
    assert (parameters["AHRS_TRIM_X"], parameters["AHRS_TRIM_Y"]) == pytest.approx(run.scenario.autopilot.trim_rad)
    beats = [m for _, m in messages["HEARTBEAT"]]
    assert {(m.type, m.autopilot) for m in beats} == {(2, 3)}
    assert [bool(m.base_mode & 128) for m in beats[:12]] == [False] * 10 + [True] * 2
    assert next(m.custom_mode for m in beats if m.custom_mode) == 4
    texts = [m.text for _, m in messages["STATUSTEXT"]]
    assert texts == [remark.text for remark in run.scenario.autopilot.remarks]
    assert messages["SYSTEM_TIME"][0][1].time_unix_usec == 0
    start_us, boot_us = run.scenario.start_ns // 1000, round(run.scenario.boot_s * 1e6)
    for _, message in messages["SYSTEM_TIME"][2:]:
        assert message.time_unix_usec - start_us == message.time_boot_ms * 1000 - boot_us


def test_gps_has_no_fix_at_first_and_then_the_path(run, messages):
    fixes = [m for _, m in messages["GPS_RAW_INT"]]
    assert [m.fix_type for m in fixes[:11]] == [1] * 10 + [3]
    assert (fixes[0].lat, fixes[0].lon) == (0, 0)
    place = rows(messages, "GPS_RAW_INT", "lat", "lon", "alt")[10:] * [1e-7, 1e-7, 1e-3]
    truth = run.scenario.place.geodetic(run.satellites.position)[10:]
    metres = (place - truth) * [110940.0, 91200.0, 1.0]
    np.testing.assert_allclose(metres.std(axis=0), [0.3, 0.3, 0.6], rtol=0.2)


def test_arrival_stamps_only_delay_and_never_go_back(run, messages):
    sent = stamps(run, messages, "RAW_IMU", "time_usec", 1000)
    arrived = np.array([round(at * 1e6) for at, _ in messages["RAW_IMU"]]) * 1000
    delay = (arrived - sent) * 1e-9
    assert delay.min() > 0.0019
    assert delay.max() < 0.2
    assert np.all(np.diff(arrived) >= 0)


def test_the_recording_and_the_columns_hold_the_same_run(run):
    log = simulation.ingested(run)
    topics = {columns.channel.topic: columns for columns in log.columns}
    assert set(topics) == {
        "/imu0/data_raw",
        "/mag0/field",
        "/gnss0/fix",
        "/reference/attitude",
        "/onboard/attitude/attitude",
    }
    recording = run.recording
    np.testing.assert_array_equal(topics["/imu0/data_raw"].time_ns, recording.imu[0].time_ns)
    assert len(recording.gnss[0].time_ns) == int(run.fixed.sum())
    assert recording.declination.degrees == pytest.approx(11.53)
    assert all(c.channel.metadata["source"] == "simulation" for c in log.columns)
    assert all(c.channel.metadata["seed"] == "1" for c in log.columns)
    assert [note.text for note in log.notes if note.name == "arming"] == ["armed", "disarmed"]
    assert [note.text for note in log.notes if note.name == "mode"][:2] == ["mode STABILIZE", "mode GUIDED"]
    assert all(a.time_ns <= b.time_ns for a, b in zip(log.notes, log.notes[1:], strict=False))


def test_compass_and_accelerometer_find_the_true_attitude_at_rest(run):
    """The chain of frames: TRIAD by scipy on the resting samples, with the declination, gives the truth."""
    from scipy.spatial.transform import Rotation

    rest = run.imu.time_ns < run.scenario.start_ns + 8 * 10**9
    field = run.magnetometer.field[: rest.sum()].mean(axis=0)
    force = run.imu.specific_force[rest].mean(axis=0)
    east_in_body, up_in_body = np.cross(field, force), force
    world = run.scenario.place.field_enu
    east, up = np.cross(world, [0.0, 0.0, 1.0]), np.array([0.0, 0.0, 1.0])
    pairs = [v / np.linalg.norm(v) for v in (east, up, east_in_body, up_in_body)]
    found, _ = Rotation.align_vectors(pairs[:2], pairs[2:])
    angle = (found * Rotation.from_quat(run.truth.orientation[0]).inv()).magnitude()
    assert np.degrees(angle) < 3.0


def test_files_by_suffix_and_never_over_another(run, tmp_path):
    path = tmp_path / "run.tlog"
    path.write_bytes(b"mine")
    with pytest.raises(StorageError, match="--force"):
        simulation.write(run, path)
    assert path.read_bytes() == b"mine"
    simulation.write(run, path, force=True)
    assert path.read_bytes() == tlog_bytes(run)
    with pytest.raises(UsageError, match=r"\.tlog or \.mcap"):
        simulation.write(run, tmp_path / "run.bin")
    with pytest.raises(StorageError, match="cannot be written"):
        simulation.write(run, tmp_path / "nowhere" / "run.tlog")
    assert [each.name for each in tmp_path.iterdir()] == ["run.tlog"]


def test_unknown_scenario_is_named():
    with pytest.raises(UsageError, match="there are: flight"):
        simulation.simulate("loop", seed=0)
    assert "flight" in simulation.scenarios()


def test_the_sample_log_is_what_its_command_makes(root, run):
    """data/ holds what ``attlog simulate flight --seed 1`` writes, byte for byte."""
    sample = root / "data" / "demo_flight.tlog"
    assert sample.read_bytes() == tlog_bytes(run)
    assert "attlog simulate flight --seed 1 -o data/demo_flight.tlog" in (root / "data" / "README.md").read_text()


def test_an_mcap_of_the_run_holds_the_very_numbers(run, tmp_path):
    """In memory or through a file: the same arrays, to the last bit."""
    from mcap.reader import make_reader

    from attlog import storage
    from attlog.schemas.unified import quaternions, vectors

    path = tmp_path / "run.mcap"
    simulation.write(run, path)
    with storage.open(path) as log:
        imu, truth = log["/imu0/data_raw"], log["/reference/attitude"]
        np.testing.assert_array_equal(imu.time_ns, run.imu.time_ns)
        np.testing.assert_array_equal(vectors(imu.data, "angular_velocity"), run.imu.angular_velocity)
        np.testing.assert_array_equal(vectors(imu.data, "linear_acceleration"), run.imu.specific_force)
        np.testing.assert_array_equal(quaternions(truth.data, "orientation"), run.reference.orientation)
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert sum(1 for _ in reader.iter_messages()) == sum(len(c) for c in simulation.ingested(run).columns)
        parameters = next(m.metadata for m in reader.iter_metadata() if m.name == "parameters")
    assert np.degrees(float(parameters["COMPASS_DEC"])) == pytest.approx(11.53)
