"""Smoothing splines: against dense matrices and quadrature, with few knots and many, with and without noise."""

from itertools import pairwise

import numpy as np
import pytest
import scipy

from exo_pin.numerics.smoothing.smoothing_splines import (
    FEWEST,
    SplineBasis,
    fit_samples,
    interpolate_samples,
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
    rows, A, normal = dense(basis, x, penalty)
    factor = basis.factor(penalty)
    weights = np.linalg.solve(A, rows[0].T @ y)
    for found, row in zip(basis.values(y, factor), rows, strict=True):
        np.testing.assert_allclose(found, row @ weights, atol=1e-8)
    assert basis.freedom(penalty) == pytest.approx(np.trace(np.linalg.solve(A, normal)), abs=1e-4)
    inverse = np.linalg.inv(A)
    expected = np.array([[[a @ inverse @ b for b in at] for a in at] for at in np.swapaxes(rows, 0, 1)])
    np.testing.assert_allclose(basis.covariance(factor), expected, rtol=1e-6, atol=1e-10)


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
