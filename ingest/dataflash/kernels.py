"""The walk over a binary log, record by record: each one's length says where the next begins."""

from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...geometry.jit import inline_kernel, kernel

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]
Kinds = NDArray[np.int32]
Flags = NDArray[np.bool_]
Places = TypeVar("Places", Ints, Kinds)

HEAD_1: Final = 0xA3
HEAD_2: Final = 0x95
FMT_TYPE: Final = 0x80
FMT_LENGTH: Final = 89
HEADER: Final = 3
LENGTH_AT, NAME_AT, CHARACTERS_AT, COLUMNS_AT = 4, 5, 9, 25
"""Where a FMT record says what."""
NEAR_US: Final = 60_000_000
"""A record found behind damage is believed if its TimeUS is this close to the last one."""

RUNS, SKIPPED, TORN_INSIDE, TORN_LAST, BAD_FORMATS, TAIL = range(6)
"""What `scan` counts; TAIL is where the last run of bad bytes begins, if it reaches the end, else -1."""
NONE: Final = -1


@inline_kernel
def _is_header(data: Bytes, at: int) -> bool:
    return bool(at + HEADER <= data.size and data[at] == HEAD_1 and data[at + 1] == HEAD_2)


@inline_kernel
def _known(data: Bytes, at: int, length: Ints) -> int:
    """Length of the record whose header is at ``at``; 0 if there is none or it does not fit."""
    if not _is_header(data, at):
        return 0
    size = int(length[data[at + 2]])
    return size if at + size <= data.size else 0


@inline_kernel
def _chained(data: Bytes, end: int, length: Ints) -> bool:
    """Whether a record that ends at ``end`` is followed by another or by the end of the log."""
    return bool(end + HEADER > data.size or (_is_header(data, end) and length[data[end + 2]] > 0))


@kernel
def _chained_within(data: Bytes, start: int, stop: int, length: Ints) -> int:
    """First place in [start, stop) of a record that another follows, else NONE."""
    for at in range(start, min(stop, data.size)):
        size = _known(data, at, length)
        if size > 0 and _chained(data, at + size, length):
            return at
    return NONE


@kernel
def _time_us(data: Bytes, at: int) -> int:
    """The 64 bits that follow the header at ``at``."""
    value = 0
    for i in range(7, -1, -1):
        value = (value << 8) | int(data[at + HEADER + i])
    return value


@kernel
def _defined_length(data: Bytes, at: int, sizes: Ints) -> int:
    """Length of the records that the FMT record at ``at`` defines; 0 if it contradicts itself."""
    total = HEADER
    for i in range(CHARACTERS_AT, COLUMNS_AT):
        if data[at + i] == 0:
            break
        if sizes[data[at + i]] == 0:
            return 0
        total += int(sizes[data[at + i]])
    named = 32 < data[at + NAME_AT] < 127
    return total if named and total == data[at + LENGTH_AT] else 0


@kernel
def _begins_with_time(data: Bytes, at: int) -> bool:
    """Whether the FMT record at ``at`` begins with a column TimeUS of 64 bits."""
    label = (84, 105, 109, 101, 85, 83)
    for i in range(6):
        if data[at + COLUMNS_AT + i] != label[i]:
            return False
    after = data[at + COLUMNS_AT + 6]
    character = data[at + CHARACTERS_AT]
    return bool((after == 44 or after == 0) and (character == 81 or character == 113))


@kernel
def _define(
    data: Bytes, at: int, sizes: Ints, definitions: Ints, defined: int, length: Ints, current: Ints, timed: Flags
) -> int:
    """Let the FMT record at ``at`` hold from here on, if it says something new; the number of definitions then."""
    kind = data[at + HEADER]
    size = _defined_length(data, at, sizes)
    if size == 0 or kind == FMT_TYPE:
        return defined
    if length[kind] > 0:
        old = definitions[current[kind]]
        if np.array_equal(data[old + LENGTH_AT : old + FMT_LENGTH], data[at + LENGTH_AT : at + FMT_LENGTH]):
            return defined
    definitions[defined] = at
    current[kind] = defined
    length[kind] = size
    timed[kind] = _begins_with_time(data, at)
    return defined + 1


@kernel
def _doubtful(
    data: Bytes, at: int, size: int, sizes: Ints, length: Ints, timed: Flags, lost: bool, last_timed: int
) -> tuple[int, int]:
    """A record of ``size`` bytes that no other follows: its size, 0 if it is none; and how many bytes to skip then.

    It has lost bytes if a record that is followed begins within it. Behind damage it is believed only if its time is
    near that of the record at ``last_timed`` (or NONE), or if it is a sound definition.
    """
    within = _chained_within(data, at + 1, at + size, length)
    if within >= 0:
        return 0, within - at
    kind = data[at + 2]
    if not lost or (kind == FMT_TYPE and _defined_length(data, at, sizes) > 0):
        return size, 1
    near = timed[kind] and last_timed >= 0 and abs(_time_us(data, at) - _time_us(data, last_timed)) < NEAR_US
    return (size if near else 0), 1


@kernel
def _is_torn_last(data: Bytes, at: int, length: Ints) -> bool:
    """Whether a record begins at ``at`` that the end of the log cuts."""
    if not _is_header(data, at) or length[data[at + 2]] == 0 or at + length[data[at + 2]] <= data.size:
        return False
    return _chained_within(data, at + 1, data.size, length) < 0


@kernel
def _grown(values: Places) -> Places:
    result = np.empty(2 * values.size, values.dtype)
    result[: values.size] = values
    return result


@kernel
def scan(data: Bytes, sizes: Ints, first: Ints) -> tuple[Ints, Kinds, Ints, Ints, Flags]:
    """Walk a binary log.

    ``sizes`` (256,) is the size of each format character, ``first`` (256,) where a definition stands that holds from
    the start on, or NONE. Returns the place of every record, the number of its definition, the place of every
    definition (number 0 is FMT's own, at NONE), the counts named above, and the types met before their definition.
    """
    places, kinds = np.empty(data.size // 32 + 1024, np.int64), np.empty(data.size // 32 + 1024, np.int32)
    definitions = np.empty(data.size // FMT_LENGTH + 258, np.int64)
    length, current = np.zeros(256, np.int64), np.zeros(256, np.int64)
    timed, early = np.zeros(256, np.bool_), np.zeros(256, np.bool_)
    counts = np.zeros(6, np.int64)
    counts[TAIL] = NONE
    definitions[0] = NONE
    length[FMT_TYPE] = FMT_LENGTH
    defined = 1
    for kind in range(256):
        if first[kind] >= 0:
            defined = _define(data, first[kind], sizes, definitions, defined, length, current, timed)
    found = 0
    last_timed = NONE
    at = 0
    size = _known(data, at, length)
    while at < data.size:
        skip = 1
        following = _known(data, at + size, length) if size > 0 else 0
        if size > 0 and following == 0 and not _chained(data, at + size, length):
            size, skip = _doubtful(data, at, size, sizes, length, timed, counts[TAIL] >= 0, last_timed)
        if size == 0:
            if _is_torn_last(data, at, length):
                counts[TORN_LAST] += 1
                counts[SKIPPED] += data.size - at
                counts[TAIL] = NONE
                break
            if _is_header(data, at):
                early[data[at + 2]] |= length[data[at + 2]] == 0
            counts[TORN_INSIDE] += skip > 1
            if counts[TAIL] < 0:
                counts[RUNS] += skip == 1
                counts[TAIL] = at
            counts[SKIPPED] += skip
            at += skip
            size = _known(data, at, length)
            continue
        counts[TAIL] = NONE
        if found == places.size:
            places, kinds = _grown(places), _grown(kinds)
        kind = data[at + 2]
        places[found], kinds[found] = at, current[kind]
        found += 1
        at += size
        size = following
        if timed[kind]:
            last_timed = places[found - 1]
        elif kind == FMT_TYPE:
            counts[BAD_FORMATS] += _defined_length(data, places[found - 1], sizes) == 0
            defined = _define(data, places[found - 1], sizes, definitions, defined, length, current, timed)
            size = _known(data, at, length)
    return places[:found], kinds[:found], definitions[:defined].copy(), counts, early


@kernel
def grouped(kinds: Kinds, count: int) -> tuple[Ints, Ints]:
    """Stable counting sort: the record numbers by kind, and where each of ``count`` kinds begins (count + 1,)."""
    starts = np.zeros(count + 1, np.int64)
    for i in range(kinds.size):
        starts[kinds[i] + 1] += 1
    for k in range(count):
        starts[k + 1] += starts[k]
    cursor = starts[:-1].copy()
    order = np.empty(kinds.size, np.int64)
    for i in range(kinds.size):
        order[cursor[kinds[i]]] = i
        cursor[kinds[i]] += 1
    return order, starts
