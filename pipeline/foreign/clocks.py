"""When other people's samples were taken: header.stamp where there is one, brought onto the file's own clock."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...schemas.columns import Time

OTHER_EPOCH_NS = 3_600_000_000_000
"""Stamps further than this from the log times count from another beginning (boot, the start of a simulation)."""
ONE_CLOCK_NS = 60_000_000_000
"""Channels whose stamps differ from the log times by as much, to within this, share a clock."""


@dataclass(frozen=True, eq=False)
class Stamped:
    """A channel's log times and header stamps (None: it has none), each (n,), n at least 1."""

    log_ns: Time
    header_ns: Time | None

    @cached_property
    def _later_ns(self) -> Time:
        return self.log_ns - (self.log_ns if self.header_ns is None else self.header_ns)

    @cached_property
    def wild(self) -> NDArray[np.bool_]:
        """Stamps that are hours from where the others say they are."""
        return np.asarray(np.abs(self._later_ns - int(np.median(self._later_ns))) > OTHER_EPOCH_NS)

    @cached_property
    def behind_ns(self) -> int:
        """What to add to a stamp to be on the file's clock, as the message that was least delayed tells."""
        return int(np.min(self._later_ns[~self.wild]))

    @property
    def elsewhere(self) -> bool:
        """Whether the stamps count from another beginning than the log times."""
        return abs(self.behind_ns) > OTHER_EPOCH_NS


def sample_times(channels: Sequence[Stamped]) -> list[tuple[Time, Mapping[str, str]]]:
    """Sample times (n,) of each channel, and how they were found where that has to be said.

    Stamps of another epoch are all moved by one constant for each clock, so that channels stay in step. A wild stamp
    gives way to the log time.
    """
    moves = sorted(channel.behind_ns for channel in channels if channel.elsewhere)
    return [_times(channel, moves) for channel in channels]


def _times(channel: Stamped, moves: Sequence[int]) -> tuple[Time, Mapping[str, str]]:
    if channel.header_ns is None:
        return channel.log_ns, {"stamped_by": "log_time"}
    move, about = 0, {}
    if channel.elsewhere:
        move = min(other for other in moves if abs(other - channel.behind_ns) <= ONE_CLOCK_NS)
        about["stamp_offset_ns"] = str(move)
    if channel.wild.any():
        about["stamps_replaced"] = str(int(channel.wild.sum()))
    return np.where(channel.wild, channel.log_ns, channel.header_ns + move), about
