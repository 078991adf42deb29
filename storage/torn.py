"""What can be had of a chunk that is cut off."""

from collections.abc import Callable, Mapping
from typing import Final, Protocol

import lz4.frame
import numpy as np
import zstandard

from .ragged import Bytes
from .records import MESSAGE_HEAD, RECORD_HEAD, Op

STEP: Final = 4096


class _Decompressor(Protocol):
    def decompress(self, data: bytes, /) -> bytes: ...


class _Plain:
    def decompress(self, data: bytes, /) -> bytes:
        return data


_DECOMPRESSORS: Final[Mapping[str, Callable[[], _Decompressor]]] = {
    "": _Plain,
    "zstd": lambda: zstandard.ZstdDecompressor().decompressobj(),
    "lz4": lz4.frame.LZ4FrameDecompressor,
}


def unpacked(packed: memoryview, compression: str, size: int) -> Bytes:
    """The bytes that come out of the beginning of a compressed chunk, at most ``size``."""
    if compression not in _DECOMPRESSORS:
        return np.zeros(0, np.uint8)
    machine = _DECOMPRESSORS[compression]()
    out, length = [], 0
    for at in range(0, len(packed), STEP):
        try:
            out.append(machine.decompress(bytes(packed[at : at + STEP])))
        except (zstandard.ZstdError, RuntimeError, EOFError):
            break
        length += len(out[-1])
        if length >= size:
            break
    return np.frombuffer(b"".join(out)[:size], np.uint8)


def whole_records(data: Bytes) -> Bytes:
    """The beginning of the bytes, as far as it is schemas, channels and messages."""
    at, end, view = 0, len(data), data.data
    while at + RECORD_HEAD <= end and view[at] in (Op.SCHEMA, Op.CHANNEL, Op.MESSAGE):
        length = RECORD_HEAD + int.from_bytes(view[at + 1 : at + RECORD_HEAD], "little")
        if length > end - at or (view[at] == Op.MESSAGE and length < MESSAGE_HEAD):
            break
        at += length
    return data[:at]
