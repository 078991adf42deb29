"""The walk over a log's messages that cannot be vectorised, and what to do where a message is none.

A message is a 16-bit size, a letter and so many bytes. Nothing guards it, so what is known of each letter is checked;
data must also be of a subscribed number and of exactly its topic's size.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...geometry.jit import inline_kernel, kernel, part

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]

HEADER: Final = 3
NUMBER: Final = 2
ADD, DATA, FORMAT, INFO, MULTI, PARAMETER, DEFAULT, SYNC, FLAGS = (ord(letter) for letter in "ADFIMPQSB")
SYNC_MAGIC: Final = np.frombuffer(b"\x2f\x73\x13\x20\x25\x0c\xbb\x12", np.uint8)

LEAST: Final = np.zeros(256, np.int64)
"""Letter -> the least size of such a message; 0 where there is no such letter."""
MOST: Final = np.full(256, 0xFFFF, np.int64)
"""The most that a key or a name of 255 letters allows, and what no text exceeds: damage shall not swallow a log."""
for _letter, _least in zip("ADFIMPQRSOLCB", (4, 2, 2, 5, 6, 5, 6, 2, 8, 2, 9, 11, 40), strict=True):
    LEAST[ord(_letter)] = _least
for _letter, _most in zip("APQRSOLCB", (258, 264, 265, 2, 8, 2, 8192, 8192, 64), strict=True):
    MOST[ord(_letter)] = _most
KEY_AT: Final = np.zeros(256, np.int64)
"""Letter -> where in the message the length of its key stands; 0 where it has none."""
KEY_AT[[INFO, PARAMETER]] = HEADER
KEY_AT[[MULTI, DEFAULT]] = HEADER + 1
SHORTEST_KEY: Final = 3
TEXT_AT: Final = np.zeros(256, np.int64)
"""Letter -> where in the message its text begins, or where it ends for one without."""
for _letter, _text in zip("AFRSOLC", (6, 3, 5, 11, 5, 12, 14), strict=True):
    TEXT_AT[ord(_letter)] = _text
PARAMETER_BYTES: Final = 4
ESCAPE: Final = 27

ENDED, SEEN, FULL, DAMAGED = range(4)
"""Why `walk` returns: the section ends, a definition or a subscription was passed, no room is left, no message is."""
BAD_BYTES, TORN, UNKNOWN_LETTER, NO_SUBSCRIPTION, WRONG_SIZE = range(5)
"""Why bytes are skipped."""


@inline_kernel
def _size(data: Bytes, at: int) -> int:
    return int(data[at]) | (int(data[at + 1]) << 8)


@inline_kernel
def _subject(data: Bytes, at: int) -> int:
    """The number of the subscription that the data message at ``at`` names."""
    return int(data[at + HEADER]) | (int(data[at + HEADER + 1]) << 8)


@part
def _is_text(data: Bytes, start: int, stop: int) -> bool:
    at = start
    while at < stop and (data[at] >= 32 or 9 <= data[at] <= 13 or data[at] == ESCAPE):
        at += 1
    return at == stop


@part
def _plausible(data: Bytes, at: int, stop: int) -> int:
    """Length of the message at ``at`` by its header alone; 0 where that cannot be one."""
    if at + HEADER > stop:
        return 0
    size = _size(data, at)
    letter = data[at + 2]
    if LEAST[letter] == 0 or size < LEAST[letter] or size > MOST[letter] or at + HEADER + size > stop:
        return 0
    return HEADER + size


@part
def _right(data: Bytes, at: int, stop: int, topics: NDArray[np.int32]) -> int:
    """Length of the message at ``at``; 0 where it is not one by all that is known of its kind."""
    length = _plausible(data, at, stop)
    if length == 0:
        return 0
    letter = data[at + 2]
    size = length - HEADER
    if letter == DATA:
        number = _subject(data, at)
        return length if topics[number, 0] <= size <= topics[number, 1] else 0
    if letter == SYNC:
        for i in range(SYNC_MAGIC.size):
            if data[at + HEADER + i] != SYNC_MAGIC[i]:
                return 0
    elif KEY_AT[letter] > 0:
        key = int(data[at + KEY_AT[letter]])
        begin = at + KEY_AT[letter] + 1
        if key < SHORTEST_KEY or begin + key > at + length or not _is_text(data, begin, begin + key):
            return 0
    return length


@inline_kernel
def _certain(letter: int) -> bool:
    """Whether a right message of this kind is never chance."""
    return letter in (DATA, SYNC)


@part
def _leads_on(data: Bytes, at: int, stop: int, steps: int) -> bool:
    """Whether so many plausible messages follow, or the section ends behind one."""
    for _ in range(steps):
        length = _plausible(data, at, stop)
        if length == 0:
            return at + HEADER > stop
        at += length
    return True


@part
def _cut(data: Bytes, at: int, stop: int) -> bool:
    """Whether a message begins at ``at`` that ends behind the section's end."""
    return at + HEADER <= stop and 0 < LEAST[data[at + 2]] <= _size(data, at) and at + HEADER + _size(data, at) > stop


@part
def _stands_alone(data: Bytes, at: int, length: int) -> bool:
    """Whether a right message is credible whatever follows: its values fill it exactly, or it is text."""
    letter = data[at + 2]
    key_at = KEY_AT[letter]
    if letter in (PARAMETER, DEFAULT):
        return bool(key_at + 1 + int(data[at + key_at]) + PARAMETER_BYTES == length)
    begin = at + (key_at + 1 if key_at > 0 else TEXT_AT[letter])
    return bool(letter != FLAGS and _is_text(data, begin, at + length))


@kernel
def walk(
    data: Bytes, at: int, stop: int, topics: NDArray[np.int32], places: Ints, slots: NDArray[np.int32], count: int
) -> tuple[int, int, int]:
    """Follow the messages from ``at`` to ``stop``.

    ``topics`` (65536, 3): by number of subscription the least and the most size, and the topic's slot. Fills from
    ``count`` on the place of every message and its slot (-1 where it is not data). Returns where it stopped, the count,
    and why (ENDED, SEEN, FULL, DAMAGED).
    """
    while at < stop:
        if count == places.size:
            return at, count, FULL
        length = _right(data, at, stop, topics)
        if length == 0:
            return at, count, DAMAGED
        letter = data[at + 2]
        end = at + length
        if not (_certain(letter) or _stands_alone(data, at, length) or _leads_on(data, end, stop, 2)):
            return at, count, DAMAGED
        places[count] = at
        slots[count] = topics[_subject(data, at), 2] if letter == DATA else -1
        count += 1
        at = end
        if letter in (ADD, FORMAT):
            return at, count, SEEN
    return at, count, ENDED


@kernel
def resume(data: Bytes, at: int, stop: int, topics: NDArray[np.int32]) -> tuple[int, int]:
    """Where to go on after ``at``, where no message is, and why what is between is skipped.

    A whole message that means nothing here is passed when others follow it; else the next message is sought that
    cannot be chance, by itself or by the two behind it.
    """
    if at + HEADER <= stop and _size(data, at) > 0:
        end = at + HEADER + _size(data, at)
        letter = data[at + 2]
        if end <= stop and _leads_on(data, end, stop, 3):
            if letter == DATA and _size(data, at) >= NUMBER:
                return end, (NO_SUBSCRIPTION if topics[_subject(data, at), 1] == 0 else WRONG_SIZE)
            if LEAST[letter] == 0:
                return end, UNKNOWN_LETTER
            if _plausible(data, at, stop) > 0:
                return end, BAD_BYTES
    for place in range(at + 1, stop - HEADER):
        length = _right(data, place, stop, topics)
        if length > 0 and _certain(data[place + 2]):
            return place, BAD_BYTES
        if length > 0 and _stands_alone(data, place, length) and _leads_on(data, place + length, stop, 2):
            return place, BAD_BYTES
    return stop, (TORN if at + HEADER > stop or _cut(data, at, stop) else BAD_BYTES)


@kernel
def grouped(slots: NDArray[np.int32], kinds: int) -> tuple[Ints, Ints]:
    """Numbers of the messages slot by slot, and where each slot's begin; those of slot -1 come first."""
    starts = np.zeros(kinds + 2, np.int64)
    for i in range(slots.size):
        starts[slots[i] + 2] += 1
    for kind in range(kinds + 1):
        starts[kind + 1] += starts[kind]
    order = np.empty(slots.size, np.int64)
    filled = starts.copy()
    for i in range(slots.size):
        order[filled[slots[i] + 1]] = i
        filled[slots[i] + 1] += 1
    return order, starts
