"""`storage.annotate`: what is added, what goes, and that everything else stays byte for byte."""

import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader

from attlog import storage
from attlog.schemas import Columns, InputError, StorageError
from attlog.schemas.unified import attitude_columns
from attlog.storage import crc

START_NS = 1_700_000_000_000_000_000


def attitude(topic: str, count: int = 3000, turn: float = 1e-3) -> Columns:
    """An attitude at 1 kHz that turns about the vertical."""
    angle = np.arange(count) * turn
    orientation = np.stack([0 * angle, 0 * angle, np.sin(angle / 2), np.cos(angle / 2)], axis=1)
    time_ns = START_NS + np.arange(count) * 1_000_000
    return attitude_columns(topic, time_ns, orientation, child_frame_id="x", source="test")


def payloads(path: Path) -> dict[str, list[tuple[int, int, bytes]]]:
    """Every message's bytes by topic, by the official reader, CRCs and counts checked."""
    found: dict[str, list[tuple[int, int, bytes]]] = {}
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        for _, channel, message in reader.iter_messages():
            found.setdefault(channel.topic, []).append((message.log_time, message.publish_time, message.data))
        summary = reader.get_summary()
    with path.open("rb") as file:
        kinds = [type(record).__name__ for record in StreamReader(file, validate_crcs=True).records]
    assert summary is not None
    assert summary.statistics is not None
    counts = {summary.channels[number].topic: n for number, n in summary.statistics.channel_message_counts.items()}
    assert counts == {topic: len(rows) for topic, rows in found.items()}
    assert summary.statistics.message_count == sum(counts.values()) == kinds.count("Message")
    if found:
        times = [row[0] for rows in found.values() for row in rows]
        assert (summary.statistics.message_start_time, summary.statistics.message_end_time) == (min(times), max(times))
    return found


@pytest.fixture
def log(log_path: Path, imu: Columns, mag: Columns, notes: Columns) -> Path:
    """A file with three channels, metadata and an attachment."""
    extra = {"metadata": {"m": {"a": "b"}, "n": {}}, "attachments": [storage.Attachment("a", b"abc")]}
    storage.write(log_path, [imu, mag, notes], **extra)  # type: ignore[arg-type]
    return log_path


def test_added_channels_and_metadata(log: Path) -> None:
    before, size = payloads(log), log.stat().st_size
    old = log.read_bytes()
    with storage.open(log) as opened:
        end = max(c.offset + c.length + c.message_index_length for c in opened.index.chunks)
    added = attitude("/estimate/ecf/attitude")
    storage.annotate(log, [added], metadata={"m": {"c": "d"}, "new": {"e": "f"}, "n": None})
    assert log.read_bytes()[:end] == old[:end]
    assert log.stat().st_size > size
    after = payloads(log)
    assert {topic: after[topic] for topic in before} == before
    with storage.open(log) as opened:
        assert opened.metadata == {"m": {"c": "d"}, "new": {"e": "f"}}
        assert opened.attachments == (storage.Attachment("a", b"abc"),)
        back = opened["/estimate/ecf/attitude"]
    assert (back.time_ns == added.time_ns).all()
    assert (back.data["orientation"] == added.data["orientation"]).all()
    assert [path.name for path in log.parent.iterdir()] == [log.name]


def test_replacing_again_and_again_changes_nothing_else(log: Path) -> None:
    before = payloads(log)
    sizes = set()
    for turn in (1e-3, 2e-3, 3e-3):
        storage.annotate(log, [attitude("/estimate/ecf/attitude", turn=turn), attitude("/estimate/gyro/attitude")])
        after = payloads(log)
        assert {topic: after[topic] for topic in before} == before
        assert set(after) == {*before, "/estimate/ecf/attitude", "/estimate/gyro/attitude"}
        with storage.open(log) as opened:
            back = opened["/estimate/ecf/attitude"].data["orientation"]
            sizes.add(len(opened.index.chunks))
        assert (back == attitude("/", turn=turn).data["orientation"]).all()
    assert len(sizes) == 1


def test_removing_interleaved_channels_rewrites_their_chunks(log: Path) -> None:
    before = payloads(log)
    storage.annotate(log, remove=lambda topic: topic in ("/mag0/field", "/annotations"))
    assert payloads(log) == {"/imu0/data_raw": before["/imu0/data_raw"]}
    with storage.open(log) as opened:
        assert set(opened.topics) == {"/imu0/data_raw"}
        assert len(opened.index.schemas) == 1
    storage.annotate(log, remove=lambda topic: True)
    assert payloads(log) == {}


def test_output_beside(log: Path, tmp_path: Path) -> None:
    old = log.read_bytes()
    target = tmp_path / "other.mcap"
    storage.annotate(log, [attitude("/a")], output=target)
    assert log.read_bytes() == old
    assert "/a" in payloads(target)
    with pytest.raises(StorageError, match="exists already"):
        storage.annotate(log, [attitude("/a")], output=target)
    storage.annotate(log, [attitude("/b")], output=target, force=True)
    assert "/b" in payloads(target)


def test_a_link_stays_a_link(log: Path, tmp_path: Path) -> None:
    link = tmp_path / "link.mcap"
    link.symlink_to(log)
    log.chmod(0o640)
    storage.annotate(link, [attitude("/a")])
    assert link.is_symlink()
    assert "/a" in payloads(log)
    assert log.stat().st_mode & 0o777 == 0o640


def test_a_file_that_changed_meanwhile_is_left(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = importlib.import_module("attlog.storage.annotate")
    original: Callable[..., None] = module.write_end

    def meddle(*given: Any) -> None:
        log.write_bytes(b"changed")
        original(*given)

    monkeypatch.setattr(module, "write_end", meddle)
    with pytest.raises(StorageError, match="meanwhile"):
        storage.annotate(log, [attitude("/a")])
    assert log.read_bytes() == b"changed"
    assert len(list(log.parent.iterdir())) == 1


def test_damage_found_on_the_way_leaves_the_file(log: Path) -> None:
    with storage.open(log) as opened:
        chunk = opened.index.chunks[0]
    data = bytearray(log.read_bytes())
    data[chunk.offset + chunk.length // 2] ^= 1
    log.write_bytes(bytes(data))
    with pytest.raises(InputError, match=r"CRC|unpack"):
        storage.annotate(log, remove=lambda topic: topic == "/mag0/field")
    assert log.read_bytes() == bytes(data)
    assert len(list(log.parent.iterdir())) == 1


@pytest.mark.parametrize("name", ["rosbag2_cdr_test.mcap", "bagel_part_0.mcap", "foxglove_json_logs.mcap"])
def test_files_of_others_keep_their_channels(name: str, logs: Path, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes((logs / name).read_bytes())
    before = payloads(path)
    with path.open("rb") as file:
        reader = make_reader(file)
        summary, header = reader.get_summary(), reader.get_header()
    storage.annotate(path, [attitude("/estimate/ecf/attitude")], metadata={"x": {}})
    storage.annotate(path, [attitude("/estimate/ecf/attitude", turn=1e-4)])
    after = payloads(path)
    assert {topic: after[topic] for topic in before} == before
    with path.open("rb") as file:
        reader = make_reader(file)
        now = reader.get_summary()
        assert reader.get_header() == header
    assert summary is not None
    assert now is not None
    assert {number: now.channels[number] for number in summary.channels} == summary.channels
    assert {number: now.schemas[number] for number in summary.schemas} == summary.schemas
    first = next(iter(before))
    storage.annotate(path, remove=lambda topic: topic == first)
    assert set(payloads(path)) == set(after) - {first}


def test_variants_of_files_of_others(tmp_path: Path, imu: Columns, notes: Columns) -> None:
    from mcap.writer import IndexType, Writer

    for number, options in enumerate(
        ({"use_chunking": False}, {"index_types": IndexType.NONE, "use_statistics": False, "chunk_size": 5000})
    ):
        plain, path = tmp_path / f"plain{number}", tmp_path / f"{number}.mcap"
        storage.write(plain, [imu, notes])
        with plain.open("rb") as source, path.open("wb") as target:
            writer = Writer(target, **options)  # type: ignore[arg-type]
            writer.start("ros2")
            ids: dict[str, int] = {}
            for schema, channel, message in make_reader(source).iter_messages():
                assert schema is not None
                if channel.topic not in ids:
                    kind = writer.register_schema(schema.name, schema.encoding, schema.data)
                    ids[channel.topic] = writer.register_channel(channel.topic, "cdr", kind)
                writer.add_message(ids[channel.topic], message.log_time, message.data, message.publish_time)
            writer.finish()
        with storage.open(path) as opened:
            before = opened.read()
        storage.annotate(path, [attitude("/a")])
        storage.annotate(path, remove=lambda topic: topic == "/annotations")
        with storage.open(path) as opened:
            after = opened.read()
            assert opened.topics["/a"].count == 3000
            assert opened.statistics.messages == 3000 + len(imu)
        assert set(after) == {"/imu0/data_raw", "/a"}
        assert (after["/imu0/data_raw"].data == before["/imu0/data_raw"].data).all()


def test_chunks_of_unknown_compression_are_copied(log: Path) -> None:
    data = log.read_bytes().replace(b"zstd", b"brot")
    log.write_bytes(data)
    with pytest.raises(InputError, match="CRC"):  # the summary was changed, too
        storage.open(log)
    start = int.from_bytes(data[-28:-20], "little")
    checksum = crc.crc32(data[start:-12]).to_bytes(4, "little")
    log.write_bytes(data[:-12] + checksum + data[-8:])
    with pytest.raises(InputError, match="data section"):
        storage.annotate(log, [attitude("/a")])
    unchecked = data[: start - 4] + bytes(4) + data[start:-12]  # a writer that gives the data section no CRC
    log.write_bytes(unchecked + checksum + data[-8:])
    storage.annotate(log, [attitude("/a")])
    with storage.open(log) as opened:
        assert opened.topics["/imu0/data_raw"].count == 5000
        assert len(opened["/a"]) == 3000
        with pytest.raises(InputError, match="brot"):
            opened.read(["/imu0/data_raw"])
    with pytest.raises(InputError, match="brot"):
        storage.annotate(log, remove=lambda topic: topic == "/mag0/field")
