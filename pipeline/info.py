"""What is in an MCAP."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .. import storage
from ..schemas import records
from ..schemas.recording import Segment
from .convert import completeness_text, segment_lines
from .inputs import is_mcap
from .logs import open_log
from .text import count, moment, seconds, table
from .verbs import Place, verb


@dataclass(frozen=True)
class ChannelSummary:
    """One topic: its type, how many messages, how often (Hz, between its own first and last message)."""

    topic: str
    type: str
    messages: int
    rate_hz: float | None
    metadata: Mapping[str, str]


@dataclass(frozen=True)
class Info:
    """What `info` tells of one MCAP."""

    source: str
    size: int
    profile: str
    library: str
    start_ns: int
    end_ns: int
    channels: tuple[ChannelSummary, ...]
    segments: tuple[Segment, ...]
    metadata: Mapping[str, Mapping[str, str]]

    complete = True

    def to_text(self) -> str:
        """What ``attlog info`` prints."""
        lines = [
            f"{self.source}: {self.size:,} bytes, profile {self.profile or 'none'}, "
            f"written by {self.library or 'unknown'}",
            f"  {moment(self.start_ns)} to {moment(self.end_ns)}, {seconds(self.end_ns - self.start_ns)}, "
            f"{count(sum(c.messages for c in self.channels), 'message')}",
            *(f"  {line}" for line in self._origin()),
            *(f"  {line}" for line in segment_lines(self.segments, self.start_ns)),
        ]
        rows = [(c.topic, c.type, f"{c.messages:,}", _rate(c.rate_hz)) for c in self.channels]
        return "\n".join([*lines, table(("topic", "type", "messages", "rate [Hz]"), rows, (2, 3))])

    def _origin(self) -> list[str]:
        source = self.metadata.get(records.SOURCE, {})
        lines = [f"source {source['name']} ({source['format']}), SHA-256 {source['sha256']}"] if source else []
        vehicle = self.metadata.get(records.VEHICLE, {})
        if vehicle:
            lines.append("vehicle " + ", ".join(f"{key} {value}" for key, value in vehicle.items()))
        if records.COMPLETENESS in self.metadata:
            lines.append(completeness_text(records.parse_completeness(self.metadata[records.COMPLETENESS])))
        return lines

    def to_dict(self) -> dict[str, Any]:
        """The same for --json."""
        return {
            "size": self.size,
            "profile": self.profile,
            "library": self.library,
            "start_ns": self.start_ns,
            "end_ns": self.end_ns,
            "channels": [vars(channel) | {"metadata": dict(channel.metadata)} for channel in self.channels],
            "segments": [vars(segment) for segment in self.segments],
            "metadata": {name: dict(record) for name, record in self.metadata.items()},
        }


def _rate(rate_hz: float | None) -> str:
    return "-" if rate_hz is None else f"{rate_hz:.2f}"


def _channel(log: storage.LogFile, topic: str) -> ChannelSummary:
    about = log.topics[topic]
    channel = about.channel
    span = about.end_ns - about.start_ns
    rate = (about.count - 1) / span * 1e9 if about.count > 1 and span > 0 else None
    return ChannelSummary(topic, about.schema_name, about.count, rate, channel.metadata)


@verb(is_mcap, writes=False)
def info(source: Place) -> Info:
    """Topics, types, counts, rates, time span, source and completeness of an MCAP, whoever wrote it.

    InputError where it cannot be read.
    """
    path = Path(source)
    with open_log(path) as log:
        return Info(
            source=str(path),
            size=path.stat().st_size,
            profile=log.profile,
            library=log.library,
            start_ns=log.start_ns,
            end_ns=log.end_ns,
            channels=tuple(_channel(log, topic) for topic in sorted(log.topics)),
            segments=records.parse_segments(log.metadata.get(records.SEGMENTS, {})),
            metadata=log.metadata,
        )
