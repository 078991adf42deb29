"""How two clocks differ, found from the body's turning and stored in the MCAP."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from .. import storage
from ..schemas.clock import ALIGNMENT, ClockAlignment, alignment_record
from ..schemas.errors import InputError, UsageError
from ..schemas.recording import Attitude, Imu, Recording
from .analyze import choose_reference, is_other_log
from .inputs import in_place_target, is_mcap
from .logs import load, open_log
from .provenance import software
from .verbs import Place, verb


@dataclass(frozen=True)
class Aligned:
    """What `align` found and stored."""

    source: str
    output: str
    alignment: ClockAlignment
    remarks: tuple[str, ...] = ()

    complete = True

    def to_text(self) -> str:
        """What ``attlog align`` prints."""
        a = self.alignment
        agreement = f"the rates agree to {a.correlation:.4f} in {a.samples:,} intervals of {a.window_s:.3g} s"
        return "\n".join([self.output, f"{a.in_words()}, to be on the clock of {a.sensor}", agreement, *self.remarks])

    def to_dict(self) -> dict[str, Any]:
        """The same for --json."""
        return {
            "output": self.output,
            "alignment": asdict(self.alignment) | {"offset_s": self.alignment.offset_s},
            "remarks": list(self.remarks),
        }


@verb(is_mcap, in_place=True)
def align(
    source: Place,
    reference: str | None = None,
    *,
    imu: int | None = None,
    drift: bool = True,
    topics: Sequence[str] = (),
    output: Place | None = None,
    force: bool = False,
) -> Aligned:
    """Find offset and drift of a reference's clock against a gyro's, and store them as the metadata ``alignment``.

    ``reference`` is ``truth``, ``onboard``, an attitude's name, or another MCAP of the same flight (its gyro, else its
    truth or onboard attitude); by default the truth, else the autopilot's attitude. ``imu`` is the gyro's number, by
    default the lowest. ``drift`` False takes both clocks to run alike. ``topics`` as for `estimate`. `estimate` and
    `analyze` shift the reference's stamps by what is stored; a new alignment of the same clock replaces it. InputError
    where the file cannot be read, a signal is missing, or there is no motion to align on.
    """
    path, target = Path(source), in_place_target(source, output, force)
    with open_log(path) as log:
        loaded = load(log, topics, aligned=False)
    recording = loaded.vehicles.get("", Recording())
    sensor = _sensor(path, recording, imu)
    if reference is not None and is_other_log(reference):
        clock, other = Path(reference).name, _of_other(Path(reference))
    else:
        other = choose_reference(recording, reference)[1]
        clock = other.topic
    found = _found(path, sensor, other, clock, drift)
    known: Mapping[str, ClockAlignment] = {**loaded.alignments, clock: found}
    metadata = {**loaded.metadata, ALIGNMENT: alignment_record(known)}
    storage.annotate(path, (), metadata=metadata, output=target)
    return Aligned(str(path), str(target), found, loaded.remarks)


def _sensor(path: Path, recording: Recording, number: int | None) -> Imu:
    if not recording.imu:
        raise InputError(f"{path}: there is no IMU to align with")
    chosen = min(recording.imu) if number is None else number
    if chosen not in recording.imu:
        raise UsageError(f"{path}: there is no IMU {chosen}; there are: {', '.join(map(str, sorted(recording.imu)))}")
    return recording.imu[chosen]


def _of_other(path: Path) -> Imu | Attitude:
    """What of another log tells how the body turned: its first gyro, which no filter has delayed, else an attitude."""
    with open_log(path) as log:
        recording = load(log, aligned=False).vehicles.get("", Recording())
    return recording.imu[min(recording.imu)] if recording.imu else choose_reference(recording, None)[1]


def _found(path: Path, sensor: Imu, other: Imu | Attitude, clock: str, drift: bool) -> ClockAlignment:
    from .. import identification  # imports scipy

    turning = identification.from_imu(other) if isinstance(other, Imu) else identification.from_attitude(other)
    name = sensor.topic or "imu"
    try:
        found = identification.align(
            identification.from_imu(sensor), turning, clock=clock, sensor_name=name, drift=drift
        )
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    return replace(found, sha256=other.sha256, software=software())
