"""Rotations: quaternions x y z w, frames and Euler angles. Kernels for Numba are in files of their own."""

from . import frames, quaternions

__all__ = ["frames", "quaternions"]
