"""The kernels' scalar rotations against scipy's, and against the vectorised ones."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from attlog.geometry import kernels, quaternions

components = st.floats(-4.0, 4.0)
vectors = st.tuples(components, components, components)


def unit(values: tuple[float, float, float]) -> tuple[float, float, float, float]:
    x, y, z, w = (float(v) for v in Rotation.from_rotvec(values).as_quat())
    return x, y, z, w


@given(vectors, st.sampled_from([1.0, 1e-2, 1e-4, 1e-9, 0.0]))
@settings(max_examples=100, deadline=None)
def test_exponential_is_scipys_at_every_size(vector: tuple[float, float, float], scale: float) -> None:
    x, y, z = (scale * v for v in vector)
    expected = Rotation.from_rotvec([x, y, z]).as_quat()
    got = np.array(kernels.exponential(x, y, z))
    assert min(np.abs(got - expected).max(), np.abs(got + expected).max()) < 1e-15
    assert np.linalg.norm(got) == pytest.approx(1.0, abs=4e-16)


@given(vectors, vectors, vectors)
@settings(max_examples=100, deadline=None)
def test_products_and_turns_are_scipys(a: tuple[float, float, float], b: tuple[float, float, float], v: tuple) -> None:
    p, q = unit(a), unit(b)
    both = Rotation.from_quat(p) * Rotation.from_quat(q)
    np.testing.assert_allclose(kernels.multiply(p, q), quaternions.multiply(p, q), atol=1e-15)
    np.testing.assert_allclose(kernels.rotate(kernels.multiply(p, q), v), both.apply(v), atol=1e-14)
    m = kernels.matrix(p)
    np.testing.assert_allclose(np.reshape(m, (3, 3)), Rotation.from_quat(p).as_matrix(), atol=1e-15)
    np.testing.assert_allclose(kernels.turned_back(m, kernels.turned(m, v)), v, atol=1e-14)


@given(vectors, vectors)
@settings(max_examples=100, deadline=None)
def test_advance_is_multiplication_by_the_exponential(a: tuple[float, float, float], b: tuple) -> None:
    q = unit(a)
    np.testing.assert_allclose(kernels.advance(q, *b), kernels.multiply(q, kernels.exponential(*b)), atol=2e-15)


def test_hand_solved() -> None:
    h = math.sqrt(0.5)
    np.testing.assert_allclose(kernels.exponential(0.0, 0.0, math.pi / 2), (0, 0, h, h), atol=1e-16)
    np.testing.assert_allclose(kernels.rotate((0.0, 0.0, h, h), (1.0, 0.0, 0.0)), (0, 1, 0), atol=1e-15)
    assert kernels.conjugate((0.1, -0.2, 0.3, 0.9)) == (-0.1, 0.2, -0.3, 0.9)
    assert kernels.cross((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)) == (0.0, 0.0, 1.0)
    assert kernels.norm((2.0, 3.0, 6.0)) == 7.0


def test_renormalize_removes_what_rounding_adds() -> None:
    q = kernels.renormalize((0.5 * (1 + 1e-8), 0.5 * (1 + 1e-8), 0.5 * (1 + 1e-8), 0.5 * (1 + 1e-8)))
    np.testing.assert_allclose(q, (0.5, 0.5, 0.5, 0.5), atol=1e-15)
