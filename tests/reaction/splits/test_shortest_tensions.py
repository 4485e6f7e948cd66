"""Tensions of least norm within limits, in stacks, against a solver and against the conditions of an optimum."""

import numpy as np
import pytest

from exo_pin.numerics import LeastSquares, solve
from exo_pin.reaction.splits.spherical import shortest_tensions, shortest_within


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


@pytest.mark.parametrize("n", [4, 5, 6, 7, 8])
def test_shortest_tensions_of_rows_of_any_size(n):
    """Components of the wanted moment may be zero, small and large in one row."""
    rng = np.random.default_rng(n)
    arms = 0.2 * rng.normal(size=(6, 3, n))
    stress = np.swapaxes(np.linalg.svd(arms)[2][:, 3:], 1, 2)
    inside = rng.uniform(0.0, 30.0, (6, n))
    moment = (arms @ inside[..., None])[..., 0]
    moment[:2] *= 1e-6
    f = (np.linalg.pinv(arms) @ moment[..., None])[..., 0]
    low, high = np.zeros((6, n)), np.full((6, n), 40.0)
    high[:2] *= 1e-6
    # The last row cannot be held.
    high[5] = 0.01
    found = shortest_tensions(f, stress, low, high)
    assert np.isnan(found).any(axis=1).tolist() == [False] * 5 + [True]
    for k in range(5):
        scale = np.abs(found[k]).max()
        np.testing.assert_allclose(arms[k] @ found[k], moment[k], atol=1e-9 * scale)
        assert (found[k] >= low[k]).all()
        assert (found[k] <= high[k]).all()
        # Optimality: where a tension is free, it is a sum of the moments' rows.
        free = (found[k] > 1e-9 * scale) & (found[k] < high[k] - 1e-9 * scale)
        y = np.linalg.lstsq(arms[k][:, free].T, found[k][free], rcond=None)[0]
        pull = arms[k].T @ y
        np.testing.assert_allclose(pull[free], found[k][free], atol=1e-6 * scale)
        assert (pull[found[k] <= 1e-9 * scale] <= 1e-6 * scale).all()
        assert (pull[found[k] >= high[k] - 1e-9 * scale] >= high[k, 0] - 1e-6 * scale).all()
    # Whatever tensions that balance the moments one begins with.
    other = f + (stress @ rng.normal(size=(6, n - 3, 1)) * 10.0)[..., 0]
    np.testing.assert_allclose(
        shortest_tensions(other, stress, low, high)[2:5], found[2:5], atol=1e-6 * np.abs(found[2:5]).max()
    )
    # A tension of one part of 1e-6 off balance is no balance.
    assert np.isnan(shortest_tensions(f[:1], stress[:1], inside[:1] + 1.0, inside[:1] + 1.0)).all()


def test_a_wanted_force_with_a_part_that_is_nothing():
    """Tensions that carry two of three directions alone are as exact as others."""
    rng = np.random.default_rng(31)
    stress = np.linalg.svd(rng.normal(size=(7, 7)))[0][:, :4][None]
    carried = np.linalg.svd(stress)[0][0][:, 4:].T
    f = (3.0 * carried[0] - 5.0 * carried[1])[None]
    found = shortest_tensions(f, stress, np.full((1, 7), -100.0), np.full((1, 7), 100.0))
    np.testing.assert_allclose(found, f, atol=1e-9)
