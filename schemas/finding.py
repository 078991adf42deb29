"""What is wrong with a log, and what people and vehicles said about it."""

from dataclasses import dataclass
from enum import IntEnum, StrEnum


class Severity(IntEnum):
    """The levels of rcl_interfaces/msg/Log."""

    DEBUG = 10
    INFO = 20
    WARN = 30
    ERROR = 40
    FATAL = 50


class Kind(StrEnum):
    """What a finding is about."""

    GAP = "gap"
    SATURATION = "saturation"
    VIBRATION = "vibration"
    MAGNETIC_DISTURBANCE = "magnetic_disturbance"
    RESET = "reset"
    DIVERGENCE = "divergence"
    CLOCK_STEP = "clock_step"
    REBOOT = "reboot"
    LOW_RATE = "low_rate"
    DECLINATION = "declination"
    TRIM = "trim"
    SKIPPED = "skipped"
    UNITS = "units"


@dataclass(frozen=True)
class Finding:
    """Something wrong from ``time_ns`` to ``end_ns`` on ``topic``: its size in ``unit``, and advice in plain words."""

    time_ns: int
    end_ns: int
    severity: Severity
    kind: Kind
    topic: str
    value: float
    unit: str
    advice: str


@dataclass(frozen=True)
class Note:
    """A line of ``/annotations``: who said what, when, and until when it holds."""

    time_ns: int
    severity: Severity
    name: str
    text: str
    end_ns: int | None = None
