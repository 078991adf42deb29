"""Files that are damaged, cut, of another kind or of another time: a clear error, or everything else and the count."""

import struct

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from attlog.schemas import InputError, Kind

TOPICS = {1: ("fast", 0), 2: ("slow", 0), 3: ("slow", 1)}
SIZES = {"fast": 3 + 2 + 20, "slow": 3 + 2 + 12}


@pytest.fixture(scope="module")
def built(writer):
    """A log with sync messages, and the place of every data message."""
    log = writer(1_000_000).format("fast:uint64_t timestamp;float[3] a;").format("slow:uint64_t timestamp;int32_t n;")
    log.info("sys_name", "PX4").parameter("ALPHA", 1.5).parameter("BETA", 3)
    for number, (name, multi_id) in TOPICS.items():
        log.add(number, name, multi_id)
    places = []
    for i in range(400):
        time = 1_000_000 + 4000 * i
        if i % 50 == 0:
            log.sync()
        if i % 90 == 89:
            log.say(f"text {i}", time).parameter("ALPHA", 1.5 + i)
        places.append(len(log.content))
        log.data(1, "Q3f", time, i, i + 0.25, i + 0.5)
        if i % 4 == 0:
            places.append(len(log.content))
            log.data(2 + i % 8 // 4, "Qi", time + 1, i)
    return bytes(log), np.array(places)


@pytest.fixture(scope="module")
def counted(channels):
    """Data messages that were read."""

    def call(result):
        return sum(len(c) for topic, c in channels(result).items() if topic.startswith("/ulog/"))

    return call


def check_whole(result, size):
    """Every byte is read or skipped, and what is skipped has a reason."""
    completeness = result.completeness
    assert completeness.bytes_total == size
    assert completeness.bytes_read + completeness.bytes_skipped == size
    assert (completeness.bytes_skipped > 0) == any(f.kind == Kind.SKIPPED for f in result.findings)
    if completeness.bytes_skipped:
        assert sum(completeness.dropped.values()) > 0
        assert not completeness.complete


def test_the_whole_log(built, ingest, counted):
    content, places = built
    result = ingest(content)
    check_whole(result, len(content))
    assert result.completeness.complete
    assert counted(result) == len(places)


def test_cut_anywhere_everything_before_is_read(built, ingest, counted):
    content, places = built
    for cut in [*range(len(content) - 60, len(content)), *range(2000, len(content), 997)]:
        result = ingest(content[:cut])
        check_whole(result, cut)
        ends = [place + 3 + struct.unpack_from("<H", content, place)[0] for place in places.tolist()]
        assert counted(result) == sum(end <= cut for end in ends)
        assert set(result.completeness.dropped) <= {"torn last message", "runs of bad bytes"}


@pytest.mark.parametrize("cut", [0, 1, 6, 7, 8, 15])
def test_cut_within_the_header(built, cut, ingest):
    with pytest.raises(InputError, match=r"flight\.ulg"):
        ingest(built[0][:cut])


@pytest.mark.parametrize("cut", [16, 18, 19, 40, 120])
def test_cut_within_the_definitions(built, cut, ingest):
    with pytest.raises(InputError, match=r"no data in the .* copied completely"):
        ingest(built[0][:cut])


@pytest.mark.parametrize("content", [b"", b"\0" * 100, b"\x7fELF" * 50, b"hello, world\n" * 20])
def test_another_kind_of_file(content, ingest):
    with pytest.raises(InputError, match="is no ULog file"):
        ingest(content)


def test_recognition():
    from attlog.ingest import ulog

    assert ulog.recognizes(b"ULog\x01\x12\x35\x01" + bytes(8))
    assert ulog.recognizes(b"ULogEnc\x01")
    for head in (b"", b"ULog", b"ULog\x02\x12\x35", b"\xa3\x95\x80", b"\x89MCAP0\r\n", b"FMT, 128"):
        assert not ulog.recognizes(head)


def test_encrypted(ingest):
    with pytest.raises(InputError, match="encrypted"):
        ingest(b"ULogEnc" + bytes(200))


@pytest.mark.parametrize("byte", range(8, 16))
def test_unknown_incompatible_flags(byte, writer, ingest):
    flags = bytearray(40)
    flags[byte] = 2
    with pytest.raises(InputError, match="incompatible flags"):
        ingest(writer(0, bytes(flags)).say("hello", 1))


def test_compatible_flags_and_newer_versions_are_read(writer, ingest):
    log = writer(0, b"\xff" * 8 + bytes(32), version=9).say("hello", 1)
    result = ingest(log)
    assert [note.text for note in result.notes] == ["hello"]
    assert result.metadata["ulog"]["version"] == "9"


def test_a_damaged_byte_costs_its_own_message_only(built, ingest, counted):
    """A flipped length, letter or number; a flipped value cannot be seen, and costs nothing."""
    content, places = built
    for place in places[::37].tolist():
        for offset in range(5):
            damaged = bytearray(content)
            damaged[place + offset] ^= 0x50
            result = ingest(bytes(damaged))
            check_whole(result, len(content))
            assert counted(result) == len(places) - 1, (place, offset)
            size = 3 + struct.unpack_from("<H", content, place)[0]
            assert result.completeness.bytes_skipped == size


@pytest.mark.parametrize("length", [0, 1, 2, 0x7FFF, 0xFFFF])
def test_absurd_lengths(length, built, ingest, counted):
    content, places = built
    for place in places[5::61].tolist():
        damaged = bytearray(content)
        struct.pack_into("<H", damaged, place, length)
        assert counted(ingest(bytes(damaged))) == len(places) - 1


@pytest.mark.parametrize("size", [1, 7, 100, 3000, 70_000])
@pytest.mark.parametrize("seed", range(3))
def test_foreign_bytes_between_messages(size, seed, built, ingest, counted):
    content, places = built
    at = int(places[len(places) // 2])
    garbage = np.random.default_rng(seed).integers(0, 256, size, dtype=np.uint8).tobytes()
    result = ingest(content[:at] + garbage + content[at:])
    check_whole(result, len(content) + size)
    assert counted(result) >= len(places) - 2
    assert abs(result.completeness.bytes_skipped - size) < 100


def test_lost_bytes(built, ingest, counted):
    content, places = built
    for lost in (1, 5, 40, 1500):
        at = int(places[200]) + 9
        result = ingest(content[:at] + content[at + lost :])
        check_whole(result, len(content) - lost)
        assert counted(result) >= len(places) - 2 - lost // 17


def test_room_that_was_never_written_is_no_loss(built, ingest, counted):
    content, places = built
    for fill in (b"\0", b"\xff"):
        result = ingest(content + fill * 5000)
        assert counted(result) == len(places)
        assert result.completeness.complete


def test_a_kind_of_message_that_is_not_known_is_passed(built, ingest, counted, writer):
    content, places = built
    at = int(places[100])
    new = struct.pack("<HB", 30, ord("Z")) + bytes(30)
    result = ingest(content[:at] + new + content[at:])
    assert counted(result) == len(places)
    assert result.completeness.dropped == {"messages of unknown kind": 1}
    assert result.completeness.bytes_skipped == 33


def test_a_lost_subscription(built, ingest, counted):
    content, places = built
    at = content.index(struct.pack("<BH", 0, 1) + b"fast")
    damaged = content[:at] + struct.pack("<BH", 0, 9) + content[at + 3 :]
    result = ingest(damaged)
    check_whole(result, len(content))
    assert counted(result) == np.count_nonzero(np.frombuffer(content, np.uint8)[places + 3] != 1)
    assert result.completeness.bytes_skipped == 400 * SIZES["fast"]


def test_a_damaged_format_costs_its_topic_only(built, ingest, channels):
    content, _ = built
    at = content.index(b"fast:")
    result = ingest(content[:at] + b"f\0st:" + content[at + 5 :])
    assert [t for t in channels(result) if t.startswith("/ulog")] == ["/ulog/slow/0", "/ulog/slow/1"]
    check_whole(result, len(content))


def test_a_text_before_damage_is_kept(writer, ingest):
    log = writer(0).format("t:uint64_t timestamp;").add(1, "t").data(1, "Q", 10).say("still here", 11)
    log.parameter("GAMMA", 7)
    log.content += b"\x01\x02\x03\x04\x05"
    log.data(1, "Q", 12)
    result = ingest(log)
    assert "still here" in [note.text for note in result.notes]
    assert result.parameters == {"GAMMA": 7.0}
    assert result.completeness.bytes_skipped == 5


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_any_damage_is_read_or_refused(data, built, ingest):
    damaged = bytearray(built[0])
    for _ in range(data.draw(st.integers(1, 12))):
        at = data.draw(st.integers(0, len(damaged) - 1))
        damaged[at] = data.draw(st.integers(0, 255))
    if data.draw(st.booleans()):
        start = data.draw(st.integers(0, len(damaged)))
        del damaged[start : start + data.draw(st.integers(0, 300))]
    try:
        result = ingest(bytes(damaged))
    except InputError:
        return
    assert result.completeness.bytes_read + result.completeness.bytes_skipped == len(damaged)


@settings(max_examples=100, deadline=None)
@given(content=st.binary(max_size=400))
def test_any_bytes_behind_a_header(content, writer, ingest):
    log = writer(0)
    log.content += content
    try:
        result = ingest(log)
    except InputError:
        return
    assert result.completeness.bytes_read + result.completeness.bytes_skipped == len(log.content)
