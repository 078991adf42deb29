"""Every frame and field of the real telemetry logs equals pymavlink's."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pymavlink import mavutil

from attlog.ingest import mavlink
from attlog.schemas import Ingested, IngestOptions, Kind, Source

LOGS = ("copter_radio_2015", "copter_sitl_mavlink2")


@pytest.fixture(scope="module", params=LOGS)
def both(request: pytest.FixtureRequest, logs: Path) -> tuple[Ingested, list[Any]]:
    """A log as attlog and as pymavlink read it."""
    path = logs / f"{request.param}.tlog"
    connection = mavutil.mavlink_connection(str(path), dialect="ardupilotmega", robust_parsing=True)
    messages = list(iter(connection.recv_match, None))
    connection.f.close()
    return mavlink.read(Source.from_path(path), IngestOptions()), messages


def test_every_message_and_field_equals_pymavlinks(both: tuple[Ingested, list[Any]]) -> None:
    ingested, messages = both
    expected: dict[str, list[Any]] = {}
    for m in messages:
        if m.get_type() != "BAD_DATA":
            expected.setdefault(f"/mavlink/{m.get_srcSystem()}/{m.get_srcComponent()}/{m.get_type()}", []).append(m)
    passed = {c.channel.topic: c.data for c in ingested.columns if c.channel.topic.startswith("/mavlink/")}
    assert {t: len(rows) for t, rows in passed.items()} == {t: len(group) for t, group in expected.items()}
    for topic, rows in passed.items():
        _compare(topic, rows[np.argsort(rows["received_us"], kind="stable")], expected[topic])


def _compare(topic: str, rows: Any, messages: list[Any]) -> None:
    assert rows["sequence"].tolist() == [m.get_seq() for m in messages], topic
    stamps = [round(m._timestamp * 1e6) for m in messages]
    assert np.max(np.abs(rows["received_us"].astype("i8") - stamps)) <= 1, topic  # pymavlink's stamps are doubles
    for field in messages[0].get_fieldnames():
        ours = rows[field.lower()]
        theirs = [getattr(m, field) for m in messages]
        if ours.dtype.kind == "S":
            assert [text.decode() for text in ours] == theirs, (topic, field)
        else:
            assert np.ascontiguousarray(ours).tobytes() == np.array(theirs, ours.dtype).tobytes(), (topic, field)


def test_bad_bytes_equal_pymavlinks(both: tuple[Ingested, list[Any]]) -> None:
    ingested, messages = both
    bad = [m for m in messages if m.get_type() == "BAD_DATA"]
    assert ingested.completeness.bytes_skipped == sum(len(m.data) for m in bad)
    assert ingested.completeness.dropped.get("bad checksum", 0) == len(bad)
    assert ingested.completeness.messages == len(messages) - len(bad)


def test_the_radio_log(logs: Path) -> None:
    ingested = mavlink.read(Source.from_path(logs / "copter_radio_2015.tlog"), IngestOptions())
    complete = ingested.completeness
    assert (complete.messages, complete.bytes_skipped) == (75_477, 17_082)
    assert complete.dropped == {"bad checksum": 1314, "torn last record": 1}
    systems = {c.channel.topic.split("/")[2] for c in ingested.columns if c.channel.topic.startswith("/mavlink/")}
    assert systems == {"1", "51", "255"}
    first, second = ingested.segments
    start_ns = min(int(c.time_ns.min()) for c in ingested.columns)
    assert second.reason == "reboot"
    assert (second.start_ns - start_ns) / 1e9 == pytest.approx(254.4, abs=0.5)
    assert first.end_ns < second.start_ns
    assert [f.kind for f in ingested.findings].count(Kind.REBOOT) == 1
    assert ingested.parameters["COMPASS_DEC"] == pytest.approx(0.214966, abs=1e-6)
    attitude = next(c for c in ingested.columns if c.channel.topic == "/onboard/attitude/attitude")
    trim = [float(value) for value in attitude.channel.metadata["trim_rad"].split()]
    assert trim == pytest.approx([ingested.parameters["AHRS_TRIM_X"], ingested.parameters["AHRS_TRIM_Y"]])


def test_times_follow_the_vehicles_clock(logs: Path) -> None:
    """Arrival jitters by up to two seconds; the vehicle's own intervals are kept to a few hundred ppm."""
    ingested = mavlink.read(Source.from_path(logs / "copter_radio_2015.tlog"), IngestOptions())
    imu = next(c for c in ingested.columns if c.channel.topic == "/mavlink/1/1/RAW_IMU")
    second = imu.time_ns >= ingested.segments[1].start_ns
    for part in (second, ~second):
        own = imu.data["time_usec"][part].astype("i8")
        assert np.abs(np.diff(imu.time_ns[part]) - 1000 * np.diff(own)).max() < 2e6
    delay_s = imu.data["received_us"] / 1e6 - imu.time_ns / 1e9
    assert np.ptp(delay_s) < 2.6


def test_every_channel_is_in_order(both: tuple[Ingested, list[Any]]) -> None:
    for columns in both[0].columns:
        assert np.all(np.diff(columns.time_ns) >= 0), columns.channel.topic


def test_attitude_agrees_with_the_simulators_truth(logs: Path) -> None:
    """SIMSTATE is the truth of the SITL log; the autopilot's yaw is some degrees off while its compass settles."""
    ingested = mavlink.read(Source.from_path(logs / "copter_sitl_mavlink2.tlog"), IngestOptions())
    truth, onboard = (
        next(c for c in ingested.columns if c.channel.topic == t)
        for t in ("/reference/attitude", "/onboard/attitude/attitude")
    )
    assert truth.channel.metadata["source"] == "SIMSTATE"
    assert truth.channel.metadata["stamped_by"] == "arrival"
    difference = truth.data["rpy_ned_deg"].mean(axis=0) - onboard.data["rpy_ned_deg"].mean(axis=0)
    assert np.all(np.abs(difference) < [0.1, 0.1, 5.0])
