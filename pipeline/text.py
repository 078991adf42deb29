"""Plain text for people: tables, counts, spans of time."""

import io
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime

FIRST_UTC_NS = 946_684_800 * 1_000_000_000
"""2000-01-01: stamps before it count from boot."""


def table(header: Sequence[str], rows: Iterable[Sequence[str]], right: Sequence[int] = ()) -> str:
    """Columns two blanks apart; those whose numbers are in ``right`` are set flush right."""
    from rich.console import Console
    from rich.table import Table

    grid = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="", highlight=False)
    for number, name in enumerate(header):
        grid.add_column(name, justify="right" if number in right else "left", no_wrap=True)
    for row in rows:
        grid.add_row(*row, style="")
    out = io.StringIO()
    Console(file=out, width=400, color_system=None, markup=False, emoji=False).print(grid)
    return "\n".join(line.rstrip() for line in out.getvalue().splitlines())


def seconds(nanoseconds: int) -> str:
    """``12.3 s``."""
    return f"{nanoseconds / 1e9:.1f} s"


def moment(time_ns: int) -> str:
    """``2015-06-11 12:13:14.500 UTC``, or ``12.300 s since boot`` where the log does not know UTC."""
    if time_ns < FIRST_UTC_NS:
        return f"{time_ns / 1e9:.3f} s since boot"
    whole = datetime.fromtimestamp(time_ns // 1_000_000_000, tz=UTC)
    return f"{whole:%Y-%m-%d %H:%M:%S}.{time_ns % 1_000_000_000 // 1_000_000:03d} UTC"


def count(number: int, unit: str) -> str:
    """``1 segment``, ``2,345 segments``."""
    return f"{number:,} {unit}" + ("" if number == 1 else "s")
