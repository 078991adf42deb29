"""A ULog writer of the tests' own, made from the format's specification, and ways to look at what was read."""

import re
import struct
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from attlog.ingest import ulog
from attlog.schemas import Columns, Ingested, Source
from attlog.schemas.passthrough import source_names

CODES = {
    "int8_t": "b",
    "uint8_t": "B",
    "int16_t": "h",
    "uint16_t": "H",
    "int32_t": "i",
    "uint32_t": "I",
    "int64_t": "q",
    "uint64_t": "Q",
    "float": "f",
    "double": "d",
    "bool": "?",
    "char": "c",
}


class Writer:
    """Appends messages to a log in memory."""

    def __init__(self, start_us: int = 0, flags: bytes | None = None, version: int = 1) -> None:
        self.content = bytearray(b"ULog\x01\x12\x35" + bytes([version]) + struct.pack("<Q", start_us))
        if flags is not None:
            self.message("B", flags)

    def message(self, letter: str, payload: bytes) -> "Writer":
        self.content += struct.pack("<HB", len(payload), ord(letter)) + payload
        return self

    def format(self, text: str) -> "Writer":
        return self.message("F", text.encode())

    def add(self, number: int, topic: str, multi_id: int = 0) -> "Writer":
        return self.message("A", struct.pack("<BH", multi_id, number) + topic.encode())

    def remove(self, number: int) -> "Writer":
        return self.message("R", struct.pack("<H", number))

    def data(self, number: int, codes: str, *values: Any) -> "Writer":
        return self.message("D", struct.pack("<H", number) + struct.pack("<" + codes, *values))

    def value(self, letter: str, kind: str, key: str, value: Any, before: bytes = b"") -> "Writer":
        named = f"{kind} {key}".encode()
        stored = value if isinstance(value, bytes) else struct.pack("<" + CODES[kind], value)
        return self.message(letter, before + bytes([len(named)]) + named + stored)

    def parameter(self, name: str, value: float) -> "Writer":
        return self.value("P", "int32_t" if isinstance(value, int) else "float", name, value)

    def default(self, name: str, value: float, bits: int) -> "Writer":
        return self.value("Q", "int32_t" if isinstance(value, int) else "float", name, value, bytes([bits]))

    def info(self, key: str, said: str) -> "Writer":
        return self.value("I", f"char[{len(said.encode())}]", key, said.encode())

    def lines(self, key: str, *said: bytes, kind: str = "char") -> "Writer":
        for number, line in enumerate(said):
            self.value("M", f"{kind}[{len(line)}]", key, line, bytes([number > 0]))
        return self

    def say(self, text: str, time_us: int, level: int = 6, tag: int | None = None) -> "Writer":
        tagged = b"" if tag is None else struct.pack("<H", tag)
        payload = bytes([ord("0") + level]) + tagged + struct.pack("<Q", time_us) + text.encode()
        return self.message("L" if tag is None else "C", payload)

    def sync(self) -> "Writer":
        return self.message("S", b"\x2f\x73\x13\x20\x25\x0c\xbb\x12")

    def dropout(self, milliseconds: int) -> "Writer":
        return self.message("O", struct.pack("<H", milliseconds))

    def __bytes__(self) -> bytes:
        return bytes(self.content)


@pytest.fixture(scope="session")
def writer() -> type[Writer]:
    """A fresh log: ``writer(start_us)``."""
    return Writer


@pytest.fixture(scope="session")
def ingest() -> Callable[[Any], Ingested]:
    """Read a log that is bytes, a `Writer` or a path."""

    def call(log: Any) -> Ingested:
        if isinstance(log, Path):
            return ulog.read(Source.from_path(log))
        return ulog.read(Source("flight.ulg", np.frombuffer(bytes(log), np.uint8)))

    return call


@pytest.fixture(scope="session")
def channels() -> Callable[[Ingested], Mapping[str, Columns]]:
    """The columns by topic."""

    def call(ingested: Ingested) -> Mapping[str, Columns]:
        found = {columns.channel.topic: columns for columns in ingested.columns}
        assert len(found) == len(ingested.columns), "two channels on one topic"
        return found

    return call


@pytest.fixture(scope="session")
def flattened() -> Callable[[Columns], dict[str, np.ndarray[Any, Any]]]:
    """Pass-through columns under pyulog's names, one for each element of an array; text as bytes."""

    def call(columns: Columns) -> dict[str, np.ndarray[Any, Any]]:
        result = {}
        for source, ros in source_names(columns.channel.type).items():
            values = columns[ros]
            if values.ndim == 1:
                result[source] = values
            else:
                result |= {f"{source}[{i}]": values[:, i] for i in range(values.shape[1])}
        return result

    return call


@pytest.fixture(scope="session")
def assert_equals_pyulog(
    channels: Callable[[Ingested], Mapping[str, Columns]], flattened: Callable[[Columns], dict[str, Any]]
) -> Callable[[Ingested, Any], None]:
    """Every topic, instance, count, field and value is pyulog's, and nothing else is there."""

    def call(ours: Ingested, theirs: Any) -> None:
        passed = {topic: c for topic, c in channels(ours).items() if topic.startswith("/ulog/")}
        assert set(passed) == {f"/ulog/{data.name}/{data.multi_id}" for data in theirs.data_list}
        for data in theirs.data_list:
            columns = passed[f"/ulog/{data.name}/{data.multi_id}"]
            assert len(columns) == len(data.data[data.field_data[0].field_name])
            _assert_same(flattened(columns), data.data)

    return call


def _assert_same(ours: dict[str, Any], theirs: dict[str, Any]) -> None:
    texts = {name for name, values in ours.items() if values.dtype.kind == "S"}
    numbers = {name: values for name, values in theirs.items() if re.sub(r"\[\d+\]$", "", name) not in texts}
    assert set(numbers) == set(ours) - texts
    for name, values in numbers.items():
        assert ours[name].dtype.itemsize == values.dtype.itemsize, name
        assert np.ascontiguousarray(ours[name]).tobytes() == np.ascontiguousarray(values).tobytes(), name
    for name in texts:
        width = max(int(key[len(name) + 1 : -1]) for key in theirs if key.startswith(f"{name}[")) + 1
        rows = np.stack([theirs[f"{name}[{i}]"] for i in range(width)], axis=1).astype(np.uint8)
        assert [bytes(row).split(b"\0")[0] for row in rows] == [bytes(value) for value in ours[name]], name
