"""Empty results: memory for what a kernel fills, shared NaN for what it does not."""

from collections.abc import Iterable
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


def empty(n: int, widths: Iterable[int]) -> tuple[Floats, ...]:
    """Arrays (n, width) for a kernel to fill."""
    return tuple(np.empty((n, width)) for width in widths)


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
    nothing = np.broadcast_to(np.float64(np.nan), (n, 9))  # NaN without memory of its own, read-only
    fields: dict[str, Any] = {key: filled.get(key, nothing[:, :width]) for key, width in WIDTHS.items()}
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
