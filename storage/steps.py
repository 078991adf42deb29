"""A message type as the steps that walk through its bytes when strings and sequences vary from message to message.

A step is a block of primitives (fixed once its phase, the place modulo the largest alignment, is known), a string, a
sequence of primitives, or an array of messages; each acts on many messages at once.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..schemas.definition import PRIMITIVES, TEXT_TYPES, MessageType
from ..schemas.layout import Wire
from .ragged import Bytes, Places

Names = tuple[str, ...]
PADDING: Names = ()
"""The path of the one byte that an empty message has."""


@dataclass(frozen=True)
class Leaf:
    """A primitive, or ``count`` of them."""

    path: Names
    primitive: str
    count: int | None


@dataclass(frozen=True)
class Block:
    """Primitives in a row."""

    leaves: tuple[Leaf, ...]

    def dtype(self, wire: Wire, phase: int) -> "np.dtype[np.void]":
        """The block where it begins at ``phase``; leading padding included, field ``str(i)`` is leaf i."""
        return _block_dtype(self, wire, phase)


@dataclass(frozen=True)
class TextStep:
    """A string."""

    path: Names


@dataclass(frozen=True)
class NumbersStep:
    """A sequence of primitives."""

    path: Names
    primitive: str


@dataclass(frozen=True)
class ElementsStep:
    """An array (``count``) or sequence (``count`` None) of messages or strings; a string's path is ``("",)``."""

    path: Names
    steps: "tuple[Step, ...]"
    count: int | None


Step = Block | TextStep | NumbersStep | ElementsStep


@dataclass(frozen=True, eq=False)
class Texts:
    """Strings as places in a pool of bytes."""

    pool: Bytes
    start: Places
    length: Places


@dataclass(frozen=True, eq=False)
class Numbers:
    """Sequences of primitives as places (in bytes) in a pool."""

    pool: Bytes
    start: Places
    count: Places
    dtype: "np.dtype[np.generic]"


@dataclass(frozen=True, eq=False)
class Elements:
    """Arrays of messages: how many each row has, and all of them, row after row."""

    count: Places
    tree: "Tree"


Node = NDArray[np.generic] | Texts | Numbers | Elements
Tree = dict[Names, Node]


@lru_cache(maxsize=4096)
def steps_of(message: MessageType) -> tuple[Step, ...]:
    """The steps through a message."""
    return tuple(_merged(_flat(message, ())))


def _flat(message: MessageType, path: Names) -> list[Step]:
    if not message.fields:
        return [Block((Leaf(PADDING, "uint8", None),))]
    found: list[Step] = []
    for field in message.fields:
        here = (*path, field.name)
        if field.type in TEXT_TYPES:
            text = TextStep(here if field.length is None else ("",))
            found.append(text if field.length is None else ElementsStep(here, (text,), field.length or None))
        elif isinstance(field.type, str):
            leaf = Block((Leaf(here, field.type, field.length),))
            found.append(NumbersStep(here, field.type) if field.length == 0 else leaf)
        elif field.length is None:
            found.extend(_flat(field.type, here))
        else:
            found.append(ElementsStep(here, steps_of(field.type), field.length or None))
    return found


def _merged(steps: list[Step]) -> list[Step]:
    result: list[Step] = []
    for step in steps:
        if isinstance(step, Block) and result and isinstance(result[-1], Block):
            result[-1] = Block(result[-1].leaves + step.leaves)
        else:
            result.append(step)
    return result


@lru_cache(maxsize=16384)
def _block_dtype(block: Block, wire: Wire, phase: int) -> "np.dtype[np.void]":
    names, formats, offsets, at = [], [], [], phase
    for number, leaf in enumerate(block.leaves):
        single = wire.dtype(leaf.primitive)
        dtype = single if leaf.count is None else np.dtype((single, (leaf.count,)))
        at = wire.align(at, single.itemsize)
        names.append(str(number))
        formats.append(dtype)
        offsets.append(at - phase)
        at += dtype.itemsize
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": at - phase})


@lru_cache(maxsize=4096)
def least_size(steps: tuple[Step, ...]) -> int:
    """Bytes that a message of these steps has at least."""
    size = 0
    for step in steps:
        if isinstance(step, Block):
            size += sum(np.dtype(PRIMITIVES[leaf.primitive]).itemsize * (leaf.count or 1) for leaf in step.leaves)
        elif isinstance(step, ElementsStep):
            size += 4 if step.count is None else step.count * least_size(step.steps)
        else:
            size += 4
    return size


@lru_cache(maxsize=4096)
def even_stride(steps: tuple[Step, ...], wire: Wire) -> int | None:
    """Bytes from element to element where all lie alike (only primitives, the first as aligned as any); else None."""
    if len(steps) != 1 or not isinstance(steps[0], Block):
        return None
    sizes = [min(wire.dtype(leaf.primitive).itemsize, wire.alignment) for leaf in steps[0].leaves]
    if sizes[0] != max(sizes):
        return None
    return wire.align(steps[0].dtype(wire, 0).itemsize, sizes[0])
