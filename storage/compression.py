"""How chunks are compressed: one codec per name that MCAP's registry knows."""

from collections.abc import Mapping
from typing import Protocol

import lz4.frame
import zstandard

LARGEST_RATIO: Mapping[str, int] = {"zstd": 1 << 16, "lz4": 256, "": 1}
"""No stream of the format unpacks to more than this many times its size, so a claim beyond it is damage."""

LEVEL = 3
"""Zstandard's level unless another is asked for."""


class Codec(Protocol):
    """Packs and unpacks chunks."""

    def compress(self, data: memoryview) -> bytes | memoryview: ...

    def decompress(self, data: memoryview, size: int) -> bytes | memoryview:
        """ValueError if ``data`` does not unpack to exactly ``size`` bytes. The next call may overwrite the result."""
        ...


class Plain:
    """No compression."""

    def compress(self, data: memoryview) -> memoryview:
        return data

    def decompress(self, data: memoryview, size: int) -> memoryview:
        return data


class Zstd:
    """Zstandard; unpacks into a buffer that is kept, since fresh memory costs as much again."""

    def __init__(self, level: int = LEVEL) -> None:
        self._pack = zstandard.ZstdCompressor(level=level)
        self._unpack = zstandard.ZstdDecompressor()
        self._buffer = memoryview(bytearray())

    def compress(self, data: memoryview) -> bytes:
        return self._pack.compress(data)

    def decompress(self, data: memoryview, size: int) -> memoryview:
        try:
            stated = zstandard.frame_content_size(data)
            if stated == -1:
                return memoryview(self._unpack.decompressobj().decompress(data))
            if stated != size:
                raise ValueError(f"zstd frame states {stated} bytes")
            if len(self._buffer) < size:
                self._buffer = memoryview(bytearray(size))
            with self._unpack.stream_reader(data) as reader:
                return self._buffer[: reader.readinto(self._buffer[:size])]
        except zstandard.ZstdError as error:
            raise ValueError(f"zstd: {error}") from error


class Lz4:
    """LZ4 frames."""

    def __init__(self) -> None:
        self._context = lz4.frame.create_decompression_context()

    def compress(self, data: memoryview) -> bytes:
        return bytes(lz4.frame.compress(data))

    def decompress(self, data: memoryview, size: int) -> bytes:
        # Twice the room: once such a block has been freed, glibc keeps blocks of this size instead of giving them back
        # to the system after each chunk, which costs four times the unpacking itself.
        try:
            lz4.frame.reset_decompression_context(self._context)
            unpacked, _, whole = lz4.frame.decompress_chunk(self._context, data, max_length=2 * size + 64)
        except RuntimeError as error:
            raise ValueError(f"lz4: {error}") from error
        if not whole:
            raise ValueError("lz4: the frame is cut off, or longer than stated")
        return bytes(unpacked)


def codecs(level: int = LEVEL) -> dict[str, Codec]:
    """A new set of codecs by the name that chunks carry (they keep state, so none is shared between threads)."""
    return {"": Plain(), "zstd": Zstd(level), "lz4": Lz4()}
