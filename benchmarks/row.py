"""One line of the benchmark's table, and the clock that it is measured with."""

import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """How many times as fast as the peer (or, ``at_most``, the share of the peer's time), and the bound."""

    work: str
    peer: str
    ratio: float
    target: float
    at_most: bool = False

    @property
    def met(self) -> bool:
        """Whether the bound holds."""
        return self.ratio <= self.target if self.at_most else self.ratio >= self.target


def cpu_seconds(work: Callable[[], object], times: int = 3) -> float:
    """The least CPU time (user and system, all threads) of ``times`` calls."""
    best = float("inf")
    for _ in range(times):
        start = time.process_time()
        work()
        best = min(best, time.process_time() - start)
    return best
