"""A DataFlash log in memory: one structured array per type of record and instance, whatever file it came from."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...schemas.columns import Table
from .formats import Format


@dataclass(frozen=True, eq=False)
class Records:
    """Records of one format, and of one instance where the format has instances, in the log's order.

    ``data`` (n,) holds the values as stored, ``order`` (n,) each record's number among all records of the log.
    """

    format: Format
    data: Table
    order: NDArray[np.int64]
    instance: int | str | None = None

    def __len__(self) -> int:
        return len(self.data)

    def select(self, index: Any, instance: int | str | None = None) -> "Records":
        """The records that ``index`` picks."""
        return Records(self.format, self.data[index], self.order[index], instance)

    def scaled(self, column: str) -> NDArray[np.float64]:
        """A column as float64 in its unit: what is stored times the multiplier."""
        values = self.data[column].astype(np.float64)
        multiplier = self.format.multiplier(column)
        # Dividing by the power of ten gives the nearest double, as people type it; multiplying does not.
        return values / round(1.0 / multiplier) if 0.0 < multiplier < 1.0 else values * multiplier

    def by_column(self, column: str) -> "Iterator[Records]":
        """The records apart by the value of ``column``, which becomes their instance."""
        values = np.ascontiguousarray(self.data[column])
        found = np.unique(values).tolist()
        for value in found:
            yield self.select(slice(None) if len(found) == 1 else values == value, value)


@dataclass(frozen=True, eq=False)
class Log:
    """All records of a log: ``count`` of them, ``dropped`` counts by reason what was not one."""

    records: tuple[Records, ...]
    count: int
    bytes_skipped: int = 0
    dropped: Mapping[str, int] = field(default_factory=dict)

    def named(self, name: str) -> tuple[Records, ...]:
        """The records of the type ``name``, one entry for each instance."""
        return tuple(records for records in self.records if records.format.name == name)
