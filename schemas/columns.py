"""A channel's messages as columns: what ingestors hand to storage, and what storage hands back."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .definition import MessageType
from .passthrough import source_names

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

Time = NDArray[np.int64]
"""Integer nanoseconds, shape (n,)."""
Table = NDArray[np.void]
"""Structured array, shape (n,)."""


@dataclass(frozen=True)
class Channel:
    """A topic with its type. ``texts`` holds the strings that every message repeats, by dotted path."""

    topic: str
    type: MessageType
    metadata: Mapping[str, str] = field(default_factory=dict)
    texts: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Columns:
    """The messages of one channel.

    ``time_ns`` (n,) is log time, publish time and header stamp at once; it need not be sorted. ``data`` (n,) is a
    structured array with any of the type's top-level fields under their ROS names; a missing header is made from
    ``time_ns`` and the channel's texts, other missing fields are zero.
    """

    channel: Channel
    time_ns: Time
    data: Table

    def __post_init__(self) -> None:
        if self.time_ns.shape != self.data.shape:
            raise ValueError(f"{self.channel.topic}: {self.time_ns.shape} stamps for {self.data.shape} messages")

    def __len__(self) -> int:
        return len(self.time_ns)

    def __getitem__(self, name: str) -> NDArray[Any]:
        """A field, by its ROS name or the source's own (``gyrx`` or ``GyrX``)."""
        known = self.data.dtype.names or ()
        field = name if name in known else source_names(self.channel.type).get(name, name)
        if field not in known:
            raise KeyError(f"{self.channel.topic} has no field {name!r}; it has {', '.join(known)}")
        return self.data[field]

    def select(self, index: Any) -> "Columns":
        """The messages that ``index`` (a slice, a mask or positions) picks."""
        return replace(self, time_ns=self.time_ns[index], data=self.data[index])

    def to_numpy(self) -> NDArray[np.void]:
        """A flat structured array (`frames_out.to_numpy`): ``time_ns``, ``angular_velocity.x``, …"""
        from .frames_out import to_numpy

        return to_numpy(self)

    def to_arrow(self) -> "pa.Table":
        """A flat Arrow table with units and the channel's metadata (`frames_out.to_arrow`)."""
        from .frames_out import to_arrow

        return to_arrow(self)

    def to_pandas(self) -> "pd.DataFrame":
        """A flat pandas frame, indexed by ``time_ns`` (`frames_out.to_pandas`)."""
        from .frames_out import to_pandas

        return to_pandas(self)

    def with_metadata(self, **entries: str) -> "Columns":
        """The same messages on a channel that says more about itself."""
        return replace(self, channel=replace(self.channel, metadata={**self.channel.metadata, **entries}))
