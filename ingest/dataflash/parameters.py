"""PARM records: the autopilot's parameters, as last set and over time."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .formats import text
from .log import Log, Records


def last_values(log: Log) -> dict[str, float]:
    """Parameter -> value, the last one where it was set again."""
    result: dict[str, float] = {}
    for records in _parm(log):
        names, values = records.data["Name"].tolist(), records.data["Value"].astype(np.float64).tolist()
        result.update(zip(names, values, strict=True))
    return {text(name) if isinstance(name, bytes) else str(name): value for name, value in result.items()}


def over_time(log: Log, names: Sequence[str], order: NDArray[np.int64]) -> NDArray[np.float64]:
    """Values (n, k) of the parameters in force at the records ``order`` (n,): before the first word of one, that one;
    0 for one that is never mentioned."""
    result = np.zeros((len(order), len(names)))
    for column, name in enumerate(names):
        for records in _parm(log):
            chosen = np.flatnonzero(records.data["Name"] == name.encode())
            if len(chosen):
                values = records.data["Value"][chosen].astype(np.float64)
                latest = np.searchsorted(records.order[chosen], order, side="right") - 1
                result[:, column] = values[np.maximum(latest, 0)]
    return result


def _parm(log: Log) -> list[Records]:
    return [records for records in log.named("PARM") if records.format.has("Name", "Value")]
