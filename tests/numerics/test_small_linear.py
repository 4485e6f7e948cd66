"""Bases, ranks, small systems and pivoted QR against NumPy's and SciPy's dense linear algebra."""

import numpy as np
import pytest
import scipy

from exo_pin.numerics.small_linear import (
    complete_basis,
    orthonormalise,
    pivoted_qr,
    solve_cholesky,
    solve_factored,
    solve_triangle,
)

pytestmark = pytest.mark.usefixtures("plain")


@pytest.mark.parametrize("n", [3, 4, 5, 8])
def test_bases_are_orthonormal_and_complete(n):
    rng = np.random.default_rng(n)
    for spread in (1.0, 1e-9):  # almost parallel columns
        A = rng.normal(size=(n, 1)) + spread * rng.normal(size=(n, 3)) * [0.0, 1.0, 1.0]
        Q, U, N = A.copy(), np.full((3, 3), 7.0), np.empty((n, n - 3))
        orthonormalise(Q, U, 3)
        np.testing.assert_allclose(Q.T @ Q, np.eye(3), atol=1e-15 * 8)
        np.testing.assert_allclose(Q @ np.triu(U), A, rtol=1e-14, atol=1e-14)
        assert (np.diag(U) > 0.0).all()
        assert (U[np.tril_indices(3, -1)] == 7.0).all()
        complete_basis(Q, N)
        whole = np.hstack([Q, N])
        np.testing.assert_allclose(whole.T @ whole, np.eye(n), atol=1e-14)


@pytest.mark.parametrize("n", [0, 1, 2, 3, 6])
def test_cholesky_solves(n):
    rng = np.random.default_rng(n)
    B = rng.normal(size=(n, n + 2))
    A, x = B @ B.T + 0.1 * np.eye(n), rng.normal(size=n)
    lower, y = np.tril(A) + np.triu(np.full((n, n), np.nan), 1), x.copy()  # the upper triangle is not read
    solve_cholesky(lower, y)
    np.testing.assert_allclose(y, np.linalg.solve(A, x) if n else [], rtol=1e-11)
    if n:
        np.testing.assert_allclose(np.tril(lower), scipy.linalg.cholesky(A, lower=True), rtol=1e-12)


def factored(A, sides, allowed, cut):
    """W as the kernel leaves it, with its other results."""
    m, n = A.shape
    W = np.ascontiguousarray(np.vstack([A.T, sides.T]))
    order, diagonal, half = np.empty(n, dtype=np.int64), np.empty(min(m, n)), np.empty(min(m, n))
    return pivoted_qr(W, allowed, order, cut, diagonal, half), W, order, diagonal, half


@pytest.mark.parametrize(("m", "n"), [(6, 4), (4, 6), (5, 5), (1, 3), (3, 1), (6, 6), (6, 8)])
def test_order_and_triangle_are_those_of_scipy(m, n):
    rng = np.random.default_rng(10 * m + n)
    for _ in range(5):
        A, sides = rng.normal(size=(m, n)) * rng.uniform(0.1, 10.0, n), rng.normal(size=(m, 2))
        rank, W, order, diagonal, half = factored(A, sides, np.ones(n, dtype=bool), 1e-12)
        Q, R, pivots = scipy.linalg.qr(A, pivoting=True)
        assert rank == min(m, n)
        np.testing.assert_array_equal(order[:rank], pivots[:rank])
        np.testing.assert_allclose(np.abs(diagonal), np.abs(np.diag(R)), rtol=1e-12)
        signs = diagonal / np.diag(R)
        for k in range(n):  # above the diagonal, and columns that are not taken
            top = min(k, rank)
            np.testing.assert_allclose(W[k, :top], (R[:top, k] * signs[:top]), rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(W[n:, :rank], ((Q.T @ sides)[:rank] * signs[:, None]).T, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(W[n:], axis=1), np.linalg.norm(sides, axis=0), rtol=1e-13)
        reflectors = [np.r_[np.zeros(k), W[k, k:]] for k in range(rank)]
        np.testing.assert_allclose(half, [0.5 * v @ v for v in reflectors], rtol=1e-13)


def test_least_squares_of_the_columns_that_were_taken():
    rng = np.random.default_rng(55)
    for case in range(20):
        A = rng.normal(size=(6, 5))
        allowed = np.ones(5, dtype=bool)
        allowed[case % 5] = False
        A[:, (case + 1) % 5] = A[:, [(case + 2) % 5, (case + 3) % 5]] @ rng.normal(size=2)
        b = rng.normal(size=6)
        rank, W, order, diagonal, half = factored(A, b[:, None], allowed, 1e-10)
        assert rank == 3
        taken = order[:rank]
        assert case % 5 not in taken
        assert sorted(order) == [0, 1, 2, 3, 4]
        expected = np.linalg.lstsq(A[:, taken], b, rcond=None)[0]
        again, beyond = b.copy(), W[5, rank:].copy()
        solve_factored(W, diagonal, half, rank, again)
        np.testing.assert_allclose(again[:rank], expected, rtol=1e-10, atol=1e-12)
        solve_triangle(W, diagonal, rank, W[5])  # the right side that took part
        np.testing.assert_allclose(W[5, :rank], expected, rtol=1e-10, atol=1e-12)
        np.testing.assert_array_equal(W[5, rank:], beyond)
