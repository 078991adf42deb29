"""Taking rows out of a tree of columns, and putting the trees of single elements together."""

import numpy as np

from .ragged import Places, ramps, starts
from .steps import Elements, Node, Numbers, Texts, Tree


def select(tree: Tree, rows: Places) -> Tree:
    """The rows at the given positions."""
    return {path: _pick(node, rows) for path, node in tree.items()}


def _pick(node: Node, rows: Places) -> Node:
    if isinstance(node, Texts):
        return Texts(node.pool, node.start[rows], node.length[rows])
    if isinstance(node, Numbers):
        return Numbers(node.pool, node.start[rows], node.count[rows], node.dtype)
    if isinstance(node, Elements):
        count = node.count[rows]
        return Elements(count, select(node.tree, ramps(starts(node.count)[rows], count)))
    return node[rows]


def combine(parts: list[tuple[Places, Tree]], total: int) -> Tree:
    """One tree of ``total`` rows from trees whose rows go to the given positions."""
    if not parts:
        return {}
    paths = parts[0][1]
    return {path: _together([(rows, tree[path]) for rows, tree in parts], total) for path in paths}


def _together(parts: list[tuple[Places, Node]], total: int) -> Node:
    first = parts[0][1]
    if isinstance(first, Texts):
        start, length = np.zeros(total, np.int64), np.zeros(total, np.int64)
        for rows, node in parts:
            assert isinstance(node, Texts)
            start[rows], length[rows] = node.start, node.length
        return Texts(first.pool, start, length)
    if isinstance(first, Numbers):
        start, count = np.zeros(total, np.int64), np.zeros(total, np.int64)
        for rows, node in parts:
            assert isinstance(node, Numbers)
            start[rows], count[rows] = node.start, node.count
        return Numbers(first.pool, start, count, first.dtype)
    if isinstance(first, Elements):
        return _elements_together(parts, total)
    values = np.zeros((total, *first.shape[1:]), first.dtype)
    for rows, node in parts:
        values[rows] = node
    return values


def _elements_together(parts: list[tuple[Places, Node]], total: int) -> Elements:
    count = np.zeros(total, np.int64)
    for rows, node in parts:
        assert isinstance(node, Elements)
        count[rows] = node.count
    begin = starts(count)
    inner = [(ramps(begin[rows], node.count), node.tree) for rows, node in parts if isinstance(node, Elements)]
    return Elements(count, combine([part for part in inner if len(part[0])] or inner[:1], int(count.sum())))
