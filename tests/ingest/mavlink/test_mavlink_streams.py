"""Streams that pymavlink packs, of all messages and in every form, come back whole, whatever lies between them."""

import random
import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from attlog.schemas import PROFILES

SIZES = {"int8_t": "b", "uint8_t": "B", "int16_t": "h", "uint16_t": "H", "int32_t": "i", "uint32_t": "I"}
SIZES |= {"int64_t": "q", "uint64_t": "Q", "float": "f", "double": "d"}


def value(chance: random.Random, c_type: str, length: int) -> Any:
    """A random value of a field; often small or zero, so that payloads end in zeros."""
    if c_type == "char" and length:
        return bytes(chance.choice(b"abcXYZ_019") for _ in range(chance.randrange(length + 1)))
    if c_type == "char":
        return bytes([chance.randrange(128)])
    code = SIZES[c_type]
    values = [struct.unpack(code, chance.randbytes(struct.calcsize(code)))[0] for _ in range(length or 1)]
    values = [0 if chance.random() < 0.3 or v != v else v for v in values]
    return values if length else values[0]


def random_message(chance: random.Random, dialect: Any, message_id: int) -> Any:
    """A message of pymavlink's with random fields."""
    kind = dialect.mavlink_map[message_id]
    lengths = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
    return kind(*(value(chance, t, lengths[n]) for n, t in zip(kind.fieldnames, kind.fieldtypes, strict=True)))


def decoded(tape: Any, ingested: Any) -> dict[str, list[Any]]:
    """The passed-through rows by topic, in the order of arrival."""
    passed = [c for c in ingested.columns if c.channel.topic.startswith("/mavlink/")]
    return {c.channel.topic: list(c.data[np.argsort(c.data["received_us"], kind="stable")]) for c in passed}


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize("stamped", [True, False])
def test_every_message_of_the_dialect(tape: Any, messages: Any, version: int, stamped: bool) -> None:
    chance = random.Random(version)
    log = tape(stamped=stamped)
    parser = messages.MAVLink(None)
    expected = []
    for number, message_id in enumerate(sorted(messages.mavlink_map) * 2):
        if version == 2 or message_id < 256:
            message = random_message(chance, messages, message_id)
            frame = log.send(number * 0.001, message, version=version, signed=version == 2 and number % 3 == 0)
            expected += parser.parse_buffer(frame)
    ingested = log.read(sensor=PROFILES["mpu9250"])
    rows = decoded(tape, ingested)
    for message in expected:
        found = [r for r in rows[f"/mavlink/1/1/{message.get_type()}"] if r["sequence"] == message.get_seq()]
        assert any(_equal(row, message) for row in found), message


def _equal(row: Any, message: Any) -> bool:
    names = [name for name in row.dtype.names if name not in ("received_us", "sequence")]
    theirs = [getattr(message, field) for field in message.get_fieldnames()]
    return all(_same(row[name], other) for name, other in zip(names, theirs, strict=True))


def _same(ours: Any, theirs: Any) -> bool:
    if isinstance(ours, bytes):
        return bool(ours.decode() == theirs)
    if isinstance(theirs, (str, bytes)):  # a single char
        return ours == (theirs.encode() if isinstance(theirs, str) else theirs)[:1].ljust(1, b"\0")[0]
    return bool(np.array_equal(ours, np.array(theirs, np.asarray(ours).dtype), equal_nan=True))


pieces = st.lists(
    st.one_of(
        st.tuples(st.just("frame"), st.integers(0, 2**32)),
        st.tuples(st.just("garbage"), st.binary(min_size=1, max_size=60)),
        st.tuples(
            st.just("tempting"),
            st.sampled_from([b"\xfe", b"\xfd\xff\x00", b"\xfe\xff\x01\x01\x01\x1e", b"\xfd\x09\x01"]),
        ),
        st.tuples(st.just("cut"), st.integers(1, 60)),
        st.tuples(st.just("flip"), st.integers(0, 2**32)),
    ),
    min_size=3,
    max_size=60,
)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(plan=pieces, stamped=st.booleans())
def test_frames_among_garbage(tape: Any, messages: Any, plan: list[tuple[str, Any]], stamped: bool) -> None:
    """All whole frames are found, in order; every other byte is counted as bad or as a stamp's."""
    log = tape(stamped=stamped)
    first = [messages.MAVLink_attitude_message(1000 + n, 0, 0, 0, 0, 0, 1) for n in range(8)]  # tell the kind of stream
    sequences = [log.send(number * 0.01, message) for number, message in enumerate(first)]
    for number, (kind, argument) in enumerate(plan):
        message = messages.MAVLink_raw_imu_message(2_000_000 + 10_000 * number, 1, 2, -1000, 4, 5, 6, 7, 8, 9)
        if kind in ("garbage", "tempting"):
            log.data += argument
            continue
        signed = kind == "frame" and number % 5 == 1  # the checksum does not cover the signature
        frame = bytearray(log.frame(message, version=1 + number % 2, signed=signed))
        if kind == "cut":
            del frame[min(argument, len(frame) - 3) :]
        elif kind == "flip":  # not in the message id, which could make it an unknown message by chance
            frame[10 + argument % (len(frame) - 10)] ^= 1 << (argument // 7 % 8)
        else:
            sequences.append(bytes(frame))
        log.put(0.1 + number * 0.01, bytes(frame))
    ingested = log.read(sensor=PROFILES["mpu9250"])
    complete = ingested.completeness
    assert complete.messages == len(sequences)
    whole = sum(len(frame) for frame in sequences)
    accounted = whole + complete.bytes_skipped + (complete.bytes_total - complete.bytes_read - complete.bytes_skipped)
    rest = complete.bytes_total - accounted
    assert rest % 8 == 0 if stamped else rest == 0
    assert 0 <= rest <= 8 * (len(sequences) + sum(kind in ("cut", "flip") for kind, _ in plan))


def test_a_bad_length_swallows_nothing(tape: Any, messages: Any) -> None:
    """pymavlink skips what a broken header claims; the frames behind it are found nevertheless."""
    log = tape()
    for number in range(20):
        frame = bytearray(log.frame(messages.MAVLink_attitude_message(100 * number + 1, 0, 0, 0, 0, 0, 1)))
        if number == 5:
            frame[1] = 255
        log.put(0.1 * number, bytes(frame))
    complete = log.read().completeness
    assert complete.messages == 19
    assert complete.bytes_skipped == len(frame)


def test_short_frames_in_great_number(tape: Any, messages: Any) -> None:
    """More frames and more bad runs than the tables are made for at first."""
    log = tape(stamped=False)
    for number in range(6000):
        log.send(0, messages.MAVLink_mission_current_message(number % 100), version=1)
        log.data += b"\x00" * (number % 3 == 0)
    complete = log.read().completeness
    assert (complete.messages, complete.bytes_skipped, complete.dropped) == (6000, 2000, {"no frame": 2000})


def test_unknown_messages_are_kept_raw(tape: Any, messages: Any) -> None:
    log = tape()
    for number in range(10):
        log.send(0.1 * number, messages.MAVLink_attitude_message(100 * number + 1, 0, 0, 0, 0, 0, 1))
        log.put(0.1 * number + 0.05, tape.unknown(54_321, b"hello" + bytes([number]), 77))
    ingested = log.read()
    rows = tape.channel(ingested, "/mavlink/1/1/UNKNOWN_54321").data
    assert [bytes(row["payload"][:6]) for row in rows] == [b"hello" + bytes([n]) for n in range(10)]
    assert ingested.completeness.messages == 20
    assert any("54321" in f.advice for f in ingested.findings)


def test_a_header_of_an_unknown_message_swallows_nothing(tape: Any, messages: Any) -> None:
    """255 headers that claim 255 bytes each; by chance one of them could have a right checksum."""
    for extra in range(255):
        log = tape()
        attitude = log.frame(messages.MAVLink_attitude_message(1, 0, 0, 0, 0, 0, 1))
        for number in range(4):
            log.put(number, attitude)
        log.data += bytes([0xFD, 60, 0, 0, extra, 1, 1, 0x31, 0xD4, 0])
        for number in range(4, 8):
            log.put(number, attitude)
        assert log.read().completeness.messages == 8


def test_texts(tape: Any, messages: Any) -> None:
    """A text ends at its first NUL; valid UTF-8 stays, other text is read as Latin-1."""
    log = tape()
    for number, text in enumerate([b"plain", b"cut\0behind", "Höhe".encode(), b"bad \xff byte"]):
        log.send(number, messages.MAVLink_attitude_message(1000 * number + 1, 0, 0, 0, 0, 0, 1))
        log.send(number, messages.MAVLink_statustext_message(6, text))
    texts = tape.channel(log.read(), "/mavlink/1/1/STATUSTEXT").data["text"]
    assert [t.decode() for t in texts] == ["plain", "cut", "Höhe", "bad ÿ byte"]


@pytest.mark.long
def test_frames_among_garbage_for_long(tape: Any, messages: Any) -> None:
    """A megabyte of random bytes, a frame every kilobyte."""
    chance = random.Random(7)
    log = tape()
    for number in range(1000):
        log.send(0.01 * number, messages.MAVLink_attitude_message(10 * number + 1, 0, 0, 0, 0, 0, 1))
        if number > 8:
            log.data += chance.randbytes(1000)
    assert log.read().completeness.messages == 1000
