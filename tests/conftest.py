"""Fixtures that every room's tests share."""

import os
import shutil
import subprocess
from collections.abc import Callable
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


@pytest.fixture(scope="session")
def readcheck(shared: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[Path], None]:
    """Fails where Foxglove's own libraries do not read a file; skips where npm or its registry is absent."""
    if not (shutil.which("node") and shutil.which("npm")):
        pytest.skip("readcheck needs node and npm")
    folder = tmp_path_factory.mktemp("readcheck")
    for name in ("package.json", "package-lock.json", "readcheck.mjs"):
        (folder / name).write_bytes((shared / "tools" / "readcheck" / name).read_bytes())
    done = subprocess.run(["npm", "ci", "--ignore-scripts"], cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"readcheck: npm ci failed: {done.stderr[-300:]}")

    def check(path: Path) -> None:
        command = ["node", "readcheck.mjs", str(path), "--quiet"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout[-3000:]

    return check
