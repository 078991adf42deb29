"""Addresses, pieces, cuts and stamps of live sources, without any port."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from attlog import ingest, storage
from attlog.ingest import live
from attlog.ingest.live.cutting import Frames, Lines
from attlog.ingest.live.options import from_text, to_text
from attlog.ingest.live.pieces import grouped
from attlog.schemas import PROFILES, AttitudeColumns, CsvOptions, IngestOptions, Source, UsageError, World

START = 1_700_000_000_000_000_000
CSV = b"t_us,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\n"


@pytest.mark.parametrize(
    ("spelled", "kind", "transport", "place", "number"),
    [
        ("serial:/dev/ttyUSB0:115200", "csv", "serial", "/dev/ttyUSB0", 115200),
        ("serial:/dev/ttyUSB0", "csv", "serial", "/dev/ttyUSB0", 115200),
        ("serial:COM3:9600", "csv", "serial", "COM3", 9600),
        ("mavlink:udpin:0.0.0.0:14550", "mavlink", "udpin", "0.0.0.0", 14550),
        ("mavlink:tcp:drone.local:5760", "mavlink", "tcp", "drone.local", 5760),
        ("mavlink:serial:/dev/ttyACM0:57600", "mavlink", "serial", "/dev/ttyACM0", 57600),
    ],
)
def test_addresses(spelled: str, kind: str, transport: str, place: str, number: int) -> None:
    address = live.Address.parse(spelled)
    assert (address.kind, address.transport, address.place, address.number) == (kind, transport, place, number)
    assert live.Address.parse(str(address)) == address


@pytest.mark.parametrize(
    "spelled",
    [
        "",
        "serial",
        "serial:",
        "udpin:0.0.0.0:1",
        "mavlink:",
        "mavlink:udpin:host",
        "mavlink:tcp:::1:5",
        "mavlink:tcp:h:0",
    ],
)
def test_wrong_addresses(spelled: str) -> None:
    with pytest.raises(UsageError, match=r"mavlink|port|host"):
        live.Address.parse(spelled)


ARRIVALS = st.lists(
    st.tuples(st.integers(0, 10**9), st.binary(max_size=40), st.sampled_from(["", "", "lost: x", "connected again"])),
    min_size=1,
    max_size=20,
)


@given(arrivals=ARRIVALS)
@settings(max_examples=100, deadline=None)
def test_pieces_survive_a_file(
    arrivals: list[tuple[int, bytes, str]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    ordered = sorted(arrivals)
    timed = [(START + 1000 * at, b"" if event else data, event) for at, data, event in ordered]
    path = tmp_path_factory.mktemp("pieces") / "stream.mcap"
    writer = storage.StreamWriter(path)
    for group in grouped(timed):
        writer.append([live.to_columns(group)])
    writer.close()
    with storage.open(path) as log:
        pieces = live.from_columns(log[live.TOPIC])
    kept = [(at, data) for at, data, _ in timed if data]
    assert pieces.data.tobytes() == b"".join(data for _, data in kept)
    assert np.diff(pieces.ends, prepend=0).tolist() == [len(data) for _, data in kept]
    assert pieces.time_ns.tolist() == [at for at, _ in kept]
    assert list(pieces.events) == [(at, event) for at, _, event in timed if event]


def test_options_survive_as_text() -> None:
    csv = CsvOptions(
        columns=("t_us", "ax"), units={"accel": "g"}, rate_hz=100.0, attitude=AttitudeColumns(World.NED, reference=True)
    )
    for options in (
        IngestOptions(),
        IngestOptions("all", PROFILES["mpu9250"], "common", csv),
        IngestOptions(vehicle=7),
    ):
        assert from_text(to_text(options)) == options


@given(cuts=st.lists(st.integers(1, 400), min_size=5, max_size=60))
@settings(max_examples=30, deadline=None)
def test_frames_are_counted_once_however_they_arrive(cuts: list[int], root: Path) -> None:
    data = np.fromfile(root / "data" / "demo_flight.tlog", np.uint8)[:20_000]
    whole = Frames("ardupilotmega")
    whole.whole(data)
    counted, carry, at = Frames("ardupilotmega"), np.zeros(0, np.uint8), 0
    for size in [*cuts, len(data)]:
        carry = np.concatenate([carry, data[at : at + size]])
        carry = carry[counted.whole(carry) :]
        at += size
    assert counted.units == whole.units > 100
    assert counted.missing == whole.missing == 0


def test_missing_frames_are_counted(root: Path) -> None:
    data = (root / "data" / "demo_flight.tlog").read_bytes()
    frames, at = [], 0
    while at < 30_000:
        size = 12 + data[at + 9]
        frames.append(data[at + 8 : at + 8 + size])
        at += 8 + size
    cutter = Frames("ardupilotmega")
    kept = frames[:50] + frames[57:120] + frames[121:200]
    cutter.whole(np.frombuffer(b"".join(kept), np.uint8))
    assert cutter.units == len(kept)
    assert cutter.missing == 8


def test_lines_are_cut_behind_the_last_whole_one() -> None:
    lines = Lines()
    assert lines.whole(np.frombuffer(b"1,2\n3,4\n5,", np.uint8)) == 8
    assert lines.units == 2
    assert lines.whole(np.frombuffer(b"5", np.uint8)) == 0
    assert lines.whole(np.zeros(5000, np.uint8)) == 5000


def pieces_of(lines: list[bytes], time_ns: list[int]) -> live.Pieces:
    """Lines that arrived one by one."""
    data = np.frombuffer(b"".join(lines), np.uint8)
    return live.Pieces(data, np.cumsum([len(line) for line in lines]), np.array(time_ns, np.int64))


def test_lines_take_utc_from_the_least_delayed_arrivals() -> None:
    count = 2000
    delay = np.random.default_rng(3).exponential(5e6, count).astype(np.int64)
    arrived = START + np.maximum.accumulate(np.arange(count) * 10**6 + delay)
    lines = [b"%d,0,0,1,0,0,%d\n" % (7_000_000 + 1000 * k, k % 5) for k in range(count)]
    pieces = pieces_of([CSV, *lines], [START, *arrived.tolist()])
    read = live.read("imu.csv", live.Kind.CSV, pieces, IngestOptions())
    imu = read.ingested.columns[0]
    assert len(imu) == count
    assert np.array_equal(np.diff(imu.time_ns), np.full(count - 1, 10**6))
    assert abs(int(imu.time_ns[0]) - START) < 500_000
    assert read.shift_ns == 0


def test_lines_without_a_time_take_their_arrival() -> None:
    rows = [b"%d,0,1,0,0,%d\n" % (k % 3, k % 5) for k in range(500)]
    pieces = pieces_of([b"ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\n", *rows], [START + k * 10**7 for k in range(501)])
    imu = live.read("imu.csv", live.Kind.CSV, pieces, IngestOptions()).ingested.columns[0]
    assert np.allclose(imu.time_ns, START + np.arange(1, 501) * 10**7, atol=2000)


def test_a_stream_is_read_as_its_telemetry_log_is(root: Path) -> None:
    data = np.fromfile(root / "data" / "demo_flight.tlog", np.uint8)
    frames, times, at = [], [], 0
    while at < len(data):
        size = 12 + int(data[at + 9])
        times.append(int.from_bytes(data[at : at + 8].tobytes(), "big") * 1000)
        frames.append(data[at + 8 : at + 8 + size].tobytes())
        at += 8 + size
    read = live.read("demo.tlog", live.Kind.MAVLINK, pieces_of(frames, times), IngestOptions())
    assert np.array_equal(read.source.data, data)
    same = ingest.read(Source("demo.tlog", data))
    for ours, theirs in zip(read.ingested.columns, same.columns, strict=True):
        assert ours.channel == theirs.channel
        assert np.array_equal(ours.time_ns, theirs.time_ns)
        assert ours.data.tobytes() == theirs.data.tobytes()
