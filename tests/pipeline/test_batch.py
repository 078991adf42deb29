"""Many logs at once: one that fails, dies or hangs stops no other."""

import importlib
import json
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from attlog.pipeline.batch import run_all
from attlog.pipeline.outcomes import as_json
from attlog.schemas import Kind, Severity, UsageError

WORKERS = """
import os, time
from dataclasses import dataclass
from attlog.schemas import InputError

@dataclass(frozen=True)
class Done:
    text: str
    complete: bool = True
    def to_text(self): return self.text
    def to_dict(self): return {"text": self.text}

def fine(text): return Done(text)
def partly(text): return Done(text, False)
def bad(text): raise InputError(text + ": no good")
def odd(text): raise ZeroDivisionError("of its own making")
def dies(text): os._exit(9)
def hangs(text): time.sleep(600)
"""


@pytest.fixture
def work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """A module that spawned workers can import."""
    (tmp_path / "attlog_test_work.py").write_text(WORKERS)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    yield importlib.import_module("attlog_test_work")
    del sys.modules["attlog_test_work"]


def _tasks(work: Any, *kinds: str) -> list[Any]:
    return [(f"{kind}{number}", partial(getattr(work, kind), f"{kind}{number}")) for number, kind in enumerate(kinds)]


def test_one_that_fails_dies_or_hangs_stops_no_other(work: Any) -> None:
    kinds = ("fine", "bad", "dies", "odd", "hangs", "fine")
    done = run_all(_tasks(work, *kinds), jobs=2, timeout_s=8.0)
    assert [outcome.source for outcome in done] == [f"{kind}{n}" for n, kind in enumerate(kinds)]
    assert [result.to_text() for result in done.results] == ["fine0", "fine5"]
    assert done.exit_code == 3
    bad, dies, odd, hangs = done.errors
    assert bad == "bad1: no good"
    assert "died" in dies
    assert "ZeroDivisionError" in odd
    assert "too long" in hangs


def test_exit_codes(work: Any) -> None:
    assert run_all(_tasks(work, "fine")).exit_code == 0
    assert run_all(_tasks(work, "fine", "fine"), jobs=1).exit_code == 0
    assert run_all(_tasks(work, "partly")).exit_code == 3
    assert run_all(_tasks(work, "bad")).exit_code == 1
    assert run_all([]).exit_code == 1


def test_a_wrong_option_is_no_logs_fault() -> None:
    def wrong() -> Any:
        raise UsageError("no such estimator")

    with pytest.raises(UsageError):
        run_all([("a", wrong)])


def test_json_has_an_object_for_each_log(work: Any) -> None:
    told = json.loads(run_all(_tasks(work, "fine", "bad"), jobs=1).to_json())
    assert told == [{"source": "fine0", "text": "fine0"}, {"source": "bad1", "error": "bad1: no good"}]


def test_json_has_no_number_that_json_does_not_know() -> None:
    told = as_json({"value": float("nan"), "rate": float("inf"), "level": Severity.WARN, "kind": Kind.GAP})
    assert json.loads(told) == {"value": None, "rate": None, "level": 30, "kind": "gap"}
