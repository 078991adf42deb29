"""Trees of columns to one structured array under the type's own names."""

import numpy as np
from numpy.typing import NDArray

from ..schemas.columns import Table
from ..schemas.definition import PRIMITIVES, TEXT_TYPES, Field, MessageType
from .ragged import Places, joined, starts, window
from .steps import Elements, Names, Numbers, Texts, Tree

LOOSEST = 8
"""A string column is padded to its longest string as long as that costs at most so many times the text itself."""
SMALL = 1 << 16


def assemble(message: MessageType, tree: Tree, count: int, path: Names = ()) -> Table:
    """All fields of the message below ``path``."""
    columns = {field.name: _column(field, tree, count, (*path, field.name)) for field in message.fields}
    dtype = np.dtype([(name, values.dtype, values.shape[1:]) for name, values in columns.items()])
    table = np.zeros(count, dtype)
    for name, values in columns.items():
        table[name] = values
    return table


def _column(field: Field, tree: Tree, count: int, path: Names) -> NDArray[np.generic]:
    if isinstance(field.type, MessageType) and field.length is None:
        return assemble(field.type, tree, count, path)
    if path not in tree:  # an array without elements
        return np.zeros((count, field.length or 0), _empty_dtype(field))
    node = tree[path]
    if isinstance(node, Texts):
        return texts(node)
    if isinstance(node, Numbers):
        return _sequences(node)
    if isinstance(node, Elements):
        return _elements(field, node)
    return node.astype(node.dtype.newbyteorder("="), copy=False)


def _empty_dtype(field: Field) -> "np.dtype[np.generic]":
    if isinstance(field.type, MessageType):
        return field.type.dtype()
    return np.dtype("S1" if field.type in TEXT_TYPES else PRIMITIVES[field.type])


def texts(node: Texts) -> NDArray[np.generic]:
    """Strings as ``S{n}``, or as objects (bytes) where padding would waste memory or lose a final NUL."""
    length = node.length
    width = int(length.max(initial=0))
    if width == 0:
        return np.zeros(len(length), "S1")
    some = np.flatnonzero(length)
    ends_in_nul = (node.pool[node.start[some] + length[some] - 1] == 0).any()
    if ends_in_nul or len(length) * width > LOOSEST * int(length.sum()) + SMALL:
        pool = node.pool
        pieces = (pool[a:b].tobytes() for a, b in zip(node.start.tolist(), (node.start + length).tolist(), strict=True))
        return np.fromiter(pieces, object, len(length))
    return _padded(node, width)


def _padded(node: Texts, width: int) -> NDArray[np.generic]:
    fits = np.flatnonzero(node.start + width <= len(node.pool))
    rest = np.setdiff1d(np.arange(len(node.start)), fits, assume_unique=True)
    matrix = np.zeros((len(node.start), width), np.uint8)
    wide = matrix.view(f"V{width}")[:, 0]
    wide[fits] = window(node.pool, wide.dtype)[node.start[fits]]
    for row in rest.tolist():
        piece = node.pool[node.start[row] : node.start[row] + node.length[row]]
        matrix[row, : len(piece)] = piece
    for low in range(0, len(matrix), SMALL):
        part = slice(low, low + SMALL)
        matrix[part][np.arange(width) >= node.length[part, None]] = 0
    return matrix.view(f"S{width}")[:, 0]


def _sequences(node: Numbers) -> NDArray[np.generic]:
    native = node.dtype.newbyteorder("=")
    if _all_equal(node.count):
        shape = (len(node.count), int(node.count[0]) if len(node.count) else 0)
        values = joined(node.pool, node.start, node.count * node.dtype.itemsize).view(node.dtype).reshape(shape)
        return values.astype(native, copy=False)
    ends = node.start + node.count * node.dtype.itemsize
    rows = (
        np.frombuffer(node.pool[a:b].tobytes(), node.dtype).astype(native, copy=False)
        for a, b in zip(node.start.tolist(), ends.tolist(), strict=True)
    )
    return np.fromiter(rows, object, len(ends))


def _elements(field: Field, node: Elements) -> NDArray[np.generic]:
    total = int(node.count.sum())
    if total == 0:
        return np.zeros((len(node.count), field.length or 0), _empty_dtype(field))
    if isinstance(field.type, MessageType):
        flat: NDArray[np.generic] = assemble(field.type, node.tree, total)
    else:
        column = node.tree[("",)]
        assert isinstance(column, Texts)
        flat = texts(column)
    if _all_equal(node.count):
        return flat.reshape(len(node.count), -1)
    begin = starts(node.count)
    rows = (flat[a:b] for a, b in zip(begin.tolist(), (begin + node.count).tolist(), strict=True))
    return np.fromiter(rows, object, len(begin))


def _all_equal(count: Places) -> bool:
    return len(count) == 0 or bool((count == count[0]).all())
