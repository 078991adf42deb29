"""Metadata records of an attlog MCAP: names, and their coding as maps of strings."""

import dataclasses
import json
from collections.abc import Mapping, Sequence

from .recording import Segment
from .source import Completeness

SOURCE = "source"
COMPLETENESS = "completeness"
VEHICLE = "vehicle"
PARAMETERS = "parameters"
SEGMENTS = "segments"
SOFTWARE = "software"


def segments_record(segments: Sequence[Segment]) -> dict[str, str]:
    """One entry per segment, numbered, each a JSON object of the fields of `Segment`."""
    return {f"{number:04d}": json.dumps(dataclasses.asdict(s)) for number, s in enumerate(segments)}


def parse_segments(record: Mapping[str, str]) -> tuple[Segment, ...]:
    """The inverse of `segments_record`."""
    return tuple(Segment(**json.loads(record[key])) for key in sorted(record) if key.isdigit())


def completeness_record(completeness: Completeness) -> dict[str, str]:
    """Counts as decimal strings; what was dropped as ``dropped.{reason}``."""
    record = {
        "bytes_total": str(completeness.bytes_total),
        "bytes_read": str(completeness.bytes_read),
        "bytes_skipped": str(completeness.bytes_skipped),
        "messages": str(completeness.messages),
        "complete": "yes" if completeness.complete else "no",
    }
    return record | {f"dropped.{reason}": str(count) for reason, count in completeness.dropped.items()}


def parse_completeness(record: Mapping[str, str]) -> Completeness:
    """The inverse of `completeness_record`."""
    dropped = {key.removeprefix("dropped."): int(value) for key, value in record.items() if key.startswith("dropped.")}
    counts = {name: int(record[name]) for name in ("bytes_total", "bytes_read", "messages", "bytes_skipped")}
    return Completeness(**counts, dropped=dropped)


def parameters_record(parameters: Mapping[str, float]) -> dict[str, str]:
    """Parameter values in the shortest form that reads back to the same double."""
    return {name: repr(float(value)) for name, value in sorted(parameters.items())}


def parse_parameters(record: Mapping[str, str]) -> dict[str, float]:
    """The inverse of `parameters_record`."""
    return {name: float(value) for name, value in record.items()}
