"""The real logs, against pyulog."""

import dataclasses

import numpy as np
import pytest

from attlog.geometry.quaternions import angle_rad, conjugate, multiply
from attlog.schemas import Kind, Severity
from attlog.schemas.unified import quaternions, vectors

pyulog = pytest.importorskip("pyulog", reason="the independent reader of these logs")

LOGS = ("px4_flight.ulg", "px4_sitl_utc_events.ulg", "px4_appended_three_times.ulg")


@pytest.fixture(scope="module", params=LOGS)
def pair(request, logs, ingest):
    path = logs / request.param
    return ingest(path), pyulog.ULog(str(path))


@pytest.fixture(scope="module")
def flight(logs, ingest):
    return ingest(logs / "px4_flight.ulg")


@pytest.fixture(scope="module")
def simulated(logs, ingest):
    return ingest(logs / "px4_sitl_utc_events.ulg")


def test_every_value_of_every_topic_is_pyulogs(pair, assert_equals_pyulog):
    assert_equals_pyulog(*pair)


def test_every_byte_is_read(pair):
    completeness = pair[0].completeness
    assert completeness.complete
    assert completeness.bytes_read == completeness.bytes_total


def test_parameters_and_their_changes(pair):
    ours, theirs = pair
    last = dict(theirs.initial_parameters) | {name: value for _, name, value in theirs.changed_parameters}
    assert ours.parameters == {name: float(value) for name, value in last.items()}
    said = [(note.time_ns, note.text.split(" (")[0]) for note in ours.notes if note.name == "parameter"]
    offset = ours.segments[0].boot_offset_ns
    assert said == [(t * 1000 + offset, f"{name} = {value:g}") for t, name, value in theirs.changed_parameters]


def test_defaults_of_parameters(pair):
    ours, theirs = pair
    stored = {
        f"{whose}.{name}": repr(float(value))
        for bit, whose in ((0, "system"), (1, "setup"))
        for name, value in theirs.get_default_parameters(bit).items()
    }
    assert dict(ours.metadata.get("ulog_parameter_defaults", {})) == stored


def test_information(pair):
    ours, theirs = pair
    record = ours.metadata["ulog_information"]
    for key, value in theirs.msg_info_dict.items():
        assert record[key] == str(value)
    for key, lists in theirs.msg_info_multiple_dict.items():
        for number, pieces in enumerate(lists):
            shown = record[f"{key}[{number}]" if len(lists) > 1 else key]
            if isinstance(pieces[0], str):
                assert shown.replace("\n", "") == "".join(pieces).replace("\n", "")
            else:
                assert shown == f"{sum(map(len, pieces))} bytes"


def test_dropouts(pair):
    ours, theirs = pair
    gaps = [(f.time_ns, f.end_ns) for f in ours.findings if f.kind == Kind.GAP]
    offset = ours.segments[0].boot_offset_ns
    assert gaps == [
        (d.timestamp * 1000 + offset, d.timestamp * 1000 + offset + d.duration * 1_000_000) for d in theirs.dropouts
    ]
    assert ours.metadata["ulog"]["dropouts"] == str(len(theirs.dropouts))


def test_logged_texts(pair):
    ours, theirs = pair
    events = any(data.name == "event" for data in theirs.data_list)
    wanted = [m.message for m in theirs.logged_messages if not (events and m.message.endswith("\t"))]
    said = [note.text for note in ours.notes if note.name == "log"]
    assert [text.replace("\x1b[32m", "").replace("\x1b[0m", "") for text in wanted] == said


def test_stamps_are_the_logs_own(pair, channels):
    ours, theirs = pair
    for data in theirs.data_list:
        columns = channels(ours)[f"/ulog/{data.name}/{data.multi_id}"]
        if "stamped_by" not in columns.channel.metadata and "stamped_on_arrival" not in columns.channel.metadata:
            np.testing.assert_array_equal(columns.time_ns, data.data["timestamp"].astype(np.int64) * 1000)


def test_what_has_no_time_of_its_own_is_stamped_on_arrival(flight, channels):
    names = [t for t, c in channels(flight).items() if c.channel.metadata.get("stamped_by") == "arrival"]
    assert names == ["/ulog/commander_state/0", "/ulog/ekf2_innovations/0", "/ulog/sensor_preflight/0"]
    for name in names:
        stamps = channels(flight)[name].time_ns
        assert np.all(np.diff(stamps) >= 0)
        assert flight.segments[0].start_ns <= stamps[0] < stamps[-1] <= flight.segments[0].end_ns


def test_the_flights_inertial_sensor(flight, logs, channels):
    columns = channels(flight)["/imu0/data_raw"]
    theirs = pyulog.ULog(str(logs / "px4_flight.ulg"), ["sensor_combined"]).data_list[0].data
    assert len(columns) == 17070
    for name, field, sign in (("gyro_rad", "angular_velocity", 1), ("accelerometer_m_s2", "linear_acceleration", 1)):
        values = vectors(columns.data, field)
        for axis, turn in enumerate((1, -1, -1)):
            np.testing.assert_array_equal(values[:, axis], sign * turn * theirs[f"{name}[{axis}]"].astype(np.float64))
    assert np.median(vectors(columns.data, "linear_acceleration")[:, 2]) == pytest.approx(9.8, abs=0.3)


def test_the_flights_magnetometer_has_every_sample_once(flight, logs, channels):
    columns = channels(flight)["/mag0/field"]
    theirs = pyulog.ULog(str(logs / "px4_flight.ulg"), ["sensor_combined"]).data_list[0].data
    times = theirs["timestamp"].astype(np.int64) + theirs["magnetometer_timestamp_relative"]
    np.testing.assert_array_equal(columns.time_ns // 1000, np.unique(times))
    strength = np.linalg.norm(vectors(columns.data, "magnetic_field"), axis=1)
    assert 25e-6 < np.median(strength) < 65e-6


def test_the_flights_attitude_follows_its_gyroscope(flight, channels):
    """The turn between two attitudes is the gyroscope's mean rate: frames, order and time fit together."""
    attitude, imu = channels(flight)["/onboard/vehicle_attitude/attitude"], channels(flight)["/imu0/data_raw"]
    q = quaternions(attitude.data)
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1.0, atol=1e-12)
    step = 47  # about half a second
    turn = multiply(conjugate(q[:-step]), q[step:])
    angle = angle_rad(turn)
    gyro = np.cumsum(vectors(imu.data, "angular_velocity"), axis=0) / 250.0
    at = [np.interp(attitude.time_ns, imu.time_ns, gyro[:, axis]) for axis in range(3)]
    total = np.stack([a[step:] - a[:-step] for a in at], axis=1)
    chosen = (angle > 0.1) & (angle < 0.5)
    measured = 2.0 * turn[chosen, :3] * np.sign(turn[chosen, 3:])
    assert np.count_nonzero(chosen) > 100
    assert np.median(np.linalg.norm(measured - total[chosen], axis=1)) < 0.05


def test_time_since_1970_is_recognised(simulated, channels):
    assert simulated.metadata["time"]["reference"] == "UTC by the log's clock"
    (segment,) = simulated.segments
    assert (segment.boot_offset_ns, segment.end_ns) == (0, 1_710_773_381_482_000_000)
    fixes = channels(simulated)["/gnss0/fix"]
    assert fixes["latitude"][0] == 47.3977422
    assert fixes["status"]["status"].tolist()[::582] == [-1, 0]


def test_instances_below_10_hz_are_passed_through_only(simulated, channels):
    assert [topic for topic in channels(simulated) if topic.startswith("/imu")] == ["/imu0/data_raw"]
    assert len(channels(simulated)["/ulog/vehicle_imu/0"]) == 62
    assert channels(simulated)["/mag0/field"].channel.metadata["source"] == "vehicle_magnetometer"


def test_events_are_said_in_pyulogs_words(simulated, logs):
    from pyulog.px4_events import PX4Events

    theirs = PX4Events().get_logged_events(pyulog.ULog(str(logs / "px4_sitl_utc_events.ulg")))
    ours = [(n.time_ns // 1000, n.text) for n in simulated.notes if n.name == "event"]
    assert ours == [(int(t), message) for t, _, message in sorted(theirs, key=lambda event: event[0])]
    assert (1710773367094000, "Takeoff detected") in ours


def test_arming_and_modes(simulated):
    said = [note.text for note in simulated.notes if note.name == "vehicle_status"]
    assert said == [
        "disarmed",
        "mode Hold",
        "armed",
        "mode Takeoff",
        "mode Hold",
        "mode Return",
        "disarmed",
        "mode Hold",
    ]


def test_who_flew(flight, simulated):
    assert {key: flight.vehicle[key] for key in ("autopilot", "type", "board")} == {
        "autopilot": "PX4",
        "type": "quadrotor",
        "board": "AUAV_X21",
    }
    assert simulated.vehicle["firmware"] == "1.15.0 development"
    assert simulated.vehicle["sysid"] == simulated.segments[0].vehicle == "1"


def test_severity_of_texts(flight):
    assert {note.severity for note in flight.notes if note.name == "log"} == {Severity.ERROR}


def test_the_same_bytes_give_the_same_columns(flight, logs, ingest):
    again = ingest(logs / "px4_flight.ulg")
    for one, other in zip(flight.columns, again.columns, strict=True):
        assert one.channel == other.channel
        assert one.data.tobytes() == other.data.tobytes()
        np.testing.assert_array_equal(one.time_ns, other.time_ns)
    assert dataclasses.astuple(flight.completeness) == dataclasses.astuple(again.completeness)
