"""Bases, ranks and small systems against NumPy's and SciPy's dense linear algebra."""

import numpy as np
import pytest
import scipy

from exo_pin.numerics.small_linear import complete_basis, orthonormalise, solve_cholesky

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
