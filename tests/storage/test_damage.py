"""Damaged files: one InputError that names the file, or (where no byte that matters was hit) the right values."""

import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer

from attlog import storage
from attlog.schemas import Columns, InputError
from attlog.storage.records import MAGIC, Op

START_NS = 1_700_000_000_000_000_000


def read_all(path: Path, crc: bool = True) -> dict[str, Columns]:
    with storage.open(path) as log:
        assert log.statistics.messages >= 0
        assert log.metadata is not None
        assert log.attachments is not None
        return log.read(crc=crc)


@pytest.fixture(params=["zstd", "none"])
def whole(request: pytest.FixtureRequest, log_path: Path, imu: Columns, notes: Columns) -> bytes:
    """A good file's bytes: a fixed and a variable channel, metadata, an attachment."""
    channels = [imu.select(slice(0, 400)), notes]
    extra = {"metadata": {"m": {"a": "b"}}, "attachments": [storage.Attachment("a", b"abc")]}
    storage.write(log_path, channels, compression=request.param, **extra)  # type: ignore[arg-type]
    return log_path.read_bytes()


def check(path: Path, data: bytes, crc: bool = True) -> None:
    """Reading ends in columns or in an InputError with the path."""
    path.write_bytes(data)
    message = str(path)
    try:
        read_all(path, crc)
    except InputError as error:
        message = str(error)
    assert str(path) in message
    assert len(message) < 600


@pytest.mark.parametrize("size", [0, 1, 7, 8, 9, 30, 44, 45])
def test_short_files(log_path: Path, whole: bytes, size: int) -> None:
    log_path.write_bytes(whole[:size])
    with pytest.raises(InputError, match=r"empty|not an MCAP|closing magic"):
        storage.open(log_path)


def test_truncation_anywhere(log_path: Path, whole: bytes) -> None:
    for size in np.linspace(8, len(whole) - 1, 60).astype(int).tolist():
        log_path.write_bytes(whole[:size])
        with pytest.raises(InputError, match="truncated"):
            storage.open(log_path)


def test_other_types_of_file(log_path: Path) -> None:
    log_path.write_bytes(b"PK\3\4" + b"\0" * 100)
    with pytest.raises(InputError, match="not an MCAP file"):
        storage.open(log_path)
    with pytest.raises(InputError, match="cannot be read"):
        storage.open(log_path.parent)


@pytest.mark.parametrize("crc", [True, False])
def test_flipped_bits(log_path: Path, whole: bytes, crc: bool) -> None:
    random = np.random.default_rng(3)
    for place in random.integers(0, len(whole), 150).tolist():
        data = bytearray(whole)
        data[place] ^= 1 << int(random.integers(8))
        check(log_path, bytes(data), crc)


def test_flipped_bit_in_a_chunk_is_found(log_path: Path, whole: bytes) -> None:
    with storage.open(log_path) as log:
        chunk = log.index.chunks[0]
    data = bytearray(whole)
    data[chunk.offset + chunk.length // 2] ^= 4
    log_path.write_bytes(bytes(data))
    with storage.open(log_path) as log, pytest.raises(InputError, match=rf"byte {chunk.offset}: .*(CRC|unpack)"):
        log.read()


def test_absurd_numbers_at_every_place(log_path: Path, whole: bytes) -> None:
    random = np.random.default_rng(4)
    for place in random.integers(8, len(whole) - 16, 120).tolist():
        for absurd in (b"\xff" * 8, b"\xff\xff\xff\x7f\0\0\0\0", struct.pack("<Q", 2**62)):
            check(log_path, whole[:place] + absurd + whole[place + 8 :], crc=False)


def test_bytes_lost_doubled_and_exchanged(log_path: Path, whole: bytes) -> None:
    random = np.random.default_rng(5)
    for _ in range(60):
        low, high = sorted(random.integers(8, len(whole) - 8, 2).tolist())
        middle = (low + high) // 2
        check(log_path, whole[:low] + whole[high:])
        check(log_path, whole[:high] + whole[low:])
        check(log_path, whole[:low] + whole[middle:high] + whole[low:middle] + whole[high:])


def test_message_index_that_lies(log_path: Path, imu: Columns) -> None:
    storage.write(log_path, [imu.select(slice(0, 100))], compression="none")
    with storage.open(log_path) as log:
        place = next(iter(log.index.chunks[0].message_indexes.values()))
    data = log_path.read_bytes()
    entries = place + 15
    for lie in ((START_NS, 2**63 + 5), (START_NS, 2**40), (START_NS, 3), (START_NS + 1, 0)):
        log_path.write_bytes(data[:entries] + struct.pack("<QQ", *lie) + data[entries + 16 :])
        with storage.open(log_path) as log, pytest.raises(InputError, match="message index"):
            log.read()


def test_claim_of_a_huge_chunk(log_path: Path) -> None:
    """A chunk of a few bytes that is said to unpack to an exabyte."""
    packed = b"\x28\xb5\x2f\xfd\x00\x00"
    head = struct.pack("<QQQI", 0, 0, 2**60, 0) + struct.pack("<I", 4) + b"zstd" + struct.pack("<Q", len(packed))
    chunk = struct.pack("<BQ", Op.CHUNK, len(head) + len(packed)) + head + packed
    header = struct.pack("<BQ", Op.HEADER, 8) + bytes(8)
    end = struct.pack("<BQI", Op.DATA_END, 4, 0) + struct.pack("<BQQQI", Op.FOOTER, 20, 0, 0, 0)
    log_path.write_bytes(MAGIC + header + chunk + end + MAGIC)
    with pytest.raises(InputError, match="cannot be"):
        read_all(log_path)


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"\0\1",
        b"\0\1\0\0",
        b"\0\3\0\0" + bytes(40),
        b"\7\1\0\0" + bytes(40),
        b"\0\1\0\0" + b"\xff\xff\xff\xff" + bytes(40),
        b"\0\1\0\0" + b"\3\0\0\0ab",
        b"\0\1\0\0" + b"\2\0\0\0a\0\0\0" + b"\xff\xff\xff\x7f",
        b"\0\1\0\0" + b"\2\0\0\0a\0\0\0" + b"\0\0\0\0" + b"\xff\xff\xff\xff",
    ],
)
@pytest.mark.parametrize("alone", [True, False])
def test_payload_that_is_not_what_the_schema_says(log_path: Path, payload: bytes, alone: bool) -> None:
    good = b"\0\1\0\0" + b"\2\0\0\0a\0\0\0" + b"\1\0\0\0" + bytes(4) + bytes(8) + bytes(4)
    text = f"string text\nfloat64[] values\nt/Part[] parts\n{'=' * 80}\nMSG: t/Part\nstring name\nuint8 a\n"
    with log_path.open("wb") as file:
        writer = Writer(file)
        writer.start("ros2")
        channel = writer.register_channel("/t", "cdr", writer.register_schema("t/msg/T", "ros2msg", text.encode()))
        for number, data in enumerate([payload] if alone else [good, good, payload]):
            writer.add_message(channel, START_NS + number, data, START_NS + number)
        writer.finish()
    with storage.open(log_path) as log, pytest.raises(InputError, match=r"/t, message (0|2) \(log time"):
        log.read()


def test_no_memory_error_and_no_hang_in_a_process_of_its_own(log_path: Path, whole: bytes) -> None:
    """The worst places, under a limit of memory and of time."""
    code = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30))
from attlog import storage
from attlog.schemas import InputError
path = sys.argv[1]
whole = open(path, 'rb').read()
for place in range(8, len(whole) - 8, max(1, len(whole) // 150)):
    open(path, 'wb').write(whole[:place] + b'\\xff\\xff\\xff\\x3f\\0\\0\\0\\0' + whole[place + 8:])
    try:
        with storage.open(path) as log:
            log.read(crc=False)
    except InputError:
        pass
print('done')
"""
    done = subprocess.run(
        [sys.executable, "-c", code, str(log_path)], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.stdout == "done\n", done.stderr[-2000:]
