"""One channel of a file: what it says of itself, and its messages as columns by the decoder of its encoding."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from ..schemas.columns import Channel, Columns, Table
from ..schemas.definition import Field, MessageType
from ..schemas.errors import InputError
from ..schemas.passthrough import source_names
from .cdr import read_cdr, read_ros1, supported
from .collect import Payloads
from .json_columns import read_json
from .records import ChannelRecord, SchemaRecord
from .ros1 import parse_ros1

RAW = MessageType("attlog_msgs/msg/Raw", (Field("data", "uint8", 0, "the message as it is in the file"),))
"""The type of channels whose encoding is not known: one field, the bytes."""


@dataclass(frozen=True)
class ChannelInfo:
    """A channel of a file: ``encoding`` is its messages' (cdr, json, …), ``raw`` says why it stays undecoded."""

    channel: Channel
    count: int
    encoding: str
    schema_name: str
    schema_encoding: str
    id: int
    metadata: Mapping[str, str] = field(default_factory=dict)
    raw: str = ""
    span: Callable[[], tuple[int, int]] = field(default=lambda: (0, 0), repr=False, compare=False)

    @property
    def start_ns(self) -> int:
        """The log time of the first message (0 without messages); found when asked for, from the message indexes."""
        return self.span()[0]

    @property
    def end_ns(self) -> int:
        """The log time of the last message (0 without messages)."""
        return self.span()[1]

    @property
    def source_names(self) -> Mapping[str, str]:
        """The source's own field name -> the ROS name."""
        return source_names(self.channel.type)


def decoded(info: ChannelInfo, payloads: Payloads) -> Columns:
    """The messages as columns; PayloadError for one that is not what the channel says."""
    channel = info.channel
    if info.raw:
        return Columns(channel, payloads.time_ns, _raw(payloads))
    if info.encoding == "json":
        message, table = read_json(info.schema_name or channel.topic, payloads)
        return Columns(Channel(channel.topic, message, channel.metadata), payloads.time_ns, table)
    read = read_ros1 if info.encoding == "ros1" else read_cdr
    return Columns(channel, payloads.time_ns, read(channel.type, payloads))


def type_of(record: ChannelRecord, schema: SchemaRecord | None) -> tuple[MessageType, str]:
    """The channel's type, or RAW and the reason."""
    encoding = (record.encoding, schema.encoding if schema else "")
    if record.encoding == "json":
        return RAW, ""
    parsers = {("cdr", "ros2msg"): MessageType.parse, ("ros1", "ros1msg"): parse_ros1}
    if schema is None or encoding not in parsers:
        return RAW, f"messages encoded as {encoding[0]!r} with a schema in {encoding[1]!r} are not decoded"
    try:
        message = parsers[encoding](schema.name, schema.data.decode())
    except (InputError, ValueError) as error:
        return RAW, f"the schema cannot be read: {error}"
    return (message, "") if supported(message) else (RAW, "wide strings are not decoded")


def _raw(payloads: Payloads) -> Table:
    ends = payloads.start + payloads.size
    pieces = (payloads.data[a:b].tobytes() for a, b in zip(payloads.start.tolist(), ends.tolist(), strict=True))
    table = np.zeros(len(payloads), [("data", object)])
    table["data"] = np.fromiter(pieces, object, len(payloads))
    return table
