"""A source file, what may be said about reading it, and what reading it gives."""

import dataclasses
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .columns import Columns
from .csv_options import CsvOptions
from .errors import InputError
from .finding import Finding, Note
from .recording import Segment
from .sensors import SensorProfile


@dataclass(frozen=True, eq=False)
class Source:
    """A log's bytes, read-only, shape (n,) uint8 (a memory map where it is a file), and the name that messages use.

    A data set in a folder has no bytes of its own: ``parts`` are its files, named by their paths in the folder.
    """

    name: str
    data: NDArray[np.uint8]
    path: Path | None = None
    parts: "tuple[Source, ...]" = ()

    @classmethod
    def from_path(cls, path: str | Path) -> "Source":
        """Map a file; InputError where there is none, it cannot be read, or it is empty."""
        place = Path(path)
        try:
            size = place.stat().st_size
            if place.is_dir():
                raise InputError(f"{place}: is a directory, not a log")
            if size == 0:
                raise InputError(f"{place}: is empty (0 bytes); was the log copied completely?")
            return cls(place.name, np.memmap(place, dtype=np.uint8, mode="r"), place)
        except OSError as error:
            raise InputError(f"{place}: cannot be read: {error.strerror or error}") from error

    @classmethod
    def from_folder(cls, folder: Path, files: Sequence[Path]) -> "Source":
        """Map the files of a data set; InputError as for `from_path`."""
        parts = (dataclasses.replace(cls.from_path(f), name=f.relative_to(folder).as_posix()) for f in files)
        return cls(folder.resolve().name, np.zeros(0, np.uint8), folder, tuple(parts))

    @property
    def size(self) -> int:
        """Bytes, of all parts."""
        return len(self.data) + sum(part.size for part in self.parts)

    @cached_property
    def sha256(self) -> str:
        """Hexadecimal digest of all bytes, of a folder those of its parts one after the other."""
        digest = hashlib.sha256(self.data.data)
        for part in self.parts:
            digest.update(part.data.data)
        return digest.hexdigest()


NOT_LOST = frozenset({"blank line", "comment", "header"})
"""Reasons of `Completeness.dropped` that are no loss: there was no sample in such a line."""


@dataclass(frozen=True)
class Completeness:
    """How much of a source was read: ``dropped`` counts what was skipped by reason."""

    bytes_total: int
    bytes_read: int
    messages: int
    bytes_skipped: int = 0
    dropped: Mapping[str, int] = dataclasses.field(default_factory=dict)

    @property
    def complete(self) -> bool:
        """Whether nothing was skipped."""
        lost = any(count for reason, count in self.dropped.items() if reason not in NOT_LOST)
        return self.bytes_skipped == 0 and not lost


@dataclass(frozen=True)
class IngestOptions:
    """What a user may say about a source: the vehicle to put first, the sensor's scales, the MAVLink dialect, a CSV's
    columns."""

    vehicle: int | Literal["all"] | None = None
    sensor: SensorProfile | None = None
    dialect: str = "ardupilotmega"
    csv: CsvOptions = dataclasses.field(default_factory=CsvOptions)


@dataclass(frozen=True, eq=False)
class Ingested:
    """A source as columns, with everything that is known about it."""

    format: str
    columns: tuple[Columns, ...]
    completeness: Completeness
    segments: tuple[Segment, ...] = ()
    vehicle: Mapping[str, str] = dataclasses.field(default_factory=dict)
    parameters: Mapping[str, float] = dataclasses.field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    notes: tuple[Note, ...] = ()
    metadata: Mapping[str, Mapping[str, str]] = dataclasses.field(default_factory=dict)
