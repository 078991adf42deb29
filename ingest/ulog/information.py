"""Keys with values: information ('I', 'M'), parameters ('P') and their defaults ('Q')."""

import struct
from collections.abc import Iterable, Mapping
from typing import Final, NamedTuple

NUMBERS: Final = {
    "int8_t": struct.Struct("<b"),
    "uint8_t": struct.Struct("<B"),
    "int16_t": struct.Struct("<h"),
    "uint16_t": struct.Struct("<H"),
    "int32_t": struct.Struct("<i"),
    "uint32_t": struct.Struct("<I"),
    "int64_t": struct.Struct("<q"),
    "uint64_t": struct.Struct("<Q"),
    "float": struct.Struct("<f"),
    "double": struct.Struct("<d"),
    "bool": struct.Struct("<?"),
    "char": struct.Struct("<c"),
}
DEFAULT_SETS: Final = {0: "system", 1: "setup"}
"""Bits of 'Q' -> whose default the value is."""

SHORT_BYTES: Final = 64
"""Bytes of a value that are shown; of a longer one only their count."""

Value = str | int | float | bytes


class Entry(NamedTuple):
    """A value by its key: ``order`` is the message's number in the log, ``flag`` the byte before the key, if any."""

    key: str
    value: Value
    order: int
    flag: int = 0


def entry(payload: bytes, order: int, flagged: bool) -> Entry | None:
    """The entry in a message's payload; None where its key or its value is none."""
    flag, at = (payload[0], 1) if flagged else (0, 0)
    begin = at + 1 + payload[at]
    kind, _, key = payload[at + 1 : begin].decode("utf-8", "ignore").partition(" ")
    number = NUMBERS.get(kind)
    if number is not None and key and len(payload) == begin + number.size:
        return Entry(key, number.unpack_from(payload, begin)[0], order, flag)
    if number is not None or not key:
        return None
    stored = payload[begin:]
    return Entry(key, text(stored) if kind.startswith("char[") else stored, order, flag)


def text(stored: bytes) -> str:
    """Text as PX4 writes it, without what is not UTF-8 and without the NULs of a buffer longer than it."""
    return stored.decode("utf-8", "ignore").rstrip("\0")


def single(entries: Iterable[Entry]) -> dict[str, Value]:
    """Key -> value of 'I' messages, the last one of each."""
    return {found.key: found.value for found in entries}


def multiple(entries: Iterable[Entry]) -> dict[str, list[list[Value]]]:
    """Key -> lists of values of 'M' messages: one that does not go on with the one before begins a list."""
    result: dict[str, list[list[Value]]] = {}
    for found in entries:
        lists = result.setdefault(found.key, [])
        if found.flag and lists:
            lists[-1].append(found.value)
        else:
            lists.append([found.value])
    return result


def defaults(entries: Iterable[Entry]) -> dict[str, float]:
    """``system.NAME`` and ``setup.NAME`` -> default value of 'Q' messages."""
    result = {}
    for found in entries:
        if isinstance(found.value, int | float):
            sets = (whose for bit, whose in DEFAULT_SETS.items() if found.flag >> bit & 1)
            result.update({f"{whose}.{found.key}": float(found.value) for whose in sets})
    return result


def printable(single_values: Mapping[str, Value], lists: Mapping[str, list[list[Value]]]) -> dict[str, str]:
    """All information as text, several lists of one key as ``key[1]``, ``key[2]``.

    Bytes are hexadecimal, of a long value only their count.
    """
    result = {key: _shown([value]) for key, value in single_values.items()}
    for key, values in lists.items():
        for number, part in enumerate(values):
            result[f"{key}[{number}]" if len(values) > 1 else key] = _shown(part)
    return result


def _shown(values: list[Value]) -> str:
    stored = [value for value in values if isinstance(value, bytes)]
    if stored:
        size = sum(map(len, stored))
        return stored[0].hex() if len(stored) == 1 and size <= SHORT_BYTES else f"{size} bytes"
    texts = [str(value) for value in values]
    # Lines come one by one, long texts in pieces that were cut anywhere.
    return ("" if any("\n" in part for part in texts) else "\n").join(texts)
