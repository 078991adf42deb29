"""Brings the vectors of the first moments into the frame of the first sample, by the gyro."""

import numpy as np

from ..geometry.jit import kernel
from ..geometry.kernels import Vector, advance, renormalize, rotate
from .gyro_kernel import interval_turn
from .loop_kernel import Floats, Times


@kernel
def unturned(
    time_ns: Times, rate: Floats, force: Floats, bias: Vector, mag_time_ns: Times, field: Floats
) -> tuple[Floats, Floats]:
    """Forces (n, 3) and fields (m, 3) as the body of the first sample would have measured them.

    A field is taken at the first IMU sample at or after its own stamp, or the last one.
    """
    n, count = time_ns.shape[0], mag_time_ns.shape[0]
    forces, fields = np.empty((n, 3)), np.empty((count, 3))
    q = (0.0, 0.0, 0.0, 1.0)
    before = (rate[0, 0] - bias[0], rate[0, 1] - bias[1], rate[0, 2] - bias[2])
    row = 0
    for k in range(n):
        u = (rate[k, 0] - bias[0], rate[k, 1] - bias[1], rate[k, 2] - bias[2])
        if k > 0:
            q = advance(renormalize(q), *interval_turn(before, u, (time_ns[k] - time_ns[k - 1]) * 1e-9, 0.0))
        before = u
        forces[k, 0], forces[k, 1], forces[k, 2] = rotate(q, (force[k, 0], force[k, 1], force[k, 2]))
        while row < count and (mag_time_ns[row] <= time_ns[k] or k == n - 1):
            v = rotate(q, (field[row, 0], field[row, 1], field[row, 2]))
            fields[row, 0], fields[row, 1], fields[row, 2] = v
            row += 1
    return forces, fields
