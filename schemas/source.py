"""A source file, what may be said about reading it, and what reading it gives."""

import dataclasses
import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .columns import Columns
from .errors import InputError
from .finding import Finding, Note
from .recording import Segment
from .sensors import SensorProfile


@dataclass(frozen=True, eq=False)
class Source:
    """A log's bytes, read-only, shape (n,) uint8 (a memory map where it is a file), and the name that messages use."""

    name: str
    data: NDArray[np.uint8]
    path: Path | None = None

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

    @property
    def size(self) -> int:
        """Bytes."""
        return len(self.data)

    @cached_property
    def sha256(self) -> str:
        """Hexadecimal digest of all bytes."""
        return hashlib.sha256(self.data.data).hexdigest()


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
        return self.bytes_skipped == 0 and not any(self.dropped.values())


@dataclass(frozen=True)
class IngestOptions:
    """What a user may say about a source: the vehicle to put first, the sensor's scales, the MAVLink dialect."""

    vehicle: int | Literal["all"] | None = None
    sensor: SensorProfile | None = None
    dialect: str = "ardupilotmega"


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
