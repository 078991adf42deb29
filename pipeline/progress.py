"""A bar on stderr while several logs, or a large one, are worked on: how many bytes, how fast. Only on a terminal."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

Done = Callable[[int], None]
"""To be called with the number of each log that is finished."""


@contextmanager
def bar(files: Sequence[Path]) -> Iterator[Done]:
    """A bar over the bytes of ``files``; where stderr is no terminal, nothing."""
    if not sys.stderr.isatty() or not files:
        yield lambda number: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TimeElapsedColumn, TransferSpeedColumn

    sizes = [file.stat().st_size if file.is_file() else 0 for file in files]
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        DownloadColumn(),
        TransferSpeedColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(f"0 of {len(files)}", total=max(1, sum(sizes)))
        finished = 0

        def done(number: int) -> None:
            nonlocal finished
            finished += 1
            progress.update(task, advance=sizes[number], description=f"{finished} of {len(files)}")

        yield done
