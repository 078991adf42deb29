"""A ULog in memory: one structured array per topic and instance, and everything that is not data."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...schemas.columns import Table
from .formats import Definition
from .information import Entry

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Topic:
    """Messages of one topic and instance, in the log's order.

    ``data`` (n,) holds them as stored, under their ROS names, ``order`` (n,) each one's number among all messages of
    the log.
    """

    name: str
    multi_id: int
    definition: Definition
    data: Table
    order: Ints

    def __len__(self) -> int:
        return len(self.data)

    def has(self, *fields: str) -> bool:
        """Whether there are fields of these names (pyulog's), each one number."""
        return all(self._is_number(name, 1) for name in fields)

    def has_array(self, length: int, *fields: str) -> bool:
        """Whether there are fields of these names, each at least ``length`` numbers."""
        return all(self._is_number(name, 2) and self[name].shape[1] >= length for name in fields)

    def _is_number(self, name: str, dimensions: int) -> bool:
        return name in self.definition.names and self[name].ndim == dimensions and self[name].dtype.kind in "iufb"

    def __getitem__(self, name: str) -> NDArray[np.generic]:
        """A column (n,) or (n, k), as stored, by pyulog's name."""
        return self.data[self.definition.names[name]]

    def integers(self, name: str) -> Ints:
        """A column of whole numbers as int64; what does not fit becomes negative or 0."""
        values = self[name]
        if values.dtype.kind == "f":
            values = np.nan_to_num(values, posinf=0.0, neginf=0.0).clip(-(2.0**62), 2.0**62)
        return values.astype(np.int64)


@dataclass(frozen=True)
class Said:
    """A logged text: its level ('0' to '7'), its tag or None, its time in us, its number among the log's messages."""

    level: int
    tag: int | None
    time_us: int
    text: str
    order: int


@dataclass(frozen=True, eq=False)
class Log:
    """Everything in a log.

    ``count`` messages; ``data_begins`` is the number of the first behind the definitions. ``dropouts`` are (message
    number, ms). ``parameters`` come first as they were at the start, then as they changed; ``dropped`` counts by reason
    what was skipped.
    """

    version: int
    start_us: int
    compatible_flags: bytes
    appended: tuple[int, ...]
    topics: tuple[Topic, ...]
    count: int
    data_begins: int
    said: Sequence[Said]
    parameters: Sequence[Entry]
    defaults: Sequence[Entry]
    single: Sequence[Entry]
    multiple: Sequence[Entry]
    dropouts: Sequence[tuple[int, int]]
    bytes_skipped: int = 0
    dropped: Mapping[str, int] = field(default_factory=dict)

    def named(self, name: str) -> tuple[Topic, ...]:
        """The instances of a topic that have messages."""
        return tuple(topic for topic in self.topics if topic.name == name)
