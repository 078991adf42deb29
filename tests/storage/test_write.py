"""What `storage.write` writes, read by the official reader, by rosbags, by Foxglove's libraries."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from attlog import storage
from attlog.schemas import Channel, Columns, MessageType, StorageError, UsageError, messages
from attlog.schemas.definition import TEXT_TYPES
from attlog.schemas.passthrough import SourceField, generated_type

START_NS = 1_700_000_000_000_000_000
STANDARD = [
    value for value in vars(messages).values() if isinstance(value, MessageType) and value is not messages.HEADER
]
ODD_NAMES = generated_type(
    "mavlink_msgs",
    "GPS_RAW_INT",
    [
        SourceField("TimeUS", "uint64", unit="us"),
        SourceField("2d__x_", "float32", unit="m", multiplier=0.01),
        SourceField("text", "string"),
        SourceField("Text", "string"),
        SourceField("q", "float32", 4),
    ],
)


def _value(kind: str | MessageType, number: int) -> Any:
    if isinstance(kind, MessageType):
        return _row(kind, number)
    if kind in TEXT_TYPES:
        return f"text {'x' * (number % 3)}"
    return number % 2 == 1 if kind == "bool" else number % 100


def _row(message: MessageType, number: int) -> dict[str, Any]:
    """Every field filled with something that tells messages, fields and elements apart."""
    row = {}
    for place, field in enumerate(message.fields):
        first = number + 7 * place
        count = field.length or number % 3
        value = _value(field.type, first)
        row[field.name] = value if field.length is None else [_value(field.type, first + k) for k in range(count)]
    return row


@pytest.fixture
def every_type(log_path: Path, table_of: Callable[..., np.ndarray]) -> tuple[Path, dict[str, list[dict[str, Any]]]]:
    """A file with a channel of each standard type, and one of a passed-through type; its values by topic."""
    columns, values = [], {}
    for place, message in enumerate([*STANDARD, ODD_NAMES]):
        rows = [_row(message, number) for number in range(5)]
        time_ns = START_NS + np.arange(5) * 1_000_000_000 + place
        for row, stamp in zip(rows, time_ns.tolist(), strict=True):
            if "header" in row:
                row["header"]["stamp"] = {"sec": stamp // 10**9, "nanosec": stamp % 10**9}
        topic = f"/{message.name}"
        columns.append(Columns(Channel(topic, message, {"source": "test"}), time_ns, table_of(message, rows)))
        values[topic] = rows
    storage.write(log_path, columns, metadata={"about": {"a": "b"}}, attachments=[storage.Attachment("a.txt", b"abc")])
    return log_path, values


def test_official_reader_agrees(every_type: Any, plain: Any) -> None:
    path, values = every_type
    found: dict[str, list[Any]] = {topic: [] for topic in values}
    types = {f"/{message.name}": message for message in [*STANDARD, ODD_NAMES]}
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, _, decoded in reader.iter_decoded_messages():
            assert "offered_qos_profiles" in channel.metadata
            found[channel.topic].append(plain(types[channel.topic], decoded))
        assert [(item.name, item.data) for item in reader.iter_attachments()] == [("a.txt", b"abc")]
        assert [(item.name, item.metadata) for item in reader.iter_metadata()] == [("about", {"a": "b"})]
        summary = reader.get_summary()
        assert summary is not None
        assert reader.get_header().profile == "ros2"
    assert found == values
    assert summary.statistics is not None
    assert summary.statistics.message_count == 5 * len(values)
    assert set(summary.statistics.channel_message_counts.values()) == {5}
    assert sum(len(chunk.message_index_offsets) for chunk in summary.chunk_indexes) == len(values)


def test_rosbags_agrees(every_type: Any, plain: Any) -> None:
    from rosbags.highlevel import AnyReader

    path, values = every_type
    types = {f"/{message.name}": message for message in [*STANDARD, ODD_NAMES]}
    found: dict[str, list[Any]] = {topic: [] for topic in values}
    with AnyReader([path]) as reader:
        for connection, _, raw in reader.messages():
            message = types[connection.topic]
            decoded = reader.deserialize(raw, connection.msgtype)
            found[connection.topic].append(plain(message, decoded))
    assert found == values


def test_attlog_agrees(every_type: Any, plain: Any) -> None:
    path, values = every_type
    with storage.open(path) as log:
        assert log.profile == "ros2"
        assert log.metadata == {"about": {"a": "b"}}
        assert log.attachments == (storage.Attachment("a.txt", b"abc"),)
        for topic, info in log.topics.items():
            back = log[topic]
            assert info.count == 5
            assert info.channel.metadata == {"source": "test"}
            assert (info.start_ns, info.end_ns) == (back.time_ns[0], back.time_ns[-1])
            assert [plain(info.channel.type, row) for row in back.data] == values[topic]
        assert log.topics[f"/{ODD_NAMES.name}"].source_names["TimeUS"] == "timeus"


@pytest.mark.parametrize("compression", ["zstd", "lz4", "none"])
def test_foxglove_reads_every_channel(every_type: Any, readcheck: Callable[[Path], None], compression: str) -> None:
    path, _ = every_type
    with storage.open(path) as log:
        columns = log.read()
    again = path.with_name("again.mcap")
    storage.write(again, columns.values(), compression=compression)
    readcheck(again)


def test_messages_of_all_channels_are_interleaved_by_time(
    log_path: Path, imu: Columns, mag: Columns, notes: Columns
) -> None:
    storage.write(log_path, [mag, notes, imu], apart=lambda topic: False)
    with log_path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        times = [message.log_time for _, _, message in reader.iter_messages(log_time_order=False)]
    assert times == sorted(times)
    assert len(times) == len(imu) + len(mag) + len(notes)
    assert summary is not None
    sizes = [chunk.uncompressed_size for chunk in summary.chunk_indexes]
    assert len(sizes) > 1
    assert all(2**20 <= size < 2**20 + 10_000 for size in sizes[:-1])


def test_derived_channels_have_chunks_of_their_own(log_path: Path, imu: Columns, mag: Columns, notes: Columns) -> None:
    storage.write(log_path, [notes, imu, mag])
    with storage.open(log_path) as log:
        ids = {topic: info.id for topic, info in log.topics.items()}
        kinds = [set(chunk.message_indexes) for chunk in log.index.chunks]
        assert (log["/annotations"].data["msg"] == notes.data["msg"]).all()
    assert kinds[-1] == {ids["/annotations"]}
    assert all(kind == {ids["/imu0/data_raw"], ids["/mag0/field"]} for kind in kinds[:-1])


def test_equal_times_keep_the_order_of_the_channels(log_path: Path, imu: Columns) -> None:
    same = Columns(imu.channel, np.zeros(len(imu), np.int64) + START_NS, imu.data)
    storage.write(log_path, [same])
    with storage.open(log_path) as log:
        back = log["/imu0/data_raw"]
    assert back.data["angular_velocity"].tolist() == imu.data["angular_velocity"].tolist()


def test_stamps_of_header_and_log_agree(log_path: Path, imu: Columns, notes: Columns) -> None:
    storage.write(log_path, [imu, notes])
    with storage.open(log_path) as log:
        read = log.read()
    for topic, path in (("/imu0/data_raw", ("header", "stamp")), ("/annotations", ("stamp",))):
        stamp = read[topic].data
        for name in path:
            stamp = stamp[name]
        assert (stamp["sec"].astype(np.int64) * 10**9 + stamp["nanosec"] == read[topic].time_ns).all()


def test_large_messages_and_empty_channels(log_path: Path) -> None:
    blob = MessageType.parse("t/msg/Blob", "uint8[] data\n")
    data = np.zeros(3, [("data", "u1", (3_000_000,))])
    data["data"][1] = 7
    channels = [
        Columns(Channel("/blob", blob), np.arange(3), data),
        Columns(Channel("/none", blob), np.zeros(0, np.int64), data[:0]),
    ]
    storage.write(log_path, channels, compression="lz4")
    with storage.open(log_path) as log:
        assert log.topics["/none"].count == 0
        assert len(log["/none"]) == 0
        assert (log["/blob"].data["data"] == data["data"]).all()


def test_file_without_messages(log_path: Path) -> None:
    storage.write(log_path, [], metadata={"a": {}})
    with storage.open(log_path) as log:
        assert dict(log.topics) == {}
        assert log.read() == {}
        assert (log.start_ns, log.end_ns) == (0, 0)
    with log_path.open("rb") as file:
        assert make_reader(file, validate_crcs=True).get_summary() is not None


def test_what_is_there_is_not_overwritten(log_path: Path, imu: Columns) -> None:
    log_path.write_bytes(b"precious")
    with pytest.raises(StorageError, match="exists already"):
        storage.write(log_path, [imu])
    assert log_path.read_bytes() == b"precious"
    storage.write(log_path, [imu], force=True)
    assert [path.name for path in log_path.parent.iterdir()] == ["log.mcap"]


def test_failure_leaves_nothing_behind(log_path: Path, imu: Columns) -> None:
    bad = Columns(imu.channel, imu.time_ns - imu.time_ns[-1], imu.data)
    with pytest.raises(StorageError, match="before 1970"):
        storage.write(log_path, [bad])
    with pytest.raises(UsageError, match="two channels"):
        storage.write(log_path, [imu, imu])
    with pytest.raises(StorageError, match="cannot be written"):
        storage.write(log_path.parent / "absent" / "log.mcap", [imu])
    with pytest.raises(UsageError, match="zstd, lz4, none"):
        storage.write(log_path, [imu], compression="gzip")
    assert list(log_path.parent.iterdir()) == []


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_full_disk_is_one_error(log_path: Path, imu: Columns, monkeypatch: pytest.MonkeyPatch) -> None:
    from attlog.storage import sink

    def on_full_disk(path: Path, mode: str) -> Any:
        Path(path).touch()
        return open("/dev/full", mode)

    monkeypatch.setattr(sink, "open", on_full_disk, raising=False)
    with pytest.raises(StorageError, match="No space left"):
        storage.write(log_path, [imu])
    assert list(log_path.parent.iterdir()) == []
