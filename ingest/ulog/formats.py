"""What a topic's fields are: the texts of 'F' messages, nested types flattened as pyulog does."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Final

import numpy as np

from ...schemas.definition import MessageType
from ...schemas.passthrough import SourceField, generated_type

PACKAGE: Final = "ulog_msgs"

C_TYPES: Final = {
    "int8_t": ("int8", "i1"),
    "uint8_t": ("uint8", "u1"),
    "int16_t": ("int16", "<i2"),
    "uint16_t": ("uint16", "<u2"),
    "int32_t": ("int32", "<i4"),
    "uint32_t": ("uint32", "<u4"),
    "int64_t": ("int64", "<i8"),
    "uint64_t": ("uint64", "<u8"),
    "float": ("float32", "<f4"),
    "double": ("float64", "<f8"),
    "bool": ("bool", "?"),
    "char": ("char", "u1"),
}
"""ULog type -> (ROS primitive, numpy type code)."""

PADDING: Final = "_padding"
MOST_BYTES: Final = 0xFFFF - 2
"""A message's size has 16 bits, its subscription's number two bytes."""

_FIELD: Final = re.compile(r"(?P<type>[^\s\[\]]+)(?:\[(?P<length>\d{1,5})\])? (?P<name>[^ ]+)(?: .*)?", re.DOTALL)
_UNPRINTABLE: Final = re.compile(r"[^\x21-\x7e]")


@dataclass(frozen=True)
class Leaf:
    """A column: pyulog's flattened name without the number of an array's element, ULog type, length or None."""

    name: str
    c_type: str
    length: int | None

    @property
    def is_text(self) -> bool:
        """Whether the field is ``char[n]``."""
        return self.c_type == "char" and self.length is not None

    @property
    def column(self) -> tuple[str, tuple[int, ...]]:
        """numpy type code and shape."""
        if self.is_text:
            return f"S{self.length}", ()
        return C_TYPES[self.c_type][1], (() if self.length is None else (self.length,))

    @property
    def size(self) -> int:
        """Bytes."""
        return np.dtype(C_TYPES[self.c_type][1]).itemsize * (self.length or 1)


@dataclass(frozen=True, eq=False)
class Definition:
    """A topic's message: columns without the padding at its end, which ``padding`` counts in bytes."""

    name: str
    leaves: tuple[Leaf, ...]
    padding: int

    @cached_property
    def type(self) -> MessageType:
        """The generated ROS type; the comment of a field is pyulog's name of it (``q``, ``esc[0].esc_rpm``)."""
        return self.type_named(self.name)

    def type_named(self, name: str) -> MessageType:
        """The generated ROS type under the name of ``name`` in CamelCase."""
        fields = [
            SourceField(
                leaf.name,
                "string" if leaf.is_text else C_TYPES[leaf.c_type][0],
                None if leaf.is_text else leaf.length,
            )
            for leaf in self.leaves
        ]
        return generated_type(PACKAGE, name, fields)

    @cached_property
    def names(self) -> Mapping[str, str]:
        """pyulog's name -> ROS name."""
        ros = (field.name for field in self.type.fields[1:])
        return {leaf.name: name for leaf, name in zip(self.leaves, ros, strict=True)}

    @cached_property
    def row(self) -> "np.dtype[np.void]":
        """A message's bytes as stored, under the ROS names of `type`."""
        ros = (field.name for field in self.type.fields[1:])
        return np.dtype([(name, *leaf.column) for name, leaf in zip(ros, self.leaves, strict=True)])

    @cached_property
    def texts(self) -> list[str]:
        """ROS names of the columns that are ``char[n]``."""
        return [field.name for field, leaf in zip(self.type.fields[1:], self.leaves, strict=True) if leaf.is_text]

    @cached_property
    def flags(self) -> list[int]:
        """Places of the bytes that are ``bool``."""
        ros = [field.name for field in self.type.fields[1:]]
        starts = ((leaf, self.row.fields[name][1]) for leaf, name in zip(self.leaves, ros, strict=True))  # type: ignore[index]
        return [at for leaf, start in starts if leaf.c_type == "bool" for at in range(start, start + leaf.size)]


Fields = tuple[tuple[str, int | None, str], ...]
"""Type, length and name of each field of a format."""


@lru_cache(maxsize=8192)
def parse(text: str) -> tuple[str, Fields] | None:
    """Name and fields of a format (``name:type field;type[n] field;``); None where the text is none."""
    name, colon, listed = text.partition(":")
    if not colon or not name:
        return None
    fields = []
    for part in filter(None, listed.split(";")):
        match = _FIELD.fullmatch(part)
        if match is None:
            return None
        fields.append((match["type"], int(match["length"] or 0) or None, _UNPRINTABLE.sub("_", match["name"])))
    return (name, tuple(fields)) if fields else None


def definition(name: str, formats: Mapping[str, Fields]) -> Definition | None:
    """The topic ``name``; None where its format, or one that is nested in it, is missing or cannot be."""
    needed: dict[str, Fields] = {}
    if not _collect(name, formats, needed, ()):
        return None
    return _definition(name, tuple(needed.items()))


def _collect(name: str, formats: Mapping[str, Fields], needed: dict[str, Fields], above: tuple[str, ...]) -> bool:
    """Gather the formats that ``name`` needs, itself first; False where one is missing or contains itself."""
    if name not in formats or name in above:
        return False
    if name in needed:
        return True
    needed[name] = formats[name]
    nested = {kind for kind, _, _ in formats[name] if kind not in C_TYPES}
    return all(_collect(kind, formats, needed, (*above, name)) for kind in sorted(nested))


@lru_cache(maxsize=4096)
def _definition(name: str, needed: tuple[tuple[str, Fields], ...]) -> Definition | None:
    leaves: list[Leaf] = []
    size = 0
    for leaf in _flattened("", name, dict(needed)):
        leaves.append(leaf)
        size += leaf.size
        if size > MOST_BYTES:
            return None
    padding = 0
    while leaves and leaves[-1].name.startswith(PADDING):
        padding += leaves.pop().size
    return Definition(name, tuple(leaves), padding) if leaves else None


def _flattened(prefix: str, name: str, formats: Mapping[str, Fields]) -> Iterator[Leaf]:
    for kind, length, field in formats[name]:
        if kind in C_TYPES:
            yield Leaf(f"{prefix}{field}", kind, length)
        elif length is None:
            yield from _flattened(f"{prefix}{field}.", kind, formats)
        else:
            for number in range(length):
                yield from _flattened(f"{prefix}{field}[{number}].", kind, formats)
