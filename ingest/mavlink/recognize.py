"""Whether a file is MAVLink, from its first bytes; without Numba."""

from functools import lru_cache
from typing import Any, Final

MAGICS: Final = (0xFE, 0xFD)
ENOUGH: Final = 2
MOST_TRIALS: Final = 4096


def recognizes(head: bytes) -> bool:
    """Whether ``head`` holds two frames with right checksums, or one where a log's first frame belongs."""
    found, at, trials = 0, 0, 0
    while at < len(head) - 7 and trials < MOST_TRIALS:
        if head[at] not in MAGICS:
            at += 1
            continue
        trials += 1
        length = _frame_length(head, at)
        if length and _is_right(head, at, length):
            found += 1
            if found == ENOUGH or at in (0, 8):
                return True
            at += length
        else:
            at += 1
    return False


def _frame_length(head: bytes, at: int) -> int:
    if head[at] == 0xFE:
        length = 8 + head[at + 1]
    elif head[at + 2] > 1:
        return 0
    else:
        length = 12 + head[at + 1] + 13 * head[at + 2]
    return length if at + length <= len(head) else 0


def _is_right(head: bytes, at: int, length: int) -> bool:
    first = head[at] == 0xFE
    identity = head[at + 5] if first else int.from_bytes(head[at + 7 : at + 10], "little")
    message = _messages().get(identity)
    if message is None:
        return False
    end = at + (6 if first else 10) + head[at + 1]
    crc = 0xFFFF
    for byte in (*head[at + 1 : end], message.crc_extra):
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ 0x8408 if crc & 1 else crc >> 1
    return crc == int.from_bytes(head[end : end + 2], "little")


@lru_cache(maxsize=1)
def _messages() -> dict[int, Any]:
    from pymavlink.dialects.v20 import ardupilotmega

    return dict(ardupilotmega.mavlink_map)
