"""`write`: columns to a new MCAP file."""

import os
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from ..schemas.columns import Channel, Columns
from ..schemas.errors import StorageError, UsageError
from .chunks_out import ChunkWriter, Outlet, write_idle
from .compression import LEVEL, codecs
from .contents import Contents, write_attachment, write_end, write_header, write_metadata
from .records import Attachment, ChannelRecord, SchemaRecord
from .rows import rows_of
from .schedule import schedule
from .sink import replacing

PROFILE = "ros2"
LIBRARY = "attlog"
COMPRESSIONS: Mapping[str, str] = {"zstd": "zstd", "lz4": "lz4", "none": ""}
_DERIVED = re.compile(r"(/vehicle\d+)?/(estimate|error|findings|annotations|tf|bodies)(/|$)")
QOS_KEY = "offered_qos_profiles"
_FOREVER = "\n    sec: 9223372036\n    nsec: 854775807\n"
QOS = (
    "- history: 1\n  depth: 10\n  reliability: 1\n  durability: 2\n"
    f"  deadline:{_FOREVER}  lifespan:{_FOREVER}  liveliness: 1\n  liveliness_lease_duration:{_FOREVER}"
    "  avoid_ros_namespace_conventions: false"
)
"""What rosbag2 records of an ordinary publisher (keep last, reliable, volatile); ``ros2 bag play`` asks for it."""


def is_derived(topic: str) -> bool:
    """Whether estimating, analyzing or annotating makes the topic, and makes it again."""
    return _DERIVED.match(topic) is not None


def write(
    path: str | os.PathLike[str],
    columns: Iterable[Columns],
    *,
    metadata: Mapping[str, Mapping[str, str]] | None = None,
    attachments: Sequence[Attachment] = (),
    compression: str = "zstd",
    level: int = LEVEL,
    force: bool = False,
    apart: Callable[[str], bool] = is_derived,
) -> None:
    """Write channels to ``path``, interleaved by time, with profile ros2, every index and every CRC.

    ``compression``: zstd (at ``level``), lz4 or none. The topics ``apart`` get chunks of their own, behind the others,
    so that `annotate` can replace them without touching the rest. The file appears whole or not at all; StorageError
    where it exists (unless ``force``) or the disk refuses, UsageError for two channels of one topic.
    """
    channels = list(columns)
    name = compression_name(compression)
    with replacing(Path(path), force) as sink:
        contents = Contents()
        write_header(sink, PROFILE, LIBRARY)
        add_channels(ChunkWriter(sink, contents, name, codecs(level)[name]), channels, apart=apart)
        for item in attachments:
            write_attachment(sink, contents, item)
        for title, entries in (metadata or {}).items():
            write_metadata(sink, contents, title, dict(entries))
        write_end(sink, contents)


def compression_name(compression: str) -> str:
    """The name that chunks carry; UsageError for one that is not supported."""
    if compression not in COMPRESSIONS:
        raise UsageError(f"compression {compression!r}: choose one of {', '.join(COMPRESSIONS)}")
    return COMPRESSIONS[compression]


def add_channels(
    writer: ChunkWriter,
    columns: Sequence[Columns],
    channel_ids: Collection[int] = (),
    schema_ids: Collection[int] = (),
    apart: Callable[[str], bool] | None = None,
) -> None:
    """Write the channels' messages as chunks, under other ids than the given ones; equal schemas are used again."""
    check(columns)
    outlets = _outlets(columns, writer.contents, free_ids(channel_ids), free_ids(schema_ids))
    write_idle(writer.sink, outlets)
    later = {outlet.channel.id for outlet in outlets if apart is not None and apart(outlet.channel.topic)}
    for group in ([o for o in outlets if o.channel.id not in later], [o for o in outlets if o.channel.id in later]):
        writer.write(group, schedule([outlet.rows for outlet in group]))


def check(columns: Sequence[Columns]) -> None:
    """UsageError for a topic given twice, StorageError for stamps that MCAP cannot hold."""
    topics: set[str] = set()
    for entry in columns:
        topic = entry.channel.topic
        if topic in topics:
            raise UsageError(f"{topic}: two channels of one topic; give each its own name")
        topics.add(topic)
        if len(entry) and int(np.min(entry.time_ns)) < 0:
            raise StorageError(
                f"{topic}: a stamp before 1970 ({int(np.min(entry.time_ns))} ns), which MCAP cannot hold"
            )


def _outlets(
    columns: Sequence[Columns], contents: Contents, ids: Iterator[int], schema_ids: Iterator[int]
) -> list[Outlet]:
    known = {(s.name, s.encoding, s.data): s for s in contents.schemas.values()}
    outlets = []
    for entry in columns:
        message = entry.channel.type
        key = (message.name, "ros2msg", message.text.encode())
        if key not in known:
            known[key] = SchemaRecord(next(schema_ids), *key)
        number = next(ids)
        record = ChannelRecord(number, known[key].id, entry.channel.topic, "cdr", channel_metadata(entry.channel))
        outlets.append(Outlet(known[key], record, rows_of(entry, number)))
    return outlets


def channel_metadata(channel: Channel) -> dict[str, str]:
    """The channel's metadata with the quality of service that ROS 2 tools ask for."""
    return {QOS_KEY: QOS, **channel.metadata}


def free_ids(taken: Collection[int]) -> Iterator[int]:
    """Ids above all that are taken, then the lowest free ones; StorageError when all 65,535 are used."""
    first = max(taken, default=0) + 1
    for number in [*range(first, 65536), *range(1, first)]:
        if number not in taken:
            yield number
    raise StorageError("more than 65,535 channels or schemas in one file: MCAP cannot hold them")
