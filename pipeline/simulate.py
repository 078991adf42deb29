"""A simulated run as a log."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .text import seconds


@dataclass(frozen=True)
class Simulation:
    """What `simulate` wrote."""

    scenario: str
    seed: int
    output: str
    size: int
    duration_s: float

    complete = True

    def to_text(self) -> str:
        """What ``attlog simulate`` prints."""
        length = seconds(round(self.duration_s * 1e9))
        return f"{self.scenario}, seed {self.seed} -> {self.output}: {length}, {self.size:,} bytes"

    def to_dict(self) -> dict[str, Any]:
        """The same for --json."""
        return vars(self).copy()


def simulate(scenario: str, output: str | Path, *, seed: int = 0, force: bool = False) -> Simulation:
    """Run ``scenario`` with ``seed`` and write it, with its truth, to ``output``: ``.tlog`` or ``.mcap``.

    The same scenario and seed give the same file. UsageError for an unknown scenario or suffix, StorageError where the
    output exists (without ``force``) or cannot be written.
    """
    from ..ingest import simulation  # imports scipy.signal, which no other verb waits for

    run = simulation.simulate(scenario, seed)
    target = Path(output)
    target.parent.mkdir(parents=True, exist_ok=True)
    simulation.write(run, target, force=force)
    duration_s = float(run.truth.time_s[-1] - run.truth.time_s[0])
    return Simulation(scenario, seed, str(target), target.stat().st_size, duration_s)
