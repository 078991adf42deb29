"""Errors of several estimates in one table: text for people, JSON and Parquet for programs."""

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from ..schemas.errors import StorageError
from .channels import alignment_metadata
from .error import MAX_PITCH_DEG, AttitudeError, Counts
from .summary import COMPONENTS, NUMBERS, Statistics

if TYPE_CHECKING:
    import pyarrow as pa

TRUTH: Final = "/reference/attitude"
LABELS: Final[Mapping[str, str]] = {
    "rmse": "RMSE",
    "sd": "SD",
    "mean": "mean",
    "median": "median |x|",
    "p95": "95 % |x|",
    "max": "max |x|",
}
SHOWN: Final = ("rmse", "sd", "mean")
_WIDTH: Final = 12


@dataclass(frozen=True)
class ErrorRow:
    """What one estimate came to. ``alignment`` holds its kind and what was removed, ``statistics`` is by component."""

    file: str
    name: str
    topic: str
    reference: str
    reference_topic: str
    reference_sha256: str
    north: str
    alignment: Mapping[str, str]
    counts: Counts
    statistics: Mapping[str, Statistics]

    @property
    def quantity(self) -> str:
        """``error`` against the truth, else ``difference from att``: another estimate is not the truth."""
        return "error" if self.reference_topic.endswith(TRUTH) else f"difference from {self.reference}"


@dataclass(frozen=True)
class ErrorTable:
    """Rows of one file or of many, in degrees."""

    rows: tuple[ErrorRow, ...]

    @classmethod
    def from_errors(cls, errors: Iterable[AttitudeError] | Mapping[str, AttitudeError], file: str = "") -> "ErrorTable":
        """A row for each error, under its estimate's name or the name that it is filed under."""
        named = errors.items() if isinstance(errors, Mapping) else ((each.estimate.name, each) for each in errors)
        return cls(tuple(_row(name, error, file) for name, error in named))

    @classmethod
    def joined(cls, tables: Iterable["ErrorTable"]) -> "ErrorTable":
        """The rows of several tables, one after the other."""
        return cls(tuple(row for table in tables for row in table.rows))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The estimates' names, in order."""
        return tuple(row.name for row in self.rows)

    def __getitem__(self, name: str) -> ErrorRow:
        """The first row called ``name``."""
        return self.rows[self.names.index(name)]

    def to_text(self, numbers: Sequence[str] = SHOWN) -> str:
        """One block per file and reference: ``numbers`` (of `NUMBERS`) by component, then remarks on the rows."""
        blocks = groupby(self.rows, key=lambda row: (row.file, row.quantity, row.reference_topic))
        return "\n\n".join("\n".join(_block(list(rows), numbers)) for _, rows in blocks)

    def to_dicts(self) -> list[dict[str, Any]]:
        """The rows as plain dictionaries."""
        return [{**asdict(row), "quantity": row.quantity, "unit": "deg"} for row in self.rows]

    def to_json(self) -> str:
        """A list of rows; a number that does not exist (no sample) is null."""
        import orjson

        return orjson.dumps(self.to_dicts(), option=orjson.OPT_INDENT_2).decode()

    def to_arrow(self, provenance: Mapping[str, str] | None = None) -> "pa.Table":
        """One record per file, estimate and component; ``provenance`` goes into the schema's metadata."""
        import pyarrow as pa

        about: dict[bytes | str, bytes | str] = {"attlog.unit": "deg"}
        about |= {f"attlog.{key}": value for key, value in (provenance or {}).items()}
        return pa.Table.from_pylist(list(self._records()), schema=pa.schema(_arrow_fields(), metadata=about))

    def to_parquet(self, path: str | Path, *, provenance: Mapping[str, str] | None = None, force: bool = False) -> None:
        """Write `to_arrow` beside ``path`` and rename it; StorageError where it exists or cannot be written."""
        import pyarrow.parquet as pq

        target = Path(path)
        if target.exists() and not force:
            raise StorageError(f"{target}: exists already; give another name or --force")
        beside = target.with_name(f".{target.name}.{os.getpid()}.part")
        try:
            pq.write_table(self.to_arrow(provenance), beside)
            os.replace(beside, target)
        except OSError as error:
            raise StorageError(f"{target}: cannot be written: {error.strerror or error}") from error
        finally:
            beside.unlink(missing_ok=True)

    def _records(self) -> Iterator[dict[str, Any]]:
        for row in self.rows:
            common = {key: getattr(row, key) for key in _TEXT_FIELDS if hasattr(row, key)}
            for component, numbers in row.statistics.items():
                yield {
                    **common,
                    "alignment": row.alignment["alignment"],
                    "removed": _removed(row),
                    "component": component,
                    **asdict(numbers),
                    **asdict(row.counts),
                }


_TEXT_FIELDS: Final = (
    *("file", "name", "quantity", "topic", "reference", "reference_topic", "reference_sha256"),
    *("north", "alignment", "removed", "component"),
)


def _arrow_fields() -> list[tuple[str, Any]]:
    import pyarrow as pa

    texts = [(name, pa.string()) for name in _TEXT_FIELDS]
    numbers = [(name, pa.int64() if name == "count" else pa.float64()) for name in NUMBERS]
    return texts + numbers + [(name, pa.int64()) for name in Counts.__dataclass_fields__]


def _row(name: str, error: AttitudeError, file: str) -> ErrorRow:
    reference = error.reference
    return ErrorRow(
        file=file,
        name=name,
        topic=error.estimate.topic,
        reference=reference.name,
        reference_topic=reference.topic,
        reference_sha256=reference.sha256,
        north=error.estimate.metadata.get("north", "true"),
        alignment=alignment_metadata(error.options.alignment, error.removed),
        counts=error.counts,
        statistics=error.statistics,
    )


def _block(rows: Sequence[ErrorRow], numbers: Sequence[str]) -> Iterator[str]:
    first = rows[0]
    place = f"{first.file}: " if first.file else ""
    against = f" against {first.reference_topic}" if first.quantity == "error" else f" ({first.reference_topic})"
    yield f"{place}{first.quantity}{against}, degrees"
    width = max(len("estimate"), *(len(row.name) for row in rows))
    yield f"{'estimate':<{width}}  {'':<10}" + "".join(f"{c:>{_WIDTH}}" for c in COMPONENTS) + f"{'samples':>10}"
    for row in rows:
        for line, number in enumerate(numbers):
            cells = "".join(f"{_cell(getattr(row.statistics[c], number)):>{_WIDTH}}" for c in COMPONENTS)
            head, tail = (row.name, f"{row.counts.counted:>10}") if line == 0 else ("", "")
            yield f"{head:<{width}}  {LABELS[number]:<10}{cells}{tail}".rstrip()
    for row in rows:
        yield from (f"{row.name}: {remark}" for remark in _remarks(row))


def _cell(value: float) -> str:
    return "-" if value != value else f"{value:.2f}"


def _remarks(row: ErrorRow) -> Iterator[str]:
    counts = row.counts
    if row.alignment["alignment"] != "none":
        why = ", since its heading counts from an arbitrary north" if row.north == "arbitrary" else ""
        yield f"removed {_removed(row)}{why}"
    reasons = {"without reference": counts.without_reference, "not finite": counts.not_finite}
    reasons["excluded"] = counts.excluded
    told = [f"{count} {reason}" for reason, count in reasons.items() if count]
    if told:
        yield f"{counts.samples - counts.counted} of {counts.samples} samples do not count: {', '.join(told)}"
    if counts.near_vertical:
        yield f"{counts.near_vertical} samples beyond {MAX_PITCH_DEG:g} deg of pitch do not count for roll, pitch, yaw"


def _removed(row: ErrorRow) -> str:
    about = row.alignment
    if about["alignment"] == "yaw":
        return f"a constant yaw of {float(about['removed_heading_deg']):.2f} deg"
    if about["alignment"] == "full":
        world, body = (_vector(about[key]) for key in ("removed_world_deg", "removed_body_deg"))
        return f"constant rotations of {world} deg in the world ENU and {body} deg in the body FLU"
    return ""


def _vector(text: str) -> str:
    return "(" + ", ".join(f"{float(part):.2f}" for part in text.split()) + ")"
