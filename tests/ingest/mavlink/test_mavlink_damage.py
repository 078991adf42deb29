"""Files that are empty, cut, of another kind or damaged all over: one clear error, or what can be read is read."""

import os
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from attlog.ingest import mavlink
from attlog.schemas import IngestOptions, InputError, Source, UsageError

OTHERS = ("copter_sitl_truth.BIN", "plane_crash_3imu.bin", "px4_flight.ulg", "rosbag2_cdr_test.mcap", "ximu3_100hz.csv")


def source(data: bytes) -> Source:
    """Bytes as a source."""
    return Source("broken.tlog", np.frombuffer(data, np.uint8))


@pytest.mark.parametrize("data", [b"", b"\xfe", b"hello world", bytes(5000), b"\xfe" * 5000, b"\xfd" * 5000])
def test_no_frame_is_an_error(data: bytes) -> None:
    assert not mavlink.recognizes(data)
    with pytest.raises(InputError, match=r"broken\.tlog: no MAVLink frame"):
        mavlink.read(source(data), IngestOptions())


def test_random_bytes_are_not_recognized() -> None:
    assert not any(mavlink.recognizes(random.Random(seed).randbytes(65536)) for seed in range(5))


@pytest.mark.parametrize("name", OTHERS)
def test_other_formats_are_not_recognized(logs: Path, name: str) -> None:
    assert not mavlink.recognizes((logs / name).read_bytes()[:65536])


def test_no_such_dialect(tape: Any, messages: Any) -> None:
    log = tape()
    log.send(0, messages.MAVLink_heartbeat_message(2, 3, 81, 0, 3, 3))
    with pytest.raises(UsageError, match="klingon"):
        log.read(dialect="klingon")
    assert log.read(dialect="common").completeness.messages == 1


@pytest.mark.parametrize("stamped", [True, False])
@pytest.mark.parametrize("version", [1, 2])
def test_a_log_of_one_frame(tape: Any, messages: Any, stamped: bool, version: int) -> None:
    log = tape(stamped=stamped)
    log.send(0, messages.MAVLink_attitude_message(1000, 0, 0, 0, 0, 0, 1), version=version)
    assert mavlink.recognizes(bytes(log.data))
    ingested = log.read()
    assert (ingested.completeness.messages, ingested.completeness.complete) == (1, True)
    assert ingested.metadata["mavlink"]["stream"] == ("telemetry log" if stamped else "raw")


def test_recognized_behind_garbage(tape: Any, messages: Any) -> None:
    log = tape()
    log.data += random.Random(3).randbytes(3000)
    for number in range(20):
        log.send(number, messages.MAVLink_attitude_message(1000 * number + 1, 0, 0, 0, 0, 0, 1))
    assert mavlink.recognizes(bytes(log.data))
    complete = log.read().completeness
    assert (complete.messages, complete.bytes_skipped) == (20, 3000)


def test_garbage_at_the_end_is_no_torn_record(tape: Any, messages: Any) -> None:
    log = tape()
    for number in range(10):
        log.send(number, messages.MAVLink_attitude_message(1000 * number + 1, 0, 0, 0, 0, 0, 1))
    log.data += b"\xfe" * 1000
    complete = log.read().completeness
    assert (complete.bytes_skipped, complete.messages) == (1000, 10)


def test_every_truncation(tape: Any, messages: Any) -> None:
    """Cut anywhere, the whole frames before the cut are read, and the rest is accounted for."""
    log = tape()
    ends = []
    for number in range(6):
        log.send(number, messages.MAVLink_attitude_message(1000 * number + 1, 0, 0, 0, 0, 0, 1), version=1 + number % 2)
        ends.append(len(log.data))
    for cut in range(ends[0], len(log.data)):
        complete = mavlink.read(source(bytes(log.data[:cut])), IngestOptions()).completeness
        assert complete.messages == sum(end <= cut for end in ends)
        assert complete.complete == (cut in ends), cut


@pytest.mark.parametrize("seed", range(6))
def test_the_sitl_log_with_flipped_bits_and_shuffled_blocks(logs: Path, seed: int) -> None:
    """No exception, and never more messages than there were."""
    _wreck((logs / "copter_sitl_mavlink2.tlog").read_bytes(), seed)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(200))
def test_wrecks_for_long(logs: Path, seed: int) -> None:
    _wreck((logs / "copter_sitl_mavlink2.tlog").read_bytes(), 1000 + seed)
    _wreck((logs / "copter_radio_2015.tlog").read_bytes()[: 1 << 19], 1000 + seed)


def _wreck(whole: bytes, seed: int) -> None:
    chance = random.Random(seed)
    data = bytearray(whole)
    for _ in range(10 ** (seed % 4 + 1)):
        data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    size = 10 ** chance.randrange(2, 5)
    blocks = [data[i : i + size] for i in range(0, len(data), size)]
    if seed % 2:
        chance.shuffle(blocks)
    wreck = b"".join(block for block in blocks if chance.random() > 0.1)
    try:
        ingested = mavlink.read(source(wreck), IngestOptions())
    except InputError:
        return
    complete = ingested.completeness
    assert 0 <= complete.bytes_skipped <= complete.bytes_total == len(wreck)
    assert sum(len(c) for c in ingested.columns if c.channel.topic.startswith("/mavlink/")) == complete.messages
    for columns in ingested.columns:
        assert np.all(np.diff(columns.time_ns) >= 0)
    edges = [t for s in ingested.segments if s.vehicle == "1" for t in (s.start_ns, s.end_ns)]
    assert edges == sorted(edges)


def test_memory_map_and_bytes_give_the_same(logs: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.tlog"
    path.write_bytes((logs / "copter_sitl_mavlink2.tlog").read_bytes())
    mapped, plain = (mavlink.read(s, IngestOptions()) for s in (Source.from_path(path), source(path.read_bytes())))
    for a, b in zip(mapped.columns, plain.columns, strict=True):
        assert (a.channel, a.time_ns.tobytes(), a.data.tobytes()) == (b.channel, b.time_ns.tobytes(), b.data.tobytes())


def test_recognizing_needs_no_numba(root: Path) -> None:
    import subprocess
    import sys

    code = "import sys; from attlog.ingest import mavlink; mavlink.recognizes(bytes(99)); print('numba' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=os.environ, check=True)
    assert done.stdout.strip() == "False"
