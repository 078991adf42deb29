"""Where the fields of a serialised message lie: XCDR1 (and XCDR2's plain form, and ROS 1's) as numpy dtypes.

A layout begins at the origin that alignment counts from: after the 4-byte encapsulation header of CDR. It is exact for
one set of string and sequence lengths; messages that share those lengths share the layout.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from .definition import PRIMITIVES, TEXT_TYPES, Field, MessageType

Path = tuple[str | int, ...]
"""A leaf's place: field names, and element numbers where a field is an array of messages or strings."""


@dataclass(frozen=True)
class Wire:
    """The rules of a serialisation: byte order, largest alignment, whether strings end in NUL."""

    byte_order: str
    alignment: int = 8
    nul: bool = True

    def dtype(self, primitive: str) -> "np.dtype[np.generic]":
        """The type of a primitive as it is stored."""
        return np.dtype(PRIMITIVES[primitive]).newbyteorder(self.byte_order)  # type: ignore[arg-type]

    @property
    def count(self) -> "np.dtype[np.generic]":
        """The type of the length before a string or a sequence."""
        return self.dtype("uint32")

    def align(self, at: int, size: int) -> int:
        """The first place from ``at`` on where a primitive of ``size`` bytes may lie."""
        step = min(size, self.alignment)
        return -(-at // step) * step


CDR_LE = Wire("<")
CDR_BE = Wire(">")
CDR2_LE = Wire("<", alignment=4)
CDR2_BE = Wire(">", alignment=4)
ROS1 = Wire("<", alignment=1, nul=False)


@dataclass(frozen=True)
class Slot:
    """One leaf of a layout: a primitive or an array of them, the characters of a string, or a length."""

    path: Path
    dtype: "np.dtype[np.generic]"
    offset: int
    count: int | None = None
    """None is a value; else this is the length word before a string or sequence, and ``count`` what it holds."""

    @property
    def end(self) -> int:
        return self.offset + self.dtype.itemsize


@dataclass(frozen=True, eq=False)
class Layout:
    """Every leaf with its offset, the size in bytes, and one structured dtype over all if the spacing allows it."""

    slots: tuple[Slot, ...]
    size: int
    dtype: "np.dtype[np.void] | None"


class _Builder:
    """Lays one message out, field after field."""

    def __init__(self, wire: Wire, lengths: Mapping[str, int]) -> None:
        self.wire = wire
        self.lengths = lengths
        self.slots: list[Slot] = []
        self.at = 0

    def message(self, message: MessageType, path: Path) -> "np.dtype[np.void] | None":
        self.at = base = self.wire.align(self.at, first_alignment(message))
        names, formats, offsets = [], [], []
        if not message.fields:
            self.at += 1
        for field in message.fields:
            formed = self.field(field, (*path, field.name))
            if formed is None:
                names.append("")
                continue
            names.append(field.name)
            formats.append(formed[0])
            offsets.append(formed[1] - base)
        if "" in names:
            return None
        ends = [o + np.dtype(f).itemsize for o, f in zip(offsets, formats, strict=True)]  # type: ignore[call-overload]
        size = max([self.at - base, *ends])
        return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": size})

    def field(self, field: Field, path: Path) -> tuple[object, int] | None:
        if field.length is None:
            return self.one(field.type, path)
        count = field.length
        if count == 0:
            count = self.lengths.get(dotted(path), self.lengths.get(dotted(path, False), 0))
            self.word(path, count)
        if isinstance(field.type, str) and field.type not in TEXT_TYPES:
            return self.primitives(field.type, path, (count,))
        return self.elements(field.type, path, count)

    def one(self, kind: str | MessageType, path: Path) -> tuple[object, int] | None:
        if isinstance(kind, MessageType):
            base = self.wire.align(self.at, first_alignment(kind))
            inner = self.message(kind, path)
            return None if inner is None else (inner, base)
        return self.text(path) if kind in TEXT_TYPES else self.primitives(kind, path, ())

    def elements(self, kind: str | MessageType, path: Path, count: int) -> tuple[object, int] | None:
        formed = [self.one(kind, (*path, number)) for number in range(count)]
        if None in formed:
            return None
        whole = [entry for entry in formed if entry is not None]
        if not whole:
            empty = np.dtype("S1") if isinstance(kind, str) else kind.dtype()
            return np.dtype((empty, (0,))), self.at
        first, start = whole[0]
        stride = whole[1][1] - start if count > 1 else np.dtype(first).itemsize  # type: ignore[call-overload]
        if any(entry != (first, start + number * stride) for number, entry in enumerate(whole)):
            return None
        spaced = _spaced(np.dtype(first), stride)  # type: ignore[call-overload]
        return None if spaced is None else (np.dtype((spaced, (count,))), start)

    def primitives(self, kind: str, path: Path, shape: tuple[int, ...]) -> tuple[object, int]:
        single = self.wire.dtype(kind)
        dtype = np.dtype((single, shape)) if shape else single
        if dtype.itemsize or not shape:
            self.at = self.wire.align(self.at, single.itemsize)
        start = self.at
        self.slots.append(Slot(path, dtype, start))
        self.at += dtype.itemsize
        return dtype, start

    def text(self, path: Path) -> tuple[object, int]:
        stored = self.lengths.get(dotted(path), self.lengths.get(dotted(path, False), int(self.wire.nul)))
        start = self.word(path, stored) + 4
        width = stored - int(self.wire.nul) if stored else 0
        self.at += stored
        if width == 0:  # the NUL, or where there is none a zero byte of the length, reads as an empty string
            self.slots.append(Slot(path, np.dtype("S0"), start))
            return np.dtype("S1"), start if stored else start - 4
        self.slots.append(Slot(path, np.dtype(f"S{width}"), start))
        return np.dtype(f"S{width}"), start

    def word(self, path: Path, count: int) -> int:
        self.at = self.wire.align(self.at, 4)
        self.slots.append(Slot(path, self.wire.count, self.at, count))
        self.at += 4
        return self.at - 4


def _spaced(dtype: "np.dtype[np.generic]", stride: int) -> "np.dtype[np.generic] | None":
    """The same element, ``stride`` bytes from the next; None where numpy cannot say so."""
    if dtype.itemsize == stride:
        return dtype
    if dtype.names is None or stride < dtype.itemsize:
        return None
    fields: Mapping[str, Any] = dtype.fields or {}
    return np.dtype(
        {
            "names": list(dtype.names),
            "formats": [fields[name][0] for name in dtype.names],
            "offsets": [fields[name][1] for name in dtype.names],
            "itemsize": stride,
        }
    )


@lru_cache(maxsize=4096)
def first_alignment(message: MessageType) -> int:
    """The alignment of a message's first primitive, where its bytes begin."""
    if not message.fields:
        return 1
    first = message.fields[0]
    if first.length == 0 or first.type in TEXT_TYPES:
        return 4
    if isinstance(first.type, MessageType):
        return first_alignment(first.type)
    return np.dtype(PRIMITIVES[first.type]).itemsize


def layout(message: MessageType, wire: Wire = CDR_LE, lengths: Mapping[str, int] | None = None) -> Layout:
    """Lay a message out.

    ``lengths`` gives, by dotted path, the elements of each sequence and the *stored* length of each string (with its
    NUL where the wire has one; 0 is a string without any byte). Elements of arrays of messages may have their own
    (``transforms[0].child_frame_id``) or share one (``transforms.child_frame_id``). What is not named is empty.
    """
    builder = _Builder(wire, lengths or {})
    dtype = builder.message(message, ())
    return Layout(tuple(builder.slots), builder.at, dtype)


def dotted(path: Path, numbered: bool = True) -> str:
    """``("transforms", 0, "header")`` -> ``transforms[0].header``, or ``transforms.header`` without the numbers."""
    result = ""
    for part in path:
        if isinstance(part, int):
            result += f"[{part}]" if numbered else ""
        else:
            result += f".{part}" if result else part
    return result


@lru_cache(maxsize=4096)
def is_fixed(message: MessageType) -> bool:
    """True where no string and no sequence is anywhere: every message of the type has the same layout."""
    return not any(True for _ in variable_fields(message))


def variable_fields(message: MessageType, path: Path = ()) -> Iterator[Path]:
    """The paths of all strings and sequences."""
    for field in message.fields:
        here = (*path, field.name)
        if field.type in TEXT_TYPES or field.length == 0:
            yield here
        if isinstance(field.type, MessageType):
            yield from variable_fields(field.type, here)
