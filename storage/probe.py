"""The lengths of the strings and sequences of one serialised message, read one after the other."""

import numpy as np

from ..schemas.definition import PRIMITIVES, TEXT_TYPES, Field, MessageType
from ..schemas.layout import Path, Wire, dotted

MOST_ELEMENTS = 1000


class ProbeError(ValueError):
    """The message is too large to be laid out element by element, or states a length that goes beyond its end."""


def lengths_of(message: MessageType, wire: Wire, data: bytes) -> dict[str, int]:
    """The lengths as `schemas.layout` takes them; ``data`` begins at the origin of alignment. ProbeError."""
    probe = _Probe(wire, data)
    probe.message(message, ())
    if probe.at > len(data):
        raise ProbeError("it states a length that goes beyond its end")
    return probe.found


class _Probe:
    def __init__(self, wire: Wire, data: bytes) -> None:
        self.wire = wire
        self.data = data
        self.at = 0
        self.found: dict[str, int] = {}

    def message(self, message: MessageType, path: Path) -> None:
        if not message.fields:
            self.at += 1
        for field in message.fields:
            self.field(field, (*path, field.name))

    def field(self, field: Field, path: Path) -> None:
        if field.length is None:
            self.one(field.type, path)
            return
        count = field.length or self.word(path)
        if isinstance(field.type, str) and field.type not in TEXT_TYPES:
            self.primitives(field.type, count)
            return
        if count > MOST_ELEMENTS:
            raise ProbeError("an array of very many messages")
        for number in range(count):
            self.one(field.type, (*path, number))

    def one(self, kind: str | MessageType, path: Path) -> None:
        if isinstance(kind, MessageType):
            self.message(kind, path)
        elif kind in TEXT_TYPES:
            length = self.word(path)
            self.at += length
        else:
            self.primitives(kind, 1)

    def primitives(self, kind: str, count: int) -> None:
        if count:
            size = np.dtype(PRIMITIVES[kind]).itemsize
            self.at = self.wire.align(self.at, size) + size * count

    def word(self, path: Path) -> int:
        self.at = self.wire.align(self.at, 4)
        if self.at + 4 > len(self.data):
            raise ProbeError("it ends before a length")
        order = "little" if self.wire.byte_order == "<" else "big"
        count = int.from_bytes(self.data[self.at : self.at + 4], order)  # type: ignore[arg-type]
        self.found[dotted(path)] = count
        self.at += 4
        return count
