"""What a user said about a source, as the strings of a metadata record, so that it can be read again later."""

import dataclasses
import json
from collections.abc import Mapping
from typing import Any

from ...schemas.csv_options import AttitudeColumns, CsvOptions, World
from ...schemas.sensors import SensorProfile
from ...schemas.source import IngestOptions


def to_text(options: IngestOptions) -> str:
    """The options as JSON."""
    return json.dumps(dataclasses.asdict(options))


def from_text(text: str) -> IngestOptions:
    """The inverse of `to_text`."""
    said: dict[str, Any] = json.loads(text)
    return IngestOptions(said["vehicle"], _sensor(said["sensor"]), said["dialect"], _csv(said["csv"]))


def _csv(said: Mapping[str, Any]) -> CsvOptions:
    attitude = dict(said["attitude"])
    if attitude["world"] is not None:
        attitude["world"] = World(attitude["world"])
    made = {
        "columns": tuple(said["columns"]),
        "attitude": AttitudeColumns(**attitude),
        "sensor": _sensor(said["sensor"]),
    }
    return CsvOptions(**{**said, **made})


def _sensor(said: Mapping[str, Any] | None) -> SensorProfile | None:
    if said is None:
        return None
    return SensorProfile(**{**said, "mag_axes": tuple(said["mag_axes"])})
