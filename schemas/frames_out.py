"""Columns as numpy, Arrow and pandas tables, flat, with units and what made the channel."""

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .columns import Columns
from .flat import TIME, FlatColumn, flat

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa


def to_numpy(columns: Columns) -> NDArray[np.void]:
    """A structured array (n,) with the flat names (``table["angular_velocity.x"]``); ``time_ns`` comes first."""
    parts = flat(columns)
    table = np.empty(len(columns), np.dtype([(p.name, p.values.dtype, p.values.shape[1:]) for p in parts]))
    for part in parts:
        table[part.name] = part.values
    return table


def to_pandas(columns: Columns) -> "pd.DataFrame":
    """A frame with the flat names; its index is ``time_ns``, ``frame.attrs`` holds units, topic, type, metadata."""
    import pandas as pd

    parts = flat(columns)
    data = {part.name: _series(part) for part in parts[1:]}
    frame = pd.DataFrame(data, index=pd.Index(parts[0].values, name=TIME))
    frame.attrs.update(_about(columns), units={part.name: part.unit for part in parts if part.unit})
    return frame


def to_arrow(columns: Columns, provenance: Mapping[str, str] | None = None) -> "pa.Table":
    """A table with the flat names. Each field's metadata has its ``unit``, the schema's the topic, the type, the
    channel's metadata (JSON) and ``provenance``, all under ``attlog.…``."""
    return arrow_table(flat(columns), {**_about(columns), **(provenance or {})})


def arrow_table(
    parts: Sequence[FlatColumn], about: Mapping[str, Any], known: NDArray[np.bool_] | None = None
) -> "pa.Table":
    """Flat columns as a table; where ``known`` (n,) is False, everything but the time is null."""
    import pyarrow as pa

    arrays, fields = [], []
    picked = None if known is None else pa.array(np.arange(len(known)), pa.int64(), mask=~known)
    for part in parts:
        array = _array(part)
        if picked is not None and part.name != TIME:
            array = array.take(picked)
        arrays.append(array)
        fields.append(pa.field(part.name, array.type, metadata={"unit": part.unit} if part.unit else None))
    metadata: dict[bytes | str, bytes | str]
    metadata = {f"attlog.{key}": value if isinstance(value, str) else json.dumps(value) for key, value in about.items()}
    return pa.table(arrays, schema=pa.schema(fields, metadata=metadata))


def _about(columns: Columns) -> dict[str, Any]:
    channel = columns.channel
    return {"topic": channel.topic, "type": channel.type.name, "channel": dict(channel.metadata)}


def _array(part: FlatColumn) -> Any:
    import pyarrow as pa

    values = part.values
    if values.ndim == 2:
        inner = _array(FlatColumn(part.name, values.reshape(-1), part.unit, part.text))
        return pa.FixedSizeListArray.from_arrays(inner, values.shape[1])
    if values.dtype == object:
        return pa.array([_plain(value, part.text) for value in values])
    if values.dtype.kind == "S":
        if len(values) and part.text and bool((values == values[0]).all()):
            return pa.repeat(pa.scalar(_text(bytes(values[0])), pa.string()), len(values))
        texts = values.tolist()
        return pa.array([_text(value) for value in texts], pa.string()) if part.text else pa.array(texts, pa.binary())
    return pa.array(values)


def _series(part: FlatColumn) -> Any:
    if part.values.ndim == 2 or part.values.dtype == object or part.values.dtype.kind == "S":
        return [_plain(value, part.text) for value in part.values]
    return part.values


def _plain(value: Any, text: bool) -> Any:
    """One value as Python has it: text, bytes, a list of numbers, or JSON of a list of messages."""
    if isinstance(value, bytes):
        return _text(value) if text else value
    if isinstance(value, np.ndarray):
        if value.dtype.names:
            return json.dumps([_row(item) for item in value])
        return [_plain(item, text) for item in value.tolist()]
    return value.item() if isinstance(value, np.generic) else value


def _row(item: Any) -> Any:
    if isinstance(item, np.void) and item.dtype.names:
        return {name: _row(item[name]) for name in item.dtype.names}
    if isinstance(item, np.ndarray):
        return [_row(each) for each in item]
    plain = item.item() if isinstance(item, np.generic) else item
    return _text(plain) if isinstance(plain, bytes) else plain


def _text(value: bytes) -> str:
    return value.decode("utf-8", "replace")
