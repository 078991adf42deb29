"""Time: the messages' own, UTC by the receiver, what has no time, clocks that start anew."""

import numpy as np
import pytest

from attlog.schemas import Kind

GPS = "vehicle_gps_position:uint64_t timestamp;uint64_t time_utc_usec;int32_t timestamp_time_relative;uint8_t fix_type;"
UTC_US = 1_700_000_000_000_000
FIRST_US = 100_000_000


@pytest.fixture
def flight(writer):
    """A log of a fast topic; ``extend`` goes on with it."""
    log = writer(FIRST_US).format("fast:uint64_t timestamp;int32_t n;").format("slow:uint64_t timestamp;int32_t n;")
    return log.format(GPS).add(1, "fast").add(2, "slow").add(3, "vehicle_gps_position")


def extend(log, start_us: int, count: int, utc_us: int | None = None, late_us: int = 0) -> None:
    for i in range(count):
        time = start_us + 10_000 * i
        log.data(1, "Qi", time, i)
        if i % 5 == 0:
            log.data(2, "Qi", time - 3000, i)
        if utc_us is not None and i % 20 == 10:
            jitter = late_us * (i % 3)
            log.data(3, "QQiB", time, utc_us + time - start_us - jitter - 2000, -2000, 3)


def test_without_utc_time_counts_from_boot(flight, ingest, channels):
    extend(flight, FIRST_US, 50)
    result = ingest(flight)
    assert result.metadata["time"]["reference"] == "since boot"
    (segment,) = result.segments
    assert (segment.start_ns, segment.boot_offset_ns, segment.reason) == ((FIRST_US - 3000) * 1000, 0, "start")
    assert channels(result)["/ulog/fast/0"].time_ns[0] == FIRST_US * 1000


@pytest.mark.parametrize("late_us", [0, 40_000])
def test_utc_is_the_receivers_and_its_messages_come_late(late_us, flight, ingest, channels):
    extend(flight, FIRST_US, 400, UTC_US, late_us)
    result = ingest(flight)
    assert result.metadata["time"]["reference"] == "UTC by GNSS"
    stamps = channels(result)["/ulog/fast/0"].time_ns
    np.testing.assert_array_equal(stamps, (UTC_US + 10_000 * np.arange(400)) * 1000)
    assert result.segments[0].boot_offset_ns == (UTC_US - FIRST_US) * 1000


def test_a_clock_that_drifts(flight, ingest, channels):
    """50 ppm over ten minutes, at receiver messages that are up to 100 ms late."""
    late = np.random.default_rng(1).integers(0, 100_000, 600).tolist()
    for i in range(6000):
        time = FIRST_US + 100_000 * i
        flight.data(1, "Qi", time, i)
        if i % 10 == 0:
            true = UTC_US + round(100_000 * i * (1 + 50e-6))
            flight.data(3, "QQiB", time, true - late[i // 10], 0, 3)
    stamps = channels(ingest(flight))["/ulog/fast/0"].time_ns
    true = (UTC_US + np.round(100_000 * np.arange(6000) * (1 + 50e-6))) * 1000
    assert np.max(np.abs(stamps - true)) < 2e6  # ns


def test_no_fix_no_utc(flight, ingest):
    extend(flight, FIRST_US, 20)
    flight.data(3, "QQiB", FIRST_US + 200_000, UTC_US, 0, 1).data(3, "QQiB", FIRST_US + 210_000, 0, 0, 3)
    assert ingest(flight).metadata["time"]["reference"] == "since boot"


def test_microseconds_since_1970(writer, ingest, channels):
    log = writer(UTC_US).format("fast:uint64_t timestamp;int32_t n;").format(GPS).add(1, "fast")
    log.add(3, "vehicle_gps_position")
    for i in range(100):
        log.data(1, "Qi", UTC_US + 10_000 * i, i).data(3, "QQiB", UTC_US + 10_000 * i, UTC_US - 5_000_000, 0, 3)
    result = ingest(log)
    assert result.metadata["time"]["reference"] == "UTC by the log's clock"
    assert channels(result)["/ulog/fast/0"].time_ns[-1] == (UTC_US + 990_000) * 1000
    assert result.segments[0].boot_offset_ns == 0


def test_old_and_missing_times_become_the_time_of_writing(flight, ingest, channels):
    extend(flight, FIRST_US, 10)
    flight.data(2, "Qi", 2_000_000, 1).data(2, "Qi", 0, 2)
    flight.format("timeless:int32_t n;").add(7, "timeless").data(7, "i", 5)
    result = ingest(flight)
    last = (FIRST_US + 90_000) * 1000
    slow, timeless = channels(result)["/ulog/slow/0"], channels(result)["/ulog/timeless/0"]
    assert slow.time_ns[-2:].tolist() == [last, last]
    assert slow["timestamp"][-2:].tolist() == [2_000_000, 0]
    assert slow.channel.metadata["stamped_on_arrival"] == "2"
    assert timeless.time_ns.tolist() == [last]
    assert timeless.channel.metadata["stamped_by"] == "arrival"
    assert len(result.segments) == 1


def test_values_that_were_kept_long_at_the_start_of_a_log(writer, ingest):
    """PX4 writes the last value of every topic when a log begins; their times are no clock."""
    log = writer(FIRST_US)
    for number in range(60):
        log.format(f"kept{number}:uint64_t timestamp;").add(number, f"kept{number}")
    log.format("fast:uint64_t timestamp;int32_t n;").add(99, "fast")
    for number in range(60):
        log.data(number, "Q", 2_000_000 + 1000 * number)
    for i in range(100):
        log.data(99, "Qi", FIRST_US + 10_000 * i, i)
    (segment,) = ingest(log).segments
    assert (segment.start_ns, segment.end_ns) == (FIRST_US * 1000, (FIRST_US + 990_000) * 1000)


@pytest.mark.parametrize("start", [0, 3_000_000_000, 2**63])
def test_a_header_with_another_time(start, writer, ingest):
    log = writer(start).format("fast:uint64_t timestamp;int32_t n;").add(1, "fast")
    for count in (1, 3, 100):
        for i in range(count):
            log.data(1, "Qi", FIRST_US + 10_000 * i, i)
        (segment,) = ingest(log).segments
        assert segment.start_ns == FIRST_US * 1000


def test_a_reboot_within_a_log(flight, ingest, channels):
    extend(flight, FIRST_US, 200)
    extend(flight, 5_000_000, 200)
    result = ingest(flight)
    first, second = result.segments
    assert (first.reason, second.reason) == ("start", "reboot")
    assert first.end_ns == (FIRST_US + 1_990_000) * 1000
    assert second.start_ns == first.end_ns + 1_000_000_000
    stamps = channels(result)["/ulog/fast/0"].time_ns
    assert np.all(np.diff(stamps) > 0)
    assert second.start_ns - second.boot_offset_ns == (5_000_000 - 3000) * 1000
    (finding,) = [f for f in result.findings if f.kind == Kind.REBOOT]
    assert (finding.time_ns, finding.end_ns) == (first.end_ns, second.start_ns)


def test_a_reboot_between_segments_of_known_utc(flight, ingest, channels):
    extend(flight, FIRST_US, 200, UTC_US)
    extend(flight, 5_000_000, 200, UTC_US + 60_000_000)
    result = ingest(flight)
    stamps = channels(result)["/ulog/fast/0"].time_ns
    assert len(result.segments) == 2
    assert stamps[0] == UTC_US * 1000
    assert stamps[200] == (UTC_US + 60_000_000) * 1000


def test_a_small_step_back_is_a_step(flight, ingest, channels):
    extend(flight, FIRST_US, 200)
    extend(flight, FIRST_US + 1_000_000, 200)
    result = ingest(flight)
    assert len(result.segments) == 2
    assert np.all(np.diff(channels(result)["/ulog/fast/0"].time_ns) > 0)


def test_a_long_gap_is_no_new_clock(flight, ingest):
    extend(flight, FIRST_US, 200)
    extend(flight, FIRST_US + 500_000_000, 200)
    (segment,) = ingest(flight).segments
    assert segment.end_ns - segment.start_ns == (501_990_000 + 3000) * 1000


def test_a_clock_that_was_set(flight, ingest):
    """The receiver says that no time has passed while the log's clock went on by 500 s."""
    extend(flight, FIRST_US, 200, UTC_US)
    extend(flight, FIRST_US + 500_000_000, 200, UTC_US + 2_000_000)
    result = ingest(flight)
    assert [segment.reason for segment in result.segments] == ["start", "clock step"]
    assert [f.kind for f in result.findings] == [Kind.CLOCK_STEP]


@pytest.mark.parametrize(
    "wrong", [1, 2**40, 2**63 + 5, FIRST_US + 9_000_000, FIRST_US + 100_000_000, FIRST_US - 50_000_000]
)
def test_one_wrong_time_moves_nothing_else(wrong, flight, ingest, channels):
    extend(flight, FIRST_US, 200)
    flight.data(2, "Qi", wrong, -1)
    extend(flight, FIRST_US + 2_000_000, 200)
    result = ingest(flight)
    assert len(result.segments) == 1
    stamps = channels(result)["/ulog/fast/0"].time_ns
    np.testing.assert_array_equal(stamps, (FIRST_US + 10_000 * np.arange(400)) * 1000)
    odd = channels(result)["/ulog/slow/0"]
    assert odd.time_ns[odd["n"] == -1].tolist() == [(FIRST_US + 1_990_000) * 1000]
