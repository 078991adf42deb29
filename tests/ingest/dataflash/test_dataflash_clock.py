"""Stamps and segments: UTC by GPS, reboots, gaps, wrapped counters, absurd stamps."""

from datetime import UTC, datetime
from typing import Any

import numpy as np
import pytest

from attlog.ingest.dataflash.leap_seconds import utc_from_gps
from attlog.schemas import Kind
from attlog.signals.envelope import Line, fit

SECOND = 1_000_000_000


def utc_ns(*when: int) -> int:
    return int(datetime(*when, tzinfo=UTC).timestamp()) * SECOND


@pytest.mark.parametrize(
    ("week", "second", "expected"),
    [
        (0, 0, utc_ns(1980, 1, 6)),
        (1042, 6 * 86400 + 15, utc_ns(1999, 12, 31) + 86_402 * SECOND),
        (1929, 86400 * 0 + 16, utc_ns(2016, 12, 25) - SECOND),
        (1930, 16, utc_ns(2017, 1, 1) - SECOND),
        (1930, 18, utc_ns(2017, 1, 1)),
        (2378, 0, utc_ns(2025, 8, 3) - 18 * SECOND),
    ],
)
def test_leap_seconds_are_those_of_the_date(week: int, second: int, expected: int) -> None:
    """GPS is ahead of UTC by 0 s in 1980, 13 s in 2000, 17 s until and 18 s from 2017-01-01."""
    assert utc_from_gps(np.array([week]), np.array([second * 1000])).tolist() == [expected]


def topics(ingested: Any) -> dict[str, Any]:
    return {columns.channel.topic: columns for columns in ingested.columns}


def gps_utc(utc_s: float, boot_s: float, week: int = 2200) -> int:
    return int(utc_from_gps(np.array([week]), np.array([round((utc_s + boot_s) * 1000) % 604_800_000]))[0])


def test_stamps_are_utc_on_the_envelope_of_late_gps_records(flight: Any, ingest: Any) -> None:
    """GPS records come 0, 1 or 2 ms late; the fit is that of the earliest."""
    ingested = ingest(flight(seconds=4.0, boot_s=10.0, utc_s=100_000.0).binary)
    imu = topics(ingested)["/imu0/data_raw"]
    assert imu.time_ns[0] == gps_utc(100_000.0, 10.0)
    assert np.all(np.diff(imu.time_ns) == 20_000_000)
    assert ingested.metadata["time"]["reference"] == "UTC by GPS"
    (segment,) = ingested.segments
    assert (segment.start_ns, segment.end_ns) == (imu.time_ns[0], imu.time_ns[-1])
    assert segment.start_ns - segment.boot_offset_ns == 10 * SECOND


def test_without_gps_time_is_since_boot(flight: Any, ingest: Any) -> None:
    ingested = ingest(flight(boot_s=10.0, utc_s=None).binary)
    assert topics(ingested)["/imu0/data_raw"].time_ns[0] == 10 * SECOND
    assert ingested.metadata["time"]["reference"] == "since boot"


def test_records_without_a_time_have_their_neighbours(flight: Any, ingest: Any) -> None:
    ingested = ingest(flight(utc_s=None).binary)
    assert set(topics(ingested)["/dataflash/FMT"].time_ns.tolist()) == {10 * SECOND}


def test_a_reboot_begins_a_segment_and_time_never_runs_backward(flight: Any, ingest: Any) -> None:
    log = flight(seconds=4, boot_s=100.0, utc_s=None)
    ingested = ingest(flight(seconds=4, boot_s=2.0, utc_s=None, log=log).binary)
    first, second = ingested.segments
    assert second.reason == "reboot"
    assert second.start_ns == first.end_ns + SECOND
    imu = topics(ingested)["/imu0/data_raw"]
    assert np.all(np.diff(imu.time_ns) > 0)
    assert [f.kind for f in ingested.findings if f.kind is not Kind.TRIM] == [Kind.REBOOT]


def test_a_reboot_with_gps_on_both_sides_has_both_in_utc(flight: Any, ingest: Any) -> None:
    log = flight(seconds=4, boot_s=100.0, utc_s=50_000.0)
    ingested = ingest(flight(seconds=4, boot_s=2.0, utc_s=50_200.0, log=log).binary)
    first, second = ingested.segments
    assert (first.start_ns, second.start_ns) == (gps_utc(50_000.0, 100.0), gps_utc(50_200.0, 2.0))


@pytest.mark.parametrize(("first", "second"), [(None, 50_200.0), (50_000.0, None)])
def test_a_segment_without_gps_stands_beside_the_one_with(flight: Any, ingest: Any, first: Any, second: Any) -> None:
    log = flight(seconds=4, boot_s=100.0, utc_s=first)
    segments = ingest(flight(seconds=4, boot_s=2.0, utc_s=second, log=log).binary).segments
    assert segments[1].start_ns - segments[0].end_ns == SECOND
    assert segments[0].start_ns > utc_ns(2020, 1, 1)


def test_a_later_boot_put_behind_is_a_clock_step(flight: Any, ingest: Any) -> None:
    """TimeUS runs forward, but GPS says that it is another clock."""
    log = flight(seconds=4, boot_s=10.0, utc_s=50_000.0)
    ingested = ingest(flight(seconds=4, boot_s=60.0, utc_s=51_000.0, log=log).binary)
    assert [segment.reason for segment in ingested.segments] == ["start", "clock step"]
    assert Kind.CLOCK_STEP in [finding.kind for finding in ingested.findings]


@pytest.mark.parametrize("utc_s", [None, 50_000.0])
def test_a_gap_is_no_segment(flight: Any, ingest: Any, utc_s: float | None) -> None:
    log = flight(seconds=4, boot_s=10.0, utc_s=utc_s)
    ingested = ingest(flight(seconds=4, boot_s=600.0, utc_s=utc_s, log=log).binary)
    assert len(ingested.segments) == 1
    assert np.diff(topics(ingested)["/imu0/data_raw"].time_ns).max() > 580 * SECOND


def test_blocks_out_of_order_are_one_clock_where_gps_says_so(flight: Any, ingest: Any) -> None:
    log = flight(seconds=40)
    head, body = log.pieces[:6], log.pieces[6:]
    blocks = [body[k : k + 300] for k in range(0, len(body), 300)]
    blocks[2], blocks[5] = blocks[5], blocks[2]
    mixed = ingest(b"".join([*head, *(piece for block in blocks for piece in block)]))
    assert [segment.reason for segment in mixed.segments] == ["start"]
    ordered = topics(ingest(log.binary))["/imu0/data_raw"]
    assert sorted(topics(mixed)["/imu0/data_raw"].time_ns.tolist()) == ordered.time_ns.tolist()


@pytest.mark.parametrize("wrong", [0, 1, 5_000_000, 12_500_000, 14_000_000, 10**9, 2**40, 2**63, 2**64 - 1])
@pytest.mark.parametrize("place", [0, 100, -1])
def test_one_absurd_stamp_is_its_neighbours(flight: Any, ingest: Any, wrong: int, place: int) -> None:
    log = flight(seconds=4, boot_s=10.0, utc_s=None)
    places = [k for k, piece in enumerate(log.pieces) if piece[2] == 130]
    piece = log.pieces[places[place]]
    log.pieces[places[place]] = piece[:3] + wrong.to_bytes(8, "little") + piece[11:]
    ingested = ingest(log.binary)
    assert len(ingested.segments) == 1
    stamps = topics(ingested)["/imu0/data_raw"].time_ns
    # The very first stamp may be early: a log may begin so, and go on after a gap.
    assert np.sort(stamps)[0 if place else 1] >= 9 * SECOND
    assert stamps.max() <= (15 if place != -1 else 1100) * SECOND
    assert len(stamps) == 200


def test_old_logs_in_milliseconds(writer: Any, ingest: Any) -> None:
    """TimeMS, and GPS with Week, TimeMS of the week, and T since boot."""
    log = writer()
    log.define(1, "IMU", "Iffffff", "TimeMS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ")
    log.define(2, "GPS", "BIHBcLLeeEefI", "Status,TimeMS,Week,NSats,HDop,Lat,Lng,RelAlt,Alt,Spd,GCrs,VZ,T")
    log.define(3, "PARM", "Nf", "Name,Value")
    log.record("PARM", b"X", 1.0)
    for k in range(100):
        log.record("IMU", 5000 + 20 * k, *[0.0] * 6)
        if k % 10 == 0:
            log.record("GPS", 3, 100_000_000 + 20 * k, 1800, 9, 100, 10**8, 10**7, 0, 5000, 0, 0, 0.0, 5000 + 20 * k)
    ingested = ingest(log.binary)
    start = int(utc_from_gps(np.array([1800]), np.array([100_000_000]))[0])
    passed = topics(ingested)
    assert passed["/imu0/data_raw"].time_ns[0] == start
    assert passed["/gnss0/fix"].time_ns[0] == start
    assert passed["/dataflash/PARM"].time_ns[0] == start


def test_the_oldest_logs_have_gps_time_alone(writer: Any, ingest: Any) -> None:
    log = writer()
    log.define(1, "IMU", "ffffff", "GyrX,GyrY,GyrZ,AccX,AccY,AccZ")
    log.define(2, "GPS", "BIHLLe", "Status,TimeMS,Week,Lat,Lng,Alt")
    for k in range(51):
        if k % 10 == 0:
            log.record("GPS", 3, 100_000_000 + 200 * (k // 10), 1700, 10**8, 10**7, 5000)
        log.record("IMU", *[0.0] * 6)
    imu = topics(ingest(log.binary))["/imu0/data_raw"]
    start = int(utc_from_gps(np.array([1700]), np.array([100_000_000]))[0])
    assert imu.time_ns[:50] == pytest.approx(start + 20_000_000 * np.arange(50), abs=20_000_000)
    assert np.all(np.diff(imu.time_ns) >= 0)


def test_a_log_without_any_time_says_so(writer: Any, ingest: Any) -> None:
    log = writer()
    log.define(1, "IMU", "ffffff", "GyrX,GyrY,GyrZ,AccX,AccY,AccZ")
    log.record("IMU", *[0.0] * 6)
    ingested = ingest(log.binary)
    assert topics(ingested)["/imu0/data_raw"].time_ns.tolist() == [0]
    assert any("no record of this log has a time" in finding.advice for finding in ingested.findings)


def test_a_wrapped_counter_goes_on(writer: Any, ingest: Any) -> None:
    log = writer()
    log.define(1, "IMU", "Iffffff", "TimeMS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ")
    for k in range(400):
        log.record("IMU", (2**32 - 4000 + 20 * k) % 2**32, *[0.0] * 6)
    first, second = ingest(log.binary).segments
    assert second.reason == "counter wrapped"
    assert second.start_ns - first.end_ns == SECOND


def test_the_fit_finds_offset_and_drift_under_jitter() -> None:
    rng = np.random.default_rng(5)
    boot = np.sort(rng.integers(0, 3600 * SECOND, 4000))
    late = rng.exponential(0.05 * SECOND, 4000).astype(np.int64)
    truth = Line(10**18, 20e-6, 0)
    line = fit(boot + late, truth.at(boot) - (boot + late))
    assert line is not None
    assert line.drift == pytest.approx(20e-6, abs=1e-6)
    assert np.abs(line.at(boot) - truth.at(boot)).max() < 3_000_000


def test_the_fit_of_little_has_no_drift() -> None:
    assert fit(np.empty(0, np.int64), np.empty(0, np.int64)) is None
    assert fit(np.array([5]), np.array([7])) == Line(7)
    boot = np.arange(10) * SECOND
    assert fit(boot, -boot // 1000) == Line(0)
