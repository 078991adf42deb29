"""SIGKILL in the middle of `write` and of `annotate`: the old file is there, whole, or the new one is."""

import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from mcap.reader import make_reader

from attlog import storage
from attlog.schemas import Columns

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="this system has no SIGKILL")

PROGRAM = """
import sys
import numpy as np
from attlog import storage
from attlog.schemas.unified import imu_columns
count = 60_000
time_ns = 1_700_000_000_000_000_000 + np.arange(count) * 1_000_000
values = np.random.default_rng(1).normal(size=(count, 3))
columns = imu_columns("/imu1/data_raw", time_ns, values, values, source="kill")
path, verb = sys.argv[1:]
print("ready", flush=True)
while True:
    if verb == "write":
        storage.write(path, [columns], force=True)
    else:
        storage.annotate(path, [columns], metadata={"kill": {}})
"""


def kill_during(path: Path, verb: str, delay: float) -> None:
    """Run the verb over and over, and kill the process ``delay`` seconds after its first begin."""
    process = subprocess.Popen([sys.executable, "-c", PROGRAM, str(path), verb], stdout=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stdout.readline() == b"ready\n"
    time.sleep(delay)
    process.send_signal(signal.SIGKILL)
    process.wait()
    process.stdout.close()


def whole(path: Path) -> int:
    """The number of messages of a file that the official reader finds sound."""
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        count = sum(1 for _ in reader.iter_messages())
        summary = reader.get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == count
    return count


def try_kills(verb: str, path: Path, imu: Columns, times: int) -> None:
    draw = random.Random(7)
    for _ in range(times):
        for left in path.parent.iterdir():
            left.unlink()
        storage.write(path, [imu])
        old = path.read_bytes()
        kill_during(path, verb, draw.uniform(0.0, 0.25))
        if path.read_bytes() != old:
            assert whole(path) in (60_000, len(imu) + 60_000)


@pytest.mark.parametrize("verb", ["write", "annotate"])
def test_killed_at_some_points(verb: str, log_path: Path, imu: Columns) -> None:
    try_kills(verb, log_path, imu, 5)


@pytest.mark.long
@pytest.mark.parametrize("verb", ["write", "annotate"])
def test_killed_at_many_points(verb: str, log_path: Path, imu: Columns) -> None:
    try_kills(verb, log_path, imu, 50)
