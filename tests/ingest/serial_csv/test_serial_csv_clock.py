"""Clocks of devices: units, wraps, resets, repeated, backward and wrong stamps."""

import numpy as np
import pytest

from attlog.ingest.serial_csv.clock import stamps
from attlog.schemas import InputError, UsageError

MS = 1_000_000
STEADY = np.arange(0, 1000, 10) * MS
HEADER = "{},ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps"


def lines(name: str, times) -> str:
    """Rows that all differ, with these times as they are printed."""
    rows = [f"{time},0,0,1,{k},0,0" for k, time in enumerate(times)]
    return "\n".join([HEADER.format(name), *rows, ""])


def rising(time_ns) -> bool:
    return bool(np.all(np.diff(time_ns) > 0))


@pytest.mark.parametrize(
    ("name", "times", "unit"),
    [
        ("t_s", [f"{k * 0.01:.2f}" for k in range(50)], "s"),
        ("t_ms", [10 * k for k in range(50)], "ms"),
        ("t_us", [10_000 * k for k in range(50)], "us"),
        ("t_ns", [10_000_000 * k for k in range(50)], "ns"),
        ("t", [f"{k * 0.01:.2f}" for k in range(50)], "s"),
        ("t", [10 * k for k in range(50)], "ms"),
        ("t", [10_000 * k for k in range(50)], "us"),
        ("millis", [10 * k for k in range(50)], "ms"),
    ],
)
def test_units_of_time(read, name: str, times, unit: str) -> None:
    result = read(lines(name, times))
    assert result.time_ns() == [10 * MS * k for k in range(50)]
    assert result.whole.metadata["csv"]["time"] == f"{name} [{unit}]"
    assert bool(result.guesses) == (name == "t")


@pytest.mark.parametrize(
    ("text", "first_ns"),
    [
        ("1403636579758555392", 1403636579758555392),
        ("1403636579758555", 1403636579758555000),
        ("1403636579758", 1403636579758000000),
        ("1403636579.758555392", 1403636579758555392),
    ],
)
def test_time_since_1970_keeps_its_digits(read, text: str, first_ns: int) -> None:
    whole = text.replace(".", "")
    step = 10 ** (len(whole) - 12)
    digits = len(text.split(".")[1]) if "." in text else 0
    spelled = [str(int(whole) + k * step) for k in range(30)]
    times = [f"{value[:-digits]}.{value[-digits:]}" if digits else value for value in spelled]
    result = read(lines("timestamp", times))
    assert result.time_ns()[0] == first_ns
    assert set(np.diff(result.time_ns())) == {10 * MS}
    assert "from 1970" in result.guesses[0]


def test_dates_are_utc(read) -> None:
    times = [f"2024-05-01T12:00:{k // 100:02d}.{k % 100:02d}0Z" for k in range(150)]
    assert read(lines("time", times)).time_ns()[149] == 1714564801_490_000_000


def test_a_fixed_rate_takes_the_place_of_the_times(read) -> None:
    text = lines("t_ms", [7] * 50)
    result = read(text, rate_hz=200.0)
    assert result.time_ns() == [5 * MS * k for k in range(50)]
    assert result["/csv/log"]["t_ms"][0] == 7  # and is kept


def test_a_damaged_line_takes_its_time_at_a_fixed_rate(read) -> None:
    rows = lines("t_ms", range(20)).splitlines()
    rows[5] = "4,0,0"
    assert read("\n".join(rows), rate_hz=100.0).time_ns()[3:6] == [30 * MS, 50 * MS, 60 * MS]


def test_no_time_and_no_rate_is_refused(read) -> None:
    text = "ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\n" + "0,0,1,0,0,0\n" * 9
    with pytest.raises(InputError, match="--rate HZ"):
        read(text)
    assert len(read(text, rate_hz=50.0)["/imu0/data_raw"]) == 9


def test_a_first_column_that_rises_is_taken_for_the_time(read) -> None:
    result = read(lines("clk", range(0, 500, 10)))
    assert result.time_ns()[1] == 10 * MS
    assert "column 1 (clk)" in result.guesses[0]
    for counter in (lines("PacketCounter", range(0, 500, 10)), lines("clk", range(50))):
        with pytest.raises(InputError, match="--rate HZ"):
            read(counter)


@pytest.mark.parametrize("rate_hz", [0.0, -1.0])
def test_rates_that_are_none(read, rate_hz: float) -> None:
    with pytest.raises(UsageError, match="not above 0"):
        read(lines("t_ms", range(20)), rate_hz=rate_hz)


def test_a_column_that_falls_is_no_clock(read) -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(InputError, match="no clock"):
        read(lines("t_ms", rng.integers(0, 10**6, 50)))


@pytest.mark.parametrize(("name", "step", "tick_ns"), [("millis", 10, MS), ("micros", 1000, 1000)])
def test_a_counter_of_32_bits_wraps(read, name: str, step: int, tick_ns: int) -> None:
    counts = np.arange(2**32 - 20 * step, 2**32 + 20 * step, step)
    result = read(lines(name, counts % 2**32))
    assert result.time_ns() == (counts * tick_ns).tolist()
    first, second = result.whole.segments
    assert (second.reason, second.start_ns, second.boot_offset_ns) == (
        "counter wrapped",
        2**32 * tick_ns,
        2**32 * tick_ns,
    )
    assert first.end_ns == (2**32 - step) * tick_ns


def test_a_reset_begins_a_segment_one_second_later(read) -> None:
    result = read(lines("t_ms", [*range(5000, 6000, 10), *range(200, 1000, 10)]))
    first, second = result.whole.segments
    assert second.reason == "reset"
    assert second.start_ns == first.end_ns + 1_000_000_000
    assert second.boot_offset_ns == second.start_ns - 200 * MS
    assert [finding.kind for finding in result.whole.findings] == ["reboot"]
    assert rising(result.time_ns())


def test_a_clock_that_is_set_begins_a_segment(read) -> None:
    result = read(lines("t_ms", [*range(5000, 6000, 10), *range(1_700_000_000_000, 1_700_000_000_500, 10)]))
    assert [segment.reason for segment in result.whole.segments] == ["start of the log", "clock step"]
    assert result.time_ns()[100] == 1_700_000_000_000 * MS


@pytest.mark.parametrize("wrong", [0, 3, 496, 10**9, 4_000_000_000])
def test_one_wrong_stamp_is_put_between_its_neighbours(read, wrong: int) -> None:
    times = list(range(0, 1000, 10))
    times[50] = wrong
    result = read(lines("t_ms", times))
    if wrong != 496:
        assert result.time_ns() == [10 * MS * k for k in range(100)]
        (finding,) = result.whole.findings
        assert (finding.kind, finding.value, finding.time_ns) == ("clock_step", 1.0, 500 * MS)
    assert len(result.whole.segments) == 1
    assert rising(result.time_ns())


def test_backward_by_one_sample(read) -> None:
    times = list(range(0, 1000, 10))
    times[50] = 485
    result = read(lines("t_ms", times))
    assert len(result.whole.segments) == 1
    assert result.time_ns()[50] == 500 * MS


def test_repeated_stamps_are_spread_and_counted(read) -> None:
    result = read(lines("t_ms", [k // 4 for k in range(200)]))
    assert result.time_ns()[:6] == [0, 250_000, 500_000, 750_000, MS, 1_250_000]
    assert result.whole.metadata["csv"]["repeated_stamps"] == "150"
    assert rising(result.time_ns())


def test_a_line_printed_twice_is_dropped(read) -> None:
    rows = lines("t_ms", range(0, 500, 10)).splitlines()
    result = read("\n".join([*rows[:20], rows[19], rows[19], *rows[20:]]))
    assert result.dropped == {"header": 1, "repeated line": 2}
    assert result.time_ns() == [10 * MS * k for k in range(50)]


def test_a_pause_is_no_new_segment(read) -> None:
    result = read(lines("t_ms", [*range(0, 500, 10), *range(60_000, 60_500, 10)]))
    assert len(result.whole.segments) == 1


@pytest.mark.parametrize("place", [0, 99])
def test_a_wrong_stamp_at_an_end(place: int) -> None:
    device = STEADY.copy()
    device[place] = 10**17 if place == 0 else 0
    np.testing.assert_array_equal(stamps(device, MS).time_ns, STEADY)


def test_stamps_that_are_right_are_untouched() -> None:
    jittered = np.cumsum(np.random.default_rng(1).integers(1, 40, 1000)) * MS
    result = stamps(jittered, MS)
    assert result.time_ns is jittered
    assert not result.breaks
