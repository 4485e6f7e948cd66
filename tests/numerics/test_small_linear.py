"""Bases, ranks and small systems against NumPy's and SciPy's dense linear algebra."""

import numpy as np
import pytest
import scipy

from exo_pin.numerics.small_linear import complete_basis, orthonormalise, row_rank, solve_cholesky

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


def test_only_the_columns_that_are_asked_for_are_changed():
    A = np.random.default_rng(56).normal(size=(4, 3))
    Q, U = A.copy(), np.zeros((3, 3))
    orthonormalise(Q, U, 2)
    np.testing.assert_allclose(Q[:, :2] @ U[:2, :2], A[:, :2], atol=1e-15)
    assert (Q[:, 2] == A[:, 2]).all()


def test_the_complement_starts_with_the_unit_vector_that_is_farthest_from_the_span():
    # The span is that of the first three axes, a little turned: the fourth axis is nearest to its complement.
    Q = np.linalg.qr(np.eye(5)[:, :3] + 0.1 * np.random.default_rng(57).normal(size=(5, 3)))[0]
    N = np.empty((5, 2))
    complete_basis(Q, N)
    outside = np.eye(5) - Q @ Q.T
    best = np.argmax(np.diag(outside))
    np.testing.assert_allclose(N[:, 0], outside[best] / np.linalg.norm(outside[best]), atol=1e-14)


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


@pytest.mark.parametrize("axes", [(0, 1, 2), (2, 0, 1), (1, 3, 4), (4, 2, 0), (5, 6, 3)])
def test_each_column_of_a_complement_is_of_the_unit_vector_that_is_farthest_from_those_before(axes):
    rng = np.random.default_rng(sum(axes))
    for spread in (0.0, 0.3):
        Q = np.linalg.qr(np.eye(7)[:, axes] + spread * rng.normal(size=(7, 3)))[0]
        N = np.empty((7, 4))
        complete_basis(Q, N)
        basis = Q
        for column in range(4):
            outside = np.eye(7) - basis @ basis.T
            best = outside[np.argmax(np.diag(outside) - 1e-12 * np.arange(7))]
            np.testing.assert_allclose(N[:, column], best / np.linalg.norm(best), atol=1e-14)
            basis = np.column_stack([basis, N[:, column]])


def test_what_is_along_other_columns_is_taken_out_twice(monkeypatch):
    """Which makes bases orthonormal to rounding; more often would be for nothing."""
    asked, kernel = [], orthonormalise.plain.__globals__["_cleared"]
    for function in (orthonormalise, complete_basis):
        monkeypatch.setitem(
            function.plain.__globals__, "_cleared", lambda *given: asked.append(given[1]) or kernel(*given)
        )
    Q, N = np.random.default_rng(58).normal(size=(6, 3)), np.empty((6, 3))
    orthonormalise(Q, np.empty((3, 3)), 3)
    assert asked == [1, 1, 2, 2, 2, 2]
    asked.clear()
    complete_basis(Q, N)
    assert asked == 6 * [0] + 8 * [1] + 10 * [2]


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("absent", [0, 1, 2])
def test_one_turn_makes_two_rows_orthogonal_with_the_longer_one_first(monkeypatch, absent, seed):
    """Beside a row of zeros: by the angle of Jacobi, whichever row is longer, and in either direction."""
    monkeypatch.setitem(row_rank.plain.__globals__, "_SWEEPS", 1)
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(3, 4)) * np.array([[1.0], [3.0], [2.0]])
    A[absent] = 0.0
    # The row of zeros goes last, which takes one of the three pairs each time.
    if absent == 0:
        A = A[[1, 2, 0]]
    elif absent == 1:
        A = A[[0, 2, 1]]
    turned, sides = A.copy(), rng.normal(size=3)
    before = sides.copy()
    assert row_rank(turned, sides, 1e-12) == 2
    values, (U, _, _) = np.linalg.svd(A, compute_uv=False), np.linalg.svd(A)
    np.testing.assert_allclose(np.linalg.norm(turned, axis=1), values, atol=1e-14)
    assert abs(turned[0] @ turned[1]) < 1e-14 * values[0] ** 2
    np.testing.assert_allclose(np.abs(sides[:2]), np.abs(U.T @ before)[:2], rtol=1e-12)
    assert sides[2] == before[2]


def test_sweeps_end_where_nothing_is_turned(monkeypatch):
    """Jacobi's method converges quadratically: five sweeps or six, of which the last turns nothing."""
    asked = []
    monkeypatch.setattr(
        row_rank.plain.__globals__["math"], "copysign", lambda *given: asked.append(1) or np.copysign(*given)
    )
    rng = np.random.default_rng(59)
    for _ in range(20):
        asked.clear()
        row_rank(rng.normal(size=(3, 5)), np.zeros(3), 1e-12)
        assert 3 <= len(asked) <= 15
