"""``-``: a log from standard input, which is kept in a file while it is worked on."""

import atexit
import shutil
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

from ..schemas.errors import UsageError

STDIN = "-"


def without_stdin(sources: Iterable[str | Path], has_output: bool) -> list[str | Path]:
    """The sources with ``-`` replaced by a file of what comes in; UsageError where the result's place is not said."""
    named = list(sources)
    if STDIN not in map(str, named):
        return named
    if not has_output:
        raise UsageError("a log from stdin (-) needs -o: there is no file to write beside")
    kept = _spooled()
    return [kept if str(source) == STDIN else source for source in named]


def _spooled() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="attlog-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    with (folder / "stdin").open("wb") as file:
        if sys.stdin is not None:
            shutil.copyfileobj(sys.stdin.buffer, file)
    return folder / "stdin"
