"""Least solutions, null spaces and minimisations in order of stacks of matrices, against NumPy's singular values."""

import numpy as np
import pytest

from exo_pin.numerics.rank_factors import fill_least_in_order, solve_and_span

pytestmark = pytest.mark.usefixtures("plain")


def matrices(rng, count, m, n, rank):
    return rng.normal(size=(count, m, rank)) @ rng.normal(size=(count, rank, n))


@pytest.mark.parametrize(
    ("m", "n", "rank"), [(5, 7, 3), (7, 4, 4), (4, 6, 4), (6, 6, 5), (3, 5, 0), (1, 2, 1), (2, 1, 1)]
)
def test_least_solutions_and_null_spaces(m, n, rank):
    rng = np.random.default_rng([m, n])
    A = matrices(rng, 3, m, n, rank) * np.array([1.0, 1e3, 1e-5])[:, None, None]
    b = np.swapaxes(np.swapaxes(A, 1, 2) @ rng.normal(size=(3, m, 2)), 1, 2)  # right sides that have a solution
    least, null, left = np.full((3, 2, m), 9.0), np.full((3, n, n), 9.0), np.full((3, m, m), 9.0)
    ranks = np.zeros(3, dtype=np.int64)
    # One more row in each, below the cut beside others: 1e-10 of the longest row.
    A[:, -1] += 1e-10 * np.abs(A).max(axis=(1, 2))[:, None] * rng.normal(size=(3, n)) * (0 < rank < min(m, n))
    solve_and_span(A, b, 1e-8, least, null, left, ranks)
    np.testing.assert_array_equal(ranks, rank)
    for k in range(3):
        expected = np.linalg.pinv(A[k].T, rcond=1e-8) @ b[k].T
        np.testing.assert_allclose(least[k], expected.T, rtol=1e-6, atol=1e-8)
        for basis, matrix in ((null[k], A[k]), (left[k], A[k].T)):
            np.testing.assert_array_equal(basis[:rank], 0.0)
            np.testing.assert_allclose(basis[rank:] @ basis[rank:].T, np.eye(len(basis) - rank), atol=1e-14)
            assert np.abs(matrix @ basis.T).max(initial=0.0) <= 1e-8 * np.abs(matrix).max()


def in_order(effects, present, ends, cut):
    """The same by pseudo-inverses, each within what those before leave open."""
    n = effects.shape[1]
    x, open_to, start = np.zeros((n, present.shape[1])), np.eye(n), 0
    scale = max(1.0, np.abs(effects).max())
    for end in ends:
        E = effects[start:end] @ open_to
        left = present[start:end] + effects[start:end] @ x
        U, values, Vt = np.linalg.svd(E)
        rank = int((values > cut * scale).sum())
        x = x - open_to @ Vt[:rank].T @ ((U[:, :rank].T @ left) / values[:rank, None])
        open_to, start = open_to @ Vt[rank:].T, end
    return x


@pytest.mark.parametrize("ends", [[2, 3, 6], [0, 4, 4, 7], [6, 7], [1, 2]])
@pytest.mark.parametrize("size", [1e-3, 40.0])
def test_quantities_are_made_least_in_their_order(ends, size):
    rng = np.random.default_rng([len(ends), int(size)])
    effects = size * rng.normal(size=(4, ends[-1], 5))
    effects[1, 0] = effects[1, 1]  # dependent rows of one quantity
    effects[2, -1] = effects[2, 0] - effects[2, 1]  # what is asked twice
    effects[3, :, 4] = 0.0
    effects[3, 0] = [1e-9, 0.0, 0.0, 0.0, 0.0]  # below the cut: none
    present = rng.normal(size=(4, ends[-1], 2))
    found = np.full((4, 2, 5), 7.0)
    fill_least_in_order(effects, present, np.array(ends), 1e-8, found)
    for k in range(4):
        np.testing.assert_allclose(found[k], in_order(effects[k], present[k], ends, 1e-8).T, rtol=1e-8, atol=1e-8)
