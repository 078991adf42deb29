"""Runs of bytes of different lengths, copied many at once: the offsets-and-bytes way of Arrow, in numpy alone."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Places = NDArray[np.int64]

FEW_LENGTHS = 48
BLOCK = 1 << 22


def window(buffer: Bytes, dtype: "np.dtype[Any]", writeable: bool = False) -> NDArray[Any]:
    """``buffer`` as an array with an element beginning at *every* byte, so that offsets are indices."""
    count = max(0, len(buffer) - dtype.itemsize + 1)
    view: NDArray[Any] = np.ndarray((count,), dtype, buffer, 0, (1,))
    view.flags.writeable = writeable
    return view


def void(size: int) -> "np.dtype[np.void]":
    """``size`` bytes without meaning."""
    return np.dtype(f"V{size}")


def starts(lengths: Places) -> Places:
    """Where runs begin that lie one after the other."""
    result = np.zeros(len(lengths), np.int64)
    np.cumsum(lengths[:-1], out=result[1:])
    return result


def ramps(first: Places, counts: Places, step: int = 1) -> Places:
    """``first[i], first[i] + step, …`` (``counts[i]`` of them) for each i, in one array."""
    total = int(counts.sum())
    within = np.arange(total, dtype=np.int64) - np.repeat(starts(counts), counts)
    return np.repeat(first, counts) + within * step


def copy(target: Bytes, target_at: Places, source: Bytes, source_at: Places, lengths: Places) -> None:
    """Copy run after run: ``lengths[i]`` bytes from ``source_at[i]`` to ``target_at[i]``."""
    if len(lengths) == 0:
        return
    if (lengths == lengths[0]).all():
        _copy_equal(target, target_at, source, source_at, int(lengths[0]))
        return
    different = np.unique(lengths)
    if len(different) <= FEW_LENGTHS or len(different) * 8 <= len(lengths):
        for length in different:
            which = np.flatnonzero(lengths == length)
            _copy_equal(target, target_at[which], source, source_at[which], int(length))
        return
    if int(lengths.mean()) >= 64:
        for to, at, length in zip(target_at.tolist(), source_at.tolist(), lengths.tolist(), strict=True):
            target[to : to + length] = source[at : at + length]
        return
    _copy_bytewise(target, target_at, source, source_at, lengths)


def _copy_equal(target: Bytes, target_at: Places, source: Bytes, source_at: Places, length: int) -> None:
    if length:
        kind = void(length)
        window(target, kind, True)[target_at] = window(source, kind)[source_at]


def _copy_bytewise(target: Bytes, target_at: Places, source: Bytes, source_at: Places, lengths: Places) -> None:
    rows = max(1, BLOCK // max(1, int(lengths.max())))
    for low in range(0, len(lengths), rows):
        part = slice(low, low + rows)
        target[ramps(target_at[part], lengths[part])] = source[ramps(source_at[part], lengths[part])]


def joined(source: Bytes, source_at: Places, lengths: Places) -> Bytes:
    """The runs one after the other."""
    target = np.empty(int(lengths.sum()), np.uint8)
    copy(target, starts(lengths), source, source_at, lengths)
    return target
