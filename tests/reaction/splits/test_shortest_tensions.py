"""Tensions of least norm within limits, in stacks, against a solver."""

import numpy as np
import pytest

from exo_pin.numerics import LeastSquares, solve
from exo_pin.reaction.splits.split import shortest_within


def program(rng, limb_count):
    """Tensions, those that balance themselves, and limits that hold some of them, of which some bind at the answer."""
    N = np.linalg.qr(rng.standard_normal((limb_count, limb_count - 3)))[0]
    f = 50.0 * rng.standard_normal(limb_count)
    inside = f + N @ (30.0 * rng.standard_normal(limb_count - 3))
    low, high = inside - rng.uniform(1.0, 40.0, limb_count), inside + rng.uniform(1.0, 40.0, limb_count)
    return f, np.ascontiguousarray(N), low, high


@pytest.mark.full
@pytest.mark.parametrize("limb_count", [4, 5, 6])
def test_shortest_tensions_agree_with_a_solver(limb_count):
    rng = np.random.default_rng(10 + limb_count)
    f, N, low, high = map(np.array, zip(*(program(rng, limb_count) for _ in range(20)), strict=True))
    # The last has no answer: it is left as it was.
    across = np.linalg.svd(N[-1].T)[2][-1]
    f[-1] += 1e4 * across
    out = f.copy()
    shortest_within(f, N, low, high, out)
    np.testing.assert_array_equal(out[-1], f[-1])
    for k in range(19):
        fixed = np.linalg.svd(N[k].T)[2][limb_count - 3 :]
        rows = np.eye(limb_count), np.zeros(limb_count), fixed, fixed @ f[k], low[k], high[k]
        answer = solve(LeastSquares(*rows, np.zeros((0, limb_count)), np.zeros(0)))
        assert answer.is_optimal
        np.testing.assert_allclose(out[k], answer.z, atol=1e-5)
