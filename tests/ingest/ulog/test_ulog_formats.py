"""Topics as the log's own formats define them."""

import io
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from attlog.schemas.definition import MessageType
from attlog.schemas.passthrough import source_names

CODES = {
    "int8_t": ("b", st.integers(-(2**7), 2**7 - 1)),
    "uint8_t": ("B", st.integers(0, 2**8 - 1)),
    "int16_t": ("h", st.integers(-(2**15), 2**15 - 1)),
    "uint16_t": ("H", st.integers(0, 2**16 - 1)),
    "int32_t": ("i", st.integers(-(2**31), 2**31 - 1)),
    "uint32_t": ("I", st.integers(0, 2**32 - 1)),
    "int64_t": ("q", st.integers(-(2**63), 2**63 - 1)),
    "uint64_t": ("Q", st.integers(0, 2**64 - 1)),
    "float": ("f", st.floats(width=32, allow_nan=False)),
    "double": ("d", st.floats(allow_nan=False)),
    "bool": ("?", st.booleans()),
}


def test_nested_types_are_flattened_as_pyulog_does(writer, ingest, channels):
    log = writer(1000).format("inner:uint8_t a;float[2] b;").format("outer:uint64_t timestamp;inner[2] part;inner one;")
    log.add(7, "outer", 3).data(7, "QB2fB2fB2f", 2000, 1, 1.5, 2.5, 2, 3.5, 4.5, 3, 5.5, 6.5)
    columns = channels(ingest(log))["/ulog/outer/3"]
    names = source_names(columns.channel.type)
    assert names == {
        "timestamp": "timestamp",
        "part[0].a": "part_0_a",
        "part[0].b": "part_0_b",
        "part[1].a": "part_1_a",
        "part[1].b": "part_1_b",
        "one.a": "one_a",
        "one.b": "one_b",
    }
    assert columns["part_1_a"].tolist() == [2]
    assert columns["one_b"].tolist() == [[5.5, 6.5]]
    assert columns.channel.type.name == "ulog_msgs/msg/Outer"
    text = columns.channel.type.text
    assert MessageType.parse("ulog_msgs/msg/Outer", text) == columns.channel.type
    assert "float32[2] part_0_b  # part[0].b" in text


def test_padding_at_the_end_is_left_out_within_it_is_kept(writer, ingest, channels):
    log = writer().format("t:uint64_t timestamp;uint8_t a;uint8_t[3] _padding0;float b;uint8_t[4] _padding1;")
    log.add(0, "t").data(0, "QB3xf", 1, 5, 2.5).data(0, "QB3xf4x", 2, 6, 3.5)
    columns = channels(ingest(log))["/ulog/t/0"]
    assert list(source_names(columns.channel.type)) == ["timestamp", "a", "_padding0", "b"]
    assert columns["b"].tolist() == [2.5, 3.5]


def test_text_ends_at_its_nul_and_is_utf8(writer, ingest, channels):
    log = writer().format("t:uint64_t timestamp;char[8] name;char letter;")
    log.add(0, "t").data(0, "Q8sc", 1, b"ab\0junk", b"x").data(0, "Q8sc", 2, "é".encode("latin-1") * 8, b"y")
    log.data(0, "Q8sc", 3, "grün".encode(), b"z")
    columns = channels(ingest(log))["/ulog/t/0"]
    assert columns.channel.type["name"].type == "string"
    assert [value.decode() for value in columns["name"].tolist()] == ["ab", "é" * 8, "grün"]
    assert columns["letter"].tolist() == [ord("x"), ord("y"), ord("z")]


def test_a_bool_is_true_or_false_whatever_is_stored(writer, ingest, channels):
    log = writer().format("t:uint64_t timestamp;bool[2] flags;uint8_t n;").add(0, "t")
    log.data(0, "Q3B", 1, 0, 7, 9).data(0, "Q3B", 2, 1, 0, 9)
    flags = channels(ingest(log))["/ulog/t/0"]["flags"]
    assert flags.view(np.uint8).tolist() == [[0, 1], [1, 0]]


@pytest.mark.parametrize(
    "formats",
    [
        "t:uint64_t timestamp;missing m;",
        "t:uint64_t timestamp;t again;",
        "t:uint64_t timestamp;float[70000] a;",
        "t:",
        "t:float[99999] a;float[99999] b;",
        "t uint64_t timestamp",
        "t:uint64_t",
    ],
)
def test_a_topic_that_cannot_be_is_counted_and_stops_no_other(formats, writer, ingest, channels):
    log = writer().format(formats).format("good:uint64_t timestamp;int32_t a;")
    log.add(1, "t").add(2, "good")
    for time in range(1, 20):
        log.data(1, "Qi", time, 1).data(2, "Qi", time, time)
    result = ingest(log)
    assert channels(result)["/ulog/good/0"]["a"].tolist() == list(range(1, 20))
    assert result.completeness.dropped["subscriptions without a format"] == 1
    assert result.completeness.dropped["data without subscription"] >= 1
    assert result.completeness.bytes_skipped == 19 * (3 + 2 + 12)


def test_deeply_nested_arrays_do_not_take_for_ever(writer, ingest):
    log = writer().format("a0:uint8_t x;")
    for depth in range(1, 16):
        log.format(f"a{depth}:a{depth - 1}[65535] x;")
    log.add(1, "a15").say("hello", 1)
    assert ingest(log).completeness.dropped == {"subscriptions without a format": 1}


def test_instances_and_a_topic_subscribed_twice(writer, ingest, channels):
    log = writer().format("t:uint64_t timestamp;int32_t a;").add(1, "t", 0).add(2, "t", 1)
    log.data(1, "Qi", 1, 10).data(2, "Qi", 2, 20).remove(1).add(3, "t", 0).data(3, "Qi", 3, 30)
    found = channels(ingest(log))
    assert found["/ulog/t/0"]["a"].tolist() == [10, 30]
    assert found["/ulog/t/1"]["a"].tolist() == [20]


def test_two_topics_whose_names_become_one_type(writer, ingest, channels):
    log = writer().format("a_b:uint64_t timestamp;int32_t a;").format("a__b:uint64_t timestamp;float c;")
    log.add(1, "a_b").add(2, "a__b").data(1, "Qi", 1, 10).data(2, "Qf", 2, 20.0)
    found = channels(ingest(log))
    assert found["/ulog/a_b/0"].channel.type.name == "ulog_msgs/msg/AB"
    assert found["/ulog/a__b/0"].channel.type.name == "ulog_msgs/msg/AB2"


@st.composite
def topics(draw):
    """Fields of a topic: (type, length or None)."""
    field = st.tuples(st.sampled_from(sorted(CODES)), st.one_of(st.none(), st.integers(1, 4)))
    return draw(st.lists(field, min_size=0, max_size=6))


@settings(max_examples=60, deadline=None)
@given(fields_of=st.lists(topics(), min_size=1, max_size=4), data=st.data())
def test_what_is_written_is_what_is_read(fields_of, data, writer, ingest, channels, flattened, agrees_with_pyulog):
    log = writer(1_000_000)
    written: dict[str, list[tuple]] = {}
    for number, fields in enumerate(fields_of):
        listed = "".join(f"{kind}{f'[{n}]' if n else ''} v{i};" for i, (kind, n) in enumerate(fields))
        log.format(f"topic{number}:uint64_t timestamp;{listed}")
    for number, fields in enumerate(fields_of):
        log.add(number, f"topic{number}", number % 2)
        codes = "Q" + "".join(CODES[kind][0] * (n or 1) for kind, n in fields)
        rows = data.draw(
            st.lists(st.tuples(*(CODES[kind][1] for kind, n in fields for _ in range(n or 1))), min_size=1, max_size=5)
        )
        for place, row in enumerate(rows):
            log.data(number, codes, 1_000_000 + place, *row)
        written[f"/ulog/topic{number}/{number % 2}"] = [(1_000_000 + i, *row) for i, row in enumerate(rows)]
    result = ingest(log)
    assert result.completeness.complete
    for topic, rows in written.items():
        values = list(flattened(channels(result)[topic]).values())
        for place, row in enumerate(rows):
            assert [v[place] for v in values] == [
                np.float32(x) if v.dtype == np.float32 else x for x, v in zip(row, values, strict=True)
            ]
    agrees_with_pyulog(bytes(log), result)


@pytest.fixture(scope="module")
def agrees_with_pyulog(assert_equals_pyulog):
    pyulog = pytest.importorskip("pyulog", reason="the independent reader of these logs")
    return lambda content, result: assert_equals_pyulog(result, pyulog.ULog(io.BytesIO(content)))


def test_a_messages_bytes_are_the_writers(writer):
    """The tests' own writer, held to the specification by hand."""
    log = bytes(writer(5).format("t:uint8_t a;").data(1, "B", 7))
    assert log[16:] == struct.pack("<HB", 12, ord("F")) + b"t:uint8_t a;" + struct.pack("<HBHB", 3, ord("D"), 1, 7)


def test_a_damaged_name_of_a_field_costs_the_name_only(writer, ingest, channels):
    log = writer().format("t:uint64_t timestamp;int32_t a\x1cb\n;float c d;").add(1, "t").data(1, "Qif", 1, 7, 2.5)
    columns = channels(ingest(log))["/ulog/t/0"]
    assert source_names(columns.channel.type) == {"timestamp": "timestamp", "a_b_": "a_b", "c": "c"}
    assert MessageType.parse(columns.channel.type.name, columns.channel.type.text) == columns.channel.type
