"""A live source to one MCAP, or to a row of them."""

import glob
import logging
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from ..ingest import live
from ..ingest.live import options as said
from ..ingest.live.cutting import Cutter, cutter
from ..ingest.live.pieces import grouped
from ..ingest.live.reading import header_of
from ..ingest.live.receiver import Arrival
from ..schemas.csv_options import CsvOptions
from ..schemas.errors import StorageError, UsageError
from ..schemas.sensors import SensorProfile
from ..schemas.source import IngestOptions
from ..storage import StreamWriter
from ..storage.writer import compression_name
from .convert import ingest_options
from .finish import RECORDING, RecordedFile, described, finish
from .provenance import software
from .text import count, seconds

POLL_S: Final = 0.05
FLUSH_S: Final = 0.25
"""So often what arrived becomes a chunk; every second time it is made to outlive a power cut too."""
PATIENCE_NS: Final = 400_000_000
"""A unit that is still not whole after this is written as far as it goes."""
HEAD: Final = 1 << 17
RATE_S: Final = 2.0
UNITS: Final = {live.Kind.CSV: "line", live.Kind.MAVLINK: "message"}
_log = logging.getLogger("attlog")
_FINISH: Final = "import sys; from attlog.pipeline.finish import finish; finish(sys.argv[1])"


@dataclass(frozen=True)
class Status:
    """How a recording stands: lines or messages so far and their rate, those missing by their sequence numbers."""

    file: str
    elapsed_s: float
    bytes: int
    units: int
    unit: str
    rate_hz: float
    missing: int
    connected: bool
    reconnections: int

    def to_text(self) -> str:
        """One line."""
        link = "" if self.connected else ", LINK LOST"
        lost = f", {self.missing:,} missing" if self.missing else ""
        again = f", {count(self.reconnections, 'reconnection')}" if self.reconnections else ""
        units = f"{count(self.units, self.unit)}, {self.rate_hz:,.0f} Hz, {self.bytes / 1e6:,.1f} MB"
        return f"{self.file or 'waiting'}  {self.elapsed_s:.0f} s  {units}{lost}{again}{link}"


@dataclass(frozen=True)
class Recorded:
    """What `record` returns: the files, and what went over the link."""

    source: str
    files: tuple[RecordedFile, ...]
    status: Status

    @property
    def complete(self) -> bool:
        """Whether something arrived, and all of it could be read."""
        return bool(self.files) and all(file.complete for file in self.files)

    def to_text(self) -> str:
        """What ``attlog record`` prints."""
        s = self.status
        told = f"{count(s.units, s.unit)}, {count(s.bytes, 'byte')} in {seconds(round(s.elapsed_s * 1e9))}"
        lost = f", {s.missing:,} missing by their sequence numbers" if s.missing else ""
        again = f", {count(s.reconnections, 'reconnection')}" if s.reconnections else ""
        return "\n".join([f"{self.source}: {told}{lost}{again}", *(file.to_text() for file in self.files)])

    def to_dict(self) -> dict[str, Any]:
        """The same for --json."""
        return {"source": self.source, **vars(self.status), "files": [file.to_dict() for file in self.files]}


def record(
    source: str,
    output: str | Path,
    *,
    duration_s: float | None = None,
    rotate_bytes: int | None = None,
    rotate_s: float | None = None,
    keep_stream: bool = True,
    vehicle: int | Literal["all"] | None = None,
    sensor: str | SensorProfile | None = None,
    dialect: str = "ardupilotmega",
    csv: CsvOptions | None = None,
    compression: str = "zstd",
    force: bool = False,
    stop: Callable[[], bool] = lambda: False,
    watch: Callable[[Status], None] = lambda status: None,
) -> Recorded:
    """Record a live source (``serial:/dev/ttyUSB0:115200``, ``mavlink:udpin:0.0.0.0:14550``, …) until ``stop()``.

    What arrives is on the disk within a second, as the channel ``/recording/stream``, also after a kill (`recover`).
    At the end the channels that `convert` would make of it join it in the same file (``keep_stream`` False: replace
    it). ``rotate_bytes`` (of what arrived) and ``rotate_s`` begin a new file, ``{stem}_0001.mcap`` being the first.
    ``watch`` is called with a `Status` a few times a second. InputError where the port cannot be opened, StorageError
    where the disk refuses. No file is made where nothing arrives.
    """
    address = live.Address.parse(source)
    options = ingest_options(vehicle, sensor, dialect, csv)
    compression_name(compression)
    target = Path(output)
    if target.is_dir() or str(output).endswith("/"):
        raise UsageError(f"{output}: is a folder; give the name of a file to record to")
    if target.suffix != ".mcap":
        target = target.with_name(f"{target.name}.mcap")
    about = {
        "source": str(address),
        "format": str(address.kind),
        "name": target.stem,
        "options": said.to_text(options),
        "compression": compression,
        "keep_stream": "yes" if keep_stream else "no",
        "software": software(),
    }
    limits = _Limits(duration_s, rotate_bytes, rotate_s)
    return _Recorder(address, target, limits, about, force, options).run(stop, watch)


@dataclass(frozen=True)
class _Limits:
    duration_s: float | None
    rotate_bytes: int | None
    rotate_s: float | None

    @property
    def rotates(self) -> bool:
        return self.rotate_bytes is not None or self.rotate_s is not None


class _Recorder:
    """One recording in progress."""

    def __init__(
        self,
        address: live.Address,
        target: Path,
        limits: _Limits,
        about: dict[str, str],
        force: bool,
        options: IngestOptions,
    ) -> None:
        self.address = address
        self.target = target
        self.limits = limits
        self.about = about
        self.force = force
        self.cutter: Cutter = cutter(address.kind, options.dialect)
        self.receiver = live.Receiver(lambda: live.connect(address))
        self.files: list[Path] = []
        self.finishing: list[subprocess.Popen[bytes]] = []
        self.writer: StreamWriter | None = None
        self.carry: list[Arrival] = []
        self.head = self.tail = b""
        self.bytes = self.bytes_before = 0
        self.began = self.file_began = time.monotonic()
        self.pace: list[tuple[float, int]] = []
        self.unsynced = False

    def run(self, stop: Callable[[], bool], watch: Callable[[Status], None]) -> Recorded:
        """Record until told to stop, or for as long as was asked."""
        self._check_target()
        self.receiver.start()
        _log.info("recording %s", self.address)
        self.began = time.monotonic()
        try:
            while not (stop() or self._is_over()):
                self._pause(stop)
                self._write(self.receiver.take())
                self._rotate_if_due()
                watch(self.status())
            self.receiver.stop()
            self._write(self.receiver.take(), last=True)
            status = self.status()
            self._close()
        except StorageError as error:
            raise StorageError(f"{error}; what was recorded before: attlog recover {self._path()}") from error
        finally:
            self.receiver.stop()
            if self.writer is not None:
                self.writer.abandon()
        return Recorded(str(self.address), tuple(self._finished()), status)

    def status(self) -> Status:
        """How it stands now."""
        now = time.monotonic()
        self.pace = [entry for entry in self.pace if entry[0] > now - RATE_S] + [(now, self.cutter.units)]
        (since, before), span = self.pace[0], now - self.pace[0][0]
        return Status(
            self.files[-1].name if self.files else "",
            now - self.began,
            self.bytes,
            self.cutter.units,
            UNITS[self.address.kind],
            (self.cutter.units - before) / span if span > 0 and since else 0.0,
            self.cutter.missing,
            self.receiver.connected,
            self.receiver.reconnections,
        )

    def _is_over(self) -> bool:
        if self.receiver.failure is not None:
            raise self.receiver.failure
        return self.limits.duration_s is not None and time.monotonic() - self.began >= self.limits.duration_s

    def _pause(self, stop: Callable[[], bool]) -> None:
        until = time.monotonic() + FLUSH_S
        while time.monotonic() < until and not stop() and not self._is_over():
            time.sleep(POLL_S)

    def _write(self, arrived: list[Arrival], last: bool = False) -> None:
        """What arrived, up to the last whole line or frame; an event of the link ends whatever was begun."""
        for group in grouped(arrived):
            if group[0][2]:
                self._append(self.carry + self._line_end(group[0]))
                self.carry = []
                self._append(group[:1])
                group = group[1:]
            self.carry += group
        if self.carry:
            joined = np.frombuffer(b"".join(data for _, data, _ in self.carry), np.uint8)
            whole = self.cutter.whole(joined)
            if last or self.receiver.now_ns() - self.carry[0][0] > PATIENCE_NS:
                whole = len(joined)
            ready, self.carry = _parted(self.carry, whole)
            self._append(ready)
        self._sync()

    def _line_end(self, event: Arrival) -> list[Arrival]:
        """A line that a lost link cut off is not to go on with the next one."""
        last = self.carry[-1][1] if self.carry else self.tail
        cut = self.address.kind is live.Kind.CSV and last and not last.endswith(b"\n")
        return [(event[0], b"\n", "")] if cut else []

    def _append(self, arrivals: list[Arrival]) -> None:
        if not arrivals:
            return
        if self.writer is None:
            self.writer = self._open()
        self.bytes += sum(len(data) for _, data, _ in arrivals)
        if len(self.head) < HEAD:
            self.head += b"".join(data for _, data, _ in arrivals)
        self.tail = next((data for _, data, _ in reversed(arrivals) if data), self.tail)
        self.writer.append([live.to_columns(arrivals)])

    def _sync(self) -> None:
        if self.writer is not None and self.unsynced:
            self.writer.sync()
        self.unsynced = not self.unsynced

    def _path(self, number: int | None = None) -> Path:
        if not self.limits.rotates:
            return self.target
        return self.target.with_name(f"{self.target.stem}_{number or len(self.files):04d}.mcap")

    def _check_target(self) -> None:
        first = self._path(1)
        numbered = first.parent.glob(f"{glob.escape(self.target.stem)}_[0-9][0-9][0-9][0-9].mcap")
        there = sorted(numbered) if self.limits.rotates else [first] * first.exists()
        if there and not self.force:
            first = there[0]
            raise StorageError(
                f"{first}: exists already; choose another name, or overwrite it with --force (force=True)"
            )
        first.parent.mkdir(parents=True, exist_ok=True)

    def _open(self) -> StreamWriter:
        path = self._path(len(self.files) + 1)
        about = self.about | {"part": str(len(self.files) + 1), "started_ns": str(self.receiver.now_ns())}
        if self.files and self.address.kind is live.Kind.CSV:
            about["header"] = header_of(np.frombuffer(self.head, np.uint8)).decode("utf-8", "replace")
        writer = StreamWriter(path, {RECORDING: about}, self.force)
        self.files.append(path)
        self.bytes_before, self.file_began = self.bytes, time.monotonic()
        return writer

    def _rotate_if_due(self) -> None:
        if self.writer is None:
            return
        limits = self.limits
        large = limits.rotate_bytes is not None and self.bytes - self.bytes_before >= limits.rotate_bytes
        long = limits.rotate_s is not None and time.monotonic() - self.file_began >= limits.rotate_s
        if large or long:
            self._close()
            command = [sys.executable, "-c", _FINISH, str(self.files[-1].resolve())]
            self.finishing.append(subprocess.Popen(command, start_new_session=True, stdin=subprocess.DEVNULL))

    def _close(self) -> None:
        if self.writer is not None:
            self.writer.close()
            self.writer = None

    def _finished(self) -> list[RecordedFile]:
        """All files with their channels; those before the last one are being made by processes of their own."""
        left = self.files[len(self.finishing) :]
        done = [finish(path) for path in left]
        for process in self.finishing:
            process.wait()
        return [*map(described, self.files[: len(self.finishing)]), *done]


def _parted(arrivals: list[Arrival], size: int) -> tuple[list[Arrival], list[Arrival]]:
    """The first ``size`` bytes, and what is left."""
    first: list[Arrival] = []
    for number, (time_ns, data, event) in enumerate(arrivals):
        if len(data) > size:
            head = [(time_ns, data[:size], event)] if size else []
            return first + head, [(time_ns, data[size:], event), *arrivals[number + 1 :]]
        first.append((time_ns, data, event))
        size -= len(data)
    return first, []
