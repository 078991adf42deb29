"""Several chunks as one, so that channels with few messages per chunk are gathered in larger steps."""

from collections.abc import Iterable, Iterator

import numpy as np

from .chunks_in import Messages, Records

PER_CHANNEL = 1 << 16
LARGEST = 32 << 20
SMALLEST = 4 << 20
"""Batches that would be smaller than this are not worth the copying."""

Part = tuple[Records, dict[int, Messages]]


def batched(parts: Iterable[Part], channels: int) -> Iterator[Part]:
    """The same messages in fewer parts; a part is valid until the next one is asked for."""
    size = min(LARGEST, channels * PER_CHANNEL)
    return iter(parts) if size < SMALLEST else _joined(parts, size)


def _joined(parts: Iterable[Part], size: int) -> Iterator[Part]:
    slab = np.empty(size, np.uint8)
    used, offset = 0, 0
    found: dict[int, list[tuple[int, Messages]]] = {}
    for records, messages in parts:
        if used and used + len(records.data) > len(slab):
            yield Records(slab[:used], offset), _merged(found)
            used, found = 0, {}
        if len(records.data) > len(slab):
            yield records, messages
            continue
        offset = offset if used else records.offset
        slab[used : used + len(records.data)] = records.data
        for number, entry in messages.items():
            found.setdefault(number, []).append((used, entry))
        used += len(records.data)
    if used:
        yield Records(slab[:used], offset), _merged(found)


def _merged(found: dict[int, list[tuple[int, Messages]]]) -> dict[int, Messages]:
    merged = {}
    for number, entries in found.items():
        at = np.concatenate([entry.at for _, entry in entries])
        at += np.repeat([place for place, _ in entries], [len(entry.at) for _, entry in entries])
        merged[number] = Messages(at, np.concatenate([entry.time_ns for _, entry in entries]))
    return merged
