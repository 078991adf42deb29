"""Everything at once: convert, estimate, analyze, one MCAP written once."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal, overload

from .. import storage
from ..analysis.table import ErrorTable
from ..schemas.errors import InputError
from ..schemas.sensors import SensorProfile
from ..schemas.source import IngestOptions
from .analyze import Analysis, AnalysisOptions, analyze_one, analyze_recordings
from .batch import TIMEOUT_S, run_all
from .bodies import bodies_columns
from .convert import Conversion, ingest_options, ingested_recordings, is_log, metadata_records, read_source, summary
from .estimate import Estimation, Made, estimate_one, estimate_vehicles
from .findings import both
from .inputs import check_target, expand, is_mcap, outputs
from .outcomes import Outcomes


@dataclass(frozen=True)
class Run:
    """What `run` did with one log; ``remarks`` say what could not be done."""

    conversion: Conversion | None
    estimation: Estimation | None
    analysis: Analysis | None
    remarks: tuple[str, ...] = ()

    @property
    def complete(self) -> bool:
        """Whether no byte of the source was skipped."""
        return self.conversion is None or self.conversion.complete

    def to_text(self) -> str:
        """What ``attlog run`` prints."""
        parts = [part.to_text() for part in (self.conversion, self.estimation, self.analysis) if part is not None]
        return "\n\n".join([*parts, *self.remarks])

    def to_dict(self) -> dict[str, Any]:
        """The same for --json."""
        parts = (self.conversion, self.estimation, self.analysis)
        merged = {key: value for part in parts if part is not None for key, value in part.to_dict().items()}
        return merged | {"remarks": list(self.remarks)}


@dataclass(frozen=True)
class RunOptions:
    """How `run` converts, estimates and analyzes."""

    ingest: IngestOptions
    analysis: AnalysisOptions
    selected: Sequence[str] | None
    declination_deg: float | None
    compression: str
    force: bool


def run_one(path: Path, output: Path, *, options: RunOptions) -> Run:
    """Run on one log; an MCAP is estimated and analyzed as it stands."""
    if path.exists() and not path.is_dir() and is_mcap(path):
        return _run_on_mcap(path, output, options)
    check_target(output, path, options.force)
    source, ingested = read_source(path, options.ingest)
    metadata = metadata_records(source, ingested)
    vehicles = ingested_recordings(ingested, metadata)
    remarks: list[str] = []
    try:
        done = estimate_vehicles(path, vehicles, options.selected, options.declination_deg)
    except InputError as error:
        done, remarks = [], [str(error)]
    estimated = [each.recording for each in done] or list(vehicles.values())
    columns = [*ingested.columns, *(channel for each in done for channel in each.columns())]
    start_ns = min((int(channel.time_ns.min()) for channel in columns if len(channel)), default=0)
    analyzed, reasons = analyze_recordings(estimated, options.analysis, start_ns)
    remarks += [f"not compared: {reason}" for reason in reasons if done]
    columns += [channel for each in analyzed for channel in each.columns()]
    columns += bodies_columns(estimated)
    columns += both([*ingested.findings, *(f for each in done for f in each.findings)], ingested.notes)
    output.parent.mkdir(parents=True, exist_ok=True)
    storage.write(output, columns, metadata=metadata, compression=options.compression, force=options.force)
    conversion = summary(source, ingested, output, columns)
    made: tuple[Made, ...] = tuple(m for each in done for m in each.made())
    skipped = {f"{each.recording.prefix}{name}": why for each in done for name, why in each.skipped.items()}
    estimation = Estimation(str(path), str(output), made, skipped, start_ns) if done else None
    table = ErrorTable.joined(each.table(str(output)) for each in analyzed)
    analysis = Analysis(str(path), str(output), table) if analyzed else None
    return Run(conversion, estimation, analysis, tuple(remarks))


def _run_on_mcap(path: Path, output: Path, options: RunOptions) -> Run:
    estimation = estimate_one(
        path, output, selected=options.selected, declination_deg=options.declination_deg, force=options.force
    )
    try:
        return Run(None, estimation, analyze_one(output, output, options=options.analysis, force=True))
    except InputError as error:
        return Run(None, estimation, None, (str(error),))


@overload
def run(source: str | Path, output: str | Path | None = ..., **options: Any) -> Run: ...
@overload
def run(source: Iterable[str | Path], output: str | Path | None = ..., **options: Any) -> Outcomes[Run]: ...
def run(
    source: str | Path | Iterable[str | Path],
    output: str | Path | None = None,
    *,
    estimators: Sequence[str] | None = None,
    declination: float | None = None,
    reference: str | None = None,
    alignment: str | None = None,
    start: float | None = None,
    end: float | None = None,
    exclude: Sequence[tuple[float, float]] = (),
    vehicle: int | Literal["all"] | None = None,
    sensor: str | SensorProfile | None = None,
    dialect: str = "ardupilotmega",
    compression: str = "zstd",
    force: bool = False,
    jobs: int | None = None,
    timeout_s: float = TIMEOUT_S,
) -> Run | Outcomes[Run]:
    """Convert a log, estimate its attitude, and compare: `convert`, `estimate`, `analyze` in one, with their options.

    A log without a usable IMU is converted all the same, and one without a reference estimated; the result's remarks
    say so. An MCAP is estimated and analyzed in place, or into ``output``. One log gives its `Run`, a list `Outcomes`.
    """
    options = RunOptions(
        ingest_options(vehicle, sensor, dialect),
        AnalysisOptions(reference, alignment, start, end, tuple(exclude)),
        estimators,
        declination,
        compression,
        force,
    )
    if isinstance(source, str | Path):
        return run_one(Path(source), _target(Path(source), output), options=options)
    files = expand(source, is_log)
    targets = outputs(files, output)
    pairs = [(f, f if output is None and is_mcap(f) else t) for f, t in zip(files, targets, strict=True)]
    return run_all([(str(f), partial(run_one, f, t, options=options)) for f, t in pairs], jobs, timeout_s)


def _target(source: Path, output: str | Path | None) -> Path:
    return source if output is None and is_mcap(source) else outputs([source], output)[0]
