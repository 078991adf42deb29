"""Times: the vehicle's own, fitted to UTC; reboots, steps and wraps begin segments; lost stamps are made up."""

import struct
from typing import Any

import numpy as np
import pytest

from attlog.schemas import Kind

ATTITUDE = "/mavlink/1/1/ATTITUDE"
HEARTBEAT = "/mavlink/1/1/HEARTBEAT"


def attitude(messages: Any, own_ms: float) -> Any:
    """An ATTITUDE of that own time."""
    return messages.MAVLink_attitude_message(round(own_ms) % 2**32, 0, 0, 0, 0, 0, 1)


def heartbeat(messages: Any) -> Any:
    """A HEARTBEAT of an ArduPilot."""
    return messages.MAVLink_heartbeat_message(2, 3, 81, 0, 3, 3)


def since_start(log: Any, time_ns: Any) -> Any:
    """Seconds since the tape's start."""
    return (np.asarray(time_ns) - 1000 * log.start_us) / 1e9


def test_own_times_on_the_lower_envelope_of_arrival(tape: Any, messages: Any) -> None:
    """Arrival is late by 20 ms at least and by up to 2 s; the vehicle's clock is 50 ppm fast."""
    log, chance = tape(), np.random.default_rng(1)
    true_s = np.arange(0, 400, 0.1)
    delay_s = np.minimum(0.02 + chance.exponential(0.15, len(true_s)), 2.0)
    arrival_s = np.maximum.accumulate(true_s + delay_s)
    own_ms = 60_000 + 1000 * true_s * (1 + 50e-6)
    for arrives, own in zip(arrival_s, own_ms, strict=True):
        log.send(arrives, attitude(messages, own))
    found = since_start(log, tape.channel(log.read(), ATTITUDE).time_ns)
    assert np.abs(found - 0.02 - true_s).max() < 0.005
    assert np.abs(np.diff(found) - 0.1).max() < 0.0011  # time_boot_ms counts milliseconds


def test_messages_without_own_time_take_the_vehicles_time_at_arrival(tape: Any, messages: Any) -> None:
    log = tape()
    for second in range(60):
        log.send(second + 0.5, attitude(messages, 1000 * second + 5000))
        log.send(second + 0.7, heartbeat(messages))
    log.send(60, messages.MAVLink_system_time_message(log.start_us + 159_500_000, 64_500))
    ingested = log.read()
    beats = tape.channel(ingested, HEARTBEAT)
    assert beats.channel.metadata["stamped_by"] == "arrival"
    assert "stamped_by" not in tape.channel(ingested, ATTITUDE).channel.metadata
    assert since_start(log, beats.time_ns) == pytest.approx(100 + np.arange(60.0) + 0.2)
    assert ingested.metadata["mavlink"]["utc_from"] == "SYSTEM_TIME"


def test_system_time_that_is_zero_is_no_utc(tape: Any, messages: Any) -> None:
    log = tape()
    for second in range(20):
        log.send(second, attitude(messages, 1000 * second + 5000))
        log.send(second, messages.MAVLink_system_time_message(0, 1000 * second + 5000))
    ingested = log.read()
    assert ingested.metadata["mavlink"]["utc_from"] == "log stamps"
    assert since_start(log, tape.channel(ingested, ATTITUDE).time_ns) == pytest.approx(np.arange(20.0))


def run(log: Any, messages: Any, own_ms: float, arrival_s: float, count: int = 300) -> tuple[float, float]:
    """Send ``count`` attitudes, 0.1 s apart; own time and arrival of what would come next."""
    for number in range(count):
        log.send(arrival_s + 0.1 * number, attitude(messages, own_ms + 100 * number))
    return own_ms + 100 * count, arrival_s + 0.1 * count


def reasons(ingested: Any) -> list[str]:
    """Why the segments begin."""
    return [s.reason for s in ingested.segments]


def test_reboot(tape: Any, messages: Any) -> None:
    log = tape()
    _, arrival = run(log, messages, 100_000, 0)
    run(log, messages, 7_000, arrival + 20)
    ingested = log.read()
    assert reasons(ingested) == ["start", "reboot"]
    assert since_start(log, [s.start_ns for s in ingested.segments]) == pytest.approx([0, 50])
    assert since_start(log, [s.end_ns for s in ingested.segments]) == pytest.approx([29.9, 79.9])
    assert [s.boot_offset_ns // 10**9 - log.start_us // 10**6 for s in ingested.segments] == [-100, 43]
    assert [f.kind for f in ingested.findings] == [Kind.REBOOT]


def test_wrap_of_the_32_bit_clock(tape: Any, messages: Any) -> None:
    log = tape()
    run(log, messages, 2**32 - 10_000, 0)
    ingested = log.read()
    assert reasons(ingested) == ["start", "wrap"]
    assert since_start(log, tape.channel(ingested, ATTITUDE).time_ns) == pytest.approx(0.1 * np.arange(300), abs=2e-3)


@pytest.mark.parametrize("step_s", [-3600.0, -5.0, 5.0, 3600.0, 100_000.0])
def test_steps_of_the_ground_clock(tape: Any, messages: Any, step_s: float) -> None:
    log = tape()
    own, arrival = run(log, messages, 100_000, 0)
    run(log, messages, own, arrival + step_s)
    ingested = log.read()
    assert reasons(ingested) == ["start", "clock_step"]
    found = since_start(log, tape.channel(ingested, ATTITUDE).time_ns)
    assert np.all(np.diff(found) > 0)
    assert found[300] == pytest.approx(30 + max(step_s, 0))  # never backward: then its own clock counts on
    assert [f.kind for f in ingested.findings] == [Kind.CLOCK_STEP]


def test_jitter_and_bursts_are_no_steps(tape: Any, messages: Any) -> None:
    """A link that stalls for 20 s and then delivers all at once."""
    log = tape()
    for number in range(1000):
        own_s = 0.1 * number
        log.send(max(own_s, 50.0 + own_s / 1e4) if 30 < own_s < 50 else own_s, attitude(messages, 5000 + 1000 * own_s))
    ingested = log.read()
    assert reasons(ingested) == ["start"]
    assert since_start(log, tape.channel(ingested, ATTITUDE).time_ns) == pytest.approx(0.1 * np.arange(1000), abs=2e-3)


def test_disorder_is_no_reboot(tape: Any, messages: Any) -> None:
    log, chance = tape(), np.random.default_rng(2)
    own_s = np.arange(0, 60, 0.1)
    order = np.argsort(own_s + chance.uniform(0, 3, len(own_s)))
    for arrival, own in zip(own_s, own_s[order], strict=True):
        log.send(arrival + 3, attitude(messages, 5000 + 1000 * own))
    ingested = log.read()
    assert reasons(ingested) == ["start"]
    times = tape.channel(ingested, ATTITUDE).time_ns
    assert np.diff(times) / 1e9 == pytest.approx(0.1, abs=2e-3)


def test_blocks_in_the_wrong_order_are_sorted(tape: Any, messages: Any) -> None:
    log = tape()
    records = [
        struct.pack(">Q", log.start_us + 100_000 * n) + log.frame(attitude(messages, 5000 + 100 * n))
        for n in range(300)
    ]
    log.data += b"".join(records[:100] + records[200:] + records[100:200])
    ingested = log.read()
    assert reasons(ingested) == ["start"]
    assert since_start(log, tape.channel(ingested, ATTITUDE).time_ns) == pytest.approx(0.1 * np.arange(300), abs=2e-3)


def test_lost_and_impossible_stamps(tape: Any, messages: Any) -> None:
    log = tape()
    for number in range(200):
        at = len(log.data)
        log.send(0.1 * number, heartbeat(messages))
        if number == 50:
            log.data[at + 2] ^= 0x40  # a bit of the stamp
        if number == 120:
            log.data[at : at + 8] = b"\x01\x02\x03"  # what is left of it
    ingested = log.read()
    assert ingested.completeness.messages == 200
    assert ingested.completeness.bytes_skipped == 3
    assert ingested.metadata["mavlink"]["stamps_repaired"] == "2"
    assert since_start(log, tape.channel(ingested, HEARTBEAT).time_ns) == pytest.approx(0.1 * np.arange(200), abs=2e-3)
    assert any("stamp" in f.advice for f in ingested.findings)


def test_a_stamp_parted_from_its_frame(tape: Any, messages: Any) -> None:
    log = tape()
    for number in range(50):
        frame = log.frame(attitude(messages, 5000 + 100 * number))
        log.put(0.1 * number, b"\x00" * 20 + frame if number == 25 else frame)
    complete = log.read().completeness
    assert (complete.messages, complete.bytes_skipped, sum(complete.dropped.values())) == (50, 20, 1)


def test_stamps_that_are_no_utc(tape: Any, messages: Any) -> None:
    """A logger without a clock: times count from the vehicle's boot, and are of one piece for all messages."""
    log = tape(start_us=3_000_000)
    _, arrival = run(log, messages, 100_000, 0)
    log.send(arrival, heartbeat(messages))
    run(log, messages, 7_000, arrival + 20)
    ingested = log.read()
    times = tape.channel(ingested, ATTITUDE).time_ns / 1e9
    assert times[:300] == pytest.approx(100 + 0.1 * np.arange(300))
    assert times[300:] == pytest.approx(130.9 + 0.1 * np.arange(300))
    assert tape.channel(ingested, HEARTBEAT).time_ns / 1e9 == pytest.approx([130.0])
    assert ingested.metadata["mavlink"]["utc_from"] == "since boot"


def test_a_second_component_with_a_clock_of_its_own(tape: Any, messages: Any) -> None:
    """A gimbal that booted later, and whose clock says nothing of UTC, is put on the vehicle's time."""
    log = tape()
    for number in range(300):
        log.send(0.1 * number, attitude(messages, 50_000 + 100 * number))
        log.send(0.1 * number + 0.03, attitude(messages, 2_000 + 100 * number), component=154)
    log.send(30, messages.MAVLink_system_time_message(log.start_us + 130_000_000, 80_000))
    ingested = log.read()
    assert since_start(log, tape.channel(ingested, ATTITUDE).time_ns) == pytest.approx(100 + 0.1 * np.arange(300))
    gimbal = tape.channel(ingested, "/mavlink/1/154/ATTITUDE")
    assert since_start(log, gimbal.time_ns) == pytest.approx(100.03 + 0.1 * np.arange(300))
    assert [s.vehicle for s in ingested.segments] == ["1"]


def test_raw_streams_count_from_boot(tape: Any, messages: Any) -> None:
    log = tape(stamped=False)
    run(log, messages, 100_000, 0)
    log.send(0, heartbeat(messages))
    run(log, messages, 7_000, 0)
    ingested = log.read()
    assert reasons(ingested) == ["start", "reboot"]
    times = tape.channel(ingested, ATTITUDE).time_ns / 1e9
    assert times[:300] == pytest.approx(100 + 0.1 * np.arange(300))
    assert times[300:] == pytest.approx(129.9 + 1 + 0.1 * np.arange(300))
    assert tape.channel(ingested, HEARTBEAT).time_ns / 1e9 == pytest.approx([129.9])


def test_raw_stream_with_utc(tape: Any, messages: Any) -> None:
    log = tape(stamped=False)
    log.send(0, messages.MAVLink_system_time_message(log.start_us, 90_000))
    run(log, messages, 100_000, 0)
    assert since_start(log, tape.channel(log.read(), ATTITUDE).time_ns) == pytest.approx(10 + 0.1 * np.arange(300))


def test_a_raw_stream_without_any_time(tape: Any, messages: Any) -> None:
    log = tape(stamped=False)
    for _ in range(10):
        log.send(0, heartbeat(messages))
    ingested = log.read()
    assert ingested.completeness.messages == 10
    assert any("numbered" in f.advice for f in ingested.findings)


def test_own_times_from_1970(tape: Any, messages: Any) -> None:
    """They are UTC themselves, and tell what the log's stamps lack for the clock that counts from boot."""
    log = tape()
    for number in range(100):
        utc_us = log.start_us + 30_000_000 + 100_000 * number
        log.send(
            0.1 * number, messages.MAVLink_highres_imu_message(utc_us, 0, 0, -9.8, 0, 0, 0, 0.2, 0, 0.4, 0, 0, 0, 0, 63)
        )
        log.send(0.1 * number, attitude(messages, 5000 + 100 * number))
    ingested = log.read()
    for topic in ("/imu0/data_raw", ATTITUDE):
        assert since_start(log, tape.channel(ingested, topic).time_ns) == pytest.approx(30 + 0.1 * np.arange(100))


def test_an_old_fix_takes_the_time_of_its_arrival(tape: Any, messages: Any) -> None:
    log = tape()
    for number in range(3000):
        log.send(0.1 * number, attitude(messages, 5000 + 100 * number))
        if number % 10 == 0:
            fix_us = 1000 * (5000 + 100 * min(number, 1000) - 50)
            log.send(0.1 * number, messages.MAVLink_gps_raw_int_message(fix_us, 3, 1, 1, 1, 1, 1, 1, 1, 9))
    fixes = tape.channel(log.read(), "/gnss0/fix").time_ns
    found = since_start(log, fixes)
    assert found[:100] == pytest.approx(np.arange(100.0) - 0.05)
    assert found[170:] == pytest.approx(np.arange(170.0, 300.0))


def test_a_simulation_that_is_faster_than_real_time(tape: Any, messages: Any) -> None:
    log = tape()
    for number in range(2000):
        log.send(0.02 * number, attitude(messages, 5000 + 100 * number))
    ingested = log.read()
    assert reasons(ingested) == ["start"]
    assert np.diff(tape.channel(ingested, ATTITUDE).time_ns) / 1e9 == pytest.approx(0.1)
    assert any("5.00 s in a second" in f.advice for f in ingested.findings)


def test_utc_set_anew_in_flight(tape: Any, messages: Any) -> None:
    log = tape()
    for number in range(300):
        late_us = 0 if number < 150 else 40_000_000
        log.send(0.1 * number, attitude(messages, 5000 + 100 * number))
        if number % 5 == 0:
            utc_us = log.start_us + 100_000 * number + late_us
            log.send(0.1 * number, messages.MAVLink_system_time_message(utc_us, 5000 + 100 * number))
    ingested = log.read()
    assert reasons(ingested) == ["start", "clock_step"]
    times = since_start(log, tape.channel(ingested, ATTITUDE).time_ns)
    assert times[0] == pytest.approx(0)
    assert times[-1] == pytest.approx(29.9 + 40)
    assert np.all(np.diff(times) > 0)


def test_utc_that_comes_late_after_a_reboot_is_no_step(tape: Any, messages: Any) -> None:
    """The fix comes 20 s after each start; all of a boot is on the UTC that it brings."""
    log = tape()
    for boot in range(2):
        for number in range(600):
            own, at = 5000 + 100 * number, 100 * boot + 0.1 * number
            log.send(at, attitude(messages, own))
            utc_us = log.start_us + 7_000_000 + round(1e6 * at) if number > 200 else 0
            log.send(at, messages.MAVLink_system_time_message(utc_us, own))
    ingested = log.read()
    assert reasons(ingested) == ["start", "reboot"]
    assert since_start(log, [s.start_ns for s in ingested.segments]) == pytest.approx([7, 107])


def test_segments_never_overlap_in_random_histories(tape: Any, messages: Any) -> None:
    """Reboots and steps of either clock at random; time never runs backward in the order of the log."""
    for seed in range(25):
        chance = np.random.default_rng(seed)
        log, own, arrival = tape(stamped=bool(seed % 4)), 5000.0, 0.0
        for _ in range(5):
            own, arrival = run(log, messages, own, arrival, int(chance.integers(30, 200)))
            event = chance.integers(3)
            own = float(chance.integers(1000, 30_000)) if event == 0 else own
            arrival += float(chance.normal(0, 300)) if event == 1 else 5.0
        ingested = log.read()
        edges = [t for s in ingested.segments for t in (s.start_ns, s.end_ns)]
        assert edges == sorted(edges), seed
        times = tape.channel(ingested, ATTITUDE).time_ns
        inside = [(times >= s.start_ns) & (times <= s.end_ns) for s in ingested.segments]
        assert np.all(np.sum(inside, axis=0) == 1), seed
