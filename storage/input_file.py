"""A file that is read by offset, and never past its end."""

import os
from pathlib import Path
from types import TracebackType

from ..schemas.errors import InputError
from .records import damaged

WINDOW = 1 << 18


class InputFile:
    """An open file: `read` for anything, `peek` for many small pieces one after the other."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        try:
            self._file = open(path, "rb", buffering=0)  # noqa: SIM115 - closed by close()
        except OSError as error:
            raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
        status = os.fstat(self._file.fileno())
        self.size = status.st_size
        self._identity = _identity(status)
        self._window = (0, b"")
        self._buffer = memoryview(bytearray())

    def read(self, offset: int, length: int) -> bytes:
        """``length`` bytes from ``offset``; InputError where the file has not so many."""
        self._check(offset, length)
        target = bytearray(length)
        self._fill(offset, memoryview(target))
        return bytes(target)

    def view(self, offset: int, length: int) -> memoryview:
        """As `read`, in a buffer that the next call overwrites (fresh memory for each chunk costs more than that)."""
        self._check(offset, length)
        if len(self._buffer) < length:
            self._buffer = memoryview(bytearray(length))
        target = self._buffer[:length]
        self._fill(offset, target)
        return target

    def _check(self, offset: int, length: int) -> None:
        if offset < 0 or length < 0 or offset + length > self.size:
            raise damaged(self.path, offset, f"{length} bytes are said to lie here, in a file of {self.size}")

    def _fill(self, offset: int, target: memoryview) -> None:
        done = 0
        try:
            self._file.seek(offset)
            while done < len(target):
                count = self._file.readinto(target[done:])
                if not count:
                    raise damaged(self.path, offset, "the file became shorter while it was read")
                done += count
        except OSError as error:
            raise InputError(f"{self.path}: byte {offset}: cannot be read: {error.strerror or error}") from error

    def peek(self, offset: int, length: int) -> bytes:
        """As `read`, by way of a window that moves along."""
        start, window = self._window
        if not start <= offset <= offset + length <= start + len(window):
            window = self.read(offset, min(max(length, WINDOW), max(length, self.size - offset)))
            self._window = start, window = offset, window
        return window[offset - start : offset - start + length]

    def is_current(self) -> bool:
        """Whether the path still leads to this file, and nobody has written to it."""
        try:
            return _identity(os.stat(self.path)) == self._identity
        except OSError:
            return False

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def __enter__(self) -> "InputFile":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()


def _identity(status: os.stat_result) -> tuple[int, ...]:
    return status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns
