"""Files that other software wrote: with and without chunks, indexes, CRCs, summaries; other encodings."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType, Writer
from mcap_ros2.decoder import DecoderFactory

from attlog import storage
from attlog.schemas import Columns, InputError, UsageError

START_NS = 1_700_000_000_000_000_000
VARIANTS: dict[str, dict[str, Any]] = {
    "zstd": {"compression": CompressionType.ZSTD},
    "lz4": {"compression": CompressionType.LZ4},
    "none": {"compression": CompressionType.NONE},
    "small chunks": {"chunk_size": 2000},
    "no chunks": {"use_chunking": False},
    "no chunks, no summary": {
        "use_chunking": False,
        "index_types": IndexType.NONE,
        "use_statistics": False,
        "use_summary_offsets": False,
        "repeat_channels": False,
        "repeat_schemas": False,
    },
    "no indexes": {"index_types": IndexType.NONE, "chunk_size": 2000},
    "no message indexes": {"index_types": IndexType.CHUNK | IndexType.METADATA, "chunk_size": 2000},
    "no statistics": {"use_statistics": False, "chunk_size": 2000},
    "no repeated channels": {"repeat_channels": False, "repeat_schemas": False, "chunk_size": 2000},
    "nothing but data": {
        "index_types": IndexType.NONE,
        "use_statistics": False,
        "use_summary_offsets": False,
        "repeat_channels": False,
        "repeat_schemas": False,
        "chunk_size": 2000,
    },
    "no CRCs": {"enable_crcs": False},
}


def write_foreign(path: Path, columns: list[Columns], **options: Any) -> None:
    """The columns' messages by the `mcap` package."""
    plain = path.with_suffix(".tmp")
    storage.write(plain, columns, compression="none", force=True)
    with plain.open("rb") as source, path.open("wb") as target:
        writer = Writer(target, **options)
        writer.start("ros2", "someone else")
        ids: dict[int, int] = {}
        for schema, channel, message in make_reader(source).iter_messages():
            assert schema is not None
            if channel.id not in ids:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                ids[channel.id] = writer.register_channel(channel.topic, "cdr", number, {"who": "else"})
            writer.add_message(ids[channel.id], message.log_time, message.data, message.publish_time)
        writer.add_attachment(5, 6, "a", "text/plain", b"data")
        writer.add_metadata("m", {"k": "v"})
        writer.finish()
    plain.unlink()


@pytest.mark.parametrize("variant", VARIANTS)
def test_every_kind_of_file_is_read(variant: str, log_path: Path, imu: Columns, mag: Columns, notes: Columns) -> None:
    sent = {entry.channel.topic: entry for entry in (imu, mag, notes)}
    write_foreign(log_path, list(sent.values()), **VARIANTS[variant])
    with storage.open(log_path) as log:
        assert log.library.endswith("someone else")
        assert {topic: info.count for topic, info in log.topics.items()} == {t: len(c) for t, c in sent.items()}
        assert (log.start_ns, log.end_ns) == (imu.time_ns[0], max(int(c.time_ns[-1]) for c in sent.values()))
        assert log.topics["/mag0/field"].metadata == {"who": "else"}
        assert (log.topics["/mag0/field"].start_ns, log.topics["/mag0/field"].end_ns) == (
            mag.time_ns[0],
            mag.time_ns[-1],
        )
        assert log.metadata == {"m": {"k": "v"}}
        assert log.attachments == (storage.Attachment("a", b"data", "text/plain", 6, 5),)
        everything, one = log.read(), log["/annotations"]
        part = log.read(["/imu0/data_raw"], int(imu.time_ns[1000]), int(imu.time_ns[2000]))["/imu0/data_raw"]
    for topic, columns in sent.items():
        assert (everything[topic].time_ns == columns.time_ns).all()
        for name in columns.data.dtype.names or ():
            assert (everything[topic].data[name] == columns.data[name]).all()
    assert (one.data["msg"] == notes.data["msg"]).all()
    assert (part.time_ns == imu.time_ns[1000:2000]).all()
    assert (part.data["angular_velocity"] == imu.data["angular_velocity"][1000:2000]).all()


@pytest.mark.parametrize("name", ["rosbag2_cdr_test.mcap", "bagel_part_0.mcap"])
def test_real_cdr_files_equal_the_official_decoder(name: str, logs: Path, plain: Any) -> None:
    with storage.open(logs / name) as log:
        assert not any(info.raw for info in log.topics.values())
        types = {topic: info.channel.type for topic, info in log.topics.items()}
        mine = {topic: [plain(types[topic], row) for row in columns.data] for topic, columns in log.read().items()}
    theirs: dict[str, list[Any]] = {topic: [] for topic in mine}
    with (logs / name).open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, _, decoded in reader.iter_decoded_messages():
            theirs[channel.topic].append(plain(types[channel.topic], decoded))
    assert mine == theirs


def test_real_json_file_equals_the_json_module(logs: Path) -> None:
    path = logs / "foxglove_json_logs.mcap"
    with storage.open(path) as log:
        read = log.read()
    rows: dict[str, list[Any]] = {}
    with path.open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages():
            rows.setdefault(channel.topic, []).append(json.loads(message.data))
    assert read["mouse"].data["clientX"].tolist() == [row["clientX"] for row in rows["mouse"]]
    logged = read["/rosout"].data
    assert [text.decode() for text in logged["message"]] == [row["message"] for row in rows["/rosout"]]
    assert logged["timestamp"]["nsec"].tolist() == [row["timestamp"]["nsec"] for row in rows["/rosout"]]


def _single(path: Path, schema: tuple[str, str, bytes], encoding: str, payloads: list[bytes]) -> None:
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start("")
        number = writer.register_schema(*schema) if schema[0] else 0
        channel = writer.register_channel("/t", encoding, number)
        for row, payload in enumerate(payloads):
            writer.add_message(channel, START_NS + row, payload, START_NS + row)
        writer.finish()


def test_ros1_messages(log_path: Path) -> None:
    text = (
        "Header header\nfloat64 value\nduration[2] spans\nstring text\n"
        f"{'=' * 80}\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
    )
    payloads = [
        struct.pack("<III", row, 100 + row, 200)
        + struct.pack("<I", row)
        + b"f" * row
        + struct.pack("<d", row / 2)
        + struct.pack("<iiii", 1, 2, -3, row)
        + struct.pack("<I2s", 2, b"ab")
        for row in range(4)
    ]
    _single(log_path, ("pkg/Kind", "ros1msg", text.encode()), "ros1", payloads)
    with storage.open(log_path) as log:
        data = log["/t"].data
    assert data["header"]["seq"].tolist() == [0, 1, 2, 3]
    assert data["header"]["frame_id"].tolist() == [b"", b"f", b"ff", b"fff"]
    assert data["value"].tolist() == [0, 0.5, 1, 1.5]
    assert data["spans"]["sec"].tolist() == [[1, -3]] * 4
    assert data["text"].tolist() == [b"ab"] * 4


@pytest.mark.parametrize(
    ("schema", "encoding"),
    [
        (("pkg.Kind", "protobuf", b"\x0a"), "protobuf"),
        (("pkg::Kind", "omgidl", b"struct"), "cdr"),
        (("pkg/msg/Kind", "ros2msg", b"this is no definition"), "cdr"),
        (("pkg/msg/Kind", "ros2msg", b"wstring text\n"), "cdr"),
        (("", "", b""), "cbor"),
    ],
)
def test_unknown_encodings_stay_bytes(log_path: Path, schema: tuple[str, str, bytes], encoding: str) -> None:
    payloads = [b"", b"abc", b"\0\1\0\0" * 3]
    _single(log_path, schema, encoding, payloads)
    with storage.open(log_path) as log:
        assert log.topics["/t"].raw
        assert log.topics["/t"].encoding == encoding
        assert log["/t"].data["data"].tolist() == payloads


def test_json_of_mixed_kinds(log_path: Path) -> None:
    rows = [
        {"a": 1, "b": {"x": 1.5}, "c": [1, 2], "d": "t", "e": True, "mixed": 1},
        {"a": 2, "b": {"x": None}, "c": [3, 4], "d": None, "e": False, "mixed": "x", "2 odd-name": 3},
    ]
    _single(log_path, ("", "", b""), "json", [json.dumps(row).encode() for row in rows])
    with storage.open(log_path) as log:
        columns = log["/t"]
    data = columns.data
    assert data["a"].tolist() == [1, 2]
    assert np.isnan(data["b"]["x"][1])
    assert data["c"].tolist() == [[1, 2], [3, 4]]
    assert data["d"].tolist() == [b"t", b""]
    assert data["e"].tolist() == [True, False]
    assert data["mixed"].tolist() == [b"1", b"x"]
    assert np.isnan(data["f2_odd_name"][0])
    assert columns.channel.type["f2_odd_name"].comment == "2 odd-name"


def test_overlapping_chunks_and_messages_out_of_order(log_path: Path, imu: Columns) -> None:
    order = np.random.default_rng(0).permutation(len(imu))
    plain = log_path.with_suffix(".plain")
    storage.write(plain, [imu])
    with plain.open("rb") as source, log_path.open("wb") as target:
        writer = Writer(target, chunk_size=10_000)
        writer.start("ros2")
        messages = list(make_reader(source).iter_messages())
        schema = messages[0][0]
        assert schema is not None
        number = writer.register_schema(schema.name, schema.encoding, schema.data)
        channel = writer.register_channel("/imu0/data_raw", "cdr", number)
        for row in order.tolist():
            message = messages[row][2]
            writer.add_message(channel, message.log_time, message.data, message.publish_time)
        writer.finish()
    with storage.open(log_path) as log:
        back = log["/imu0/data_raw"]
    assert (back.time_ns == imu.time_ns).all()
    assert (back.data["angular_velocity"] == imu.data["angular_velocity"]).all()


def test_unknown_topic_and_missing_file(log_path: Path, imu: Columns) -> None:
    storage.write(log_path, [imu])
    with storage.open(log_path) as log, pytest.raises(UsageError, match="/imu0/data_raw"):
        log.read(["/absent"])
    with pytest.raises(InputError, match="cannot be read"):
        storage.open(log_path.with_name("absent.mcap"))
