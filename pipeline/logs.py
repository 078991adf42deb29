"""Opening an MCAP and reading what a verb needs of it."""

from pathlib import Path

from .. import storage
from ..schemas.errors import InputError
from ..schemas.finding import Finding, Note
from ..schemas.recording import Recording
from .findings import ANNOTATIONS, FINDINGS, findings_from, notes_from
from .inputs import is_mcap
from .recordings import is_recorded, recordings


def open_log(path: Path) -> storage.LogFile:
    """Open an MCAP; InputError tells what to do with a file that is none."""
    if path.exists() and not path.is_dir() and not is_mcap(path):
        raise InputError(f"{path}: is no MCAP; `attlog convert {path}` makes one, `attlog run {path}` does everything")
    return storage.open(path)


def read_recordings(log: storage.LogFile) -> dict[str, Recording]:
    """The vehicles of an MCAP."""
    columns = log.read([topic for topic in log.topics if is_recorded(topic)])
    return recordings(columns.values(), log.metadata)


def everything_said(log: storage.LogFile) -> tuple[list[Finding], list[Note]]:
    """The findings and notes of an MCAP."""
    said = log.read([topic for topic in (FINDINGS, ANNOTATIONS) if topic in log.topics])
    return findings_from(said.get(FINDINGS)), notes_from(said.get(ANNOTATIONS))
