"""The package as installed: which one is under test, what the wheel holds, which room imports which."""

import ast
import importlib.metadata
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

import attlog

ROOMS = (
    "geometry",
    "signals",
    "schemas",
    "storage",
    "ingest",
    "estimators",
    "identification",
    "analysis",
    "report",
    "serve",
    "pipeline",
)
ALLOWED = {
    "geometry": set(),
    "signals": set(),
    "schemas": {"geometry"},
    "storage": {"schemas"},
    "ingest": {"schemas", "geometry", "signals", "storage"},
    "estimators": {"schemas", "geometry", "signals"},
    "identification": {"estimators", "schemas", "geometry", "signals"},
    "analysis": {"schemas", "geometry", "signals"},
    "report": {"analysis", "schemas"},
    "serve": {"report", "storage"},
    "pipeline": set(ROOMS) - {"pipeline"},
}


def _tracked(root: Path) -> list[str]:
    done = subprocess.run(["git", "ls-files", "*.py"], cwd=root, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        pytest.skip("not a git checkout, so its tracked files are not known")
    return done.stdout.split()


def test_the_attlog_under_test_is_the_installed_one() -> None:
    installed = importlib.metadata.distribution("attlog")
    assert attlog.__name__ == "attlog"
    assert attlog.__version__ == installed.version
    twins = [
        name
        for name, module in sys.modules.items()
        if getattr(module, "__file__", None) == attlog.__file__ and name != "attlog"
    ]
    assert twins == []


@pytest.mark.parametrize("room", [room for room in ROOMS if room in ALLOWED])
def test_a_room_imports_none_below_it(room: str, root: Path) -> None:
    files = [name for name in _tracked(root) if name.startswith(f"{room}/")]
    for name in files:
        depth = len(Path(name).parts)
        for node in ast.walk(ast.parse((root / name).read_text())):
            if not isinstance(node, ast.ImportFrom) or node.level == 0:
                continue
            if node.level == depth:
                used = {(node.module or alias.name).split(".")[0] for alias in node.names}
                assert used - {room} <= ALLOWED[room], f"{name}:{node.lineno} imports {used}"
            assert node.level <= depth, f"{name}:{node.lineno} imports from outside the package"


@pytest.mark.parametrize("room", ["geometry", "signals", "schemas", "storage"])
def test_a_room_without_kernels_imports_no_numba(room: str) -> None:
    code = f"import sys, attlog.{room}; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_packages_named_in_pyproject_are_the_rooms(root: Path) -> None:
    named = set(tomllib.loads((root / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"])
    folders = {Path(name).parent for name in _tracked(root) if Path(name).parts[0] in ROOMS}
    assert named == {"attlog"} | {"attlog." + ".".join(folder.parts) for folder in folders}


def test_the_wheel_holds_the_rooms_and_nothing_else(root: Path, tmp_path: Path) -> None:
    source = tmp_path / "source"
    tracked = subprocess.run(["git", "ls-files"], cwd=root, capture_output=True, text=True, check=False).stdout.split()
    if not tracked:
        pytest.skip("not a git checkout, so its tracked files are not known")
    for name in tracked:
        if (root / name).is_file():
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            (source / name).write_bytes((root / name).read_bytes())
    build = [sys.executable, "-m", "build", "--wheel", "--outdir", str(tmp_path / "dist"), str(source)]
    subprocess.run(build, check=True, capture_output=True)
    (wheel,) = (tmp_path / "dist").glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        packed = {name for name in archive.namelist() if ".dist-info/" not in name}
    rooms = {name for name in tracked if name.endswith(".py") and Path(name).parts[0] in ROOMS}
    expected = {f"attlog/{name}" for name in rooms | {"__init__.py", "cli.py", "py.typed"}}
    expected |= {f"attlog/{name}" for name in tracked if name.startswith("report/templates/")}
    assert packed == expected
