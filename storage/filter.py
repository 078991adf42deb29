"""Records without those of some channels."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from .chunks_in import I8, Messages, Records, walk
from .input_file import InputFile
from .ragged import Bytes, Places, window
from .records import INDEX_ENTRY, MESSAGE_HEAD, RECORD_HEAD, Op, damaged


@dataclass(frozen=True, eq=False)
class Filtered:
    """What is left: the bytes, the messages with their new places, the schema and channel records among the bytes."""

    data: Bytes
    messages: dict[int, Messages]
    definitions: list[bytes]

    @property
    def indexes(self) -> list[tuple[int, bytes]]:
        """The message indexes: channel id and entries."""
        packed = []
        for channel, found in self.messages.items():
            entries = np.empty(len(found.at), INDEX_ENTRY)
            entries["time"], entries["offset"] = found.time_ns, found.at
            packed.append((channel, entries.tobytes()))
        return packed

    @property
    def span(self) -> tuple[int, int]:
        """First and last log time."""
        times = [found.time_ns for found in self.messages.values()]
        return min(int(t.min()) for t in times), max(int(t.max()) for t in times)


def without(
    file: InputFile,
    records: Records,
    found: dict[int, Messages],
    channels: Collection[int],
    schemas: Collection[int],
) -> Filtered:
    """The records but for the messages and definitions of ``channels``, and the definitions of ``schemas``."""
    begin, length = _extents(file, records, found)
    kept_definitions, dropped = _definitions(file, records, begin, length, channels, schemas)
    gone = [found[number].at for number in channels if number in found]
    at = np.concatenate([*gone, np.array([a for a, _ in dropped], np.int64)])
    size = np.concatenate([_lengths(records, part) for part in gone] + [np.array([n for _, n in dropped], np.int64)])
    order = np.argsort(at)
    at, size = at[order], size[order]
    before = np.concatenate([np.zeros(1, np.int64), np.cumsum(size)])
    left = {
        number: Messages(messages.at - before[np.searchsorted(at, messages.at)], messages.time_ns)
        for number, messages in found.items()
        if number not in channels and len(messages.at)
    }
    return Filtered(records.data[~_covered(at, size, len(records.data))], left, kept_definitions)


def _lengths(records: Records, at: Places) -> Places:
    length: Places = window(records.data, I8)[at + 1]
    return length + RECORD_HEAD


def _extents(file: InputFile, records: Records, found: dict[int, Messages]) -> tuple[Places, Places]:
    """Begin and length of every message, in order; InputError where they overlap or are none."""
    at = np.sort(np.concatenate([np.zeros(0, np.int64), *[messages.at for messages in found.values()]]))
    if len(at) and (int(at[0]) < 0 or int(at[-1]) + MESSAGE_HEAD > len(records.data)):
        raise damaged(file.path, records.offset, "a message index points beyond its chunk")
    length = _lengths(records, at)
    ends = np.append(at[1:], len(records.data))
    if (length < MESSAGE_HEAD).any() or (length > ends - at).any() or (records.data[at] != Op.MESSAGE).any():
        raise damaged(file.path, records.offset, "a message index points at what is not its message")
    return at, length


def _definitions(
    file: InputFile,
    records: Records,
    begin: Places,
    length: Places,
    channels: Collection[int],
    schemas: Collection[int],
) -> tuple[list[bytes], list[tuple[int, int]]]:
    """The schema and channel records between the messages: those that stay, and (place, length) of those that go."""
    starts = np.concatenate([[0], begin + length]).tolist()
    ends = np.concatenate([begin, [len(records.data)]]).tolist()
    kept, dropped = [], []
    for low, high in zip(starts, ends, strict=True):
        if low == high:
            continue
        for op, at, size in walk(file, Records(records.data[low:high], records.offset)):
            place = low + at
            number = int.from_bytes(records.data[place + RECORD_HEAD : place + RECORD_HEAD + 2].tobytes(), "little")
            if (op == Op.SCHEMA and number in schemas) or (op == Op.CHANNEL and number in channels):
                dropped.append((place, size))
            elif op in (Op.SCHEMA, Op.CHANNEL):
                kept.append(records.data[place : place + size].tobytes())
    return kept, dropped


def _covered(at: Places, size: Places, total: int) -> "np.ndarray[tuple[int], np.dtype[np.bool_]]":
    """Which bytes lie in one of the extents."""
    steps = np.zeros(total + 1, np.int8)
    steps[at] += 1
    steps[at + size] -= 1
    return np.cumsum(steps[:-1], dtype=np.int8).astype(np.bool_)
