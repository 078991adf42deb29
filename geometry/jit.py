"""The one way in which attlog's kernels are compiled."""

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba

P = ParamSpec("P")
R = TypeVar("R")


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile at first call, keep the machine code on disk, release the GIL."""
    return cast("Callable[P, R]", numba.njit(cache=True, nogil=True)(function))


def inline_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """As `kernel`, and inlined into the kernels that call it."""
    return cast("Callable[P, R]", numba.njit(cache=True, nogil=True, inline="always")(function))


def part(function: Callable[P, R]) -> Callable[P, R]:
    """A piece of a kernel, in scalars: always fused into its caller by LLVM, and kept on disk only within it.

    Left to itself LLVM stops inlining in large kernels, and tuples then travel through memory: three times slower.
    """
    return cast("Callable[P, R]", numba.njit(nogil=True, forceinline=True)(function))
