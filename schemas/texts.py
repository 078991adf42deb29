"""Text columns as sources store them, made what ROS 2 calls a string: UTF-8 that ends at the first NUL."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from .columns import Table


def clean(strings: NDArray[np.bytes_]) -> NDArray[np.bytes_] | None:
    """Texts (n,) cut at their first NUL, and what is not UTF-8 read as Latin-1; None where they are clean already."""
    if len(strings) == 0:
        return None
    width = strings.dtype.itemsize
    stored = np.ascontiguousarray(strings).view(np.uint8).reshape(len(strings), width)
    ended = np.logical_or.accumulate(stored == 0, axis=1)
    foreign = np.flatnonzero(np.any((stored >= 0x80) & ~ended, axis=1))
    if not len(foreign) and not np.any(stored[ended]):
        return None
    cut = np.where(ended, np.uint8(0), stored).view(f"S{width}")[:, 0]
    legal = {row: _utf8(bytes(cut[row])) for row in foreign.tolist()}
    result = cut.astype(f"S{max([width, *map(len, legal.values())])}")
    for row, value in legal.items():
        result[row] = value
    return result


def replaced(data: Table, changed: Mapping[str, NDArray[np.bytes_]]) -> Table:
    """A structured array (n,) with other values in the fields that ``changed`` names; itself where there are none."""
    if not changed:
        return data
    fields = data.dtype.names or ()
    types = [(name, changed[name].dtype if name in changed else data.dtype[name]) for name in fields]
    result = np.zeros(len(data), types)
    for name in fields:
        result[name] = changed.get(name, data[name])
    return result


def _utf8(value: bytes) -> bytes:
    try:
        value.decode()
    except UnicodeDecodeError:
        return value.decode("latin-1").encode()
    return value
