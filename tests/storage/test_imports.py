"""Reading and writing need numpy, not a compiler."""

import subprocess
import sys


def test_storage_comes_without_numba() -> None:
    code = "import sys; import attlog.storage; print(sorted({'numba', 'pandas', 'scipy'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
