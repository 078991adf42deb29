"""JSON messages to columns: the keys of all messages become fields, nested objects nested ones."""

import re
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from ..schemas.columns import Table
from ..schemas.definition import Field, MessageType
from .cdr import PayloadError
from .collect import Payloads


def read_json(name: str, payloads: Payloads) -> tuple[MessageType, Table]:
    """The type that fits all messages, and its columns; PayloadError for what is no JSON object.

    Numbers become float64 (absent: NaN) or int64, true and false bool, texts strings; equally long lists of numbers
    become subarrays. Whatever is of mixed kinds stays as JSON text.
    """
    raw = payloads.data.tobytes()
    pieces = [raw[a : a + n] for a, n in zip(payloads.start.tolist(), payloads.size.tolist(), strict=True)]
    rows = []
    for row, piece in enumerate(pieces):
        try:
            rows.append(orjson.loads(piece))
        except orjson.JSONDecodeError as error:
            raise PayloadError(row, f"not JSON: {error}") from error
    if not all(isinstance(row, dict) for row in rows):
        raise PayloadError(next(i for i, row in enumerate(rows) if not isinstance(row, dict)), "not a JSON object")
    return _objects(_type_name(name), rows)


def _objects(name: str, rows: list[Any]) -> tuple[MessageType, Table]:
    keys = list(dict.fromkeys(key for row in rows for key in row))
    fields, columns = [], {}
    for key, plain in zip(keys, _field_names(keys), strict=True):
        kind, length, values = _column(f"{name}{plain.title().replace('_', '')}", [row.get(key) for row in rows])
        fields.append(Field(plain, kind, length, key))
        columns[plain] = values
    dtype = np.dtype([(field, values.dtype, values.shape[1:]) for field, values in columns.items()])
    table = np.zeros(len(rows), dtype)
    for field, values in columns.items():
        table[field] = values
    return MessageType(name, tuple(fields)), table


def _column(name: str, values: list[Any]) -> tuple[str | MessageType, int | None, NDArray[Any]]:
    kinds = {type(value) for value in values}
    given = kinds - {type(None)}
    if given == {dict}:
        message, table = _objects(name, [value or {} for value in values])
        return message, None, table
    if given == {bool}:
        return "bool", None, np.array([bool(value) for value in values])
    if kinds == {int} and min(values) >= -(2**63) and max(values) < 2**63:
        return "int64", None, np.array(values, np.int64)
    if given and given <= {int, float}:
        return "float64", None, np.array([np.nan if value is None else float(value) for value in values])
    if kinds == {list}:
        return _lists(values)
    return _text(values)


def _lists(values: list[Any]) -> tuple[str, int | None, NDArray[Any]]:
    items = {type(item) for value in values for item in value}
    if not items <= {int, float}:
        return _text(values)
    lengths = {len(value) for value in values}
    if len(lengths) == 1:
        return "float64", 0, np.array(values, np.float64).reshape(len(values), lengths.pop())
    return "float64", 0, np.fromiter((np.array(value, np.float64) for value in values), object, len(values))


def _text(values: list[Any]) -> tuple[str, int | None, NDArray[Any]]:
    texts = ("" if v is None else v if isinstance(v, str) else orjson.dumps(v).decode() for v in values)
    return "string", None, np.fromiter((text.encode() for text in texts), object, len(values))


def _type_name(name: str) -> str:
    words = re.findall(r"[A-Za-z0-9]+", name) or ["Object"]
    camel = "".join(word[:1].upper() + word[1:] for word in words)
    return f"json_msgs/msg/{camel if camel[0].isalpha() else f'M{camel}'}"


def _field_names(keys: list[str]) -> list[str]:
    """The keys as they are where they can be field names, else made so; distinct."""
    taken: set[str] = set()
    result = []
    for key in keys:
        plain = re.sub(r"_+", "_", re.sub(r"\W", "_", key, flags=re.ASCII)).strip("_") or "f"
        plain = plain if plain[0].isalpha() else f"f{plain}"
        unique, number = plain, 2
        while unique in taken:
            unique, number = f"{plain}_{number}", number + 1
        taken.add(unique)
        result.append(unique)
    return result
