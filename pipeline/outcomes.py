"""What became of each log of a call."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar, overload

EXIT_OK = 0
EXIT_NOTHING = 1
EXIT_PARTIAL = 3


class Result(Protocol):
    """What a verb's call returns for one log."""

    @property
    def complete(self) -> bool:
        """False where bytes of the source were skipped."""

    def to_text(self) -> str:
        """What the command prints."""

    def to_dict(self) -> dict[str, Any]:
        """The same for --json."""


T = TypeVar("T", bound=Result)


@dataclass(frozen=True)
class Outcome(Generic[T]):
    """One log: its result, or the one line that says why there is none."""

    source: str
    result: T | None = None
    error: str = ""


@dataclass(frozen=True)
class Outcomes(Sequence[Outcome[T]]):
    """The outcome of every log of a call, in the order given."""

    outcomes: tuple[Outcome[T], ...]

    @overload
    def __getitem__(self, index: int) -> Outcome[T]: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Outcome[T]]: ...
    def __getitem__(self, index: int | slice) -> Outcome[T] | Sequence[Outcome[T]]:
        return self.outcomes[index]

    def __len__(self) -> int:
        return len(self.outcomes)

    def __iter__(self) -> Iterator[Outcome[T]]:
        return iter(self.outcomes)

    @property
    def results(self) -> tuple[T, ...]:
        """The results of the logs that have one."""
        return tuple(outcome.result for outcome in self.outcomes if outcome.result is not None)

    @property
    def errors(self) -> tuple[str, ...]:
        """One line for each log that failed."""
        return tuple(outcome.error for outcome in self.outcomes if outcome.result is None)

    @property
    def exit_code(self) -> int:
        """1 where nothing was done, 3 where some of it was, 0 where all of it was."""
        if not self.results:
            return EXIT_NOTHING
        whole = not self.errors and all(result.complete for result in self.results)
        return EXIT_OK if whole else EXIT_PARTIAL

    def to_text(self) -> str:
        """What the command prints on stdout."""
        return "\n\n".join(result.to_text() for result in self.results)

    def to_json(self) -> str:
        """One JSON array with an object for each log, failed ones included."""
        return as_json([_as_dict(outcome) for outcome in self.outcomes])


def as_json(told: Any) -> str:
    """JSON, indented; a number that does not exist (NaN, infinity) is null."""
    import orjson

    return orjson.dumps(told, option=orjson.OPT_INDENT_2 | orjson.OPT_SERIALIZE_NUMPY, default=str).decode()


def _as_dict(outcome: Outcome[Any]) -> dict[str, Any]:
    if outcome.result is None:
        return {"source": outcome.source, "error": outcome.error}
    return {"source": outcome.source, **outcome.result.to_dict()}
