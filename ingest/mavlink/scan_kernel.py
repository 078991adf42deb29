"""Where the frames are: one pass over a log's bytes, with resynchronisation after whatever is not a frame.

A telemetry log is a row of records, each 8 bytes of big-endian microseconds and a frame; a raw stream is frames alone.
A frame counts when its checksum, which includes the message's CRC_EXTRA, is right. Whatever else there is belongs to a
run of bad bytes; after it the scan goes on at the next byte where a frame is right or a record begins credibly, so that
a bad length byte never swallows the frames behind it.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ...geometry.jit import kernel, part
from .crc_kernel import Integer, checksum, implied_extra, with_extra, word

MAGIC_1: Final = 0xFE
MAGIC_2: Final = 0xFD
HEADER_1: Final = 6
HEADER_2: Final = 10
CHECKSUM: Final = 2
SIGNATURE: Final = 13
SIGNED: Final = 1
SHORTEST: Final = HEADER_1 + CHECKSUM
LONGEST: Final = HEADER_2 + 255 + CHECKSUM + SIGNATURE
STAMP: Final = 8
NO_STAMP: Final = -1
CREDIBLE_US: Final = 86_400_000_000
# What stands behind a frame's stamp
LOOSE: Final = 0
IN_PLACE: Final = 1
OF_BAD_FRAME: Final = 2

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]


@part
def frame_length(data: Bytes, at: Integer) -> Integer:
    """Bytes of the frame whose header is at ``at``, 0 where there is no header or the data end before it does."""
    size = len(data)
    if at + SHORTEST > size:
        return 0
    if data[at] == MAGIC_1:
        length = HEADER_1 + np.int64(data[at + 1]) + CHECKSUM
    elif data[at] == MAGIC_2:
        if data[at + 2] > SIGNED:
            return 0
        length = HEADER_2 + np.int64(data[at + 1]) + CHECKSUM + (SIGNATURE if data[at + 2] == SIGNED else 0)
    else:
        return 0
    return length if at + length <= size else 0


@part
def message_id(data: Bytes, at: Integer) -> Integer:
    """The message id of the frame at ``at``."""
    if data[at] == MAGIC_1:
        return np.int64(data[at + 5])
    return np.int64(data[at + 7]) | (np.int64(data[at + 8]) << 8) | (np.int64(data[at + 9]) << 16)


@part
def key_of(data: Bytes, at: Integer) -> Integer:
    """Message id, system id and component id of the frame at ``at``, in one number."""
    first = at + 3 if data[at] == MAGIC_1 else at + 5
    return (message_id(data, at) << 16) | (np.int64(data[first]) << 8) | np.int64(data[first + 1])


@part
def extra_of(crc_extra: NDArray[np.int16], identity: Integer) -> Integer:
    """CRC_EXTRA of a message, -1 where the dialect does not know it."""
    return int(crc_extra[identity]) if identity < len(crc_extra) else -1


@part
def sums(data: Bytes, at: Integer) -> tuple[Integer, Integer]:
    """The checksum of the frame at ``at`` before CRC_EXTRA, and the one that it carries."""
    header = HEADER_1 if data[at] == MAGIC_1 else HEADER_2
    end = at + header + np.int64(data[at + 1])
    return checksum(data, at + 1, end), np.int64(data[end]) | (np.int64(data[end + 1]) << 8)


@part
def known_frame(data: Bytes, at: Integer, crc_extra: NDArray[np.int16]) -> tuple[Integer, Integer]:
    """(bytes, `key_of`) of the frame at ``at`` where it is right and its message known, else (0, 0).

    The hot path: what `frame_length`, `message_id` and `sums` say one by one, from one load of the header.
    """
    if at + SHORTEST > len(data):
        return 0, 0
    header = np.int64(word(data, at))
    magic = header & 0xFF
    end = at + (header >> 8 & 0xFF)
    signature: Integer = 0
    if magic == MAGIC_1:
        end += HEADER_1
        identity = header >> 40 & 0xFF
        sender = (header >> 16 & 0xFF00) | (header >> 32 & 0xFF)
    elif magic == MAGIC_2:
        signature = SIGNATURE * (header >> 16 & 0xFF)
        end += HEADER_2
        if signature > SIGNATURE or end + CHECKSUM > len(data):
            return 0, 0
        identity = (
            header >> 56 & 0xFF | np.int64(data[np.uint64(at + 8)]) << 8 | np.int64(data[np.uint64(at + 9)]) << 16
        )
        sender = (header >> 32 & 0xFF00) | (header >> 48 & 0xFF)
    else:
        return 0, 0
    length = end + CHECKSUM + signature - at
    if at + length > len(data) or identity >= len(crc_extra):
        return 0, 0
    extra = np.int64(crc_extra[np.uint64(identity)])
    if extra < 0:
        return 0, 0
    carried = np.int64(data[np.uint64(end)]) | np.int64(data[np.uint64(end + 1)]) << 8
    if with_extra(checksum(data, at + 1, end), extra) != carried:
        return 0, 0
    return length, identity << 16 | sender


@part
def extra_in(data: Bytes, at: Integer) -> Integer:
    """The CRC_EXTRA that makes the checksum of the frame at ``at`` right, -1 where none does or no frame is there."""
    if frame_length(data, at) == 0:
        return -1
    crc, carried = sums(data, at)
    return implied_extra(crc, carried)


@part
def is_magic(data: Bytes, at: Integer) -> bool:
    """Whether a frame could begin at ``at``."""
    return bool(at < len(data) and (data[at] == MAGIC_1 or data[at] == MAGIC_2))


@part
def stamp_at(data: Bytes, at: Integer) -> Integer:
    """The big-endian stamp at ``at`` in microseconds, NO_STAMP where it is beyond the year 2112."""
    high, low = np.int64(0), np.int64(0)
    for i in range(4):
        high = high << 8 | np.int64(data[np.uint64(at + i)])
        low = low << 8 | np.int64(data[np.uint64(at + 4 + i)])
    return NO_STAMP if high >> 20 else high << 32 | low


@part
def near(stamp: Integer, other: Integer) -> bool:
    """Whether two stamps are within a day."""
    return bool(-CREDIBLE_US <= stamp - other <= CREDIBLE_US)


@part
def stamp_is_credible(data: Bytes, at: Integer, last: Integer) -> bool:
    """Whether a stamp within a day of ``last`` is at ``at``, and something behind it."""
    if at + STAMP >= len(data):
        return False
    stamp = stamp_at(data, at)
    return bool(stamp >= 0 and near(stamp, last))


@part
def record_begins(data: Bytes, at: Integer, last: Integer) -> bool:
    """Whether a credible stamp and then a header's first byte are at ``at``."""
    return bool(is_magic(data, at + STAMP) and stamp_is_credible(data, at, last))


@part
def holds_known_frame(data: Bytes, start: Integer, stop: Integer, crc_extra: NDArray[np.int16]) -> bool:
    """Whether a right frame of a known message begins in ``[start, stop)``."""
    for at in range(start, stop):  # noqa: SIM110 - Numba has no any() of a generator
        if is_magic(data, at) and known_frame(data, at, crc_extra)[0] > 0:
            return True
    return False


@kernel
def gaps_and_stamps(data: Bytes, places: Ints) -> tuple[Ints, Ints]:
    """Bytes between each frame and the one before, and the stamp that would stand before it (NO_STAMP at the start)."""
    gaps, stamps = np.empty(len(places), np.int64), np.empty(len(places), np.int64)
    end = 0
    for i in range(len(places)):
        gaps[i] = places[i] - end
        stamps[i] = stamp_at(data, places[i] - STAMP) if places[i] >= STAMP else NO_STAMP
        end = places[i] + frame_length(data, places[i])
    return gaps, stamps


@part
def unknown_frame(
    data: Bytes, at: Integer, crc_extra: NDArray[np.int16], stamped: bool, last: Integer, in_place: bool
) -> Integer:
    """Bytes of a credible frame of an unknown message at ``at``, else 0.

    Some CRC_EXTRA must make it right (in garbage, one of 256 times), and the next record must begin behind it or the
    data end there; in its place in the row of records it will also do that it covers no known frame.
    """
    length = frame_length(data, at)
    if length == 0 or extra_of(crc_extra, message_id(data, at)) >= 0 or extra_in(data, at) < 0:
        return 0
    end = at + length
    if end == len(data) or (record_begins(data, end, last) if stamped else is_magic(data, end)):
        return length
    return length if in_place and not holds_known_frame(data, at + 1, end, crc_extra) else 0


@part
def next_right(
    data: Bytes, at: Integer, crc_extra: NDArray[np.int16], stamped: bool, last: Integer
) -> tuple[Integer, Integer]:
    """(place, length) of the next frame that counts, or (place, 0) of the next record's stamp or of the data's end."""
    while at < len(data):
        if stamped and record_begins(data, at, last):
            return at, 0
        if is_magic(data, at):
            length, _ = known_frame(data, at, crc_extra)
            if length == 0:
                length = unknown_frame(data, at, crc_extra, stamped, last, False)
            if length > 0:
                return at, length
        at += 1
    return at, 0


@kernel
def scan(
    data: Bytes,
    at: Integer,
    crc_extra: NDArray[np.int16],
    stamped: bool,
    last: Integer,
    found_frames: Ints,
    kinds: Bytes,
    bad: Ints,
) -> tuple[Integer, Integer, Integer, Integer]:
    """Find the frames from ``at`` on until the data end or the tables are full.

    Returns how many frames and how many runs of bad bytes there are, where the scan ended, and the last right stamp.
    ``last``: a stamp that is known to be right, for telemetry logs. Filled are, per frame, ``found_frames`` (3, n):
    place, stamp as it stands in the log (us, NO_STAMP where there is none), key (`key_of`); ``kinds`` (n,): where the
    stamp comes from (LOOSE, IN_PLACE, OF_BAD_FRAME); ``bad`` (r, 4): a run's start, stop, message id of a header there
    (-1 none), CRC_EXTRA it implies (-1 none).
    """
    size = len(data)
    places, stamps, keys = found_frames
    count, runs = 0, 0
    before: Integer = last
    while at < size and count < len(places) and runs < len(bad):
        head = at + STAMP if stamped else at
        length, key = known_frame(data, head, crc_extra)
        if length == 0:
            length = unknown_frame(data, head, crc_extra, stamped, last, True)
            key = key_of(data, head) if length > 0 else 0
        if length > 0:
            stamp = stamp_at(data, at) if stamped else NO_STAMP
            if stamp >= 0 and (near(stamp, last) or near(stamp, before)):
                last = stamp
            before = stamp
            places[count], stamps[count], keys[count], kinds[count] = head, stamp, key, IN_PLACE
            count += 1
            at = head + length
            continue
        start, found = at, at
        owner: Integer = NO_STAMP
        if stamped and stamp_is_credible(data, at, last):
            owner, start, found = stamp_at(data, at), head, head
        if start == head and is_magic(data, head):
            found = start + 1
        found, length = next_right(data, found, crc_extra, stamped, last)
        if length > 0:
            kinds[count] = OF_BAD_FRAME if owner >= 0 else LOOSE
            places[count], stamps[count], keys[count] = found, owner, key_of(data, found)
            count += 1
        if found > start:
            header = frame_length(data, start) > 0
            bad[runs, 0], bad[runs, 1] = start, found
            bad[runs, 2] = message_id(data, start) if header else -1
            bad[runs, 3] = extra_in(data, start)
            runs += 1
        at = found + length
    return count, runs, at, last
