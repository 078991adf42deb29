"""A small writer of DataFlash logs, made from the format's description and sharing nothing with the reader."""

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from attlog.schemas import Columns, Ingested, Source
from attlog.schemas.passthrough import source_names

PACKED = {
    "n": "4s",
    "N": "16s",
    "Z": "64s",
    "a": "64s",
    "g": "e",
    "M": "B",
    "L": "i",
    "c": "h",
    "C": "H",
    "e": "i",
    "E": "I",
}


class Writer:
    """Appends definitions and records; ``pieces`` are the records' bytes, ``lines`` the same as text."""

    def __init__(self, *, describe_fmt: bool = True) -> None:
        self.pieces: list[bytes] = []
        self.lines: list[str] = []
        self.formats: dict[str, tuple[int, str, list[str]]] = {"FMT": (128, "BBnNZ", [])}
        if describe_fmt:
            self.define(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")

    def define(self, number: int, name: str, characters: str, columns: str) -> None:
        """A FMT record."""
        length = 3 + struct.calcsize("<" + packing(characters))
        self.formats[name] = (number, characters, columns.split(","))
        self._append("FMT", (number, length, name.encode(), characters.encode(), columns.encode()))

    def record(self, name: str, *values: Any) -> None:
        """A record of a defined type: stored values."""
        self._append(name, values)

    def _append(self, name: str, values: tuple[Any, ...]) -> None:
        number, characters, _ = self.formats[name]
        self.pieces.append(b"\xa3\x95" + bytes([number]) + struct.pack("<" + packing(characters), *values))
        self.lines.append(", ".join([name, *(written(c, v) for c, v in zip(characters, values, strict=True))]))

    @property
    def binary(self) -> bytes:
        return b"".join(self.pieces)

    @property
    def text(self) -> bytes:
        return "".join(line + "\r\n" for line in self.lines).encode()


def packing(characters: str) -> str:
    return "".join(PACKED.get(character, character) for character in characters)


def written(character: str, value: Any) -> str:
    """A stored value as ground stations write it into a text log."""
    if isinstance(value, bytes):
        return value.split(b"\0", 1)[0].decode("latin-1")
    if character in "cCeE":
        return f"{value / 100:.2f}"
    if character == "L":
        return f"{value / 1e7:.7f}"
    if character == "f":
        return repr(float(np.float32(value))) if np.isfinite(value) else str(float(value))
    return repr(value)


@pytest.fixture
def writer() -> type[Writer]:
    return Writer


@pytest.fixture
def flight(writer: type[Writer]) -> Callable[..., Writer]:
    """A log of one IMU at 50 Hz with GPS at 5 Hz and ATT at 10 Hz, ``seconds`` long from ``boot_s`` after boot."""

    def make(
        seconds: float = 4.0, boot_s: float = 10.0, utc_s: float | None = 1_000_000.0, log: Writer | None = None
    ) -> Writer:
        result = log or writer()
        define_flight(result)
        for k in range(round(seconds * 50)):
            time_us = round(boot_s * 1e6) + 20_000 * k
            result.record("IMU", time_us, 0, 0.1, -0.2, 0.3, 1.0, -2.0, -9.8)
            if k % 5 == 0:
                result.record("ATT", time_us, 1000, -500, 9000)
            if k % 10 == 0 and utc_s is not None:
                ms = round((utc_s + (time_us / 1e6)) * 1000) % 604_800_000
                result.record("GPS", time_us + 1000 * (k % 3), 3, ms, 2200, 473_000_000, 85_000_000, 43_000)
        return result

    return make


def define_flight(log: Writer) -> None:
    log.define(129, "PARM", "QNf", "TimeUS,Name,Value")
    log.define(130, "IMU", "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ")
    log.define(131, "GPS", "QBIHLLe", "TimeUS,Status,GMS,GWk,Lat,Lng,Alt")
    log.define(132, "ATT", "QccC", "TimeUS,Roll,Pitch,Yaw")
    log.define(133, "MSG", "QZ", "TimeUS,Message")


@pytest.fixture
def ingest() -> Callable[[bytes], Ingested]:
    """Bytes to columns."""
    from attlog.ingest import dataflash

    return lambda data: dataflash.read(Source("log.bin", np.frombuffer(data, np.uint8)))


@pytest.fixture
def by_topic() -> Callable[[Ingested], dict[str, Columns]]:
    return lambda ingested: {columns.channel.topic: columns for columns in ingested.columns}


Rows = dict[str, tuple[list[str], list[tuple[Any, ...]]]]


@pytest.fixture
def pymavlink_rows(tmp_path: Path) -> Callable[..., Rows]:
    """What pymavlink reads: type -> column names and rows of stored values (strings cut at their NUL)."""

    def rows(data: bytes, suffix: str = ".bin") -> Rows:
        from pymavlink import DFReader

        path = tmp_path / f"log{suffix}"
        path.write_bytes(data)
        reader = DFReader.DFReader_text if suffix == ".log" else DFReader.DFReader_binary
        result: Rows = {}
        with reader(str(path)) as log:
            while (message := log.recv_msg()) is not None:
                columns, found = result.setdefault(message.get_type(), (message.fmt.columns, []))
                assert columns == message.fmt.columns
                found.append(stored(message))
        return result

    return rows


def stored(message: Any) -> tuple[Any, ...]:
    characters = zip(message.fmt.columns, message.fmt.format, message._elements, strict=True)
    return tuple(getattr(message, name) if c in "nNZ" else value for name, c, value in characters)


@pytest.fixture
def assert_same() -> Callable[[Ingested, Rows], None]:
    """Every record and value of the one is in the other: bit-equal numbers, equal strings."""

    def check(ingested: Ingested, rows: Rows) -> None:
        passed = [c for c in ingested.columns if c.channel.topic.startswith("/dataflash/")]
        assert {c.channel.metadata["source"] for c in passed} == set(rows)
        assert len({c.channel.topic for c in passed}) == len(passed)
        assert sum(map(len, passed)) == sum(len(found) for _, found in rows.values()) == ingested.completeness.messages
        for columns in passed:
            compare(columns, *rows[columns.channel.metadata["source"]])

    return check


def compare(columns: Columns, names: list[str], rows: list[tuple[Any, ...]]) -> None:
    about = columns.channel.metadata
    if "instance" in about:
        place = names.index(about["instance_field"])
        rows = [row for row in rows if str(row[place]) == about["instance"]]
    assert len(rows) == len(columns), columns.channel.topic
    ours = source_names(columns.channel.type)
    assert list(ours) == [name for name in names if name]
    for position, name in enumerate(names):
        values = columns.data[ours[name]]
        expected = [row[position] for row in rows]
        if values.dtype.kind == "S":
            assert [value.decode() for value in values.tolist()] == expected
        elif expected and isinstance(expected[0], bytes):
            assert values.tobytes() == b"".join(expected)
        else:
            assert np.array(expected, values.dtype).tobytes() == values.tobytes(), (columns.channel.topic, name)
