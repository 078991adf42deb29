"""What makes a call on one log a verb: given a list, it does every log, each on its own."""

import functools
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar, overload

from .batch import TIMEOUT_S, run_all
from .inputs import expand, outputs
from .outcomes import Outcomes, Result
from .stdin import without_stdin

P = ParamSpec("P")
T = TypeVar("T", bound=Result)
Place = str | Path
Progress = Callable[[Sequence[Path]], AbstractContextManager[Callable[[int], None]]]


class Verb(Generic[P, T]):
    """A call on one log. One log gives its result or raises; a list of files, folders and globs gives `Outcomes`.

    ``accepts`` says which files of a folder it takes; ``writes`` whether it has an ``output``; ``in_place`` whether
    that is the log itself unless another is named; ``suffix`` is that of an output's name,
    empty where the output is a folder.
    """

    def __init__(
        self,
        one: Callable[Concatenate[Place, P], T],
        accepts: Callable[[Path], bool],
        in_place: bool,
        writes: bool,
        suffix: str = ".mcap",
    ) -> None:
        self.one = one
        self.accepts = accepts
        self.in_place = in_place
        self.writes = writes
        self.suffix = suffix
        functools.update_wrapper(self, one)

    @overload
    def __call__(self, source: Place, /, *args: P.args, **options: P.kwargs) -> T: ...  # type: ignore[overload-overlap]
    @overload
    def __call__(self, source: Iterable[Place], /, *args: P.args, **options: P.kwargs) -> Outcomes[T]: ...
    def __call__(self, source: Place | Iterable[Place], /, *args: P.args, **options: P.kwargs) -> T | Outcomes[T]:
        """Do one log, or each of a list."""
        if isinstance(source, str | Path):
            return self.one(source, *args, **options)
        return for_each(self, source, *args, **options)  # type: ignore[arg-type]

    def __reduce__(self) -> str:
        return str(self.one.__qualname__)  # workers find it by name

    def targets(self, files: list[Path], output: Place | None) -> list[dict[str, Path]]:
        """The argument that says where each file's result goes."""
        if not self.writes:
            return [{} for _ in files]
        if not self.suffix and output is not None and len(files) == 1:
            return [{"output": Path(output)}]
        places = files if self.in_place and output is None else outputs(files, output, self.suffix)
        return [{"output": place} for place in places]


def verb(
    accepts: Callable[[Path], bool], *, in_place: bool = False, writes: bool = True, suffix: str = ".mcap"
) -> Callable[[Callable[Concatenate[Place, P], T]], Verb[P, T]]:
    """Make a call on one log a `Verb`."""
    return lambda one: Verb(one, accepts, in_place, writes, suffix)


def for_each(
    call: Verb[Any, T],
    sources: Iterable[Place],
    *args: Any,
    output: Place | None = None,
    jobs: int = 1,
    timeout_s: float = TIMEOUT_S,
    progress: Progress | None = None,
    **options: Any,
) -> Outcomes[T]:
    """Do every log that ``sources`` (files, folders, globs, - for stdin) name, at most ``jobs`` at once.

    ``output`` is a folder, or a file where there is one log; ``args`` and ``options`` are those of ``call``. One log
    that fails stops no other; with more than one job, neither does one that dies or takes longer than ``timeout_s``,
    and a script that calls this needs the guard ``if __name__ == "__main__":``, since workers import it. ``progress``
    is told which logs there are and the number of each that is finished.
    """
    files = expand(without_stdin(sources, output is not None or not call.writes), call.accepts)
    tasks = [
        (str(file), functools.partial(call, file, *args, **target, **options))
        for file, target in zip(files, call.targets(files, output), strict=True)
    ]
    with (progress or _untold)(files) as done:
        return run_all(tasks, jobs, timeout_s, done)


@contextmanager
def _untold(_: Sequence[Path]) -> Iterator[Callable[[int], None]]:
    yield lambda number: None
