"""Binary logs made here, whole and damaged, against what was written and against pymavlink."""

import random
import struct
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from attlog.ingest import dataflash
from attlog.schemas import Ingested, InputError

EVERY = "abBhHiIfdgnNZcCeELMqQ"


def counts(ingested: Ingested) -> dict[str, int]:
    return {
        c.channel.topic.removeprefix("/dataflash/"): len(c)
        for c in ingested.columns
        if c.channel.topic.startswith("/dataflash/")
    }


def test_every_format_character_is_stored_bit_for_bit(
    writer: Any, ingest: Any, pymavlink_rows: Any, assert_same: Any
) -> None:
    log = writer()
    for number, character in enumerate(EVERY, 1):
        log.define(number, f"T{number}", f"Q{character}", "TimeUS,Value")
    values = {
        "a": np.arange(-16, 16, dtype="<i2").tobytes(),
        **dict.fromkeys("fdg", -1.5),
        **dict.fromkeys("nNZ", b"ab"),
        **dict.fromkeys("bhiqcLe", -7),
        **dict.fromkeys("BHIQCEM", 7),
    }
    for number, character in enumerate(EVERY, 1):
        log.record(f"T{number}", 1000 + number, values[character])
    assert_same(ingest(log.binary), pymavlink_rows(log.binary))


def test_not_a_number_and_the_largest_integers_survive(
    writer: Any, ingest: Any, assert_same: Any, pymavlink_rows: Any
) -> None:
    log = writer()
    log.define(1, "EDGE", "QfdQqIi", "TimeUS,F,D,Q,q,I,i")
    quiet = struct.unpack("<f", struct.pack("<I", 0x7FC04152))[0]
    log.record("EDGE", 5, quiet, float("nan"), 2**64 - 1, -(2**63), 2**32 - 1, -(2**31))
    log.record("EDGE", 6, float("inf"), -0.0, 0, 0, 0, 0)
    assert_same(ingest(log.binary), pymavlink_rows(log.binary))


def test_records_before_their_definition_are_read_by_it(writer: Any, ingest: Any) -> None:
    late, log = writer(describe_fmt=False), writer()
    late.define(1, "LATE", "QB", "TimeUS,Value")
    for k in range(3):
        late.record("LATE", 1000 + k, k)
    definition, *records = late.pieces
    data = log.binary + b"".join(records) + definition + records[0]
    ingested = ingest(data)
    assert counts(ingested)["LATE"] == 4
    assert ingested.completeness.complete


def test_a_type_defined_anew_is_a_channel_of_its_own(writer: Any, ingest: Any, by_topic: Any) -> None:
    log = writer()
    log.define(1, "TYPE", "QB", "TimeUS,Value")
    log.record("TYPE", 1000, 1)
    log.define(1, "TYPE", "QBB", "TimeUS,Value,More")
    log.record("TYPE", 2000, 2, 3)
    log.define(1, "TYPE", "QB", "TimeUS,Value")
    log.record("TYPE", 3000, 4)
    passed = by_topic(ingest(log.binary))
    assert passed["/dataflash/TYPE"].data["value"].tolist() == [1, 4]
    assert passed["/dataflash/TYPE_2"].data["more"].tolist() == [3]
    assert passed["/dataflash/TYPE"].channel.type.name != passed["/dataflash/TYPE_2"].channel.type.name


def test_instances_are_channels_and_a_string_may_name_them(writer: Any, ingest: Any, by_topic: Any) -> None:
    log = writer()
    log.define(1, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds")
    log.define(2, "NVF", "QNf", "TimeUS,Name,Value")
    log.record("FMTU", 1, 2, b"s#-", b"F--")
    for k, name in enumerate((b"left", b"right/1", b"left")):
        log.record("NVF", 10 + k, name, k)
    passed = by_topic(ingest(log.binary))
    assert passed["/dataflash/NVF/left"].data["value"].tolist() == [0.0, 2.0]
    assert passed["/dataflash/NVF/right_1"].channel.metadata["instance"] == "right/1"


def test_strings_end_at_their_nul_and_are_utf8(writer: Any, ingest: Any, by_topic: Any) -> None:
    log = writer()
    log.define(1, "MSG", "QZ", "TimeUS,Message")
    for text in (b"plain", b"cut\0junk", "grüße".encode(), b"temp 20\xb0C", b""):
        log.record("MSG", 1, text)
    ingested = ingest(log.binary)
    stored = by_topic(ingested)["/dataflash/MSG"].data["message"].tolist()
    assert [value.decode() for value in stored] == ["plain", "cut", "grüße", "temp 20°C", ""]
    assert [note.text for note in ingested.notes] == ["plain", "cut", "grüße", "temp 20°C", ""]


def test_a_definition_that_contradicts_itself_is_counted_not_believed(writer: Any, ingest: Any) -> None:
    log = writer()
    log.define(1, "GOOD", "QB", "TimeUS,Value")
    log.record("GOOD", 1, 1)
    wrong = bytearray(log.pieces[1])
    wrong[4] += 3
    ingested = ingest(log.binary + bytes(wrong) + log.pieces[2])
    assert counts(ingested)["GOOD"] == 2
    assert ingested.completeness.dropped == {"unreadable definitions": 1}


def test_columns_and_characters_need_not_match(writer: Any, ingest: Any, by_topic: Any) -> None:
    log = writer()
    log.define(1, "MORE", "QBB", "TimeUS,A")
    log.define(2, "LESS", "QB", "TimeUS,A,B,C")
    log.define(3, "SAME", "QBB", "TimeUS,A,A")
    log.record("MORE", 1, 2, 3)
    log.record("LESS", 1, 2)
    log.record("SAME", 1, 2, 3)
    passed = by_topic(ingest(log.binary))
    for name, fields in (("MORE", ("a", "f2")), ("LESS", ("a",)), ("SAME", ("a", "a_2"))):
        assert passed[f"/dataflash/{name}"].data.dtype.names[1:] == fields


def test_a_torn_last_record_counts(flight: Any, ingest: Any) -> None:
    whole = flight().binary
    ingested = ingest(whole[:-5])
    size = len(flight().pieces[-1])
    assert ingested.completeness.dropped == {"torn last record": 1}
    assert ingested.completeness.bytes_skipped == size - 5
    assert ingested.completeness.messages == ingest(whole).completeness.messages - 1


@pytest.mark.parametrize("fill", [b"\0", b"\xff"])
def test_padding_of_the_last_page_is_no_loss(flight: Any, ingest: Any, fill: bytes) -> None:
    assert ingest(flight().binary + fill * 500).completeness.complete


def test_junk_between_records_is_skipped_and_counted(flight: Any, ingest: Any) -> None:
    log = flight()
    junk = [b"\x00" * 40, b"\xa3\x95\x82", b"\xa3" * 7, random.Random(1).randbytes(5000)]
    pieces = list(log.pieces)
    for k, noise in enumerate(junk):
        pieces.insert(50 + 30 * k, noise)
    ingested = ingest(b"".join(pieces))
    assert ingested.completeness.messages == len(log.pieces)
    assert ingested.completeness.bytes_skipped == sum(map(len, junk))
    assert ingested.completeness.dropped.keys() <= {"runs of bad bytes", "records cut short"}


@pytest.mark.parametrize("seed", range(15))
def test_logs_with_noise_between_records_agree_with_pymavlink(
    flight: Any, ingest: Any, pymavlink_rows: Any, assert_same: Any, seed: int
) -> None:
    chance = random.Random(seed)
    pieces = list(flight(seconds=1.0).pieces)
    for _ in range(6):
        noise = chance.randbytes(chance.randrange(1, 900)).replace(b"\xa3", b"\xa2")
        pieces.insert(chance.randrange(8, len(pieces)), noise)
    data = b"".join(pieces)
    assert_same(ingest(data), pymavlink_rows(data))


def test_lost_bytes_cost_one_record_not_its_successor(flight: Any, ingest: Any) -> None:
    """pymavlink takes the head of the one and the tail of the other as a record, and loses both."""
    log = flight()
    whole = counts(ingest(log.binary))
    pieces = list(log.pieces)
    place = next(k for k, piece in enumerate(pieces) if k > 60 and piece[2] == 130)
    pieces[place] = pieces[place][:20]
    ingested = ingest(b"".join(pieces))
    assert counts(ingested) == {**whole, "IMU": whole["IMU"] - 1}
    assert ingested.completeness.dropped == {"records cut short": 1}
    assert ingested.completeness.bytes_skipped == 20


@pytest.mark.parametrize(
    "data", [b"\xa3\x95\x80", bytes(5000), random.Random(2).randbytes(20_000), b"FMT, nonsense\n" * 9]
)
def test_nothing_to_read_is_one_clear_error(ingest: Any, data: bytes) -> None:
    with pytest.raises(InputError, match=r"log\.bin: no DataFlash record"):
        ingest(data)


def test_definitions_alone_are_no_log(writer: Any, ingest: Any) -> None:
    with pytest.raises(InputError, match="no DataFlash record"):
        ingest(writer().binary)


def test_recognizes(flight: Any) -> None:
    log = flight()
    assert dataflash.recognizes(log.binary[:4096])
    assert dataflash.recognizes(log.text[:4096])
    assert dataflash.recognizes(b"junk" + log.binary[:4096])
    assert not dataflash.recognizes(b"\xfe" + b"".join(piece + b"\xfe\x01" for piece in log.pieces))
    assert not dataflash.recognizes(random.Random(3).randbytes(65536))
    assert not dataflash.recognizes(b"timestamp,x,y,FMT,\n1,2,3,4\n")
    assert not dataflash.recognizes(b"")


@pytest.mark.parametrize("seed", range(30))
def test_bit_flips_cost_the_records_they_hit_and_no_other(flight: Any, ingest: Any, seed: int) -> None:
    chance = random.Random(seed)
    log = flight()
    first = 1 + next(k for k, piece in enumerate(log.pieces) if piece[2] == 133 or k == 6)
    pieces = [bytearray(piece) for piece in log.pieces]
    hit = set(chance.sample(range(first, len(pieces)), 12))
    for k in hit:
        place = chance.randrange(len(pieces[k]))
        pieces[k][place] ^= 1 << chance.randrange(8)
    ingested = ingest(b"".join(map(bytes, pieces)))
    read = {row.tobytes() for c in ingested.columns if c.channel.topic.startswith("/dataflash/") for row in c.data}
    untouched = {bytes(piece[3:]) for k, piece in enumerate(pieces) if k not in hit}
    assert untouched <= read
    assert len(ingested.segments) == 1


@pytest.mark.parametrize("seed", range(20))
def test_cut_logs_agree_with_pymavlink(
    flight: Any, ingest: Any, pymavlink_rows: Any, assert_same: Any, seed: int
) -> None:
    data = flight(seconds=1.0).binary
    cut = data[: random.Random(seed).randrange(700, len(data))]
    assert_same(ingest(cut), pymavlink_rows(cut))


ROW = st.tuples(
    st.integers(0, 2**40),
    st.integers(0, 255),
    st.integers(-(2**15), 2**15 - 1),
    st.floats(width=32),
    st.binary(max_size=16).map(lambda text: text.replace(b"\0", b"")),
)


@settings(max_examples=60, deadline=None)
@given(rows=st.lists(ROW, min_size=1, max_size=40), noise=st.binary(max_size=60))
def test_any_values_come_back_whatever_stands_before_them(rows: list[Any], noise: bytes) -> None:
    from attlog.ingest.dataflash import binary

    body = b"".join(b"\xa3\x95\x01" + struct.pack("<QBhf16s", *row) for row in rows)
    definition = struct.pack("<BBBBB4s16s64s", 0xA3, 0x95, 128, 1, 34, b"ANY", b"QBhfN", b"TimeUS,B,C,F,Name")
    log = binary.parse(np.frombuffer(definition + body + noise, np.uint8))
    found = next(records for records in log.records if records.format.name == "ANY")
    expected = np.frombuffer(body, np.dtype([("head", "V3"), ("row", "V31")]))["row"]
    assert found.data[: len(rows)].tobytes() == expected.tobytes()


@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=3000), st.integers(0, 255))
def test_no_bytes_whatever_crash_it(noise: bytes, kind: int) -> None:
    from attlog.schemas import Source

    head = struct.pack("<BBBBB4s16s64s", 0xA3, 0x95, 128, kind, 12, b"ANY", b"QB", b"TimeUS,B")
    record = bytes([0xA3, 0x95, kind]) + struct.pack("<QB", 77, 1)
    for data in (noise, head + record + noise, noise + head + record):
        try:
            ingested = dataflash.read(Source("noise", np.frombuffer(data or b"\0", np.uint8)))
        except InputError:
            continue
        assert (
            ingested.completeness.bytes_read + ingested.completeness.bytes_skipped == ingested.completeness.bytes_total
        )


@pytest.mark.long
@pytest.mark.parametrize("seed", range(400))
def test_heavy_damage_leaves_most_of_a_log(flight: Any, ingest: Any, seed: int) -> None:
    """Blocks lost, doubled and overwritten, and flipped bits, all at once."""
    chance = random.Random(seed)
    data = bytearray(flight(seconds=8.0).binary)
    definitions = 89 * 6
    for _ in range(20):
        at, size = chance.randrange(definitions, len(data) - 600), chance.randrange(1, 600)
        harm = chance.randrange(4)
        if harm == 0:
            del data[at : at + size]
        elif harm == 1:
            data[at:at] = data[at - min(at, size) : at]
        elif harm == 2:
            data[at : at + size] = chance.randbytes(size)
        else:
            data[at] ^= 1 << chance.randrange(8)
    ingested = ingest(bytes(data))
    completeness = ingested.completeness
    assert completeness.bytes_read + completeness.bytes_skipped == len(data)
    assert completeness.messages > 200
    assert len(ingested.segments) <= 3
