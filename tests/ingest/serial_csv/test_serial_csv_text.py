"""However a device or a spreadsheet writes its lines: the same numbers come out, and every other line is counted."""

import numpy as np
import pytest

from attlog.ingest import serial_csv
from attlog.schemas import InputError

HEADER = "t_ms,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps"
ROWS = [f"{10 * k},0.0{k % 7},0.1,1.0,{k},-2.5,3e-1" for k in range(40)]
PLAIN = "\n".join([HEADER, *ROWS, ""])


@pytest.fixture(scope="module")
def expected(read):
    return read(PLAIN)


def same(result, expected):
    np.testing.assert_array_equal(result["/imu0/data_raw"].time_ns, expected["/imu0/data_raw"].time_ns)
    np.testing.assert_array_equal(result.rate(), expected.rate())
    np.testing.assert_array_equal(result.force(), expected.force())


WAYS = {
    "semicolons": PLAIN.replace(",", ";"),
    "tabs": PLAIN.replace(",", "\t"),
    "blanks": PLAIN.replace(",", " "),
    "many blanks": PLAIN.replace(",", "   ").replace("\n", "  \n "),
    "comma and blank": PLAIN.replace(",", ", "),
    "decimal comma": PLAIN.replace(",", ";").replace(".", ","),
    "decimal comma and tabs": PLAIN.replace(",", "\t").replace(".", ","),
    "CRLF": PLAIN.replace("\n", "\r\n"),
    "CR": PLAIN.replace("\n", "\r"),
    "BOM": "\ufeff" + PLAIN,
    "no last newline": PLAIN[:-1],
    "quoted header": PLAIN.replace(HEADER, ",".join(f'"{name}"' for name in HEADER.split(","))),
    "quoted values": "\n".join(",".join(f'"{cell}"' for cell in line.split(",")) for line in PLAIN.splitlines()) + "\n",
    "commented header": "# " + PLAIN,
    "percent header": "%" + PLAIN,
    "trailing delimiter": PLAIN.replace("\n", ",\n"),
    "trailing in data only": PLAIN.replace("\n", ",\n").replace(HEADER + ",", HEADER),
    "units below": PLAIN.replace(HEADER, "t,ax,ay,az,gx,gy,gz\nms,g,g,g,deg/s,deg/s,deg/s"),
    "groups above": PLAIN.replace(HEADER, "time (ms),accelerometer (g),,,gyroscope (deg/s),,\n,X,Y,Z,X,Y,Z").replace(
        "time (ms)", "time_ms"
    ),
}


@pytest.mark.parametrize("way", WAYS)
def test_ways_of_writing_the_same_table(read, expected, way: str) -> None:
    units = {"accel": "g", "gyro": "deg/s"}
    result = read(WAYS[way].encode(), units=units)
    same(result, expected)
    assert result.whole.completeness.complete


def test_utf16_as_a_windows_shell_redirects_it(read, expected) -> None:
    same(read(PLAIN.encode("utf-16")), expected)


def test_labels_of_the_serial_plotter(read, expected) -> None:
    names = HEADER.split(",")
    lines = [", ".join(f"{n}:{v}" for n, v in zip(names, row.split(","), strict=True)) for row in ROWS]
    same(read("\n".join(lines)), expected)


def test_names_and_equals_signs(read, expected) -> None:
    names = HEADER.split(",")
    lines = ["; ".join(f"{n} = {v}" for n, v in zip(names, row.split(","), strict=True)) for row in ROWS]
    same(read("\n".join(["Free heap: 1234", *lines])), expected)


def test_stamps_of_the_serial_monitor(read, expected) -> None:
    lines = [f"12:34:{k // 10:02d}.{k % 10}00 -> {line}" for k, line in enumerate(PLAIN.splitlines())]
    same(read("\r\n".join(lines)), expected)


def test_every_kind_of_bad_line_is_counted(read, expected) -> None:
    lines = PLAIN.splitlines()
    text = b"\n".join(
        [
            b"ets Jun  8 2016 00:22:57",
            b"rst:0x1 (POWERON_RESET),boot:0x13 (SPI_FAST_FLASH_BOOT)",
            b"load:0x3fff0030,len:1184",
            b"\xff\xfe\x90\x00\x13garbage\x80",
            b"# calibrated",
            *(line.encode() for line in lines[:11]),
            b"",
            b"100,0.02,0.1",
            b"110,0.02,0.1,1.0,1.2.3,4,5",
            b"MPU init ok",
            HEADER.encode(),
            *(line.encode() for line in lines[11:]),
            b"500,0.0",
        ]
    )
    result = read(text)
    same(result, expected)
    assert result.dropped == {
        "blank line": 1,
        "comment": 1,
        "header": 2,
        "garbage bytes": 1,
        "text": 4,
        "wrong number of fields": 2,
        "not a number": 1,
    }
    completeness = result.whole.completeness
    assert not completeness.complete
    assert completeness.messages + sum(completeness.dropped.values()) == text.count(b"\n") + 1
    said = {note.text for note in result.whole.notes}
    assert {"# calibrated", "MPU init ok", "load:0x3fff0030,len:1184"} <= said
    assert completeness.bytes_read + completeness.bytes_skipped == completeness.bytes_total == len(text)
    lost = [line for line in text.split(b"\n") if line not in (b"", b"# calibrated", HEADER.encode())]
    kept = {line.encode() for line in ROWS}
    assert completeness.bytes_skipped == sum(len(line) + 1 for line in lost if line not in kept)


def test_half_a_sample_that_runs_into_the_header(read, expected) -> None:
    """The log begins in the midst of a line, and the device resets in the midst of another."""
    text = "\n".join([f"5,0.0{HEADER}", f"0.1,0.2{HEADER}", HEADER, *ROWS[:20], f"200,0.0{HEADER}", *ROWS[20:]])
    result = read(text)
    same(result, expected)
    assert sum(result.dropped.values()) == 4


def test_values_that_are_not_there_leave_their_channel_out(read) -> None:
    header = HEADER + ",mx_uT,my_uT,mz_uT"
    rows = [row + (f",{20 + k},1,-40" if k % 5 == 0 else ",,,") for k, row in enumerate(ROWS)]
    rows[3] = rows[3].replace("1.0", "nan")
    rows[4] = rows[4].replace("3e-1", "ovf")
    result = read("\n".join([header, *rows]))
    assert len(result["/imu0/data_raw"]) == len(ROWS) - 2
    assert len(result["/mag0/field"]) == len(ROWS) // 5
    # Two lines gave no message at all.
    assert result.dropped == {"header": 1, "no value": 2}


def test_other_columns_pass_through_with_their_names(read) -> None:
    rows = [row + f",{20 + k / 8},{k % 3},ok {k}" for k, row in enumerate(ROWS)]
    result = read("\n".join([HEADER + ",Temp (°C),PacketCounter,state", *rows]), name="7 flight-a.csv")
    other = result["/csv/7_flight_a"]
    fields = {field.name: (field.type, field.comment) for field in other.channel.type.fields[1:]}
    assert fields["temp"] == ("float64", "Temp [°C]")
    assert fields["state"][0] == "string"
    np.testing.assert_array_equal(other["temp"], 20 + np.arange(len(ROWS)) / 8)
    assert other["state"][5].decode() == "ok 5"
    assert other.channel.type.name == "csv_msgs/msg/M7FlightA"


def test_two_columns_of_one_name_are_both_kept(read) -> None:
    text = PLAIN.replace("\n", ",1,2\n").replace(HEADER + ",1,2", HEADER + ",extra,extra")
    other = read(text)["/csv/log"]
    assert (other["extra"][0], other["extra_2"][0]) == (1, 2)


@pytest.mark.parametrize("text", ["", "hello\nworld\n", "a,b,c,d\n" * 9, "1,2\n3,4\n5,6\n", "\0\0\0\0" * 100])
def test_what_is_no_table_is_refused(read, text: str) -> None:
    assert not serial_csv.recognizes(text.encode())
    with pytest.raises(InputError, match="table of numbers"):
        read(text)


def test_header_alone_holds_no_data(read) -> None:
    with pytest.raises(InputError):
        read(HEADER + "\n")


def test_two_sensors_in_one_line(read) -> None:
    names = "t_ms," + ",".join(f"imu{n}_{q}" for n in (1, 2) for q in ("ax", "ay", "az", "gx", "gy", "gz"))
    rows = [f"{10 * k},0,0,1,{k},0,0,0,0,-1,0,{k},0" for k in range(30)]
    result = read("\n".join([names, *rows]), units={"accel": "g", "gyro": "deg/s"})
    assert result.topics == ["/imu0/data_raw", "/imu1/data_raw"]
    assert result.force("/imu1/data_raw")[0, 2] == pytest.approx(-9.80665)
    assert np.degrees(result.rate("/imu1/data_raw")[9, 1]) == pytest.approx(9)
