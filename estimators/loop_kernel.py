"""The one loop that every recursive estimator runs in: a filter gives a step and a writer, this gives the samples.

`march` is compiled into each filter's own kernel, which passes its step and writer as constants, so nothing is called
through a pointer. Uneven sampling, a magnetometer of another rate and its lag are dealt with here and nowhere else.
"""

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..geometry.jit import inline_kernel
from ..geometry.kernels import exponential, rotate
from ..schemas.estimate import Status

Floats: TypeAlias = NDArray[np.float64]
Times: TypeAlias = NDArray[np.int64]
Span: TypeAlias = tuple[int, int, int, float, float]
"""First and last + 1 sample, first magnetometer sample after the first one, coasting and magnetometer limits in s."""

COASTING = int(Status.COASTING)
MISSING = int(Status.MAGNETOMETER_MISSING)
MAG_MISSING_S = 2.0
"""An interval of the magnetometer beyond which the heading is marked as not measured."""


@inline_kernel
def march(
    step: Callable[..., Any],
    write: Callable[..., None],
    constants: Any,
    state: Any,
    imu: tuple[Times, Floats, Floats],
    mag: tuple[Times, Floats],
    span: Span,
    output: Any,
    status: NDArray[np.uint32],
) -> Any:
    """Step a filter over one unbroken stretch of samples; its state after the last one.

    ``step(constants, state, dt, rate, force, dt_mag, field)`` gives the new state, a report and status bits. ``dt`` is
    the step's own interval in s (0 at the first sample), ``dt_mag`` the magnetometer's (0 where it has no new sample);
    the field is turned from its own stamp to the IMU's by the measured rate. ``write(output, k, constants, state,
    report)`` fills row k.
    """
    time_ns, angular_velocity, specific_force = imu
    mag_time_ns, field = mag
    first, last, row, coast_s, mag_limit_s = span
    mag_count = mag_time_ns.shape[0]
    mag_before = time_ns[first]
    if row > 0:
        mag_before = mag_time_ns[row - 1]
    before = time_ns[first]
    for k in range(first, last):
        now = time_ns[k]
        dt = (now - before) * 1e-9
        before = now
        rate = (angular_velocity[k, 0], angular_velocity[k, 1], angular_velocity[k, 2])
        force = (specific_force[k, 0], specific_force[k, 1], specific_force[k, 2])
        dt_mag = 0.0
        m = (0.0, 0.0, 0.0)
        bits = 0
        if mag_count > 0:
            newest = -1
            while row < mag_count and mag_time_ns[row] <= now:
                newest = row
                row += 1
            if newest >= 0:
                dt_mag = (mag_time_ns[newest] - mag_before) * 1e-9
                if dt_mag > mag_limit_s:
                    dt_mag = mag_limit_s
                mag_before = mag_time_ns[newest]
                m = (field[newest, 0], field[newest, 1], field[newest, 2])
                lag = (now - mag_before) * 1e-9
                if lag > 0.0:
                    m = rotate(exponential(-rate[0] * lag, -rate[1] * lag, -rate[2] * lag), m)
            elif (now - mag_before) * 1e-9 > MAG_MISSING_S:
                bits |= MISSING
        if dt > coast_s:
            bits |= COASTING
        state, report, flags = step(constants, state, dt, rate, force, dt_mag, m)
        write(output, k, constants, state, report)
        status[k] |= np.uint32(bits | flags)
    return state
