"""How long the strings and sequences of some columns are: one layout for all messages, or not."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..schemas.columns import Columns
from ..schemas.definition import TEXT_TYPES, Field, MessageType
from ..schemas.layout import Path, dotted

MOST_ELEMENTS = 1000
"""Arrays of messages beyond this are not laid out element by element."""


class _VaryingError(Exception):
    """Two messages differ in a length."""


def common_lengths(columns: Columns) -> dict[str, int] | None:
    """The lengths that all messages share, as `schemas.layout` takes them (strings with their NUL); else None."""
    names = columns.data.dtype.names or ()
    found: dict[str, int] = {}
    try:
        for field in columns.channel.type.fields:
            if field.name in names:
                _measure(field, columns.data[field.name], (field.name,), found)
    except _VaryingError:
        return None
    for path, text in columns.channel.texts.items():
        if path.split(".")[0] not in names:
            found[path] = len(text.encode()) + 1
    return found


def _measure(field: Field, values: NDArray[Any], path: Path, found: dict[str, int]) -> None:
    if values.dtype == object or values.dtype.kind == "U":
        raise _VaryingError
    if field.length is None:
        _measure_one(field.type, values, path, found)
        return
    count = values.shape[1]
    if field.length == 0:
        found[dotted(path)] = count
    if isinstance(field.type, str) and field.type not in TEXT_TYPES:
        return
    if count > MOST_ELEMENTS:
        raise _VaryingError
    for number in range(count):
        _measure_one(field.type, values[:, number], (*path, number), found)


def _measure_one(kind: str | MessageType, values: NDArray[Any], path: Path, found: dict[str, int]) -> None:
    if values.dtype == object or values.dtype.kind == "U":
        raise _VaryingError
    if isinstance(kind, MessageType):
        for inner in kind.fields:
            if inner.name in (values.dtype.names or ()):
                _measure(inner, values[inner.name], (*path, inner.name), found)
    elif kind in TEXT_TYPES and len(values):
        length = np.strings.str_len(values)
        if (length != length[0]).any():
            raise _VaryingError
        found[dotted(path)] = int(length[0]) + 1
