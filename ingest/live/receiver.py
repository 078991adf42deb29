"""A thread that does nothing but take what arrives and note when; it opens a lost port again."""

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Final

from ...schemas.errors import InputError
from .connections import Connection, LinkLostError

FIRST_WAIT_S: Final = 0.1
LONGEST_WAIT_S: Final = 5.0

Arrival = tuple[int, bytes, str]
"""UNIX nanoseconds, the bytes, and what happened to the link ("" mostly)."""


class Receiver:
    """Receives from `start` to `stop`. The clock is the system's at the start and never steps after it."""

    def __init__(self, connect: Callable[[], Connection]) -> None:
        self._connect = connect
        self._epoch_ns = time.time_ns() - time.monotonic_ns()
        self._arrived: deque[Arrival] = deque()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="attlog receiver", daemon=True)
        self._connection: Connection | None = None
        self.connected = False
        self.reconnections = 0
        self.failure: BaseException | None = None

    def start(self) -> None:
        """Open the port; InputError where that fails at first."""
        self._connection = self._connect()
        self.connected = True
        self._thread.start()

    def take(self) -> list[Arrival]:
        """What arrived since the last call, in its order."""
        taken = []
        while self._arrived:
            taken.append(self._arrived.popleft())
        return taken

    def stop(self) -> None:
        """Stop receiving; what has arrived can still be taken."""
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join()

    def now_ns(self) -> int:
        """UNIX nanoseconds by the clock of the stamps."""
        return self._epoch_ns + time.monotonic_ns()

    def _run(self) -> None:
        try:
            while not self._stop.is_set():
                self._receive()
        except BaseException as error:  # shown by the thread that takes
            self.failure = error
        finally:
            self._close()

    def _receive(self) -> None:
        if self._connection is None and not self._reopen():
            return
        assert self._connection is not None
        try:
            data = self._connection.read()
        except LinkLostError as error:
            self._arrived.append((self.now_ns(), b"", f"lost: {error}"))
            self._close()
            return
        if data:
            self._arrived.append((self.now_ns(), data, ""))

    def _reopen(self) -> bool:
        wait = FIRST_WAIT_S
        while not self._stop.wait(wait):
            try:
                self._connection = self._connect()
            except InputError:
                wait = min(2 * wait, LONGEST_WAIT_S)
                continue
            self.connected = True
            self.reconnections += 1
            self._arrived.append((self.now_ns(), b"", "connected again"))
            return True
        return False

    def _close(self) -> None:
        self.connected = False
        if self._connection is not None:
            self._connection.close()
            self._connection = None
