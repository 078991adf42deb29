"""What the parameters of all estimators share, and the one gate that checks their values."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..schemas.errors import UsageError


def quantity(default: float, unit: str, about: str, *, minimum: float = 0.0, maximum: float = math.inf) -> Any:
    """A dataclass field: a number with its unit, its meaning and the range that it must lie in."""
    return dataclasses.field(
        default=default, metadata={"unit": unit, "about": about, "minimum": minimum, "maximum": maximum}
    )


def choice(default: object, about: str) -> Any:
    """A dataclass field that is not a number with a range."""
    return dataclasses.field(default=default, metadata={"about": about})


@dataclass(frozen=True)
class ImuParameters:
    """Which IMU, and when to start anew."""

    imu: int = choice(0, "number of the IMU")
    max_gap_s: float = quantity(0.5, "s", "longest interval to bridge; at least 5 median intervals are bridged")


@dataclass(frozen=True)
class MargParameters(ImuParameters):
    """Which IMU and which magnetometer (None: leave it out, where the estimator can)."""

    mag: int | None = choice(0, "number of the magnetometer, or none")


def check(parameters: ImuParameters) -> None:
    """Raise UsageError for a number that is not finite or lies outside its range."""
    for field in dataclasses.fields(parameters):
        value = getattr(parameters, field.name)
        if "minimum" not in field.metadata:
            continue
        low, high = field.metadata["minimum"], field.metadata["maximum"]
        if not (isinstance(value, (int, float)) and low <= value <= high):
            unit = f" {field.metadata['unit']}" if field.metadata["unit"] else ""
            raise UsageError(f"{field.name} = {value}: must be from {low:g} to {high:g}{unit}")


def as_mapping(parameters: ImuParameters) -> Mapping[str, object]:
    """Names and values, as an Estimate carries them."""
    return {field.name: getattr(parameters, field.name) for field in dataclasses.fields(parameters)}
