"""What each sender says of its clock: own times in the order of the log, and pairs of own time and UTC."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from . import clocks
from .clocks import Observations
from .frames import Frames, Group
from .rows_kernel import BOOT_MS, UNIX_US, WRAP_US
from .scan_kernel import Ints

# Messages without time_boot_ms whose time is that of sending; others (a GPS fix) may be old.
PROMPT: Final = frozenset({"RAW_IMU", "HIGHRES_IMU"})
UTC_FROM_US: Final = 946_684_800_000_000
UTC_TO_US: Final = 4_102_444_800_000_000


@dataclass(frozen=True, eq=False)
class Pairs:
    """SYSTEM_TIME messages that know UTC: frame, own time (unwrapped), UTC."""

    frame: Ints
    own: Ints
    utc: Ints


NO_PAIRS: Final = Pairs(*np.empty((3, 0), np.int64))


@dataclass(frozen=True, eq=False)
class Sender:
    """A component with one kind of time, from boot or (``unix``) from 1970.

    ``wraps``: how often time_boot_ms had begun anew, per observation; the own times count on over it.
    """

    system: int
    component: int
    unix: bool
    seen: Observations
    wraps: Ints
    pairs: Pairs


def prompt(group: Group) -> bool:
    """Whether the message's own time is that of its sending."""
    return group.definition.own_time[0] == BOOT_MS or group.name in PROMPT


def senders(frames: Frames) -> Iterator[Sender]:
    """All senders that say a time, by their prompt messages, or by all where they have no prompt one."""
    key = _keys(frames)[frames.groups_of]
    index = np.flatnonzero((key >= 0) & (frames.own_us >= 0))
    if len(index) == 0:
        return
    kind = (key[index] | (frames.own_us[index] >= UNIX_US)).astype(np.int32)
    if kind.min() != kind.max():
        order = np.argsort(kind, kind="stable")
        index, kind = index[order], kind[order]
    firsts = np.flatnonzero(np.diff(kind, prepend=-1))
    for start, part in zip(firsts, np.split(index, firsts[1:]), strict=True):
        number = int(kind[start])
        seen = Observations(part, frames.stamps_us[part], frames.own_us[part])
        yield _sender(frames, number >> 9, number >> 1 & 0xFF, bool(number & 1), seen)


def _keys(frames: Frames) -> Ints:
    """Per group its sender as a number whose lowest bit is free, -1 where its times do not count."""
    with_prompt = {(g.system, g.component) for g in frames.groups if prompt(g)}
    keys = []
    for group in frames.groups:
        counts = prompt(group) or (group.system, group.component) not in with_prompt
        timed = group.definition.own_time[0] > 0
        keys.append(group.system << 9 | group.component << 1 if timed and counts else -1)
    return np.array(keys, np.int64)


def _sender(frames: Frames, system: int, component: int, unix: bool, seen: Observations) -> Sender:
    if unix:
        return Sender(system, component, unix, seen, np.zeros(len(seen), np.int64), NO_PAIRS)
    seen, wraps = clocks.unwrap(seen, frames.stamped)
    pairs = _pairs(frames, system, component)
    near = np.clip(np.searchsorted(seen.frame, pairs.frame), 0, len(seen) - 1)
    return Sender(
        system, component, unix, seen, wraps, Pairs(pairs.frame, pairs.own + WRAP_US * wraps[near], pairs.utc)
    )


def _pairs(frames: Frames, system: int, component: int) -> Pairs:
    for group in frames.of("SYSTEM_TIME", system=system):
        if group.component == component:
            utc, own_ms = group.rows["time_unix_usec"], group.rows["time_boot_ms"]
            knows = (utc >= UTC_FROM_US) & (utc < UTC_TO_US) & (own_ms > 0)
            place = np.flatnonzero(frames.groups_of == group.number)[knows]
            return Pairs(place, own_ms[knows].astype(np.int64) * 1000, utc[knows].astype(np.int64))
    return NO_PAIRS
