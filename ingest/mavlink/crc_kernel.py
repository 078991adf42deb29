"""CRC-16/MCRF4XX, MAVLink's checksum, sixteen bytes a step."""

from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ...geometry.jit import part

Integer: TypeAlias = int | np.signedinteger[Any]
"""What numbers are inside kernels; a plain int(...) of unsigned bytes would be unsigned there."""

POLYNOMIAL: Final = 0x8408
INITIAL: Final = 0xFFFF


def _tables() -> NDArray[np.uint16]:
    """Row k: the CRC of each byte followed by k zero bytes."""
    row = np.arange(256, dtype=np.uint16)
    for _ in range(8):
        row = np.where(row & 1, (row >> 1) ^ np.uint16(POLYNOMIAL), row >> 1).astype(np.uint16)
    rows = [row]
    for _ in range(15):
        rows.append((rows[-1] >> 8) ^ row[rows[-1] & 0xFF])
    return np.array(rows)


TABLES: Final = _tables()
# A table entry's high byte -> its index; distinct, since the polynomial's top bit is set.
INDEX_OF_HIGH: Final = np.argsort(TABLES[0] >> 8).astype(np.uint8)


@part
def word(data: NDArray[np.uint8], at: Integer) -> np.uint64:
    """Eight bytes, little-endian; the compiler makes it one load."""
    i = np.uint64(at)
    return (
        np.uint64(data[i])
        | np.uint64(data[i + np.uint64(1)]) << np.uint64(8)
        | np.uint64(data[i + np.uint64(2)]) << np.uint64(16)
        | np.uint64(data[i + np.uint64(3)]) << np.uint64(24)
        | np.uint64(data[i + np.uint64(4)]) << np.uint64(32)
        | np.uint64(data[i + np.uint64(5)]) << np.uint64(40)
        | np.uint64(data[i + np.uint64(6)]) << np.uint64(48)
        | np.uint64(data[i + np.uint64(7)]) << np.uint64(56)
    )


@part
def folded(eight: np.uint64, after: Integer) -> Integer:
    """CRC, begun with 0, of eight bytes and as many zero bytes as ``after`` says (0 or 8)."""
    byte = np.uint64(0xFF)
    return np.int64(
        TABLES[after + 7, eight & byte]
        ^ TABLES[after + 6, eight >> np.uint64(8) & byte]
        ^ TABLES[after + 5, eight >> np.uint64(16) & byte]
        ^ TABLES[after + 4, eight >> np.uint64(24) & byte]
        ^ TABLES[after + 3, eight >> np.uint64(32) & byte]
        ^ TABLES[after + 2, eight >> np.uint64(40) & byte]
        ^ TABLES[after + 1, eight >> np.uint64(48) & byte]
        ^ TABLES[after, eight >> np.uint64(56)]
    )


@part
def checksum(data: NDArray[np.uint8], start: Integer, stop: Integer) -> Integer:
    """CRC of ``data[start:stop]``, before CRC_EXTRA.

    The bytes over a multiple of eight go first, behind zero bytes, which a CRC begun with 0 does not see; the true
    beginning, INITIAL, is then what the first two bytes are changed by.
    """
    if start + 8 > len(data):
        return bytewise(data, start, stop)
    odd = (stop - start) & 7
    crc = np.uint64(INITIAL)
    at = start
    if odd:
        shift = np.uint64(64 - 8 * odd)
        crc = np.uint64(folded((word(data, at) ^ crc) << shift, 0)) ^ crc >> np.uint64(8 * odd)
        at += odd
    if (stop - at) & 8:
        crc = np.uint64(folded(word(data, at) ^ crc, 0))
        at += 8
    while at < stop:
        crc = np.uint64(folded(word(data, at) ^ crc, 8) ^ folded(word(data, at + 8), 0))
        at += 16
    return np.int64(crc)


@part
def bytewise(data: NDArray[np.uint8], start: Integer, stop: Integer) -> Integer:
    """`checksum` without reading behind ``stop``."""
    crc = INITIAL
    for at in range(start, stop):
        crc = crc >> 8 ^ int(TABLES[0, (crc ^ data[at]) & 0xFF])
    return np.int64(crc)


@part
def with_extra(crc: Integer, extra: Integer) -> Integer:
    """The CRC after one more byte, CRC_EXTRA."""
    return (crc >> 8) ^ np.int64(TABLES[0, np.uint64((crc ^ extra) & 0xFF)])


@part
def implied_extra(crc: Integer, received: Integer) -> Integer:
    """The CRC_EXTRA that makes ``received`` right, -1 where none does (255 of 256 times, in garbage)."""
    wanted = received ^ (crc >> 8)
    index = int(INDEX_OF_HIGH[(wanted >> 8) & 0xFF])
    return index ^ (crc & 0xFF) if int(TABLES[0, index]) == wanted else -1
