"""PX4's events in words, by the definitions that the log itself holds (libevents' JSON, compressed with xz)."""

import json
import lzma
import re
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

import orjson

from ...schemas import InputError

TYPES: Final = {
    "uint8_t": "B",
    "int8_t": "b",
    "uint16_t": "H",
    "int16_t": "h",
    "uint32_t": "I",
    "int32_t": "i",
    "uint64_t": "Q",
    "int64_t": "q",
    "float": "f",
}
MOST_BYTES: Final = 64_000_000
"""Definitions are about a megabyte; what unpacks to more is none."""
SHOWN_GROUP: Final = "default"
"""Events of other groups are parts of protocols between autopilot and ground station."""
PROFILE: Final = "dev"

_TOKEN: Final = re.compile(
    r"\\(?P<escaped>.)"
    r"|<(?P<tag>[a-z]+)(?: [a-z]+=\"(?P<option>[^\"]*)\")?>(?P<content>.*?)</(?P=tag)>"
    r"|\{(?P<number>\d+)(?::?(?:\.(?P<digits>\d+))?)?(?P<unit>m_v|m/s|m\^2|m|C)?\}",
    re.DOTALL,
)


@dataclass(frozen=True)
class Definitions:
    """Event number -> (namespace, group, definition), and enum by its full name."""

    events: Mapping[int, tuple[str, str, Mapping[str, Any]]]
    enums: Mapping[str, Mapping[str, Any]]

    def group(self, number: int) -> str | None:
        """The group of an event; None where it is not defined."""
        return self.events[number][1] if number in self.events else None

    def message(self, number: int, arguments: bytes) -> str | None:
        """An event in words; None where it is not defined, or its arguments are not what the definition says."""
        if number not in self.events:
            return None
        namespace, _, event = self.events[number]
        try:
            shown = list(self._arguments(namespace, event.get("arguments", ()), arguments))
            return _filled(str(event["message"]), shown).strip()
        except (KeyError, TypeError, ValueError, AttributeError, struct.error):
            return None

    def _arguments(self, namespace: str, defined: Sequence[Mapping[str, Any]], stored: bytes) -> Iterator[Any]:
        at = 0
        for argument in defined:
            name = str(argument["type"])
            enum = None if name in TYPES else self.enums[name if "::" in name else f"{namespace}::{name}"]
            code = struct.Struct("<" + TYPES[name if enum is None else str(enum["type"])])
            (value,) = code.unpack_from(stored, at)
            at += code.size
            yield value if enum is None else _entry(enum, value)


def _entry(enum: Mapping[str, Any], value: int) -> str:
    described = {int(number): str(entry["description"]) for number, entry in enum["entries"].items()}
    if not enum.get("is_bitfield"):
        return described.get(value, f"(unknown: {value})")
    bits = (1 << bit for bit in range(64) if value >> bit & 1)
    return str(enum.get("separator", "|")).join(described.get(bit, f"(unknown: {value})") for bit in bits)


def _filled(message: str, values: Sequence[Any]) -> str:
    """The message with its arguments, without its tags: those of links and parameters leave their content."""

    def replacement(match: re.Match[str]) -> str:
        if match["escaped"] is not None:
            return str(match["escaped"])
        if match["tag"] is not None:
            return _content(match["tag"], match["option"], match["content"], values)
        place = int(match["number"]) - 1
        if not 0 <= place < len(values):
            return match[0]
        value = values[place]
        shown = str(value) if match["digits"] is None else f"{value:.{int(match['digits'])}f}"
        unit = match["unit"]
        return f"{shown} {'m' if unit == 'm_v' else unit}" if unit else shown

    return _TOKEN.sub(replacement, message)


def _content(tag: str, option: str | None, content: str, values: Sequence[Any]) -> str:
    if tag in ("a", "param"):
        return content
    if tag != "profile" or option is None:
        return ""
    shown = option[1:] != PROFILE if option.startswith("!") else option == PROFILE
    return _filled(content, values) if shown else ""


@lru_cache(maxsize=4)
def definitions(compressed: bytes) -> Definitions:
    """Read definitions from their xz; InputError where they are none."""
    try:
        unpacked = lzma.LZMADecompressor().decompress(compressed, MOST_BYTES)
        components = orjson.loads(unpacked)["components"]
        events, enums = {}, {}
        for component, held in components.items():
            namespace = str(held["namespace"])
            for name, enum in held.get("enums", {}).items():
                enums[f"{namespace}::{name}"] = enum
            for group, listed in held.get("event_groups", {}).items():
                for number, event in listed.get("events", {}).items():
                    events[int(component) << 24 | int(number)] = (namespace, str(group), event)
    except (lzma.LZMAError, json.JSONDecodeError, KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"the log's event definitions cannot be read: {error}") from error
    return Definitions(events, enums)
