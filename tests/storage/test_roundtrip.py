"""Random types and values, written and read, against serialisers that others wrote."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros2._dynamic import serialize_dynamic
from mcap_ros2.decoder import DecoderFactory
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from attlog import storage
from attlog.schemas import Channel, Columns, MessageType

QUICK = settings(
    max_examples=60,
    deadline=None,
    suppress_health_check=list(HealthCheck),
    phases=(Phase.explicit, Phase.generate),  # shrinking types within types takes minutes
    report_multiple_bugs=False,
)
START_NS = 1_700_000_000_000_000_000


def rosbags_bytes(message: MessageType, row: Any, little_endian: bool) -> bytes:
    """The message as rosbags serialises it."""
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(message.text, message.name))
    return bytes(store.serialize_cdr(rosbags_object(store, message, row), message.name, little_endian=little_endian))


def rosbags_object(store: Any, message: MessageType, row: dict[str, Any]) -> Any:
    values = {}
    for field in message.fields:
        value = row[field.name]
        if isinstance(field.type, MessageType):
            nested = [value] if field.length is None else value
            made = [rosbags_object(store, field.type, item) for item in nested]
            value = made[0] if field.length is None else made
        elif field.length is not None and field.type != "string":
            kind = {"bool": "bool", "byte": "uint8", "char": "uint8"}.get(field.type, field.type)
            value = np.array(value, kind)
        values[field.name] = value
    return store.types[message.name](**values)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("roundtrip")


@QUICK
@given(data=st.data())
def test_what_is_written_is_what_others_would_write(
    data: st.DataObject, folder: Path, typed_rows: Any, table_of: Any, message_object: Any, plain: Any
) -> None:
    message, rows = data.draw(typed_rows)
    columns = Columns(Channel("/t", message), START_NS + np.arange(len(rows)), table_of(message, rows))
    path = folder / "own.mcap"
    storage.write(path, [columns], compression="none", force=True)
    encode = serialize_dynamic(message.name, message.text)[message.name]
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        found = list(reader.iter_decoded_messages())
    assert len(found) == len(rows)
    for (_, _, stored, decoded), row in zip(found, rows, strict=True):
        assert stored.data == encode(message_object(message, row))
        assert plain(message, decoded) == plain(message, message_object(message, row))
    with storage.open(path) as log:
        assert log.topics["/t"].channel.type == message
        back = log["/t"].data
    assert [plain(message, row) for row in back] == [plain(message, message_object(message, row)) for row in rows]


@QUICK
@given(data=st.data())
def test_what_others_wrote_is_read_in_either_byte_order(
    data: st.DataObject, folder: Path, typed_rows: Any, plain: Any, message_object: Any
) -> None:
    message, rows = data.draw(typed_rows)
    orders = data.draw(st.lists(st.booleans(), min_size=len(rows), max_size=len(rows)))
    path = folder / "other.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start("ros2")
        schema = writer.register_schema(message.name, "ros2msg", message.text.encode())
        channel = writer.register_channel("/t", "cdr", schema)
        for number, (row, order) in enumerate(zip(rows, orders, strict=True)):
            writer.add_message(channel, START_NS + number, rosbags_bytes(message, row, order), START_NS + number)
        writer.finish()
    with storage.open(path) as log:
        back = log["/t"].data
    assert [plain(message, row) for row in back] == [plain(message, message_object(message, row)) for row in rows]


@QUICK
@given(data=st.data())
def test_rows_come_back_in_order_of_time_and_the_same_when_written_again(
    data: st.DataObject, folder: Path, typed_rows: Any, table_of: Any, plain: Any
) -> None:
    message, rows = data.draw(typed_rows)
    time_ns = np.array(data.draw(st.lists(st.integers(0, 5), min_size=len(rows), max_size=len(rows))), np.int64)
    first, second = folder / "first.mcap", folder / "second.mcap"
    storage.write(first, [Columns(Channel("/t", message), time_ns, table_of(message, rows))], force=True)
    with storage.open(first) as log:
        once = log["/t"]
    storage.write(second, [once], force=True)
    with storage.open(second) as log:
        twice = log["/t"]
    order = np.argsort(time_ns, kind="stable")
    assert once.time_ns.tolist() == time_ns[order].tolist() == twice.time_ns.tolist()
    expected = [plain(message, row) for row in table_of(message, rows)[order]]
    assert [plain(message, row) for row in once.data] == expected == [plain(message, row) for row in twice.data]


def test_text_that_ends_in_nul_or_is_very_long_is_kept(log_path: Path) -> None:
    message = MessageType.parse("t/msg/Text", "string text\nuint8[] blob\n")
    texts = [b"a\0", b"", b"x" * 300_000, b"b"]
    data = np.zeros(4, [("text", object), ("blob", object)])
    data["text"] = np.fromiter(texts, object, 4)
    data["blob"] = np.fromiter((np.arange(n, dtype=np.uint8) for n in (0, 3, 200, 7)), object, 4)
    storage.write(log_path, [Columns(Channel("/t", message), np.arange(4), data)])
    with storage.open(log_path) as log:
        back = log["/t"].data
    assert back["text"].tolist() == texts
    assert [len(blob) for blob in back["blob"]] == [0, 3, 200, 7]


def test_zero_length_string_without_nul_is_read(log_path: Path) -> None:
    message = MessageType.parse("t/msg/Text", "string text\nuint32 after\n")
    payloads = [b"\0\1\0\0" + b"\0\0\0\0" + b"\5\0\0\0", b"\0\1\0\0" + b"\2\0\0\0a\0\0\0" + b"\6\0\0\0"]
    for chosen in ([0, 0], [0, 1]):
        with log_path.open("wb") as file:
            writer = Writer(file)
            writer.start("ros2")
            schema = writer.register_schema(message.name, "ros2msg", message.text.encode())
            channel = writer.register_channel("/t", "cdr", schema)
            for number in chosen:
                writer.add_message(channel, number, payloads[number], number)
            writer.finish()
        with storage.open(log_path) as log:
            data = log["/t"].data
        assert data["text"].tolist() == [[b"", b"a"][number] for number in chosen]
        assert data["after"].tolist() == [[5, 6][number] for number in chosen]
