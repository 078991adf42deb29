"""Helpers as fixtures: plain Python values to columns and back, random message types, small logs."""

import string
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from zlib import crc32

import numpy as np
import pytest
from hypothesis import strategies as st

from attlog.schemas import Channel, Columns, Field, MessageType
from attlog.schemas.definition import PRIMITIVES, TEXT_TYPES
from attlog.schemas.messages import LOG
from attlog.schemas.unified import imu_columns, mag_columns

START_NS = 1_700_000_000_000_000_000
RANGES = {"byte": (0, 127), "char": (0, 127)}
"""Other libraries disagree about the sign of these two."""


def _column(field: Field, values: list[Any]) -> np.ndarray:
    """The column of a field from plain values (dict, list, str, number), row after row."""
    if field.length is None:
        return _flat(field.type, values)
    if field.length:
        rows = [_flat(field.type, row) for row in values]
        return np.stack(rows) if rows else np.zeros((0, field.length), _dtype(field.type))
    return np.fromiter((_flat(field.type, row) for row in values), object, len(values))


def _flat(kind: str | MessageType, values: list[Any]) -> np.ndarray:
    if isinstance(kind, MessageType):
        return _table(kind, values)
    if kind in TEXT_TYPES:
        return np.fromiter((value.encode() for value in values), object, len(values))
    return np.array(values, PRIMITIVES[kind])


def _dtype(kind: str | MessageType) -> np.dtype:
    return _flat(kind, []).dtype


def _table(kind: MessageType, rows: list[dict[str, Any]]) -> np.ndarray:
    columns = {field.name: _column(field, [row[field.name] for row in rows]) for field in kind.fields}
    table = np.zeros(len(rows), [(name, values.dtype, values.shape[1:]) for name, values in columns.items()])
    for name, values in columns.items():
        table[name] = values
    return table


def _plain(kind: MessageType, row: Any) -> dict[str, Any]:
    """The plain values of one row of columns that were read, or of a message that another library decoded."""
    return {field.name: _plain_field(field, _get(row, field.name)) for field in kind.fields}


def _get(row: Any, name: str) -> Any:
    return row[name] if isinstance(row, np.void) else getattr(row, name)


def _plain_field(field: Field, value: Any) -> Any:
    if field.length is None:
        return _plain_one(field.type, value)
    return [_plain_one(field.type, item) for item in value]


def _plain_one(kind: str | MessageType, value: Any) -> Any:
    if isinstance(kind, MessageType):
        return _plain(kind, value)
    if kind in TEXT_TYPES:
        return value.decode() if isinstance(value, bytes) else str(value)
    if kind in ("float32", "float64"):
        return float(value)
    return bool(value) if kind == "bool" else int(value)


def _object(kind: MessageType, row: dict[str, Any]) -> SimpleNamespace:
    """A message as other libraries take it."""
    return SimpleNamespace(**{field.name: _object_field(field, row[field.name]) for field in kind.fields})


def _object_field(field: Field, value: Any) -> Any:
    if not isinstance(field.type, MessageType):
        return value
    return _object(field.type, value) if field.length is None else [_object(field.type, item) for item in value]


@pytest.fixture(scope="session")
def table_of() -> Callable[[MessageType, list[dict[str, Any]]], np.ndarray]:
    """Plain rows -> structured array."""
    return _table


@pytest.fixture(scope="session")
def plain() -> Callable[[MessageType, Any], dict[str, Any]]:
    """Structured row or decoded message -> plain values."""
    return _plain


@pytest.fixture(scope="session")
def message_object() -> Callable[[MessageType, dict[str, Any]], SimpleNamespace]:
    """Plain values -> message object."""
    return _object


def _message_types(depth: int, label: str) -> st.SearchStrategy[MessageType]:
    kinds: st.SearchStrategy[Any] = st.sampled_from([*sorted(PRIMITIVES), "string"])
    if depth:
        kinds = kinds | _message_types(depth - 1, f"{label}{depth}")
    lengths = st.sampled_from([None, None, 0, 1, 2, 3])
    fields = st.lists(st.tuples(kinds, lengths), min_size=1, max_size=5)
    # names within one message must be distinct, and one name must mean one type within the whole
    return fields.map(
        lambda parts: MessageType(
            f"test_msgs/msg/{label}{crc32(repr(parts).encode())}",
            tuple(Field(f"f{number}", kind, length) for number, (kind, length) in enumerate(parts)),
        )
    )


def _values(kind: str | MessageType) -> st.SearchStrategy[Any]:
    if isinstance(kind, MessageType):
        return st.fixed_dictionaries({field.name: _field_values(field) for field in kind.fields})
    if kind == "string":
        return st.text(string.ascii_letters + " äß€", max_size=9)
    if kind == "bool":
        return st.booleans()
    if kind in ("float32", "float64"):
        return st.floats(allow_nan=False, width=int(kind[5:]))
    bits = int("".join(c for c in kind if c.isdigit()) or 8)
    signed = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    low, high = RANGES.get(kind, (0, 2**bits - 1) if kind.startswith("u") else signed)
    return st.integers(low, high)


def _field_values(field: Field) -> st.SearchStrategy[Any]:
    if field.length is None:
        return _values(field.type)
    low, high = (field.length, field.length) if field.length else (0, 3)
    return st.lists(_values(field.type), min_size=low, max_size=high)


@pytest.fixture(scope="session")
def typed_rows() -> st.SearchStrategy[tuple[MessageType, list[dict[str, Any]]]]:
    """Random message types with some rows of values."""
    return _message_types(2, "T").flatmap(
        lambda kind: st.tuples(st.just(kind), st.lists(_values(kind), min_size=1, max_size=6))
    )


@pytest.fixture
def imu() -> Columns:
    """5,000 samples at 1 kHz, distinguishable."""
    count = np.arange(5000)
    rate = count[:, None] * np.array([1e-3, 2e-3, 3e-3])
    return imu_columns("/imu0/data_raw", START_NS + count * 1_000_000, rate, rate + 9.81, source="test")


@pytest.fixture
def mag() -> Columns:
    """1,250 samples at 250 Hz."""
    count = np.arange(1250)
    field = count[:, None] * np.array([1e-6, 2e-6, 3e-6])
    return mag_columns("/mag0/field", START_NS + count * 4_000_000 + 7, field, source="test")


@pytest.fixture
def notes() -> Columns:
    """Texts of different lengths, one of them empty."""
    texts = [f"note {'x' * (number % 7)}" for number in range(50)] + [""]
    data = np.zeros(len(texts), [("level", "u1"), ("msg", "S16")])
    data["msg"] = [text.encode() for text in texts]
    data["level"] = 20
    time_ns = START_NS + np.arange(len(texts)) * 90_000_000
    return Columns(Channel("/annotations", LOG, {"source": "test"}, {"name": "attlog"}), time_ns, data)


@pytest.fixture
def log_path(tmp_path: Path) -> Path:
    """Where a test writes its file."""
    return tmp_path / "log.mcap"
