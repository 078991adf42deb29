"""What arrived, as it arrived: the channel ``/recording/stream``, one message for each batch of pieces."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...schemas.columns import Channel, Columns
from ...schemas.definition import Field, MessageType
from ...schemas.messages import HEADER
from .receiver import Arrival

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]

TOPIC: Final = "/recording/stream"
STREAM: Final = MessageType(
    "attlog_msgs/msg/RecordedStream",
    (
        Field("header", HEADER, None, "stamp: when the first piece arrived"),
        Field("event", "string", None, "what happened to the link before these pieces, empty mostly"),
        Field("size", "uint32", 0, "bytes of each piece"),
        Field("after_us", "uint32", 0, "when each piece arrived, in microseconds after the stamp"),
        Field("data", "uint8", 0, "the pieces, one behind the other"),
    ),
)
CHANNEL: Final = Channel(TOPIC, STREAM)
MICROSECOND: Final = 1000
SECOND: Final = 10**9


@dataclass(frozen=True, eq=False)
class Pieces:
    """``data`` (b,), the ``ends`` (p,) of its pieces, ``time_ns`` (p,) of their arrival, and the link's events."""

    data: Bytes
    ends: Ints
    time_ns: Ints
    events: tuple[tuple[int, str], ...] = ()

    def arrival_of(self, at: Ints) -> Ints:
        """When the bytes at these places arrived."""
        return np.asarray(self.time_ns[np.searchsorted(self.ends, at, "right")])


def to_columns(arrivals: Sequence[Arrival]) -> Columns:
    """One message of at least one arrival, all with the first one's event."""
    start = arrivals[0][0]
    sizes = [len(data) for _, data, _ in arrivals if data]
    times = [time_ns for time_ns, data, _ in arrivals if data]
    data = b"".join(data for _, data, _ in arrivals)
    event = arrivals[0][2].encode()
    lengths = {"event": len(event), "size": len(sizes), "after_us": len(sizes), "data": len(data)}
    dtype = STREAM.dtype(lengths)
    row: NDArray[Any] = np.zeros(1, [(name, dtype[name]) for name in ("header", "event", "size", "after_us", "data")])
    stamp = row["header"]["stamp"]
    stamp["sec"], stamp["nanosec"] = divmod(start, SECOND)
    if event:
        row["event"] = event
    if sizes:
        row["size"][0] = sizes
        row["after_us"][0] = (np.array(times, np.int64) - start) // MICROSECOND
        row["data"][0] = np.frombuffer(data, np.uint8)
    return Columns(CHANNEL, np.array([start], np.int64), row)


def from_columns(columns: Columns) -> Pieces:
    """All pieces of a recording, in the order of their arrival (by the headers: log times may have been moved)."""
    start = arrivals_of(columns).tolist()
    sizes = [np.asarray(size, np.int64) for size in columns["size"]]
    after = [np.asarray(times, np.int64) for times in columns["after_us"]]
    data = [np.asarray(part, np.uint8) for part in columns["data"]]
    times = [begin + MICROSECOND * part for begin, part in zip(start, after, strict=True)]
    events = [
        (begin, bytes(event).decode("utf-8", "replace"))
        for begin, event in zip(start, columns["event"].tolist(), strict=True)
        if event
    ]
    empty = np.zeros(0, np.int64)
    return Pieces(
        np.concatenate([*data, np.zeros(0, np.uint8)]),
        np.cumsum(np.concatenate([*sizes, empty])),
        np.concatenate([*times, empty]),
        tuple(events),
    )


def arrivals_of(columns: Columns) -> Ints:
    """When the first piece of each message arrived."""
    stamp = columns["header"]["stamp"]
    return np.asarray(stamp["sec"].astype(np.int64) * SECOND + stamp["nanosec"])


def grouped(arrivals: Sequence[Arrival]) -> list[list[Arrival]]:
    """The arrivals, a new group at each event of the link."""
    groups: list[list[Arrival]] = []
    for arrival in arrivals:
        if arrival[2] or not groups:
            groups.append([])
        groups[-1].append(arrival)
    return groups
