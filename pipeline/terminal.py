"""What the command line shows and hears while it works: a status line, and the signals that end a recording."""

import shutil
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class StatusLine:
    """One line on stderr that is written over and over, on a terminal only."""

    def __init__(self, wanted: bool = True) -> None:
        self._shown = wanted and sys.stderr.isatty()
        self._width = 0

    def show(self, text: str) -> None:
        """Put ``text`` in the place of what is there."""
        if self._shown:
            text = text[: shutil.get_terminal_size().columns - 1]
            sys.stderr.write(f"\r{text.ljust(self._width)}")
            sys.stderr.flush()
            self._width = len(text)

    def end(self) -> None:
        """Leave the line."""
        if self._shown and self._width:
            sys.stderr.write("\n")


class Stop:
    """Whether somebody has asked to stop; calling it says so."""

    def __init__(self) -> None:
        self.asked = False

    def __call__(self) -> bool:
        return self.asked


@contextmanager
def stopping() -> Iterator[Stop]:
    """Ctrl-C, SIGTERM and the terminal's hanging up ask to stop; the second one acts as it always does."""
    stop = Stop()
    names = [name for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    before = {name: signal.getsignal(getattr(signal, name)) for name in names}

    def ask(number: int, _frame: FrameType | None) -> None:
        stop.asked = True
        signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)

    for name in names:
        signal.signal(getattr(signal, name), ask)
    try:
        yield stop
    finally:
        for name, handler in before.items():
            signal.signal(getattr(signal, name), handler)
