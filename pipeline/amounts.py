"""Sizes and times as people write them."""

import re
from typing import Final

from ..schemas.errors import UsageError

SECONDS: Final = {"": 1.0, "s": 1.0, "min": 60.0, "m": 60.0, "h": 3600.0}
BYTES: Final = {"": 1, "b": 1, "kb": 10**3, "mb": 10**6, "gb": 10**9, "kib": 2**10, "mib": 2**20, "gib": 2**30}
_AMOUNT: Final = re.compile(r"\s*(\d+(?:\.\d+)?)\s*([a-zA-Z]*)\s*")


def seconds_of(spelled: str) -> float:
    """``90``, ``90s``, ``10min``, ``2h`` in seconds; UsageError for anything else."""
    return _amount(spelled, SECONDS, "a time, such as 90s, 10min or 2h")


def bytes_of(spelled: str) -> int:
    """``500000``, ``100MB``, ``1GiB`` in bytes; UsageError for anything else."""
    return round(_amount(spelled, BYTES, "a size, such as 100MB or 1GiB"))


def _amount(spelled: str, units: "dict[str, float] | dict[str, int]", what: str) -> float:
    match = _AMOUNT.fullmatch(spelled)
    unit = match[2].lower() if match else "?"
    if match is None or unit not in units or float(match[1]) == 0:
        raise UsageError(f"{spelled!r} is no {what.removeprefix('a ')}")
    return float(match[1]) * float(units[unit])
