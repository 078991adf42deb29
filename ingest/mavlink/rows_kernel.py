"""Kernels that sort frames into groups (message, system, component) and lay each group out as an array of rows.

A row is what `definitions.Definition.row` describes: stamp, zero-padded payload, sequence.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...geometry.jit import kernel, part
from .crc_kernel import Integer, word
from .scan_kernel import HEADER_1, HEADER_2, MAGIC_1, Bytes, Ints

NO_TIME: Final = -1
UNIX_US: Final = 1_000_000_000_000_000
"""Times from here on (September 2001) count from 1970, smaller ones from the sender's boot."""
LATEST_US: Final = 1 << 52
"""Times from here on (the year 2112) are none."""
WRAP_US: Final = 4_294_967_296_000
"""time_boot_ms begins anew after so many microseconds (49.7 days); boot times are kept modulo this."""
BOOT_MS: Final = 1
MICROSECONDS: Final = 2
SHORT_MICROSECONDS: Final = 3
MULTIPLIER: Final = 0x9E3779B1
FREE: Final = -1
FIRST_SIZE: Final = 1024


@part
def slot_of(table: Ints, keys: Ints, key: Integer) -> Integer:
    """Where ``key`` is in an open-addressing table of numbers of keys (its size a power of two), or where it goes."""
    mask = len(table) - 1
    slot = ((key * MULTIPLIER) >> 15) & mask
    while table[slot] != FREE and keys[table[slot]] != key:
        slot = (slot + 1) & mask
    return slot


@kernel
def classify(
    key_of_frame: Ints, start: Integer, table: Ints, keys: Ints, counts: Ints, known: Integer, groups: NDArray[np.int32]
) -> tuple[Integer, Integer]:
    """Number the frames' keys from frame ``start`` on, until ``keys`` are full or all frames are done.

    ``table`` is empty and twice as long as ``keys``, of which ``known`` are known already. Filled are ``groups``, the
    number of each frame's key, ``keys`` and their ``counts``. Returns how many keys are known and frames are done.
    """
    for number in range(known):
        table[slot_of(table, keys, keys[number])] = number
    for i in range(start, len(key_of_frame)):
        key = key_of_frame[i]
        slot = slot_of(table, keys, key)
        if table[slot] == FREE:
            if known == len(keys):
                return known, i
            table[slot], keys[known] = known, key
            known += 1
        groups[i] = table[slot]
        counts[table[slot]] += 1
    return known, len(key_of_frame)


@part
def extend_short(value: Integer, near: Integer) -> Integer:
    """Microseconds of which only 32 bits were sent: the time nearest to ``near`` that ends in them."""
    period = 1 << 32
    return near + (value - near + period // 2) % period - period // 2


@part
def own_time(out: NDArray[np.uint64], at: Integer, how: Integer, near: Integer) -> Integer:
    """A message's own time in microseconds, NO_TIME where it is not set (0).

    ``at``: its first byte, counted from that of ``out``; ``how``: see `definitions.OWN_TIME`.
    """
    shift = np.uint64(8 * (at & 7))
    value = out[at >> 3] >> shift
    if shift > np.uint64(0 if how == MICROSECONDS else 32):
        value |= out[(at >> 3) + 1] << (np.uint64(64) - shift)
    own: Integer = np.int64(value if how == MICROSECONDS else value & np.uint64(0xFFFFFFFF))
    if how == BOOT_MS:
        own *= 1000
    elif how == SHORT_MICROSECONDS:
        own = extend_short(own, near) if own > 0 and near >= 0 else NO_TIME
    if own <= 0 or own > LATEST_US:
        return NO_TIME
    return own if own >= UNIX_US else own % WRAP_US


@part
def copy_payload(data: Bytes, at: Integer, length: Integer, out: NDArray[np.uint64], to: Integer) -> None:
    """Copy ``length`` bytes to ``out`` from its word ``to`` on, in words where the data are long enough."""
    whole, odd = length >> 3, length & 7
    if at + length + 8 > len(data):
        for j in range(length):
            out[to + (j >> 3)] |= np.uint64(data[at + j]) << np.uint64(8 * (j & 7))
        return
    for j in range(whole):
        out[np.uint64(to + j)] = word(data, at + 8 * j)
    if odd:
        mask = (np.uint64(1) << np.uint64(8 * odd)) - np.uint64(1)
        out[np.uint64(to + whole)] = word(data, at + 8 * whole) & mask


@kernel
def gather(
    data: Bytes,
    places: Ints,
    stamps_us: Ints,
    groups: NDArray[np.int32],
    layout: Ints,
    out: NDArray[np.uint64],
    rows: Ints,
    own: Ints,
) -> None:
    """Fill the rows of all groups and read the messages' own times.

    ``layout`` (groups, 7): first word in ``out``, words a row, bytes of payload, how and where it says its own time,
    the group's first row when all groups are counted through, the sender's number. ``out`` is zero. Filled are per
    frame ``rows``, its row, and ``own``, its own time (us, NO_TIME).
    """
    filled = np.zeros(len(layout), np.int64)
    latest = np.full(len(layout), NO_TIME, np.int64)
    for i in range(len(places)):
        at, group = places[i], groups[i]
        header = np.int64(word(data, at))
        version_1 = header & 0xFF == MAGIC_1
        first = layout[group, 0] + filled[group] * layout[group, 1] + 1
        size = layout[group, 2]
        rows[i] = layout[group, 5] + filled[group]
        filled[group] += 1
        out[np.uint64(first - 1)] = np.uint64(max(stamps_us[i], 0))
        copy_payload(data, at + (HEADER_1 if version_1 else HEADER_2), min(header >> 8 & 0xFF, size), out, first)
        sequence = header >> (16 if version_1 else 32) & 0xFF
        out[np.uint64(first + (size >> 3))] |= np.uint64(sequence) << np.uint64(8 * (size & 7))
        how = layout[group, 3]
        if how == 0:
            own[i] = NO_TIME
            continue
        sender = layout[group, 6]
        own[i] = own_time(out, 8 * first + layout[group, 4], how, latest[sender])
        if how == BOOT_MS and own[i] >= 0:
            latest[sender] = own[i]
