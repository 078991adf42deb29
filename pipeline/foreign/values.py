"""The columns of other people's channels as vectors, quaternions, stamps and frames, whatever their encoding."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from ...schemas.columns import Columns, Time
from ...schemas.recording import Floats

SECONDS = ("sec", "secs")
NANOSECONDS = ("nanosec", "nsec", "nsecs")


def at(values: NDArray[Any], path: Sequence[str]) -> NDArray[Any]:
    """A nested field; KeyError where there is none."""
    for name in path:
        if name not in (values.dtype.names or ()):
            raise KeyError(name)
        values = values[name]
    return values


def components(values: NDArray[Any], axes: str) -> Floats:
    """The fields named by the letters of ``axes`` as one array (n, k), in whatever order the message has them."""
    return np.stack([np.asarray(at(values, (axis,)), dtype=np.float64) for axis in axes], axis=-1)


def stamps(values: NDArray[Any]) -> Time | None:
    """Nanoseconds of ``header.stamp`` or ``timestamp`` (n,); None where there is none, or not every message has one."""
    for path in (("header", "stamp"), ("timestamp",)):
        try:
            stamp = at(values, path)
            seconds, nanoseconds = (
                np.asarray(at(stamp, (_first(stamp, names),)), dtype=np.int64) for names in (SECONDS, NANOSECONDS)
            )
        except (KeyError, ValueError):
            continue
        time_ns = seconds * 1_000_000_000 + nanoseconds
        return time_ns if len(time_ns) and bool((time_ns > 0).all()) else None
    return None


def _first(stamp: NDArray[Any], names: Sequence[str]) -> str:
    return next((name for name in names if name in (stamp.dtype.names or ())), "")


def frame(values: NDArray[Any], path: Sequence[str]) -> str:
    """The name of a frame in the first message; empty where there is none."""
    try:
        return _text(at(values, path)[0])
    except (KeyError, IndexError):
        return ""


def parent(values: NDArray[Any]) -> str:
    """The frame that a message's values are in."""
    paths = (("header", "frame_id"), ("frame_id",), ("parent_frame_id",))
    return next((name for path in paths if (name := frame(values, path))), "")


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


@dataclass(frozen=True, eq=False)
class Transforms:
    """Every transform of a channel by (parent, child): log times and stamps (n,), rotations (n, 4)."""

    pairs: dict[tuple[str, str], tuple[Time, Time | None, Floats]]


def transforms(columns: Columns, rotation: Sequence[str]) -> Transforms:
    """The transforms of a TFMessage or FrameTransforms channel; KeyError where it has none."""
    row, values = _elements(at(columns.data, ("transforms",)))
    parents = _names(values, (("header", "frame_id"), ("parent_frame_id",)))
    children = _names(values, (("child_frame_id",),))
    turned, stamped = components(at(values, rotation), "xyzw"), stamps(values)
    pairs = {}
    for pair in dict.fromkeys(zip(parents.tolist(), children.tolist(), strict=True)):
        mask = (parents == pair[0]) & (children == pair[1])
        pairs[pair] = columns.time_ns[row[mask]], None if stamped is None else stamped[mask], turned[mask]
    return Transforms(pairs)


def _names(values: NDArray[Any], paths: Sequence[Sequence[str]]) -> NDArray[np.object_]:
    for path in paths:
        try:
            found = at(values, path)
        except KeyError:
            continue
        return np.array([_text(name) for name in found.tolist()], dtype=object)
    raise KeyError(paths[0][-1])


def _elements(values: NDArray[Any]) -> tuple[NDArray[np.intp], NDArray[Any]]:
    """The elements of each row's sequence in one array, with their rows."""
    if values.dtype != object:
        count = values.shape[1]
        return np.repeat(np.arange(len(values)), count), values.reshape(-1)
    parts = [_parsed(value) if isinstance(value, bytes) else value for value in values]
    row = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    filled = [part for part in parts if len(part)]
    if not filled:
        raise KeyError("transforms")
    return row, np.concatenate(filled)


def _parsed(text: bytes) -> NDArray[Any]:
    """A JSON list of objects as a structured array; empty where it is none."""
    rows = orjson.loads(text) if text else []
    if not isinstance(rows, list) or not all(isinstance(item, dict) for item in rows) or not rows:
        return np.zeros(0, [("x", "f8")])
    names = [list(_leaves(item)) for item in rows]
    dtype = _dtype(names[0])
    table = np.zeros(len(rows), dtype)
    for number, item in enumerate(names):
        for path, value in item:
            _put(table[number : number + 1], path, value)
    return table


def _leaves(item: dict[str, Any], path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    for name, value in item.items():
        if isinstance(value, dict):
            yield from _leaves(value, (*path, name))
        elif isinstance(value, int | float | str):
            yield (*path, name), value


def _dtype(leaves: Sequence[tuple[tuple[str, ...], Any]]) -> "np.dtype[np.void]":
    nested: dict[str, list[tuple[tuple[str, ...], Any]]] = {}
    for path, value in leaves:
        nested.setdefault(path[0], []).append((path[1:], value))
    fields: list[tuple[str, Any]] = []
    for name, inner in nested.items():
        value = inner[0][1]
        leaf = "O" if isinstance(value, str) else "i8" if name in (*SECONDS, *NANOSECONDS) else "f8"
        fields.append((name, leaf if inner[0][0] == () else _dtype(inner)))
    return np.dtype(fields)


def _put(table: NDArray[Any], path: Sequence[str], value: Any) -> None:
    for name in path:
        if name not in (table.dtype.names or ()):
            return
        table = table[name]
    table[0] = value
