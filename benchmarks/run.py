"""``attlog run`` on a 40 MB DataFlash log, everything included, against pymavlink merely iterating over it."""

import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from .dataflash import long_flight
from .row import Row

ITERATE = "import sys; from pymavlink import DFReader; log = DFReader.DFReader_binary(sys.argv[1]); " + (
    "\nwhile log.recv_msg() is not None: pass"
)
TARGET = 0.6


def rows() -> Iterator[Row]:
    """One row, or none where the real log is not there."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "long.bin"
        if not long_flight(log):
            return
        ours = [str(Path(sys.executable).with_name("attlog")), "run", str(log), "--force"]
        _cpu(ours)  # compiles the kernels
        share = min(_cpu(ours) for _ in range(3)) / _cpu([sys.executable, "-c", ITERATE, str(log)])
        work = f"attlog run on a {log.stat().st_size / 1e6:.0f} MB BIN, share of the peer's time"
        yield Row(work, "pymavlink iterating over it", share, TARGET, at_most=True)


def _cpu(command: list[str]) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
