"""Simulated flights: a scenario is data, and the same scenario and seed give the same run everywhere.

``simulate("flight", seed=1)`` gives a `SimulatedRun`: truth, sensors and an autopilot's attitude as arrays. It becomes
a `Recording` (``run.recording``), the columns of a log (`ingested`), or a file (`write`, by its suffix).
"""

from collections.abc import Callable, Mapping
from pathlib import Path

from ...schemas.errors import UsageError
from .catalog import SCENARIOS, Scenario, scenarios
from .columns import ingested, write_mcap
from .motion import Motion, Trajectory
from .run import SimulatedRun, run_scenario, simulate

__all__ = [
    "SCENARIOS",
    "Motion",
    "Scenario",
    "SimulatedRun",
    "Trajectory",
    "ingested",
    "run_scenario",
    "scenarios",
    "simulate",
    "write",
    "write_mcap",
    "write_tlog",
]


def write_tlog(run: SimulatedRun, path: str | Path, *, force: bool = False) -> None:
    """Write the run as a MAVLink telemetry log; StorageError where it exists or cannot be written."""
    from . import tlog

    tlog.write_tlog(run, path, force=force)


_WRITERS: Mapping[str, Callable[..., None]] = {".tlog": write_tlog, ".mcap": write_mcap}


def write(run: SimulatedRun, path: str | Path, *, force: bool = False) -> None:
    """Write the run as the suffix of ``path`` says; UsageError for a suffix that is not known."""
    suffix = Path(path).suffix.lower()
    if suffix not in _WRITERS:
        raise UsageError(f"{path}: a run is written as {' or '.join(_WRITERS)}; give the output such a name")
    _WRITERS[suffix](run, path, force=force)
