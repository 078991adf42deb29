"""What was printed with known units is what is read, and every physical line is a sample or counted with its reason."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from attlog.ingest.serial_csv.clock import stamps
from attlog.schemas import InputError

ACCEL = {"g": 9.80665, "mg": 9.80665e-3, "m/s2": 1.0}
GYRO = {"dps": np.pi / 180, "rad/s": 1.0, "mdps": np.pi / 180e3}
TIME = {"s": 10**9, "ms": 10**6, "us": 10**3, "ns": 1}
SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "blanks": "  ", "comma and blank": ", "}
JUNK = {
    "blank line": ["", "   ", "\r"],
    "comment": ["# started", "// x", "% 1,2,3", "#1,2,3,4,5,6,7"],
    "text": ["ets Jun  8 2016 00:22:57", "MPU6050 ready!", "rst:0x1 (POWERON_RESET)"],
    "garbage bytes": ["\x1b[0m", "\x00\x00\x7f", "caf\xe9,\xff\x01"],
    "wrong number of fields": ["1", "1.5{0}2", "0{0}0{0}0{0}0{0}0{0}0{0}0{0}0", "17{0}0.25{0}-"],
    "not a number": ["7{0}0{0}0{0}1.2.3{0}0{0}0{0}0", "7{0}0{0}0{0}--1{0}0{0}0{0}0", "7{0}0{0}0{0}1e{0}0{0}0{0}0"],
}


@dataclass(frozen=True)
class Printed:
    """A file, what its numbers are, and how many lines of each kind of junk it has."""

    data: bytes
    columns: tuple[str, ...]
    has_header: bool
    stamps_ns: list[int]
    values: np.ndarray
    junk: dict[str, int]


@st.composite
def files(draw: st.DrawFn) -> Printed:
    """Any of the ways in which a device prints six numbers and a time, with junk between the lines."""
    count = draw(st.integers(3, 40))
    accel, gyro, unit = (draw(st.sampled_from(sorted(names))) for names in (ACCEL, GYRO, TIME))
    separator = SEPARATORS[draw(st.sampled_from(sorted(SEPARATORS)))]
    comma = draw(st.booleans()) and separator.strip() != ","
    digits = draw(st.integers(0, 6))
    number = st.integers(-(10**7), 10**7)
    rows = [draw(st.lists(number, min_size=6, max_size=6)) for _ in range(count)]
    ticks = np.cumsum([draw(st.integers(1, 30)) for _ in range(count)])
    times = [f"{tick / 100:.2f}" if unit == "s" else str(tick) for tick in ticks.tolist()]
    stamps_ns = [int(tick) * TIME[unit] // (100 if unit == "s" else 1) for tick in ticks]
    texts = [
        [time, *(f"{value / 10**digits:.{digits}f}" for value in row)] for time, row in zip(times, rows, strict=True)
    ]
    lines = [separator.join(row) for row in texts]
    lines = [line.replace(".", ",") for line in lines] if comma else lines
    columns = (f"t_{unit}", *(f"a{axis}_{accel}" for axis in "xyz"), *(f"g{axis}_{gyro}" for axis in "xyz"))
    has_header = draw(st.booleans())
    junk: dict[str, int] = {}
    for kind in draw(st.lists(st.sampled_from(sorted(JUNK)), max_size=count)):
        text = draw(st.sampled_from(JUNK[kind])).format(separator)
        if kind == "not a number" and comma:
            text = text.replace(".", ",")
        lines.insert(draw(st.integers(0, len(lines) - 1)), text)
        junk[kind] = junk.get(kind, 0) + 1
    if has_header:
        lines.insert(0, separator.join(columns))
    end = draw(st.sampled_from(["\n", "\r\n"]))
    text = end.join(lines) + draw(st.sampled_from(["", end]))
    mark = draw(st.sampled_from([b"", b"\xef\xbb\xbf"]))
    scales = np.array([ACCEL[accel]] * 3 + [GYRO[gyro]] * 3)
    values = np.array([[float(text) for text in row[1:]] for row in texts]) * scales
    return Printed(mark + text.encode("latin-1"), columns, has_header, stamps_ns, values, junk)


@pytest.mark.filterwarnings("default::pytest.PytestUnraisableExceptionWarning")  # what other tests left open
@pytest.mark.filterwarnings("error")
@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(files())
def test_what_was_printed_is_what_is_read(read, printed: Printed) -> None:
    result = read(printed.data, strict=True, columns=() if printed.has_header else printed.columns)
    assert result.time_ns() == printed.stamps_ns
    np.testing.assert_allclose(result.force(), printed.values[:, :3], rtol=1e-15, atol=0)
    np.testing.assert_allclose(result.rate(), printed.values[:, 3:], rtol=1e-15, atol=0)


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(files())
def test_every_line_is_a_sample_or_counted(read, printed: Printed) -> None:
    result = read(printed.data, columns=() if printed.has_header else printed.columns)
    completeness = result.whole.completeness
    physical = printed.data.count(b"\n") + (not printed.data.endswith(b"\n"))
    assert completeness.messages == len(printed.stamps_ns)
    assert completeness.messages + sum(completeness.dropped.values()) == physical
    assert result.dropped.get("header", 0) == printed.has_header
    assert sum(result.dropped.values()) - printed.has_header == sum(printed.junk.values())
    assert completeness.bytes_read + completeness.bytes_skipped == completeness.bytes_total


@settings(max_examples=60, deadline=None)
@given(files(), st.data())
def test_a_file_cut_anywhere_loses_no_line_without_counting_it(read, printed: Printed, data: st.DataObject) -> None:
    header_end = printed.data.index(b"\n") if printed.has_header else 0
    at = data.draw(st.integers(header_end + len(printed.data) // 2, len(printed.data)))
    cut = printed.data[:at]
    try:
        result = read(cut, columns=() if printed.has_header else printed.columns)
    except InputError:  # too little is left
        return
    physical = cut.count(b"\n") + (not cut.endswith(b"\n"))
    assert result.whole.completeness.messages + sum(result.dropped.values()) == physical


DEVICE_NS = st.lists(st.one_of(st.integers(0, 10**12), st.integers(0, 5000), st.just(0)), min_size=1, max_size=80)


@settings(max_examples=200, deadline=None)
@example([0, 0, 0])
@example([5, 3, 3, 8, 10**12, 9])
@given(DEVICE_NS)
def test_stamps_always_rise(device: list[int]) -> None:
    result = stamps(np.array(device, np.int64) * 1000, 1000)
    assert len(result.time_ns) == len(device)
    assert bool(np.all(np.diff(result.time_ns) > 0))
    assert result.first == sorted(set(result.first))
    assert len(result.offset_ns) == len(result.first)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.integers(1, 10**6), min_size=2, max_size=60), st.data())
def test_a_reset_anywhere_keeps_the_intervals(steps: list[int], data: st.DataObject) -> None:
    time_ns = np.cumsum(steps) * 1000 + 10**12
    at = data.draw(st.integers(1, len(steps) - 1))
    device = time_ns.copy()
    device[at:] -= device[at] - data.draw(st.integers(0, 1000))
    result = stamps(device, 1000)
    if len(result.breaks) == 1 and not result.glitched.any():
        assert result.first == [0, at]
        np.testing.assert_array_equal(np.diff(result.time_ns[at:]), np.diff(time_ns[at:]))
        assert result.time_ns[at] - result.time_ns[at - 1] == 10**9
