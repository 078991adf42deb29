"""Which channels of a file are attlog's own, and where its next ones go beside other people's."""

from collections.abc import Iterable
from dataclasses import replace

from .. import storage
from ..schemas.columns import Columns
from .bodies import BODIES, MADE_BY, TF
from .findings import ANNOTATIONS, FINDINGS
from .recordings import is_recorded

OWN_TYPES = "attlog_msgs/"
_TYPES = {FINDINGS: "attlog_msgs/msg/Finding", ANNOTATIONS: "rcl_interfaces/msg/Log"}


def is_own(log: storage.LogFile, topic: str) -> bool:
    """Whether a channel is one that attlog writes: a recording's, results, notes, frames and bodies."""
    info = log.topics[topic]
    if topic in (TF, BODIES):
        return info.metadata.get(MADE_BY[0]) == MADE_BY[1]
    if topic in _TYPES:
        return info.schema_name == _TYPES[topic]
    return is_native(log, topic)


def is_native(log: storage.LogFile, topic: str) -> bool:
    """Whether a recording takes the channel under its name: topic and type are attlog's, and attlog wrote it."""
    info = log.topics[topic]
    ours = info.schema_name.startswith(OWN_TYPES) or "source" in info.metadata
    return ours and is_recorded(topic) and not info.raw and info.encoding == "cdr"


def place_of(log: storage.LogFile, topic: str) -> str:
    """The topic itself, or ``/attlog`` and the topic where the file has another's channel there."""
    return topic if topic not in log.topics or is_own(log, topic) else f"/attlog{topic}"


def places(log: storage.LogFile, topics: Iterable[str] = (TF, BODIES, FINDINGS, ANNOTATIONS)) -> dict[str, str]:
    """`place_of` of each."""
    return {topic: place_of(log, topic) for topic in topics}


def moved(columns: Iterable[Columns], to: dict[str, str]) -> list[Columns]:
    """The columns on the topics that ``to`` says."""
    return [replace(c, channel=replace(c.channel, topic=to.get(c.channel.topic, c.channel.topic))) for c in columns]
