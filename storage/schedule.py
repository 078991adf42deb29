"""Which message goes where: all channels interleaved by time, cut into chunks of about 1 MiB."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .ragged import Places
from .rows import Rows

CHUNK_SIZE = 1 << 20


@dataclass(frozen=True, eq=False)
class Schedule:
    """``places[c]``: where each record of channel c begins in the stream of all records; ``edges``: where chunks do.

    ``bounds[c, k]`` is the first message of channel c that is in chunk k or later.
    """

    places: tuple[Places, ...]
    edges: Places
    bounds: Places

    @property
    def chunks(self) -> int:
        return len(self.edges) - 1


def schedule(channels: Sequence[Rows], chunk_size: int = CHUNK_SIZE) -> Schedule:
    """Interleave by log time, at equal times in the order of the channels; a chunk ends once it has ``chunk_size``."""
    counts = [len(rows.time_ns) for rows in channels]
    total = sum(counts)
    if total == 0:
        return Schedule(
            tuple(np.zeros(0, np.int64) for _ in channels), np.zeros(1, np.int64), np.zeros((len(counts), 1), np.int64)
        )
    order = np.argsort(np.concatenate([rows.time_ns for rows in channels]), kind="stable")
    sizes = np.empty(total, np.int64)
    first = 0
    for rows, count in zip(channels, counts, strict=True):
        sizes[first : first + count] = rows.sizes
        first += count
    ends = np.cumsum(sizes[order])
    edges = _edges(ends, chunk_size)
    places = np.empty(total, np.int64)
    places[order] = ends
    places -= sizes
    cuts = np.cumsum(counts)[:-1]
    own = tuple(np.split(places, cuts))
    bounds = np.array([np.searchsorted(place, edges) for place in own])
    return Schedule(own, edges, bounds)


def _edges(ends: Places, chunk_size: int) -> Places:
    edges = [0]
    while edges[-1] < ends[-1]:
        last = int(np.searchsorted(ends, edges[-1] + chunk_size))
        edges.append(int(ends[min(last, len(ends) - 1)]))
    return np.array(edges, np.int64)
