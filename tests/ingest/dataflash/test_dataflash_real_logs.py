"""The two real binary logs against pymavlink, record for record, and against what is known of them."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from attlog.geometry.frames import orientation_from_rpy_ned, rpy_ned_deg
from attlog.geometry.quaternions import angle_rad, conjugate, multiply, slerp
from attlog.ingest import dataflash
from attlog.schemas import Columns, Ingested, Source
from attlog.schemas.passthrough import source_names
from attlog.schemas.unified import quaternions, vectors

LOGS = ("copter_sitl_truth.BIN", "plane_crash_3imu.bin")


@pytest.fixture(scope="module")
def read(logs: Path) -> Callable[[str], Ingested]:
    kept: dict[str, Ingested] = {}

    def of(name: str) -> Ingested:
        if name not in kept:
            kept[name] = dataflash.read(Source.from_path(logs / name))
        return kept[name]

    return of


def topics(ingested: Ingested) -> dict[str, Columns]:
    return {columns.channel.topic: columns for columns in ingested.columns}


@pytest.mark.parametrize("name", LOGS)
def test_every_record_and_value_equals_pymavlinks(
    name: str, read: Any, logs: Path, pymavlink_rows: Any, assert_same: Any
) -> None:
    assert_same(read(name), pymavlink_rows((logs / name).read_bytes()))


@pytest.mark.parametrize("name", LOGS)
def test_stored_integers_times_their_multiplier_are_pymavlinks_scaled_values(name: str, read: Any, logs: Path) -> None:
    from pymavlink import DFReader

    passed = topics(read(name))
    divisor = {"c": 100.0, "C": 100.0, "e": 100.0, "E": 100.0, "L": 1e7}
    expected: dict[tuple[str, str], list[float]] = {}
    with DFReader.DFReader_binary(str(logs / name)) as log:
        while (message := log.recv_match(type=["ATT", "AHR2", "SIM", "POS", "ORGN", "XKF1"])) is not None:
            for column, character in zip(message.fmt.columns, message.fmt.format, strict=True):
                if character in divisor:
                    core = f"/{message.C}" if message.get_type() == "XKF1" else ""
                    core = (
                        f"/{message.Type}" if "/dataflash/ORGN/0" in passed and message.get_type() == "ORGN" else core
                    )
                    place = (f"/dataflash/{message.get_type()}{core}", column)
                    expected.setdefault(place, []).append(getattr(message, column))
    assert expected
    for (topic, column), values in expected.items():
        columns = passed[topic]
        field = columns.channel.type[source_names(columns.channel.type)[column]]
        multiplier = 1e-7 if "x1e-07" in field.comment else 0.01
        assert f"x{multiplier:g}" in field.comment
        assert (columns.data[field.name] / round(1 / multiplier)).tolist() == values


def test_what_was_read_is_counted(read: Any) -> None:
    copter, plane = (read(name).completeness for name in LOGS)
    assert (copter.messages, copter.bytes_skipped, dict(copter.dropped)) == (100_000, 23, {"torn last record": 1})
    assert (plane.messages, plane.bytes_skipped, dict(plane.dropped)) == (69_769, 0, {})
    assert plane.complete
    assert not copter.complete


def test_copter_att_against_sim_as_logged(read: Any) -> None:
    """The figures that the log's description gives, over all 1997 samples."""
    passed = topics(read(LOGS[0]))
    att, sim = passed["/dataflash/ATT"].data, passed["/dataflash/SIM"].data
    assert len(att) == len(sim) == 1997
    rms = []
    for field in ("roll", "pitch", "yaw"):
        difference = att[field].astype(float) / 100 - sim[field].astype(float) / 100
        rms.append(np.sqrt(np.mean(((difference + 180) % 360 - 180) ** 2)))
    assert rms == pytest.approx([0.12, 0.10, 3.345], abs=0.006)


def test_copter_reference_is_sims_quaternion_and_agrees_with_its_euler_angles(read: Any) -> None:
    passed = topics(read(LOGS[0]))
    reference, sim = passed["/reference/attitude"], passed["/dataflash/SIM"].data
    logged = np.stack([sim[field] for field in ("roll", "pitch", "yaw")], axis=-1).astype(float) / 100
    off = multiply(conjugate(orientation_from_rpy_ned(np.radians(logged))), quaternions(reference.data))
    assert np.degrees(angle_rad(off)).max() < 0.02
    unwrapped = (reference.data["rpy_ned_deg"] - logged + 180) % 360 - 180
    assert np.abs(unwrapped).max() < 0.02


def test_plane_att_and_xkq_agree_once_the_trim_is_taken_out(read: Any) -> None:
    """AHRS_TRIM_Y = -0.1234 rad: as logged they are 7 degrees apart."""
    passed = topics(read(LOGS[1]))
    att, xkq = passed["/onboard/att/attitude"], passed["/onboard/xkq0/attitude"]
    trim = [float(word) for word in att.channel.metadata["trim_rad"].split()]
    assert trim == pytest.approx([0.000806, -0.123386, 0.0], abs=1e-6)
    assert "trim_rad" not in xkq.channel.metadata
    at_att = rpy_ned_deg(slerp(xkq.time_ns, quaternions(xkq.data), att.time_ns))
    assert np.nanmedian(np.abs(att.data["rpy_ned_deg"] - at_att)[:, 1]) < 0.02
    logged = passed["/dataflash/ATT"].data["pitch"]
    assert np.nanmedian(np.abs(logged - at_att[:, 1])) > 6.5


@pytest.mark.parametrize(("source", "limit_deg"), [("att", 0.05), ("xkf10", 0.02), ("ahr2", 0.5), ("dcm", 0.5)])
def test_plane_other_attitudes_are_in_the_same_frame(read: Any, source: str, limit_deg: float) -> None:
    passed = topics(read(LOGS[1]))
    other, xkq = passed[f"/onboard/{source}/attitude"], passed["/onboard/xkq0/attitude"]
    off = multiply(conjugate(slerp(xkq.time_ns, quaternions(xkq.data), other.time_ns)), quaternions(other.data))
    assert np.degrees(np.nanmedian(angle_rad(off))) < limit_deg


def test_an_attitude_that_was_never_filled_is_not_a_channel(read: Any) -> None:
    passed = topics(read(LOGS[1]))
    assert "/dataflash/EAHR" in passed
    assert not any("eahr" in topic for topic in passed)


def test_plane_sensors_are_si_and_flu(read: Any) -> None:
    passed = topics(read(LOGS[1]))
    assert [len(passed[f"/imu{n}/data_raw"]) for n in range(3)] == [12353, 12352, 12351]
    for n in range(3):
        stored, ours = passed[f"/dataflash/IMU/{n}"].data, passed[f"/imu{n}/data_raw"].data
        expected = np.stack([stored["accx"], -stored["accy"], -stored["accz"]], axis=-1)
        assert np.array_equal(vectors(ours, "linear_acceleration"), expected)
        expected = np.stack([stored["gyrx"], -stored["gyry"], -stored["gyrz"]], axis=-1)
        assert np.array_equal(vectors(ours, "angular_velocity"), expected)
    at_rest = vectors(passed["/imu0/data_raw"].data, "linear_acceleration")[:1000].mean(axis=0)
    assert 9 < at_rest[2] < 10.5


def test_plane_compasses_agree_because_offsets_are_in_the_logged_field(read: Any) -> None:
    """OfsX is far from 0 here: the two fields agree as logged, and would not with the offsets put in or out again."""
    passed = topics(read(LOGS[1]))
    strengths = [
        np.median(np.linalg.norm(vectors(passed[f"/mag{n}/field"].data, "magnetic_field"), axis=1)) for n in (0, 1)
    ]
    assert strengths == pytest.approx([41.3e-6, 42.1e-6], rel=0.03)
    offset = np.linalg.norm([float(passed["/dataflash/MAG/0"].data[f"ofs{axis}"][0]) for axis in "xyz"])
    assert offset > 500


def test_plane_a_stuck_compass_gives_each_measurement_once(read: Any) -> None:
    ingested = read(LOGS[1])
    mag = topics(ingested)["/mag1/field"]
    assert (len(mag), mag.channel.metadata["repeated"]) == (360, "51")
    assert np.all(np.diff(mag.time_ns) > 0)
    assert any(f.topic == "/mag1/field" and f.value == 51 for f in ingested.findings)


@pytest.mark.parametrize("name", LOGS)
def test_utc_is_that_of_the_gps(name: str, read: Any, logs: Path) -> None:
    """pymavlink takes the first fix and 18 leap seconds; ours lies on the envelope of all, so never later."""
    from pymavlink import DFReader

    ingested = read(name)
    with DFReader.DFReader_binary(str(logs / name)) as log:
        att = log.recv_match(type="ATT")
    ours = topics(ingested)["/dataflash/ATT"].time_ns[0] / 1e9
    assert -0.001 < ours - att._timestamp < 0.1
    assert ingested.metadata["time"]["reference"] == "UTC by GPS"
    assert [segment.reason for segment in ingested.segments] == ["start"]


def test_who_it_was_and_what_it_said(read: Any) -> None:
    copter, plane = (read(name) for name in LOGS)
    assert copter.vehicle["type"] == "ArduCopter"
    assert copter.vehicle["firmware"] == "ArduCopter V4.1.0-dev (0b517cfc)"
    assert plane.vehicle == {
        "autopilot": "ArduPilot",
        "type": "ArduPlane",
        "firmware": "ArduPlane V4.6.0 (9cc2b9d5)",
        "board": "CubeOrangePlus",
        "sysid": "1",
    }
    assert np.degrees(copter.parameters["COMPASS_DEC"]) == pytest.approx(11.9, abs=0.05)
    said = [(note.name, note.text) for note in copter.notes]
    assert ("MODE", "mode LAND (reason 2)") in said
    assert ("EV", "AUTO_ARMED") in said
    assert ("ARM", "disarmed") in [(note.name, note.text) for note in plane.notes]


def test_units_and_multipliers_are_in_the_comments(read: Any) -> None:
    passed = topics(read(LOGS[1]))

    def comment(topic: str, field: str) -> str:
        return passed[topic].channel.type[field].comment

    assert comment("/dataflash/IMU/0", "timeus") == "TimeUS [s] x1e-06"
    assert comment("/dataflash/IMU/0", "gyrx") == "GyrX [rad/s]"
    assert comment("/dataflash/MAG/0", "magx") == "MagX [Gauss] x0.001"
    assert comment("/dataflash/GPS/0", "lat") == "Lat [deglatitude] x1e-07"
    assert comment("/dataflash/XKF1/0", "roll") == "Roll [deg] x0.01"
