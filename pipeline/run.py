"""Everything at once: convert, estimate, analyze, one MCAP written once."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from .. import storage
from ..schemas.columns import Columns
from ..schemas.csv_options import CsvOptions
from ..schemas.errors import InputError, UsageError
from ..schemas.finding import Finding
from ..schemas.recording import Recording
from ..schemas.sensors import SensorProfile
from ..schemas.source import Ingested
from .analyze import Analysis, AnalysisOptions, Analyzed, analysis, analyze, analyze_recordings
from .bodies import bodies_columns
from .convert import (
    LEVEL,
    Conversion,
    ingest_options,
    ingested_recordings,
    is_log,
    metadata_records,
    read_source,
    summary,
)
from .estimate import Estimated, Estimation, estimate, estimate_vehicles, estimation
from .findings import both
from .inputs import check_target, is_mcap, outputs
from .verbs import Place, verb


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


@verb(is_log)
def run(
    source: Place,
    output: Place | None = None,
    *,
    estimators: Sequence[str] | None = None,
    declination: float | None = None,
    reference: str | None = None,
    alignment: str | None = None,
    start: float | None = None,
    end: float | None = None,
    exclude: Sequence[tuple[float, float]] = (),
    topics: Sequence[str] = (),
    vehicle: int | Literal["all"] | None = None,
    sensor: str | SensorProfile | None = None,
    dialect: str = "ardupilotmega",
    csv: CsvOptions | None = None,
    compression: str = "zstd",
    force: bool = False,
) -> Run:
    """Convert a log, estimate its attitude, and compare: `convert`, `estimate`, `analyze` in one, with their options.

    A log without a usable IMU is converted all the same, and one without a reference estimated; the result's remarks
    say so. An MCAP is estimated and analyzed in place, or into ``output``. InputError or StorageError where nothing can
    be done.
    """
    path = Path(source)
    options = AnalysisOptions(reference, alignment, start, end, tuple(exclude))
    if is_mcap(path):
        return _run_on_mcap(path, output, estimators, declination, options, topics, force)
    if topics:
        raise UsageError(f"{path}: --topic chooses channels of an MCAP; what this format holds is known")
    target = outputs([path], output)[0]
    check_target(target, path, force)
    log, ingested = read_source(path, ingest_options(vehicle, sensor, dialect, csv))
    metadata = metadata_records(log, ingested)
    work = _work(path, ingested, metadata, estimators, declination, options)
    columns = [*ingested.columns, *work.columns(), *both([*ingested.findings, *work.findings()], ingested.notes)]
    target.parent.mkdir(parents=True, exist_ok=True)
    storage.write(target, columns, metadata=metadata, compression=compression, level=LEVEL, force=force)
    return Run(
        summary(log, ingested, target, columns),
        estimation(path, target, work.estimated, work.start_ns) if work.estimated else None,
        analysis(path, target, work.analyzed) if work.analyzed else None,
        work.remarks,
    )


@dataclass(frozen=True, eq=False)
class _Work:
    """What was made of a source's recordings."""

    recordings: tuple[Recording, ...]
    estimated: tuple[Estimated, ...]
    analyzed: tuple[Analyzed, ...]
    remarks: tuple[str, ...]
    start_ns: int

    def columns(self) -> list[Columns]:
        estimates = [channel for each in self.estimated for channel in each.columns]
        errors = [channel for each in self.analyzed for channel in each.columns()]
        return [*estimates, *errors, *bodies_columns(self.recordings)]

    def findings(self) -> list[Finding]:
        return [finding for each in self.estimated for finding in each.findings]


def _work(
    path: Path,
    ingested: Ingested,
    metadata: dict[str, dict[str, str]],
    estimators: Sequence[str] | None,
    declination: float | None,
    options: AnalysisOptions,
) -> _Work:
    vehicles = ingested_recordings(ingested, metadata)
    remarks: list[str] = []
    try:
        estimated = estimate_vehicles(path, vehicles, estimators, declination)
    except InputError as error:
        estimated = []
        remarks.append(str(error))
    recordings = [each.recording for each in estimated] or list(vehicles.values())
    start_ns = min((int(channel.time_ns.min()) for channel in ingested.columns if len(channel)), default=0)
    analyzed, reasons = analyze_recordings(recordings, options, start_ns)
    remarks += [f"not compared: {reason}" for reason in reasons]
    return _Work(tuple(recordings), tuple(estimated), tuple(analyzed), tuple(remarks), start_ns)


def _run_on_mcap(
    path: Path,
    output: Place | None,
    estimators: Sequence[str] | None,
    declination: float | None,
    options: AnalysisOptions,
    topics: Sequence[str],
    force: bool,
) -> Run:
    place = None if output is not None and Path(output) == path else output
    estimated = estimate(path, estimators, declination=declination, topics=topics, output=place, force=force)
    try:
        analyzed = analyze(
            Path(estimated.output),
            reference=options.reference,
            alignment=options.alignment,
            start=options.start_s,
            end=options.end_s,
            exclude=options.exclude_s,
            topics=topics,
        )
    except InputError as error:
        return Run(None, estimated, None, (str(error),))
    return Run(None, estimated, analyzed)
