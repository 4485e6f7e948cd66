"""Sums of at most three unknowns within limits, against an enumeration of all active sets."""

from itertools import combinations

import numpy as np
import pytest

from exo_pin.numerics.bounded.polytope_program import least_sum_force

pytestmark = pytest.mark.usefixtures("plain")

#: Weight of the variables' squares beside those of the force.
SMALL = 1e-9


def solved(c, G, f, N, low, high):
    z = np.full(N.shape[1], np.nan)
    return least_sum_force(c, np.ascontiguousarray(G), f, np.ascontiguousarray(N), low, high, z), z


def by_enumeration(c, G, f, N, low, high):
    """The feasible minimiser of least objective on all sets of at most m limits that hold with equality."""
    m = N.shape[1]
    H, g = G.T @ G + SMALL * np.eye(m), G.T @ c
    a = np.concatenate([N, -N])
    b = np.concatenate([low - f, f - high])
    a, b = a[np.isfinite(b)], b[np.isfinite(b)]
    best, least = None, np.inf
    for count in range(m + 1):
        for held in combinations(range(len(b)), count):
            A = a[list(held)]
            if np.linalg.matrix_rank(A, tol=1e-9) < count:
                continue
            K = np.block([[H, A.T], [A, np.zeros((count, count))]])
            z = np.linalg.solve(K, np.concatenate([-g, b[list(held)]]))[:m]
            value = 0.5 * z @ H @ z + g @ z
            if (a @ z >= b - 1e-9).all() and value < least:
                best, least = z, value
    return best


def program(rng, n, m, kind):
    N = np.linalg.qr(rng.normal(size=(n, m)))[0]
    if kind == "parallel":
        N[1] = -0.5 * N[0]
    f = 30.0 * rng.normal(size=n)
    inside = f + N @ (20.0 * rng.normal(size=m))
    low, high = inside - rng.uniform(0.5, 20.0, n), inside + rng.uniform(0.5, 20.0, n)
    if kind == "half-open":
        low[rng.random(n) < 0.4] = -np.inf
        high[rng.random(n) < 0.4] = np.inf
    if kind == "fixed":
        low[: m - 1] = high[: m - 1] = inside[: m - 1]
    return 60.0 * rng.normal(size=3), rng.normal(size=(3, m)), f, N, low, high


@pytest.mark.parametrize("kind", ["two-sided", "half-open", "fixed", "parallel"])
@pytest.mark.parametrize("m", [1, 2, 3])
def test_answers_are_the_best_of_all_active_sets(m, kind):
    rng = np.random.default_rng(10 * m + len(kind))
    for _ in range(6):
        arguments = program(rng, m + 3, m, kind)
        found, z = solved(*arguments)
        assert found
        np.testing.assert_allclose(z, by_enumeration(*arguments), rtol=1e-9, atol=1e-8)


@pytest.mark.parametrize("m", [1, 2, 3])
@pytest.mark.parametrize("force", [0.5, 10.0])
def test_limits_that_no_unknown_moves_are_met_to_rounding_of_the_largest_force(m, force):
    """A limb without part in the unknowns: 1e-11 of the largest tension, of at least 1 N, is rounding."""
    rng = np.random.default_rng(59)
    N = np.vstack([np.linalg.qr(rng.normal(size=(4, m)))[0], np.zeros(m)])
    f, c, G = np.full(5, force), rng.normal(size=3), rng.normal(size=(3, m))
    none = np.full(5, np.inf)
    for share, expected in ((0.0, True), (0.9, True), (1.1, False), (2.0, False), (1e6, False)):
        off = share * 1e-11 * max(1.0, force)
        for side in (1.0, -1.0):
            limit = np.full(5, np.inf)
            limit[4] = -side * force - off
            low, high = (-none, limit) if side < 0.0 else (-limit, none)
            found, z = solved(c, G, f, N, low, high)
            assert found == expected, (share, side)
            if found:
                free = by_enumeration(c, G, f, N, -none, none)
                np.testing.assert_allclose(z, free, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("m", [1, 2, 3])
def test_opposite_limits_may_cross_by_rounding_only(m):
    """Two limbs that take the same part in the unknowns, one of which is to pull more than the other may."""
    rng = np.random.default_rng(60)
    N = np.linalg.qr(rng.normal(size=(4, m)))[0]
    N = np.vstack([N, N[0]])
    f, c, G, none = np.zeros(5), 5.0 * rng.normal(size=3), rng.normal(size=(3, m)), np.full(5, np.inf)
    for share, expected in ((0.0, True), (0.3, True), (10.0, False), (1e6, False)):
        low, high = -none, none.copy()
        low[0], high[4] = 0.25 + share * 1e-11, 0.25
        found, z = solved(c, G, f, N, low, high)
        assert found == expected, share
        if found:
            high[0] = high[4] = low[0] = 0.25
            np.testing.assert_allclose(z, by_enumeration(c, G, f, N, low, high), rtol=1e-8, atol=1e-8)
