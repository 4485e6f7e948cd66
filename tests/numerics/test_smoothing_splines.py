"""Smoothing splines against dense matrices and quadrature, and motions of quaternions against differences."""

from itertools import pairwise

import numpy as np
import pytest
import scipy
from scipy.spatial.transform import Rotation

from exo_pin.numerics.smoothing.smoothing_splines import (
    FEWEST,
    SplineBasis,
    continuous_quaternions,
    fit_samples,
    interpolate_samples,
    motion_of_quaternions,
)


def dense(basis, x, penalty):
    """Rows of value and derivatives, X'X + λ P with P by SciPy's quadrature, and X'X."""
    count = len(basis.knots) - 8
    spline = scipy.interpolate.BSpline(basis.knots, np.eye(count), 7)
    rows = [spline(x, order) for order in range(3)]
    breaks = basis.knots[7:-7]
    P = np.zeros((count, count))
    for a, b in pairwise(breaks):
        nodes, weights = np.polynomial.legendre.leggauss(6)
        fourth = spline(0.5 * (a + b) + 0.5 * (b - a) * nodes, 4)
        P += 0.5 * (b - a) * (fourth.T * weights) @ fourth
    normal = rows[0].T @ rows[0]
    return rows, normal + penalty * P, normal


@pytest.mark.parametrize(("stride", "penalty"), [(1, 1e-3), (1, 10.0), (4, 100.0)])
def test_banded_equations_are_those_of_dense_matrices(stride, penalty):
    rng = np.random.default_rng(1)
    x = np.arange(60.0) + rng.uniform(-0.3, 0.3, 60)
    y = rng.normal(size=(60, 2))
    basis = SplineBasis(x, stride)
    np.testing.assert_array_equal(basis.knots[8:-8], x[4:-4:stride])
    rows, A, normal = dense(basis, x, penalty)
    factor = basis.factor(penalty)
    weights = np.linalg.solve(A, rows[0].T @ y)
    for found, row in zip(basis.values(y, factor), rows, strict=True):
        np.testing.assert_allclose(found, row @ weights, atol=1e-8)
    assert basis.freedom(penalty) == pytest.approx(np.trace(np.linalg.solve(A, normal)), abs=1e-4)
    inverse = np.linalg.inv(A)
    expected = np.array([[[a @ inverse @ b for b in at] for a in at] for at in np.swapaxes(rows, 0, 1)])
    np.testing.assert_allclose(basis.covariance(factor), expected, rtol=1e-6, atol=1e-10)


def test_samples_near_an_end_or_one_another_share_a_knot():
    x = np.array([0.0, 0.2, 0.25, 0.3, 0.35, 2.0, 3.0, 3.1, 4.0, 5.0, 5.66, 5.7, 5.75, 5.8, 6.0])
    for nearest, inner in ((0.0, x[4:-4]), (0.3, [0.35, 2.0, 3.0, 4.0, 5.0, 5.66]), (0.345, [0.35, 2.0, 3.0, 4.0, 5.0]),
                           (0.36, [2.0, 3.0, 4.0, 5.0])):  # fmt: skip
        knots = SplineBasis(x, nearest=nearest).knots
        kept = knots[(knots > x[0]) & (knots < x[-1])]
        np.testing.assert_array_equal(kept, inner)


def test_a_movement_from_rest_begins_and_ends_at_rest():
    x, rng = np.arange(50.0), np.random.default_rng(5)
    y = (np.sin(x / 10.0) + 0.05 * rng.normal(size=50))[:, None]
    free, held = (fit_samples(x, y, 1, rest=rest).values[:, [0, -1], 0] for rest in (False, True))
    assert np.abs(free[1]).min() > 1e-2
    assert np.abs(held[1:]).max() < 1e-6


def test_noise_is_found_and_curves_without_noise_are_interpolated():
    rng = np.random.default_rng(3)
    x = np.arange(300.0)
    curve = np.stack([np.sin(x / 15.0), np.cos(x / 23.0)], axis=1)
    for noise in (1e-8, 1e-4, 1e-1):
        found = fit_samples(x, curve + noise * rng.normal(size=curve.shape), 2).noise
        assert found == pytest.approx(noise, rel=0.3)
    exact = fit_samples(x, curve, 2)
    assert exact.penalty == 0.0
    # What is left of the sine in differences of order 8: (1/15)⁸ of it, over √12870.
    assert exact.noise < 1e-11
    np.testing.assert_allclose(exact.values[2][:, 0], -np.sin(x / 15.0) / 225, atol=1e-9)


def test_odd_sampling():
    """Samples at almost the same time, in clusters, or few: a curve, and no error."""
    rng = np.random.default_rng(6)
    for x in (
        np.sort(np.concatenate([np.arange(20.0), np.arange(20.0) + 1e-9])),
        np.concatenate([np.arange(10) * 1e-6, 1e3 + np.arange(10) * 1e-6]),
        np.arange(float(FEWEST)),
        np.arange(FEWEST - 1.0),
    ):
        x = (x - x[0]) * (len(x) - 1) / (x[-1] - x[0])
        fit = fit_samples(x, rng.normal(size=(len(x), 1)), 1)
        assert np.isfinite(fit.values[0]).all()


def test_interpolation_is_exact_up_to_its_degree_and_no_further():
    for count, degree in ((FEWEST, 7), (FEWEST - 1, 5), (5, 3)):
        x = np.linspace(-1.0, 1.0, count)
        for power in (degree, degree + 1):
            found = interpolate_samples(x, x[:, None] ** power, 1).values[1][:, 0]
            error = np.abs(found - power * x ** (power - 1)).max()
            assert (error < 1e-9) == (power == degree), (count, power, error)


#: A curve of quaternions whose length changes, too: coefficients of t, t² and t³ beside a constant.
CURVE = np.array([[0.2, -0.4, 0.1, 1.3], [0.5, 0.3, -0.7, 0.2], [-0.1, 0.6, 0.2, -0.3], [0.3, -0.2, 0.4, 0.1]])


def derivatives(t):
    powers = np.array([[1, t, t**2, t**3], [0, 1, 2 * t, 3 * t**2], [0, 0, 2, 6 * t]])
    return (powers @ CURVE)[:, None]


@pytest.mark.parametrize("unit", [1.0, 0.25])
@pytest.mark.parametrize("t", [-0.7, 0.0, 0.4, 1.1])
def test_motion_is_that_of_the_rotations(t, unit):
    u, velocity, acceleration = motion_of_quaternions(derivatives(t), unit)
    np.testing.assert_allclose(np.linalg.norm(u, axis=-1), 1.0, rtol=1e-15)
    np.testing.assert_allclose(u[0], derivatives(t)[0, 0] / np.linalg.norm(derivatives(t)[0, 0]), rtol=1e-14)

    def rotation(shift):
        return Rotation.from_quat(derivatives(t + shift / unit)[0, 0])

    def rate(shift, h=1e-5):
        # In the base frame: the turn from before to after.
        return (rotation(shift + h) * rotation(shift - h).inv()).as_rotvec() / (2 * h)

    h = 1e-3
    np.testing.assert_allclose(velocity[0], rate(0.0), atol=1e-8 / unit**3)
    np.testing.assert_allclose(acceleration[0], (rate(h) - rate(-h)) / (2 * h), atol=2e-5 / unit**4)


def test_quaternions_follow_one_another_by_less_than_half_a_turn():
    """Over two turns, from readings of any sign: the fourth component goes through zero and on."""
    angles = np.linspace(0.0, 4.0 * np.pi, 60)
    axis = np.array([0.6, 0.0, 0.8])
    expected = np.concatenate([np.outer(np.sin(angles / 2), axis), np.cos(angles / 2)[:, None]], axis=1)
    signs = np.random.default_rng(55).choice([-1.0, 1.0], 60)
    found = continuous_quaternions(Rotation.from_quat(expected * signs[:, None]))
    np.testing.assert_allclose(found * signs[0], expected, atol=1e-15)
    assert (np.einsum("ij,ij->i", found[1:], found[:-1]) > 0.9).all()
