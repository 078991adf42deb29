"""A damaged or cut-off MCAP made whole."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from .. import storage
from ..schemas.csv_options import CsvOptions
from ..schemas.sensors import SensorProfile
from ..schemas.source import IngestOptions
from ..storage import Recovery
from .convert import ingest_options
from .finish import RecordedFile, finish, is_unread
from .inputs import check_target, is_mcap, outputs
from .text import count
from .verbs import Place, verb

SUFFIX = ".recovered.mcap"


@dataclass(frozen=True)
class Recovered:
    """What `recover` did with one file: what was kept and lost, and, of a recording, the channels made of it."""

    source: str
    output: str
    recovery: Recovery
    recording: RecordedFile | None = field(default=None)

    @property
    def complete(self) -> bool:
        """Whether nothing of the file had to be left out."""
        return self.recovery.complete and (self.recording is None or self.recording.complete)

    def to_text(self) -> str:
        """What ``attlog recover`` prints."""
        r = self.recovery
        kept = f"{count(r.chunks, 'chunk')}, {count(r.messages, 'message')}"
        lines = [f"{self.source} -> {self.output}", f"  {kept}" + ("" if r.ended else "; the file had no end")]
        if r.dropped:
            reasons = ", ".join(f"{number:,} {reason}" for reason, number in r.dropped.items())
            lines.append(f"  lost: {count(r.bytes_skipped, 'byte')} of {r.bytes_total:,} ({reasons})")
        lines += [f"    {note}" for note in r.notes[:20]]
        if len(r.notes) > 20:
            lines.append(f"    and {len(r.notes) - 20:,} more")
        if self.recording is not None:
            lines.append(f"  {self.recording.to_text()}".replace("\n", "\n  "))
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """The same for --json."""
        recording = None if self.recording is None else self.recording.to_dict()
        return {"output": self.output, "complete": self.complete, **vars(self.recovery), "recording": recording}


@verb(is_mcap, suffix=SUFFIX)
def recover(
    source: Place,
    output: Place | None = None,
    *,
    vehicle: int | Literal["all"] | None = None,
    sensor: str | SensorProfile | None = None,
    dialect: str = "ardupilotmega",
    csv: CsvOptions | None = None,
    force: bool = False,
) -> Recovered:
    """Make a whole MCAP of one that was cut off or damaged, whoever wrote it; the source is only read.

    Every sound chunk and record is kept, of a chunk that is cut off its whole messages; the rest is counted. Where it
    is a recording that was killed, its stream becomes channels as at the end of `record` (the options take the place
    of those it was started with). ``output`` is a file or a folder, without it ``{stem}.recovered.mcap`` beside the
    source. InputError where nothing can be saved.
    """
    path = Path(source)
    target = outputs([path], output, SUFFIX)[0]
    check_target(target, path, force)
    target.parent.mkdir(parents=True, exist_ok=True)
    recovery = storage.recover(path, target, force=force)
    given = ingest_options(vehicle, sensor, dialect, csv)
    again = None if given == IngestOptions() else given
    recording = finish(target, again) if is_unread(target) else None
    return Recovered(str(path), str(target), recovery, recording)
