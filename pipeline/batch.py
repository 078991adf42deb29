"""One task per log: a single one in this process, several in a pool of reused workers, where a crash costs that log."""

import logging
import multiprocessing
from collections.abc import Callable, Sequence
from concurrent.futures import TimeoutError as PoolTimeoutError
from typing import Any, TypeVar

from ..schemas.errors import AttlogError, UsageError
from .outcomes import Outcome, Outcomes, Result

T = TypeVar("T", bound=Result)
Task = tuple[str, Callable[[], T]]
"""The log's name, and the picklable call that handles it."""

TIMEOUT_S = 3600.0
_log = logging.getLogger("attlog")


def run_all(
    tasks: Sequence[Task[T]],
    jobs: int = 1,
    timeout_s: float = TIMEOUT_S,
    done: Callable[[int], None] = lambda number: None,
) -> Outcomes[T]:
    """Run every task, at most ``jobs`` at once; one that fails, dies or hangs stops no other.

    ``done`` is called with the number of each task that is finished.
    """
    workers = min(jobs, len(tasks))
    if len(tasks) <= 1 or workers == 1:
        return Outcomes(tuple(_here(number, name, call, done) for number, (name, call) in enumerate(tasks)))
    return Outcomes(tuple(_in_pool(tasks, workers, timeout_s, done)))


def _here(number: int, name: str, call: Callable[[], T], done: Callable[[int], None]) -> Outcome[T]:
    try:
        return Outcome(name, call())
    except UsageError:
        raise
    except Exception as error:
        return Outcome(name, None, describe(name, error))
    finally:
        done(number)


def _in_pool(tasks: Sequence[Task[T]], workers: int, timeout_s: float, done: Callable[[int], None]) -> list[Outcome[T]]:
    from pebble import ProcessPool

    pool: Any = ProcessPool(max_workers=workers, context=multiprocessing.get_context("spawn"))
    try:
        futures = [(name, pool.schedule(call, timeout=timeout_s)) for name, call in tasks]
        for number, (_, future) in enumerate(futures):
            future.add_done_callback(lambda _, number=number: done(number))
        outcomes = [_collect(name, future) for name, future in futures]
        pool.close()
    except BaseException:
        pool.stop()
        raise
    finally:
        pool.join()
    return outcomes


def _collect(name: str, future: Any) -> Outcome[Any]:
    try:
        return Outcome(name, future.result())
    except UsageError:
        raise
    except Exception as error:
        return Outcome(name, None, describe(name, error))


def describe(name: str, error: Exception) -> str:
    """The one line for an error; the traceback of one that nobody expected goes to the log at debug level."""
    if isinstance(error, AttlogError):
        return str(error)
    _log.debug("%s", name, exc_info=error)
    if isinstance(error, PoolTimeoutError):
        return f"{name}: took too long and was stopped; give --timeout more seconds, or fewer -j"
    if isinstance(error, MemoryError):
        return f"{name}: not enough memory; give fewer -j, or cut the log"
    if type(error).__name__ == "ProcessExpired":
        return f"{name}: the process that read it died ({error}); the other logs are not affected"
    return f"{name}: unexpected {type(error).__name__}: {error}; run with -vv for the traceback, and report it"
