"""Attitude estimators: one file each, reading like its paper; a registry; one loop that all recursive ones share.

`estimate(recording, "ecf:imu=1,kp=0.3")` runs one. Kernels are compiled at first use and kept on disk.
"""

from .registry import Estimator, get, names
from .selection import Selection, estimate, parse

__all__ = ["Estimator", "Selection", "estimate", "get", "names", "parse"]
