"""Fixtures that every room's tests share."""

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def root() -> Path:
    """The checkout: the folder that holds pyproject.toml."""
    return ROOT


@pytest.fixture(scope="session")
def shared() -> Path:
    """The real logs and papers beside the checkout (or where ATTLOG_SHARED says); skips where they are absent."""
    place = Path(os.environ.get("ATTLOG_SHARED", ROOT.parent / "shared"))
    if not place.is_dir():
        pytest.skip(f"no shared data at {place}: set ATTLOG_SHARED to a folder with data/logs and data/broad")
    return place


@pytest.fixture(scope="session")
def logs(shared: Path) -> Path:
    """The real logs."""
    return shared / "data" / "logs"
