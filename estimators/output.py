"""Empty results: one block of memory for all that a kernel fills, shared NaN for all that it does not."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..schemas.estimate import Estimate
from ..schemas.finding import Finding
from .inputs import Inputs

Floats = NDArray[np.float64]

WIDTHS = {
    "orientation": 4,
    "angular_velocity": 3,
    "gyro_bias": 3,
    "attitude_covariance": 9,
    "rpy_sigma_deg": 3,
    "rate_sigma": 3,
    "bias_sigma": 3,
    "state": 0,
    "state_covariance": 0,
    "innovation": 0,
    "innovation_covariance": 0,
}


def block(n: int, widths: list[int]) -> list[Floats]:
    """Contiguous arrays (n, width) cut from one allocation: large enough for huge pages, which halves its cost."""
    memory = np.empty(n * sum(widths))
    ends = np.cumsum([0, *widths]) * n
    return [memory[ends[i] : ends[i + 1]].reshape(n, width) for i, width in enumerate(widths)]


def nothing(n: int, width: int) -> Floats:
    """NaN, (n, width), without memory of its own; read-only."""
    return np.broadcast_to(np.float64(np.nan), (n, width))


def result(
    name: str,
    inputs: Inputs,
    filled: dict[str, Floats],
    *,
    state_names: tuple[str, ...] = (),
    innovation_names: tuple[str, ...] = (),
    findings: tuple[Finding, ...] = (),
) -> Estimate:
    """An Estimate of ``filled``, NaN elsewhere; `attlog.estimators.estimate` sets its name and parameters."""
    n = len(inputs.time_ns)
    fields: dict[str, Any] = {key: filled[key] if key in filled else nothing(n, width) for key, width in WIDTHS.items()}
    return Estimate(
        name=name,
        estimator=name,
        time_ns=inputs.time_ns,
        status=inputs.status,
        state_names=state_names,
        innovation_names=innovation_names,
        inputs=inputs.topics,
        north=inputs.north,
        declination_deg=inputs.declination_deg,
        findings=inputs.findings + findings,
        **fields,
    )
