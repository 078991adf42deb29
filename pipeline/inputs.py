"""Which files a call means, and where the result of each goes."""

import glob
import logging
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from ..schemas.errors import InputError, StorageError, UsageError

MCAP_MAGIC = b"\x89MCAP0\r\n"
HEAD_BYTES = 65536
LOG_SUFFIXES = frozenset({".bin", ".log", ".tlog", ".ulg", ".csv", ".mat", ".hdf5", ".mcap"})
"""Files of a folder that are called so and are no logs are told; all others are left out in silence."""
_log = logging.getLogger("attlog")


def expand(sources: Iterable[str | Path], accepts: Callable[[Path], bool]) -> list[Path]:
    """The logs that ``sources`` name: a file is itself, a folder the files in it (at any depth, sorted, hidden ones
    left out) that ``accepts`` takes, or the folder itself where it is taken as one log, a glob its matches. A name that
    matches nothing stays, to be reported."""
    found: dict[Path, None] = {}
    for source in sources:
        if not str(source).strip():
            raise UsageError("one of the names is empty; is a variable not set?")
        for place in _matches(str(source)):
            members = _members(place, accepts) if place.is_dir() else [place]
            found.update(dict.fromkeys(members))
    return list(found)


def _matches(source: str) -> list[Path]:
    if Path(source).exists() or not glob.has_magic(source):
        return [Path(source)]
    return [Path(match) for match in sorted(glob.glob(source, recursive=True))] or [Path(source)]


def _members(folder: Path, accepts: Callable[[Path], bool]) -> list[Path]:
    if accepts(folder):
        return [folder]
    found: list[Path] = []
    left_out: list[str] = []
    for path in _visible(folder):
        if path.is_dir() and not path.is_symlink():
            found += _members(path, accepts)
        elif path.is_file() and accepts(path):
            found.append(path)
        elif path.is_file() and path.suffix.lower() in LOG_SUFFIXES and not is_mcap(path):
            left_out.append(path.name)
    if left_out:
        _log.warning("%s: left out, of no format that is read: %s", folder, ", ".join(left_out))
    return found


def _visible(folder: Path) -> list[Path]:
    try:
        return sorted(path for path in folder.iterdir() if not path.name.startswith("."))
    except OSError:
        return []


def head_of(path: Path) -> bytes:
    """The first bytes of a file, as formats are recognised by; InputError where it cannot be read."""
    try:
        if path.exists() and not (path.is_file() or path.is_dir()):
            raise InputError(f"{path}: is no regular file; give what comes out of it on stdin, as -")
        with path.open("rb") as file:
            return file.read(HEAD_BYTES)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error


def is_mcap(path: Path) -> bool:
    """Whether the file begins as an MCAP does."""
    try:
        return head_of(path).startswith(MCAP_MAGIC)
    except InputError:
        return False


def outputs(sources: Sequence[Path], output: str | Path | None, suffix: str = ".mcap") -> list[Path]:
    """Where each source's result goes: beside it, or to ``output`` (a file for one source, else a folder).

    Two sources whose results would be one file keep their own suffix (``flight.tlog.mcap``), and after that the names
    of as many of their folders as it takes.
    """
    target = Path(output) if output is not None else None
    if target is not None and len(sources) == 1 and not _is_folder(target, output):
        return [target]
    if target is not None and len(sources) > 1 and target.is_file():
        raise UsageError(f"{target} is a file, and there are {len(sources)} logs to write: give -o a folder")
    level = [0] * len(sources)
    for _ in range(32):
        names = [_output(source, target, suffix, depth) for source, depth in zip(sources, level, strict=True)]
        twice = {name for name, count in Counter(names).items() if count > 1}
        if not twice:
            return names
        level = [depth + (name in twice) for depth, name in zip(level, names, strict=True)]
    raise UsageError("two of the sources would be written to one file: convert them in two calls")


def _is_folder(target: Path, spelled: str | Path | None) -> bool:
    return target.is_dir() or str(spelled).endswith(("/", "\\"))


def _output(source: Path, folder: Path | None, suffix: str, depth: int) -> Path:
    name = source.stem if depth == 0 else source.name
    above = source.resolve().parent.parts[1:]
    folders = "_".join(above[len(above) - depth + 1 :]) if depth > 1 else ""
    stem = f"{folders}_{name}" if folders else name
    return (folder if folder is not None else source.parent) / f"{stem}{suffix}"


def check_target(target: Path, source: Path | None, force: bool) -> None:
    """StorageError where ``target`` must not be written: it exists without ``force``, or it is the source itself."""
    if source is not None and target.exists() and source.exists() and target.samefile(source):
        raise StorageError(f"{target}: is the source itself; give another name with -o")
    if target.exists() and not force:
        raise StorageError(f"{target}: exists already; give --force to replace it, or another name with -o")


def in_place_target(source: str | Path, output: str | Path | None, force: bool) -> Path:
    """Where an annotated MCAP goes: the file itself, or ``output``, which is checked as by `check_target`."""
    path = Path(source)
    target = path if output is None else outputs([path], output)[0]
    if target != path:
        check_target(target, path, force)
        target.parent.mkdir(parents=True, exist_ok=True)
    return target
