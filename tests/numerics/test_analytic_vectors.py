"""Rotation vectors by series and closed form, against SciPy's rotations, quadrature and complex steps."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from exo_pin.numerics.analytic_vectors import (
    angle_about,
    cross_matrix,
    dot,
    left_jacobian,
    length_of,
    solved,
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


def test_lengths_angles_and_unit_vectors():
    rng = np.random.default_rng(20)
    v = np.concatenate([rng.normal(size=(4, 3)), [[0.0, 0.6, 0.8], [0.0, 0.0, 0.0], [0.0, -3.0, 0.0]]])
    size = np.linalg.norm(v, axis=1, keepdims=True)
    np.testing.assert_allclose(length_of(v), size, rtol=1e-15)
    np.testing.assert_allclose(unit(v) * size, v, rtol=1e-15)
    assert (unit(v)[5] == 0.0).all()
    # The rate of a unit vector is across it.
    rate = rng.normal(size=(4, 3))
    across = rate / size[:4] - unit(v[:4]) * dot(unit(v[:4]), rate)[:, None] / size[:4]
    np.testing.assert_allclose(unit(v[:4] + 1e-40j * rate).imag / 1e-40, across, atol=1e-14)
    for angle in (-3.0, -0.4, 0.0, 1.2, 3.0):
        s, first = unit(v[0]), unit(np.cross(v[0], v[1]))
        assert angle_about(s, first, Rotation.from_rotvec(angle * s).apply(first)) == pytest.approx(angle, abs=1e-14)


def test_systems_without_a_solution_are_nan_and_leave_the_others():
    rng = np.random.default_rng(19)
    A, b = rng.normal(size=(5, 3, 3)), rng.normal(size=(5, 3))
    A[4, 0, 0] = np.inf
    A[1, :, 2] = A[1, 2] = [0.0, 0.0, np.nan]  # beside two equations that have one
    A[2] = np.diag([1.0, 2.0, 0.0])
    found = solved(A, b)
    np.testing.assert_array_equal(np.isnan(found).all(axis=1), [False, True, True, False, True])
    for k in (0, 3):
        np.testing.assert_allclose(A[k] @ found[k], b[k], atol=1e-13)
