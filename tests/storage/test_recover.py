"""Recover: cut at any byte, flipped at any bit, other writers' files; judged by the official reader."""

import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType, Writer

from attlog import storage
from attlog.schemas import InputError, StorageError
from attlog.schemas.columns import Columns
from attlog.schemas.unified import imu_columns

START = 1_700_000_000_000_000_000
BATCHES, BATCH = 20, 50
FEW = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def batch(number: int) -> Columns:
    time_ns = START + (number * BATCH + np.arange(BATCH)) * 1_000_000
    values = np.random.default_rng(number).normal(size=(BATCH, 3))
    return imu_columns("/imu0/data_raw", time_ns, values, values, source="test")


@pytest.fixture(scope="module")
def streamed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of 20 chunks with 50 messages each, metadata before and after."""
    path = tmp_path_factory.mktemp("streamed") / "log.mcap"
    writer = storage.StreamWriter(path, {"first": {"a": "b"}})
    for number in range(BATCHES):
        writer.append([batch(number)])
    writer.close({"last": {"c": "d"}})
    return path


def official(compression: CompressionType, chunked: bool = True) -> bytes:
    """A file as the official writer makes it, with an attachment."""
    out = io.BytesIO()
    writer = Writer(out, chunk_size=2000, compression=compression, use_chunking=chunked, index_types=IndexType.ALL)
    writer.start("", "official")
    schema = writer.register_schema("pkg/msg/Text", "ros2msg", b"string data")
    channels = [writer.register_channel(topic, "cdr", schema) for topic in ("/a", "/b")]
    writer.add_attachment(1, 1, "notes.txt", "text/plain", b"hello" * 10)
    for number in range(400):
        payload = b"\x00\x01\x00\x00\x29\x00\x00\x00" + np.random.default_rng(number).bytes(20).hex().encode() + b"\x00"
        writer.add_message(channels[number % 2], START + number, payload, START + number)
    writer.add_metadata("about", {"key": "value"})
    writer.finish()
    return out.getvalue()


def read(path: Path) -> list[tuple[str, int, bytes]]:
    """Every message, by the official reader, which checks every CRC and the statistics."""
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        messages = [(c.topic, m.log_time, m.data) for _, c, m in reader.iter_messages()]
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == len(messages)
    with storage.open(path) as log:
        assert sum(len(columns) for columns in log.read().values()) == len(messages)
    return messages


def recovered(data: bytes, folder: Path) -> tuple[storage.Recovery, list[tuple[str, int, bytes]]]:
    """Recover these bytes, which must stay as they are."""
    source = folder / "broken.mcap"
    source.write_bytes(data)
    report = storage.recover(source, folder / "whole.mcap", force=True)
    assert source.read_bytes() == data
    return report, read(folder / "whole.mcap")


def test_a_whole_file_stays_as_it_is(streamed: Path, tmp_path: Path) -> None:
    report, messages = recovered(streamed.read_bytes(), tmp_path)
    assert report.complete
    assert report.ended
    assert messages == read(streamed)
    with storage.open(tmp_path / "whole.mcap") as log:
        assert log.metadata["first"] == {"a": "b"}
        assert log.metadata["last"] == {"c": "d"}
        assert log.metadata["recovery"]["bytes_skipped"] == "0"
        assert log.profile == "ros2"


@given(data=st.data())
@FEW
def test_cut_anywhere(streamed: Path, data: st.DataObject, tmp_path: Path) -> None:
    whole_file = streamed.read_bytes()
    cut = data.draw(st.integers(40, len(whole_file)))
    chunks = _chunk_ends(whole_file)
    report, messages = recovered(whole_file[:cut], tmp_path)
    whole = sum(end <= cut for end in chunks) * BATCH
    assert whole <= len(messages) <= min(whole + BATCH, BATCHES * BATCH)
    assert len(messages) == whole + report.saved
    times = [time_ns for _, time_ns, _ in messages]
    assert times == [START + k * 1_000_000 for k in range(len(times))]


@given(data=st.data())
@FEW
def test_a_flipped_bit_costs_its_chunk_and_is_counted(streamed: Path, data: st.DataObject, tmp_path: Path) -> None:
    sound = read(streamed)
    flipped = bytearray(streamed.read_bytes())
    at = data.draw(st.integers(0, len(flipped) * 8 - 1))
    flipped[at // 8] ^= 1 << at % 8
    report, messages = recovered(bytes(flipped), tmp_path)
    assert len(messages) >= (BATCHES - 1) * BATCH
    assert len(messages) == BATCHES * BATCH or not report.complete
    assert {time_ns for _, time_ns, _ in messages} <= {time_ns for _, time_ns, _ in sound}
    assert {payload for _, _, payload in messages} <= {payload for _, _, payload in sound}


@given(data=st.data())
@FEW
def test_a_hole_costs_what_was_in_it(streamed: Path, data: st.DataObject, tmp_path: Path) -> None:
    sound = streamed.read_bytes()
    start = data.draw(st.integers(0, len(sound) - 1))
    length = data.draw(st.integers(1, 3000))
    fill = data.draw(st.sampled_from([b"\x00", b"\xff", b""]))
    broken = sound[:start] + fill * length + sound[start + length :]
    chunks = _chunk_ends(sound)
    touched = sum(start < end and start + length > begin for begin, end in zip([0, *chunks[:-1]], chunks, strict=True))
    report, messages = recovered(broken, tmp_path)
    assert len(messages) >= (BATCHES - touched - 1) * BATCH
    assert len(messages) == BATCHES * BATCH or not report.complete or not fill or not report.ended


@pytest.mark.parametrize("chunked", [True, False], ids=["chunks", "loose"])
@pytest.mark.parametrize("compression", list(CompressionType), ids=lambda kind: kind.name.lower())
def test_files_of_other_writers(compression: CompressionType, chunked: bool, tmp_path: Path) -> None:
    data = official(compression, chunked)
    (tmp_path / "sound.mcap").write_bytes(data)
    sound = read(tmp_path / "sound.mcap")
    report, messages = recovered(data, tmp_path)
    assert report.complete
    assert messages == sound
    with storage.open(tmp_path / "whole.mcap") as log:
        assert log.attachments[0].data == b"hello" * 10
        assert log.metadata["about"] == {"key": "value"}
    for cut in np.linspace(400, len(data), 25).astype(int).tolist():
        report, messages = recovered(data[:cut], tmp_path)
        assert messages == [m for m in sound if m in messages]
        assert messages == sound[: len(messages)]


def test_messages_of_a_torn_chunk_are_saved(tmp_path: Path) -> None:
    for compression, least in ((CompressionType.NONE, 20), (CompressionType.LZ4, 0), (CompressionType.ZSTD, 0)):
        data = official(compression)
        ends = _chunk_ends(data)
        report, messages = recovered(data[: ends[3] - 200], tmp_path)
        assert report.saved >= least
        assert report.dropped["torn last record"] == 1
        assert len(messages) > 50


def test_definitions_come_from_the_summary_where_their_chunk_is_lost(tmp_path: Path) -> None:
    data = bytearray(official(CompressionType.ZSTD))
    first = next(end for end in _chunk_ends(bytes(data)))
    data[first - 10] ^= 0xFF
    report, messages = recovered(bytes(data), tmp_path)
    assert report.dropped == {"damaged chunk": 1}
    assert len(messages) > 300


def test_a_cut_in_the_summary_loses_nothing(streamed: Path, tmp_path: Path) -> None:
    report, messages = recovered(streamed.read_bytes()[:-200], tmp_path)
    assert report.complete
    assert not report.ended
    assert len(messages) == BATCHES * BATCH


def test_nothing_is_overwritten_and_nonsense_is_refused(streamed: Path, tmp_path: Path) -> None:
    source = tmp_path / "log.mcap"
    source.write_bytes(streamed.read_bytes()[:5000])
    with pytest.raises(StorageError, match="itself"):
        storage.recover(source, source, force=True)
    (tmp_path / "there.mcap").write_bytes(b"mine")
    with pytest.raises(StorageError, match="exists"):
        storage.recover(source, tmp_path / "there.mcap")
    for nonsense in (b"", b"hello, this is no log\n" * 100, bytes(10_000)):
        source.write_bytes(nonsense)
        with pytest.raises(InputError):
            storage.recover(source, tmp_path / "new.mcap")
        assert not (tmp_path / "new.mcap").exists()


def test_opening_a_cut_file_names_the_remedy(streamed: Path, tmp_path: Path) -> None:
    (tmp_path / "cut.mcap").write_bytes(streamed.read_bytes()[:5000])
    with pytest.raises(InputError, match="attlog recover"):
        storage.open(tmp_path / "cut.mcap")


def _chunk_ends(data: bytes) -> list[int]:
    return list(_ends(data))


def _ends(data: bytes) -> Iterator[int]:
    at = 8
    while at < len(data) - 8:
        length = int.from_bytes(data[at + 1 : at + 9], "little")
        if data[at] == 6:
            yield at + 9 + length
        at += 9 + length
