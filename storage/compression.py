"""How chunks are compressed: one codec per name that MCAP's registry knows."""

from collections.abc import Mapping
from typing import Protocol

import lz4.frame
import zstandard

LARGEST_RATIO: Mapping[str, int] = {"zstd": 1 << 16, "lz4": 256, "": 1}
"""No stream of the format unpacks to more than this many times its size, so a claim beyond it is damage."""


class Codec(Protocol):
    """Packs and unpacks chunks."""

    def compress(self, data: memoryview) -> bytes | memoryview: ...

    def decompress(self, data: memoryview, size: int) -> bytes | memoryview:
        """ValueError if ``data`` does not unpack to exactly ``size`` bytes."""
        ...


class Plain:
    """No compression."""

    def compress(self, data: memoryview) -> memoryview:
        return data

    def decompress(self, data: memoryview, size: int) -> memoryview:
        return data


class Zstd:
    """Zstandard, level 3."""

    def __init__(self, level: int = 3) -> None:
        self._pack = zstandard.ZstdCompressor(level=level)
        self._unpack = zstandard.ZstdDecompressor()

    def compress(self, data: memoryview) -> bytes:
        return self._pack.compress(data)

    def decompress(self, data: memoryview, size: int) -> bytes:
        try:
            stated = zstandard.frame_content_size(data)
            if stated not in (-1, size):
                raise ValueError(f"zstd frame states {stated} bytes")
            return self._unpack.decompress(data, max_output_size=size)
        except zstandard.ZstdError as error:
            raise ValueError(f"zstd: {error}") from error


class Lz4:
    """LZ4 frames."""

    def compress(self, data: memoryview) -> bytes:
        return bytes(lz4.frame.compress(data))

    def decompress(self, data: memoryview, size: int) -> bytes:
        try:
            stated = lz4.frame.get_frame_info(data)["content_size"]
            if stated == size:
                return bytes(lz4.frame.decompress(data))
            if stated:
                raise ValueError(f"lz4 frame states {stated} bytes")
            return bytes(lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size))
        except RuntimeError as error:
            raise ValueError(f"lz4: {error}") from error


def codecs() -> dict[str, Codec]:
    """A new set of codecs by the name that chunks carry (they keep state, so none is shared between threads)."""
    return {"": Plain(), "zstd": Zstd(), "lz4": Lz4()}
