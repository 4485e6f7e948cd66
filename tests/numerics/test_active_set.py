"""The walk over working sets from empty ones, to answers that are known by hand or by every working set in turn."""

from itertools import combinations, product

import numpy as np
import pytest

from exo_pin.numerics import LeastSquares
from exo_pin.numerics.quadratic import _walk
from exo_pin.numerics.smoothing.smoothing_splines import _inverse_bands


def walked(program, start):
    none = np.zeros(len(program.b)), np.zeros(len(program.c)), np.zeros(program.size)
    answer, _, _ = _walk(program, np.array(start, dtype=float), *none)
    return answer


def box(E, d, C, c, low=-np.inf, high=np.inf):
    size = E.shape[1]
    return LeastSquares(
        E, d, np.zeros((0, size)), np.zeros(0), np.full(size, low), np.full(size, high), np.atleast_2d(C), np.array(c)
    )


@pytest.mark.parametrize("order", [[0, 1], [1, 0]])
def test_the_row_that_is_hit_first_is_held_whatever_its_number(order):
    # The nearest point to (2, 2) with z_1 + z_2 <= 1 is (1/2, 1/2); the other row is far away.
    rows, sides = np.array([[1.0, 1.0], [1.0, 0.0]])[order], np.array([1.0, 50.0])[order]
    answer = walked(box(np.eye(2), np.array([2.0, 2.0]), rows, sides), [0.0, -1.0])
    np.testing.assert_allclose(answer.z, [0.5, 0.5], atol=1e-12)
    # Its multiplier, by stationarity: z - d + λ n = 0.
    np.testing.assert_allclose(answer.inequality[order.index(0)], 1.5, atol=1e-12)
    np.testing.assert_allclose(answer.inequality[order.index(1)], 0.0, atol=1e-12)


def by_every_working_set(program):
    """The least objective among the feasible minimisers of all working sets."""
    best, size = np.inf, program.size
    for sides in product((-1, 0, 1), repeat=size):
        for count in range(len(program.c) + 1):
            for rows in combinations(range(len(program.c)), count):
                held = [np.eye(size)[i] for i in range(size) if sides[i]] + [program.C[k] for k in rows]
                at = [(program.low if sides[i] < 0 else program.high)[i] for i in range(size) if sides[i]]
                at += [program.c[k] for k in rows]
                H, g = program.E.T @ program.E, program.E.T @ program.d
                if not held:
                    z = np.linalg.solve(H, g)
                elif np.linalg.matrix_rank(np.array(held)) < len(held):
                    continue
                else:
                    N = np.array(held)
                    K = np.block([[H, N.T], [N, np.zeros((len(N), len(N)))]])
                    z = np.linalg.solve(K, np.concatenate([g, at]))[:size]
                inside = (z >= program.low - 1e-9).all() and (z <= program.high + 1e-9).all()
                if inside and (program.C @ z <= program.c + 1e-9).all():
                    best = min(best, float(np.linalg.norm(program.E @ z - program.d)))
    return best


@pytest.mark.parametrize("seed", range(8))
def test_the_walk_ends_at_the_least_of_all_working_sets(seed):
    rng = np.random.default_rng(seed)
    program = box(
        rng.normal(size=(4, 3)), 3.0 * rng.normal(size=4), rng.normal(size=(2, 3)), rng.uniform(0.1, 1.0, 2), -1.0, 1.0
    )
    answer = walked(program, np.zeros(3))
    assert program.violation(answer.z) < 1e-10
    assert np.linalg.norm(program.E @ answer.z - program.d) == pytest.approx(by_every_working_set(program), rel=1e-9)


@pytest.mark.parametrize("size", [3, 7])
def test_bands_of_an_inverse_are_those_of_the_dense_one(size):
    rng = np.random.default_rng(size)
    factor = np.tril(rng.normal(size=(size, size))) * (np.abs(np.subtract.outer(range(size), range(size))) <= 2)
    np.fill_diagonal(factor, rng.uniform(1.0, 2.0, size))
    bands = np.array([np.append(np.diagonal(factor, -k), np.zeros(k)) for k in range(3)])
    dense = np.linalg.inv(factor @ factor.T)
    expected = np.array([np.append(np.diagonal(dense, -k), np.zeros(k)) for k in range(3)])
    found = _inverse_bands(bands)
    for k in range(3):
        np.testing.assert_allclose(found[k, : size - k], expected[k, : size - k], rtol=1e-10)
