"""One structured array to a tree of columns: the way back from `assemble`."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..schemas.columns import Columns
from ..schemas.definition import PRIMITIVES, TEXT_TYPES, Field, MessageType
from ..schemas.errors import StorageError
from .ragged import Places, starts
from .steps import Elements, Names, Numbers, Texts, Tree

LAST_SECOND = 2**31 - 1


def disassemble(columns: Columns) -> Tree:
    """Every field of the channel's type: from the data, else from stamps and texts, else zero."""
    message = columns.channel.type
    tree: Tree = {}
    for field in message.fields:
        if field.name in (columns.data.dtype.names or ()):
            _take(field, columns.data[field.name], (field.name,), tree)
        else:
            _default(field, (field.name,), len(columns), columns.channel.texts, tree)
    stamp = stamp_path(message)
    if stamp and stamp[0] not in (columns.data.dtype.names or ()):
        tree[(*stamp, "sec")], tree[(*stamp, "nanosec")] = stamps(columns.time_ns)
    return tree


def stamp_path(message: MessageType) -> Names:
    """Where the message's own time is: in the standard header, or a Time of its own, as first field; else ()."""
    first = message.fields[0] if message.fields else None
    if first is None or first.length is not None:
        return ()
    if first.type_name == "std_msgs/Header":
        return (first.name, "stamp")
    return (first.name,) if first.name == "stamp" and first.type_name == "builtin_interfaces/Time" else ()


def stamps(time_ns: NDArray[np.int64]) -> tuple[NDArray[np.int32], NDArray[np.uint32]]:
    """Seconds and nanoseconds of ROS 2's Time, whose seconds end in 2038 (later times keep its last second)."""
    seconds = time_ns // 1_000_000_000
    nanoseconds = time_ns - seconds * 1_000_000_000
    if len(seconds) and int(seconds.max()) > LAST_SECOND:
        seconds = np.minimum(seconds, LAST_SECOND)
    return seconds.astype(np.int32), nanoseconds.astype(np.uint32)


def _take(field: Field, values: NDArray[Any], path: Names, tree: Tree) -> None:
    if field.length is not None and (isinstance(field.type, MessageType) or field.type in TEXT_TYPES):
        tree[path] = _elements(field, values, path)
    elif isinstance(field.type, MessageType):
        for inner in field.type.fields:
            if inner.name in (values.dtype.names or ()):
                _take(inner, values[inner.name], (*path, inner.name), tree)
            else:
                _default(inner, (*path, inner.name), len(values), {}, tree)
    elif field.type in TEXT_TYPES:
        tree[path] = texts_of(values)
    elif field.length == 0:
        tree[path] = _numbers(field.type, values)
    else:
        tree[path] = np.asarray(values)


def _default(field: Field, path: Names, count: int, texts: Mapping[str, str], tree: Tree) -> None:
    zero = np.zeros(count, np.int64)
    if field.length is not None and (isinstance(field.type, MessageType) or field.type in TEXT_TYPES):
        length = field.length
        inner = _no_elements(field, count * length)
        tree[path] = Elements(np.full(count, length, np.int64), inner)
    elif isinstance(field.type, MessageType):
        for part in field.type.fields:
            _default(part, (*path, part.name), count, texts, tree)
    elif field.type in TEXT_TYPES:
        pool = np.frombuffer(texts.get(".".join(path), "").encode(), np.uint8)
        tree[path] = Texts(pool, zero, np.full(count, len(pool), np.int64))
    elif field.length == 0:
        tree[path] = Numbers(np.zeros(0, np.uint8), zero, zero, np.dtype(PRIMITIVES[field.type]))
    else:
        tree[path] = np.zeros((count, field.length) if field.length else count, PRIMITIVES[field.type])


def _no_elements(field: Field, count: int) -> Tree:
    inner: Tree = {}
    if isinstance(field.type, MessageType):
        for part in field.type.fields:
            _default(part, (part.name,), count, {}, inner)
    else:
        zero = np.zeros(count, np.int64)
        inner[("",)] = Texts(np.zeros(0, np.uint8), zero, zero)
    return inner


def _elements(field: Field, values: NDArray[Any], path: Names) -> Elements:
    if values.dtype == object and values.ndim == 1 and not _is_text(field, values):
        count = np.fromiter((len(row) for row in values), np.int64, len(values))
        rows = [np.asarray(row) for row in values if len(row)]
        flat = np.concatenate(rows) if rows else _empty(field)
    else:
        count = np.full(len(values), values.shape[1], np.int64)
        flat = values.reshape(-1)
    if field.length and (count != field.length).any():
        raise StorageError(f"{'.'.join(path)}: an array of {field.length} elements was given another number of them")
    if not isinstance(field.type, MessageType):
        return Elements(count, {("",): texts_of(flat)})
    inner: Tree = {}
    for part in field.type.fields:
        if part.name in (flat.dtype.names or ()):
            _take(part, flat[part.name], (part.name,), inner)
        else:
            _default(part, (part.name,), len(flat), {}, inner)
    return Elements(count, inner)


def _is_text(field: Field, values: NDArray[Any]) -> bool:
    return field.length is None and field.type in TEXT_TYPES


def _empty(field: Field) -> NDArray[Any]:
    return np.zeros(0, field.type.dtype() if isinstance(field.type, MessageType) else "S1")


def _numbers(primitive: str, values: NDArray[Any]) -> Numbers:
    dtype = np.dtype(PRIMITIVES[primitive])
    if values.dtype == object:
        count = np.fromiter((len(row) for row in values), np.int64, len(values))
        rows = [np.asarray(row, dtype) for row in values]
        flat = np.concatenate(rows) if rows else np.zeros(0, dtype)
    else:
        count = np.full(len(values), values.shape[1] if values.ndim > 1 else 0, np.int64)
        flat = np.ascontiguousarray(values, dtype).reshape(-1)
    return Numbers(flat.view(np.uint8), starts(count) * dtype.itemsize, count, dtype)


def texts_of(values: NDArray[Any]) -> Texts:
    """Strings from ``S{n}``, ``U{n}`` or objects (bytes or str)."""
    if values.dtype.kind == "U":
        values = np.strings.encode(values, "utf-8")
    if values.dtype.kind == "S":
        width = values.dtype.itemsize
        pool = np.ascontiguousarray(values).view(np.uint8).reshape(-1)
        length: Places = np.strings.str_len(values).astype(np.int64)
        return Texts(pool, np.arange(len(values), dtype=np.int64) * width, length)
    pieces = [piece.encode() if isinstance(piece, str) else bytes(piece) for piece in values.tolist()]
    lengths = np.fromiter(map(len, pieces), np.int64, len(pieces))
    return Texts(np.frombuffer(b"".join(pieces), np.uint8), starts(lengths), lengths)
