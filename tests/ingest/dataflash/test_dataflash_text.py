"""Text logs: the same columns as the binary log of the same flight, and pymavlink's values."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from attlog.ingest import dataflash
from attlog.ingest.dataflash.text_kernels import _number, _whole
from attlog.schemas import Source
from attlog.schemas.passthrough import source_names


def passed(ingested: Any) -> dict[str, Any]:
    return {c.channel.topic: c for c in ingested.columns if c.channel.topic.startswith("/dataflash/")}


def assert_equal_columns(ours: Any, theirs: Any) -> None:
    """Strings may be of another width."""
    assert ours.keys() == theirs.keys()
    for topic, columns in ours.items():
        other = theirs[topic]
        assert np.array_equal(columns.time_ns, other.time_ns)
        for name in columns.data.dtype.names:
            floats = columns.data[name].dtype.kind == "f"
            assert np.array_equal(columns.data[name], other.data[name], equal_nan=floats), (topic, name)


def test_text_and_binary_of_one_flight_are_the_same_columns(flight: Any, ingest: Any) -> None:
    log = flight()
    log.record("MSG", 15_000_000, b"Hello, world, again")
    log.record("PARM", 15_000_001, b"COMPASS_DEC", 0.1)
    binary, text = ingest(log.binary), ingest(log.text)
    assert (binary.format, text.format) == ("dataflash", "dataflash-text")
    assert_equal_columns(passed(text), passed(binary))
    assert text.segments == binary.segments
    assert text.parameters == binary.parameters
    assert text.notes == binary.notes
    assert text.completeness.complete
    unified = [c.channel.topic for c in text.columns if not c.channel.topic.startswith("/dataflash/")]
    assert unified == ["/imu0/data_raw", "/gnss0/fix", "/onboard/att/attitude"]


@pytest.mark.parametrize("name", ["copter_sitl_truth.BIN", "plane_crash_3imu.bin"])
def test_a_real_log_written_as_text_is_read_back(name: str, logs: Path, writer: Any, ingest: Any) -> None:
    """Every type whose values text can carry; FILE's bytes are none."""
    from pymavlink import DFReader

    log = writer()
    with DFReader.DFReader_binary(str(logs / name)) as reader:
        while (message := reader.recv_msg()) is not None:
            form = message.fmt
            if message.get_type() == "FMT":
                if message.Name not in log.formats:
                    log.define(message.Type, message.Name, message.Format, message.Columns)
            elif message.get_type() != "FILE":
                log.record(form.name, *message._elements)
    binary, text = ingest(log.binary), ingest(log.text)
    ours, theirs = passed(text), passed(binary)
    assert ours.keys() == theirs.keys()
    assert text.completeness.complete
    assert_equal_columns(ours, theirs)


def test_values_are_those_of_pymavlinks_text_reader(flight: Any, ingest: Any, tmp_path: Path) -> None:
    from pymavlink import DFReader

    log = flight()
    path = tmp_path / "flight.log"
    path.write_bytes(log.text)
    ours = passed(ingest(log.text))
    checked = 0
    with DFReader.DFReader_text(str(path)) as reader:
        rows = dict.fromkeys(ours, 0)
        while (message := reader.recv_msg()) is not None:
            topic = f"/dataflash/{message.get_type()}"
            columns, row = ours[topic], rows[topic]
            rows[topic] += 1
            for position, (name, ros) in enumerate(source_names(columns.channel.type).items()):
                value, character = columns.data[ros][row], message.fmt.format[position]
                theirs = getattr(message, name)
                if character in "cCeEL":
                    assert value / (1e7 if character == "L" else 100) == theirs
                elif character == "f":
                    assert value == np.float32(theirs)
                else:
                    assert (value.decode() if isinstance(value, bytes) else value) == theirs
                checked += 1
    assert rows == {topic: len(columns) for topic, columns in ours.items()}
    assert checked > 1900


def test_a_mode_may_be_written_as_a_name(ingest: Any) -> None:
    lines = (
        "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns",
        "FMT, 1, 14, MODE, QMBB, TimeUS,Mode,ModeNum,Rsn",
        "FMT, 2, 75, MSG, QZ, TimeUS,Message",
        "MSG, 900, ArduCopter V4.1.0",
        "MODE, 1000, Stabilize, 0, 1",
        "MODE, 2000, 5, 5, 2",
    )
    ingested = ingest("\n".join(lines).encode())
    assert passed(ingested)["/dataflash/MODE"].data["mode"].tolist() == [b"Stabilize", b"5"]
    assert [note.text for note in ingested.notes if note.name == "MODE"] == [
        "mode Stabilize (reason 1)",
        "mode LOITER (reason 2)",
    ]


def test_commas_without_spaces_line_ends_and_preamble(ingest: Any) -> None:
    lines = (
        "ArduCopter V2.9.1",
        "",
        "FMT,128,89,FMT,BBnNZ,Type,Length,Name,Format,Columns",
        "FMT,1,31,PARM,QNf,TimeUS,Name,Value",
        "PARM,1000,RATE_P,0.15",
        "PARM,2000,RATE_I,1.5e-3",
    )
    for end in ("\n", "\r\n"):
        ingested = ingest(end.join(lines).encode())
        assert ingested.parameters == {"RATE_P": np.float32(0.15), "RATE_I": np.float32(0.0015)}
        assert ingested.completeness.dropped == {"unreadable lines": 1}


def test_lines_that_do_not_fit_are_counted(flight: Any, ingest: Any) -> None:
    log = flight()
    whole = len(log.lines)
    broken = [
        "IMU, 12, 0, 0.1",
        "IMU, x, 0, 1, 2, 3, 4, 5, 6",
        "IMU, 12, 256, 1, 2, 3, 4, 5, 6",
        "HUH, 1, 2",
        "MSG, 12, " + "long " * 10_000 + "!",
        "\x01\x02",
    ]
    text = "\n".join([*log.lines, *broken]).encode()
    ingested = ingest(text)
    assert ingested.completeness.messages == whole
    assert ingested.completeness.dropped == {"unreadable lines": len(broken)}
    assert ingested.completeness.bytes_skipped == sum(map(len, broken))


def test_a_type_defined_anew_holds_from_there_on(ingest: Any) -> None:
    lines = (
        "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns",
        "FMT, 1, 12, TYPE, QB, TimeUS,A",
        "TYPE, 1, 1",
        "FMT, 1, 13, TYPE, QBB, TimeUS,A,B",
        "TYPE, 2, 2, 3",
    )
    ours = passed(ingest("\n".join(lines).encode()))
    assert ours["/dataflash/TYPE"].data["a"].tolist() == [1]
    assert ours["/dataflash/TYPE_2"].data["b"].tolist() == [3]


@settings(max_examples=300, deadline=None)
@given(st.floats(allow_nan=False, allow_infinity=False), st.sampled_from(["r", ".6f", ".3g", "+.9e", ".2f"]))
def test_numbers_are_the_nearest_double_or_left_to_python(value: float, form: str) -> None:
    written = repr(value) if form == "r" else format(value, form)
    raw = np.frombuffer(written.encode(), np.uint8)
    plain, digits, power = _number(raw, 0, len(raw))
    if plain and abs(digits) <= 2**53 and -22 <= power <= 22:
        number = digits * 10.0**power if power >= 0 else digits / 10.0**-power
        assert number == float(written) or math.isclose(number, 0.0, abs_tol=0.0)


@settings(max_examples=300, deadline=None)
@given(st.integers(-(10**16), 10**16), st.integers(-20, 6))
def test_scaled_integers_round_to_the_nearest(digits: int, power: int) -> None:
    fits, whole = _whole(digits, power)
    if fits:
        twice = 2 * abs(abs(whole) * 10 ** max(-power, 0) - abs(digits) * 10 ** max(power, 0))
        assert twice <= 10 ** max(-power, 0)


@pytest.mark.parametrize(
    "token", ["nan", "NaN", "-nan", "inf", "-inf", "1e400", "123456789012345678901234567890", "0x10", "--1"]
)
def test_unusual_numbers(token: str, ingest: Any) -> None:
    lines = ("FMT, 1, 15, TYPE, Qd, TimeUS,A", f"TYPE, 1, {token}", "TYPE, 2, 2")
    ingested = ingest(("FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns\n" + "\n".join(lines)).encode())
    try:
        expected = [float(token), 2.0]
    except ValueError:
        expected = [2.0]
    assert np.array_equal(passed(ingested)["/dataflash/TYPE"].data["a"], expected, equal_nan=True)


@settings(max_examples=80, deadline=None)
@given(st.text(max_size=400), st.binary(max_size=100))
def test_no_text_whatever_crashes_it(noise: str, bytes_after: bytes) -> None:
    head = b"FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns\nFMT, 1, 12, ANY, QB, TimeUS,B\nANY, 1, 1\n"
    data = head + noise.encode(errors="surrogatepass") + bytes_after
    ingested = dataflash.read(Source("noise.log", np.frombuffer(data, np.uint8)))
    assert len(passed(ingested)["/dataflash/ANY"]) >= 1
