"""Serialised messages of any lengths to columns, all messages of a channel at once."""

from collections.abc import Sequence

import numpy as np

from ..schemas.columns import Table
from ..schemas.definition import MessageType
from ..schemas.layout import Wire
from .assemble import assemble
from .ragged import Bytes, Places, ramps, starts, void, window
from .steps import (
    Block,
    Elements,
    ElementsStep,
    Node,
    Numbers,
    NumbersStep,
    Step,
    Texts,
    TextStep,
    Tree,
    even_stride,
    least_size,
    steps_of,
)
from .tree import combine


class OverrunError(ValueError):
    """A message says that it has more than it has; ``row`` is the first such."""

    def __init__(self, row: int, what: str) -> None:
        super().__init__(what)
        self.row = row


def decode(message: MessageType, wire: Wire, data: Bytes, origin: Places, size: Places) -> Table:
    """Messages whose alignment counts from ``data[origin[i]]`` and which have ``size[i]`` bytes from there.

    Strings become ``S{n}`` where that is compact, else objects (bytes); sequences become subarrays where all have one
    length, else objects (arrays). OverrunError for a length that cannot be.
    """
    walk = _Walk(wire, data)
    rows = np.arange(len(origin), dtype=np.int64)
    tree, _ = walk.through(steps_of(message), rows, origin, np.zeros(len(origin), np.int64), size)
    return assemble(message, tree, len(origin))


class _Walk:
    """``rows`` are the messages' numbers (for errors), ``at`` where each one is, counted from its origin."""

    def __init__(self, wire: Wire, data: Bytes) -> None:
        self.wire = wire
        self.data = data
        self.words = window(data, wire.count)

    def through(
        self, steps: Sequence[Step], rows: Places, origin: Places, at: Places, size: Places
    ) -> tuple[Tree, Places]:
        tree: Tree = {}
        for step in steps:
            if isinstance(step, Block):
                at = self.block(step, tree, rows, origin, at, size)
                continue
            if isinstance(step, ElementsStep):
                tree[step.path], at = self.elements(step, rows, origin, at, size)
                continue
            least = 1 if isinstance(step, TextStep) else self.wire.dtype(step.primitive).itemsize
            count, at = self.count(least, rows, origin, at, size)
            if isinstance(step, TextStep):
                length = np.maximum(count - 1, 0) if self.wire.nul else count
                tree[step.path], at = Texts(self.data, origin + at, length), at + count
            else:
                tree[step.path], at = self.numbers(step, count, rows, origin, at, size)
        return tree, at

    def count(self, least: int, rows: Places, origin: Places, at: Places, size: Places) -> tuple[Places, Places]:
        """The length word at each place; OverrunError unless so many things of ``least`` bytes can follow."""
        at = self.aligned(at, 4)
        self.check(at + 4 <= size, rows, "ends before a length")
        count = self.words[origin + at].astype(np.int64)
        at = at + 4
        self.check(count * least <= size - at, rows, "states a length that goes beyond its end")
        return count, at

    def numbers(
        self, step: NumbersStep, count: Places, rows: Places, origin: Places, at: Places, size: Places
    ) -> tuple[Node, Places]:
        dtype = self.wire.dtype(step.primitive)
        at = np.where(count > 0, self.aligned(at, dtype.itemsize), at)
        end = at + count * dtype.itemsize
        self.check(end <= size, rows, "states a length that goes beyond its end")
        return Numbers(self.data, origin + at, count, dtype), end

    def block(self, step: Block, tree: Tree, rows: Places, origin: Places, at: Places, size: Places) -> Places:
        phase = at % self.wire.alignment
        kinds = np.unique(phase).tolist()
        parts = []
        end = at.copy()
        for kind in kinds:
            which = slice(None) if len(kinds) == 1 else np.flatnonzero(phase == kind)
            dtype = step.dtype(self.wire, kind)
            end[which] += dtype.itemsize
            self.check(end[which] <= size[which], rows[which], "ends before its last field")
            bytes_of = window(self.data, void(dtype.itemsize))[(origin + at)[which]]
            parts.append((which, np.ascontiguousarray(bytes_of).view(dtype)))
        for number, leaf in enumerate(step.leaves):
            if not leaf.path:
                continue
            if len(parts) == 1:
                tree[leaf.path] = parts[0][1][str(number)]
                continue
            first = parts[0][1][str(number)] if parts else np.zeros(0, step.dtype(self.wire, 0)[str(number)])
            values = np.zeros((len(at), *first.shape[1:]), first.dtype)
            for which, part in parts:
                values[which] = part[str(number)]
            tree[leaf.path] = values
        return end

    def elements(
        self, step: ElementsStep, rows: Places, origin: Places, at: Places, size: Places
    ) -> tuple[Elements, Places]:
        if step.count is None:
            count, at = self.count(least_size(step.steps), rows, origin, at, size)
        else:
            count = np.full(len(rows), step.count, np.int64)
        stride = even_stride(step.steps, self.wire)
        if stride is not None:
            return self.even_elements(step, stride, count, rows, origin, at, size)
        total, begin, parts = int(count.sum()), starts(count), []
        at = at.copy()
        for number in range(int(count.max(initial=0))):
            which = np.flatnonzero(count > number)
            tree, at[which] = self.through(step.steps, rows[which], origin[which], at[which], size[which])
            parts.append((begin[which] + number, tree))
        nothing = np.zeros(0, np.int64)
        parts = parts or [(nothing, self.through(step.steps, nothing, nothing, nothing, nothing)[0])]
        return Elements(count, combine(parts, total)), at

    def even_elements(
        self, step: ElementsStep, stride: int, count: Places, rows: Places, origin: Places, at: Places, size: Places
    ) -> tuple[Elements, Places]:
        """Elements that all lie alike: one block for all of them."""
        (block,) = step.steps
        assert isinstance(block, Block)
        first = self.wire.dtype(block.leaves[0].primitive).itemsize
        least = block.dtype(self.wire, 0).itemsize
        begin = np.where(count > 0, self.aligned(at, first), at)
        end = np.where(count > 0, begin + (count - 1) * stride + least, at)
        self.check(end <= size, rows, "states a length that goes beyond its end")
        tree: Tree = {}
        inner = ramps(begin, count, stride)
        repeated = [np.repeat(values, count) for values in (rows, origin, size)]
        self.block(block, tree, repeated[0], repeated[1], inner, repeated[2])
        return Elements(count, tree), end

    def aligned(self, at: Places, size: int) -> Places:
        step = min(size, self.wire.alignment)
        return -(-at // step) * step

    def check(self, good: "np.ndarray[tuple[int], np.dtype[np.bool_]]", rows: Places, what: str) -> None:
        if not good.all():
            raise OverrunError(int(rows[np.argmin(good)]), what)
