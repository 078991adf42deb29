"""A file that appears whole or not at all."""

import contextlib
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from ..schemas.errors import StorageError
from .crc import crc32


class Sink:
    """A file being written, with its position and the CRC of all its bytes."""

    def __init__(self, file: BinaryIO, path: Path) -> None:
        self._file = file
        self.path = path
        self.position = 0
        self.crc = 0

    def write(self, data: "bytes | memoryview") -> None:
        """Append bytes."""
        self.crc = crc32(data, self.crc)
        self._file.write(data)
        self.position += len(data)


@contextmanager
def replacing(path: Path, force: bool) -> Iterator[Sink]:
    """A Sink whose file becomes ``path`` when the block ends well: written beside it, synced, renamed.

    StorageError where ``path`` exists (unless ``force``), the folder does not, or the disk refuses; then nothing is
    left behind and what was at ``path`` is as before.
    """
    target = Path(os.path.realpath(path))
    if not force and os.path.lexists(path):
        raise StorageError(f"{path}: exists already; choose another name, or overwrite it with --force (force=True)")
    if target.is_dir():
        raise StorageError(f"{path}: is a directory; give the name of a file")
    if target.exists() and not target.is_file():
        raise StorageError(f"{path}: is no regular file, and is not replaced; give another name")
    beside = target.with_name(f".attlog-{os.getpid()}-{secrets.token_hex(4)}.part")
    _remove_leftovers(target.parent)
    try:
        with open(beside, "wb") as file:
            yield Sink(file, path)
            file.flush()
            os.fsync(file.fileno())
        if target.exists():
            with contextlib.suppress(OSError):
                os.chmod(beside, target.stat().st_mode & 0o777)
        if not force and os.path.lexists(path):
            raise StorageError(f"{path}: appeared while it was being written; choose another name, or use --force")
        os.replace(beside, target)
    except OSError as error:
        _remove(beside)
        raise StorageError(f"{path}: cannot be written: {error.strerror or error}") from error
    except BaseException:
        _remove(beside)
        raise
    _sync_folder(target.parent)


def _remove_leftovers(folder: Path) -> None:
    """Unfinished files of processes that were killed."""
    if os.name != "posix":
        return
    for left in folder.glob(".attlog-*-*.part"):
        try:
            os.kill(int(left.name.split("-")[1]), 0)
        except ProcessLookupError:
            _remove(left)
        except (OSError, ValueError, OverflowError):
            continue  # another user's, or not ours


def _remove(path: Path) -> None:
    with contextlib.suppress(OSError):
        path.unlink()


def _sync_folder(folder: Path) -> None:
    """Make the new name last through a power cut, where the system can."""
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
