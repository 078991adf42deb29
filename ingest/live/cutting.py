"""Where the last whole line or frame of what has arrived ends, how many there are, and how many are missing."""

from collections.abc import Mapping
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from ..mavlink import frames as framing
from ..mavlink import scan_kernel
from ..mavlink.definitions import dialect
from .address import Kind

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]

NEWLINE: Final = 10
LONGEST: Final = 300
"""More bytes than a frame or a line has: what is longer without an end is cut anyway."""
LONGEST_LINE: Final = 4096
REPEATED: Final = 192
"""A sequence number that seems to skip so many is one that came late or twice."""


class Cutter(Protocol):
    """Counts units (lines, frames) and those that are missing by their sequence numbers."""

    units: int
    missing: int

    def whole(self, data: Bytes) -> int:
        """Bytes up to the end of the last whole unit; what is behind comes again in the next call."""
        ...


class Lines:
    """Lines of text."""

    def __init__(self, _dialect: str = "") -> None:
        self.units = 0
        self.missing = 0

    def whole(self, data: Bytes) -> int:
        ends = np.flatnonzero(data == NEWLINE)
        self.units += len(ends)
        end = int(ends[-1]) + 1 if len(ends) else 0
        return len(data) if len(data) - end > LONGEST_LINE else end


class Frames:
    """MAVLink frames with right checksums."""

    def __init__(self, dialect_name: str) -> None:
        self.units = 0
        self.missing = 0
        self._crc_extra = dialect(dialect_name).crc_extra
        self._last: dict[int, int] = {}
        self.whole(np.zeros(16, np.uint8))  # loads the machine code before anything can arrive

    def whole(self, data: Bytes) -> int:
        places, keys = frames(data, self._crc_extra)
        self.units += len(places)
        self._count_missing(data, places, keys & 0xFFFF)
        end = int(places[-1] + frame_sizes(data, places[-1:])[0]) if len(places) else 0
        return max(end, len(data) - LONGEST) if len(data) - end > LONGEST else end

    def _count_missing(self, data: Bytes, places: Ints, senders: Ints) -> None:
        numbers = data[places + np.where(data[places] == scan_kernel.MAGIC_1, 2, 4)].astype(np.int64)
        for sender in np.unique(senders).tolist():
            own = numbers[senders == sender]
            before = self._last.get(sender, int(own[0]) - 1)
            skipped = (np.diff(own, prepend=before) - 1) & 0xFF
            self.missing += int(skipped[skipped < REPEATED].sum())
            self._last[sender] = int(own[-1])


def frames(data: Bytes, crc_extra: NDArray[np.int16]) -> tuple[Ints, Ints]:
    """The places of all right frames of a raw stream, and their keys (message, system, component)."""
    data = np.asarray(data).view()
    data.flags.writeable = False  # as the kernel is compiled
    found, _, _ = framing.scan(data, crc_extra, False, scan_kernel.NO_STAMP)
    return found[0], found[2]


def frame_sizes(data: Bytes, places: Ints) -> Ints:
    """Bytes of the frames at these places."""
    first = data[places] == scan_kernel.MAGIC_1
    size = data[places + 1].astype(np.int64)
    second = scan_kernel.HEADER_2 + scan_kernel.SIGNATURE * (data[places + 2] & 1)
    return np.asarray(size + scan_kernel.CHECKSUM + np.where(first, scan_kernel.HEADER_1, second))


CUTTERS: Final[Mapping[Kind, type[Lines] | type[Frames]]] = {Kind.CSV: Lines, Kind.MAVLINK: Frames}


def cutter(kind: Kind, dialect_name: str) -> Cutter:
    """The cutter of a source; loading what it needs may take a second."""
    return CUTTERS[kind](dialect_name)
