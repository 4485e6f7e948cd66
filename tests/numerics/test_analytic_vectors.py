"""Rotation vectors by series and closed form, against SciPy's rotations, quadrature and complex steps."""

import math
from fractions import Fraction

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from exo_pin.numerics.analytic_vectors import (
    angle_about,
    cross_matrix,
    left_jacobian,
    length_of,
    solved,
    turn_coefficients,
    turn_matrix,
    unit,
)

#: rad: the series up to 0.1, the closed form beyond.
ANGLES = [0.0, 1e-9, 1e-3, 0.05, 0.0999999, 0.1000001, 0.5, 1.7, 3.1, 5.0]


def vectors(angle):
    axes = np.random.default_rng(17).normal(size=(5, 3))
    return angle * axes / np.linalg.norm(axes, axis=1, keepdims=True)


@pytest.mark.parametrize("angle", ANGLES)
def test_turns_and_their_mean_along_the_way(angle):
    v = vectors(angle)
    np.testing.assert_allclose(turn_matrix(v), Rotation.from_rotvec(v).as_matrix(), rtol=0, atol=4e-16 * (1 + angle))
    # J_l is the mean of exp(s [v]) over s from 0 to 1.
    nodes, weights = np.polynomial.legendre.leggauss(20)
    turns = np.array([Rotation.from_rotvec(0.5 * (1 + s) * v).as_matrix() for s in nodes])
    mean = np.einsum("s,skij->kij", 0.5 * weights, turns)
    np.testing.assert_allclose(left_jacobian(v), mean, rtol=0, atol=2e-15 * (1 + angle))


@pytest.mark.parametrize("angle", ANGLES[1:])
def test_complex_steps_give_the_angular_velocity(angle):
    """The rate of exp [v] is [ω] exp [v] with ω = J_l dv/dt."""
    v, rate = vectors(angle), np.random.default_rng(18).normal(size=(5, 3))
    h = 1e-40
    change = turn_matrix(v + 1j * h * rate).imag / h
    omega = np.einsum("kij,kj->ki", left_jacobian(v), rate)
    np.testing.assert_allclose(change, cross_matrix(omega) @ turn_matrix(v), rtol=0, atol=1e-14)


def test_lengths_units_and_angles():
    rng = np.random.default_rng(19)
    v = rng.normal(size=(4, 3))
    np.testing.assert_allclose(length_of(v)[:, 0], np.linalg.norm(v, axis=1), rtol=1e-15)
    np.testing.assert_allclose(unit(v) * length_of(v), v, rtol=1e-15)
    assert (unit(np.zeros(3)) == 0.0).all()
    axis = unit(v)
    first = unit(np.cross(axis, rng.normal(size=(4, 3))))
    angle = np.array([-3.0, -0.4, 1e-8, 2.9])
    second = np.einsum("kij,kj->ki", turn_matrix(angle[:, None] * axis), first)
    np.testing.assert_allclose(angle_about(axis, first, second), angle, rtol=1e-7)


def test_systems_that_have_no_answer_are_nan_and_spoil_no_other():
    rng = np.random.default_rng(20)
    A, x = rng.normal(size=(4, 2, 2)), rng.normal(size=(4, 2))
    right = np.einsum("kij,kj->ki", A, x)
    A[1], A[2, 0, 1] = 0.0, np.inf
    found = solved(A, right)
    assert np.isnan(found[1:3]).all()
    np.testing.assert_allclose(found[[0, 3]], x[[0, 3]], rtol=1e-12)


@pytest.mark.parametrize("angle", [1e-6, 1e-3, 0.05, 0.0999, 0.1001, 0.3])
def test_coefficients_of_turns_are_their_series_on_both_sides_of_the_threshold(angle):
    """With twenty terms, in whole numbers: exact to the last digits where the short series is used."""
    square = Fraction(angle) ** 2
    for first, found in zip((1, 2, 3), turn_coefficients(np.array([angle * angle])), strict=True):
        exact = sum((-square) ** k / math.factorial(2 * k + first) for k in range(20))
        assert found[0] == pytest.approx(float(exact), rel=3e-16 if angle < 0.1 else 2e-13)


@pytest.mark.parametrize("shape", [(), (2,), (2, 4), (3, 3)])
def test_stacks_of_any_shape(shape):
    v = np.random.default_rng(18).normal(size=(*shape, 3))
    np.testing.assert_allclose(length_of(v)[..., 0], np.linalg.norm(v, axis=-1), rtol=1e-15)
    np.testing.assert_allclose(unit(v), v / np.linalg.norm(v, axis=-1, keepdims=True), rtol=1e-15)
    w = np.random.default_rng(19).normal(size=(*shape, 3))
    np.testing.assert_allclose((cross_matrix(v) @ w[..., None])[..., 0], np.cross(v, w), atol=1e-15)
    flat = np.array([Rotation.from_rotvec(one).as_matrix() for one in v.reshape(-1, 3)])
    np.testing.assert_allclose(turn_matrix(v), flat.reshape(*shape, 3, 3), atol=2e-15)
    assert left_jacobian(v).shape == (*shape, 3, 3)
