"""Every command and every code block of README and docs/ runs as printed."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCK = re.compile(r"^```(?P<language>sh|python)\n(?P<code>.*?)^```$", re.MULTILINE | re.DOTALL)
BY_CI = {"make demo", "make test", "make test-long", "make bench", "make lint"}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_what_a_page_shows_runs(page: Path, tmp_path: Path) -> None:
    blocks = [(match["language"], match["code"]) for match in BLOCK.finditer(page.read_text())]
    if not blocks:
        return
    place = tmp_path / "attlog"
    shutil.copytree(ROOT / "data", place / "data")
    _link_shared(blocks, tmp_path)
    for language, code in blocks:
        (_run_shell if language == "sh" else _run_python)(code, place)


def _link_shared(blocks: list[tuple[str, str]], folder: Path) -> None:
    if not any("../shared" in code for _, code in blocks):
        return
    shared = Path(os.environ.get("ATTLOG_SHARED", ROOT.parent / "shared"))
    if not shared.is_dir():
        pytest.skip(f"the page uses the shared logs, which are not at {shared}")
    (folder / "shared").symlink_to(shared)


def _run_shell(code: str, place: Path) -> None:
    for line in code.splitlines():
        command = line.partition(" #")[0].strip()
        if not command or command in BY_CI:
            continue
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        done = subprocess.run(
            command,
            shell=True,
            cwd=place,
            env={**os.environ, "PATH": path},
            capture_output=True,
            text=True,
            check=False,
        )
        # 3: the real radio logs have damaged bytes.
        assert done.returncode in ((0, 3) if "../shared" in command else (0,)), f"{command}\n{done.stderr}"


def _run_python(code: str, place: Path) -> None:
    done = subprocess.run([sys.executable, "-c", code], cwd=place, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{code}\n{done.stderr}"


def test_ci_runs_the_readmes_two_commands() -> None:
    script = (ROOT / ".ci" / "run").read_text()
    assert "make demo" in script
    assert "make test" in script


def test_links_between_pages_lead_somewhere() -> None:
    for page in PAGES:
        for target in re.findall(r"\]\((?!https?:|#)([^)#]+)", page.read_text()):
            assert (page.parent / target).exists(), f"{page.name} links to {target}"


def test_the_reference_of_the_command_line_is_up_to_date() -> None:
    script = ROOT / "docs" / "cli_reference.py"
    printed = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=True).stdout
    assert printed == (ROOT / "docs" / "cli.md").read_text(), "python docs/cli_reference.py > docs/cli.md"
