"""The one way in which attlog's kernels are compiled."""

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numba

P = ParamSpec("P")
R = TypeVar("R")


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile at first call, keep the machine code on disk, release the GIL."""
    return cast("Callable[P, R]", _stamped(numba.njit(cache=True, nogil=True)(function)))


def inline_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """As `kernel`, and inlined into the kernels that call it."""
    return cast("Callable[P, R]", numba.njit(cache=True, nogil=True, inline="always")(function))


def part(function: Callable[P, R]) -> Callable[P, R]:
    """A piece of a kernel, in scalars: always fused into its caller by LLVM, and kept on disk only within it.

    Left to itself LLVM stops inlining in large kernels, and tuples then travel through memory: three times slower.
    Multiplications and additions may fuse where the machine can, which spares a rounding.
    """
    return cast("Callable[P, R]", numba.njit(nogil=True, forceinline=True, fastmath={"contract"})(function))


def _stamped(dispatcher: Any) -> Any:
    """Numba keeps machine code as long as the kernel's own file is unchanged; its pieces may lie in others."""
    kept: Any = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
    if hasattr(kept, "_source_stamp"):
        kept._source_stamp = f"{kept._source_stamp} {_sources()}"
    return dispatcher


@cache
def _sources() -> str:
    """Digest of all files that hold kernels or pieces of them: those named ``…kernel.py`` or ``…kernels.py``."""
    package = Path(__file__).resolve().parents[1]
    folders = [place for place in package.iterdir() if (place / "__init__.py").is_file()]
    files = sorted(file for place in folders for file in place.rglob("*kernel*.py"))
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()
