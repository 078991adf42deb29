"""Columns to serialised messages of any lengths, all messages at once."""

from collections.abc import Sequence

import numpy as np

from ..schemas.layout import Wire
from . import ragged
from .ragged import Bytes, Places, starts, void, window
from .steps import Block, Elements, ElementsStep, Numbers, NumbersStep, Step, Texts, TextStep, Tree
from .tree import select


def sizes(steps: Sequence[Step], wire: Wire, tree: Tree, count: int) -> Places:
    """The bytes of each message, counted from its origin."""
    return _Walk(wire, None).through(steps, tree, np.zeros(count, np.int64), np.zeros(count, np.int64))


def encode(steps: Sequence[Step], wire: Wire, tree: Tree, target: Bytes, origin: Places) -> None:
    """Write each message to ``target`` so that its alignment counts from ``origin[i]``; gaps are left as they are."""
    _Walk(wire, target).through(steps, tree, origin, np.zeros(len(origin), np.int64))


class _Walk:
    """Moves through the steps, writing where there is a target."""

    def __init__(self, wire: Wire, target: Bytes | None) -> None:
        self.wire = wire
        self.target = target

    def through(self, steps: Sequence[Step], tree: Tree, origin: Places, at: Places) -> Places:
        for step in steps:
            if isinstance(step, Block):
                at = self.block(step, tree, origin, at)
            elif isinstance(step, ElementsStep):
                at = self.elements(step, tree[step.path], origin, at)
            elif isinstance(step, TextStep):
                at = self.text(tree[step.path], origin, at)
            else:
                at = self.numbers(step, tree[step.path], origin, at)
        return at

    def block(self, step: Block, tree: Tree, origin: Places, at: Places) -> Places:
        phase = at % self.wire.alignment
        end = at.copy()
        for kind in np.unique(phase).tolist():
            which = np.flatnonzero(phase == kind)
            dtype = step.dtype(self.wire, kind)
            end[which] += dtype.itemsize
            if self.target is None:
                continue
            rows = np.zeros(len(which), dtype)
            for number, leaf in enumerate(step.leaves):
                if leaf.path:
                    rows[str(number)] = tree[leaf.path][which]  # type: ignore[index]
            size = void(dtype.itemsize)
            window(self.target, size, True)[(origin + at)[which]] = rows.view(size)
        return end

    def text(self, node: object, origin: Places, at: Places) -> Places:
        assert isinstance(node, Texts)
        at = self.word(node.length + int(self.wire.nul), origin, at)
        if self.target is not None:
            ragged.copy(self.target, origin + at, node.pool, node.start, node.length)
            if self.wire.nul:
                self.target[origin + at + node.length] = 0
        return at + node.length + int(self.wire.nul)

    def numbers(self, step: NumbersStep, node: object, origin: Places, at: Places) -> Places:
        assert isinstance(node, Numbers)
        at = self.word(node.count, origin, at)
        size = self.wire.dtype(step.primitive).itemsize
        at = np.where(node.count > 0, self.aligned(at, size), at)
        if self.target is not None:
            ragged.copy(self.target, origin + at, node.pool, node.start, node.count * size)
        return at + node.count * size

    def elements(self, step: ElementsStep, node: object, origin: Places, at: Places) -> Places:
        assert isinstance(node, Elements)
        at = at.copy() if step.count is not None else self.word(node.count, origin, at)
        begin = starts(node.count)
        for number in range(int(node.count.max(initial=0))):
            which = np.flatnonzero(node.count > number)
            at[which] = self.through(step.steps, select(node.tree, begin[which] + number), origin[which], at[which])
        return at

    def word(self, count: Places, origin: Places, at: Places) -> Places:
        at = self.aligned(at, 4)
        if self.target is not None:
            window(self.target, self.wire.count, True)[origin + at] = count
        return at + 4

    def aligned(self, at: Places, size: int) -> Places:
        step = min(size, self.wire.alignment)
        return -(-at // step) * step
