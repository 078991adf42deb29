"""Runs a recursive filter over the unbroken stretches of its inputs, from an alignment each."""

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from .alignment import Start, align, heading_of
from .inputs import Inputs

MAG_LIMIT_S = 1.0
"""Longest interval for which one magnetic sample counts."""

Begin: TypeAlias = Callable[[Start], tuple[Any, Any]]


def each_run(inputs: Inputs, kernel: Callable[..., Any], begin: Begin, output: Any, *, mag: bool) -> None:
    """Fill ``output`` and the inputs' status.

    ``begin(start)`` gives a filter's constants and first state, whose first two items are attitude and bias. Behind a
    gap the bias goes on, and the heading where no magnetometer gives one; behind a reboot everything is new.
    """
    imu = (inputs.time_ns, inputs.angular_velocity, inputs.specific_force)
    magnetometer = (inputs.mag_time_ns, inputs.field) if mag else (inputs.mag_time_ns[:0], inputs.field[:0])
    heading, bias = 0.0, None
    for part in inputs.runs:
        start = align(inputs, part) if part.fresh else align(inputs, part, heading=heading, bias=bias)
        constants, state = begin(start)
        row = int(np.searchsorted(magnetometer[0], inputs.time_ns[part.first], side="right"))
        span = (part.first, part.last, row, inputs.coast_s, MAG_LIMIT_S)
        state = kernel(constants, state, imu, magnetometer, span, output, inputs.status)
        heading, bias = heading_of(state[0]), state[1]
