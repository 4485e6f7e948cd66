"""The optimality conditions of a program whose optimum is known by construction, and each of them violated in turn."""

from dataclasses import replace

import numpy as np
import pytest

from exo_pin.numerics import LeastSquares, Solution, judged
from exo_pin.numerics.quadratic import _is_unique

INF = np.inf
#: Of six variables: two inside, one on each bound, one that cannot move, and one without bounds.
Z = np.array([0.2, -0.3, -1.0, 2.0, 0.5, 7.0])
LOW, HIGH = np.array([-1.0, -1.0, -1.0, -1.0, 0.5, -INF]), np.array([2.0, 2.0, 2.0, 2.0, 0.5, INF])
#: Multipliers: of bounds, of one equality, and of inequalities of which the last has room of 0.6.
BOUND, EQUALITY, INEQUALITY = np.array([0, 0, -0.7, 0.4, 0.9, 0.0]), np.array([1.3]), np.array([0.8, 0.3, 0.0])
ROOM = np.array([0.0, 0.0, 0.6])


@pytest.fixture
def program():
    rng = np.random.default_rng(70)
    E, A, C = rng.normal(size=(6, 6)), rng.normal(size=(1, 6)), rng.normal(size=(3, 6))
    # Stationarity, Eᵀ r + Aᵀ λ + Cᵀ ν + bound = 0, gives the residual, and d with it.
    residual = np.linalg.solve(E.T, -(A.T @ EQUALITY + C.T @ INEQUALITY + BOUND))
    return LeastSquares(E, E @ Z - residual, A, A @ Z, LOW, HIGH, C, C @ Z + ROOM)


def test_an_optimum_is_one(program):
    answer = judged(program, Z, EQUALITY, INEQUALITY)
    assert answer.kkt < 1e-13
    assert answer.gap < 1e-12
    assert answer.is_optimal
    assert answer.unique
    assert program.size == 6
    np.testing.assert_allclose(answer.bound, BOUND, atol=1e-13)
    np.testing.assert_allclose(answer.residual, program.E @ Z - program.d, atol=1e-13)


def test_no_number_is_no_optimum(program):
    spoilt = np.where(np.arange(6) == 1, np.nan, Z)
    assert judged(program, spoilt, EQUALITY, INEQUALITY).kkt == INF


def test_a_pull_without_a_bound_has_an_infinite_gap(program):
    for pull, finite in ((0.9e-8, True), (1.1e-8, False), (-0.9e-8, True), (-1.1e-8, False), (-1.0, False)):
        bound = BOUND + np.where(np.arange(6) == 5, pull, 0.0)
        residual = np.linalg.solve(program.E.T, -(program.A.T @ EQUALITY + program.C.T @ INEQUALITY + bound))
        changed = replace(program, d=program.E @ Z - residual)
        gap = judged(changed, Z, EQUALITY, INEQUALITY).gap
        assert (gap < 1e-7) if finite else (gap == INF)
    # Half open: only the side that is pulled to counts. The multiplier of a bound pulls the other way.
    for pull, low, high, finite in (
        (0.4, -INF, 7.0, True), (0.4, 7.0, INF, False), (-0.4, 7.0, INF, True), (-0.4, -INF, 7.0, False)
    ):  # fmt: skip
        bound = BOUND + np.where(np.arange(6) == 5, pull, 0.0)
        residual = np.linalg.solve(program.E.T, -(program.A.T @ EQUALITY + program.C.T @ INEQUALITY + bound))
        sides = {"low": np.append(LOW[:5], low), "high": np.append(HIGH[:5], high)}
        changed = replace(program, d=program.E @ Z - residual, **sides)
        gap = judged(changed, Z, EQUALITY, INEQUALITY).gap
        assert (gap < 1e-10) if finite else (gap == INF)


@pytest.mark.parametrize(
    ("rank", "held", "fixed", "equality", "multiplier", "unique"),
    [
        (3, (), (), 0, 0.0, True),
        (2, (), (), 0, 0.0, False),
        (2, (0,), (), 0, 0.0, True),
        (2, (), (1,), 0, 0.0, True),
        (2, (), (), 1, 0.0, True),
        (2, (), (), 0, 1.0, True),
        (2, (), (), 0, 1.1e-8, True),
        (2, (), (), 0, 0.9e-8, False),
        (1, (0,), (), 0, 0.0, False),
        (1, (0,), (), 1, 0.0, True),
        (1, (0,), (2,), 0, 0.0, True),
        (0, (0, 1, 2), (), 0, 0.0, True),
        (0, (0,), (1, 2), 0, 0.0, True),
        (0, (0,), (1,), 0, 0.0, False),
    ],
)
def test_what_is_not_held_by_bounds_has_to_be_spanned(rank, held, fixed, equality, multiplier, unique):
    """By rows of E, equalities and the inequalities that carry a multiplier."""
    rng = np.random.default_rng(72)
    E = rng.normal(size=(4, rank)) @ rng.normal(size=(rank, 3))
    A, C = rng.normal(size=(equality, 3)), rng.normal(size=(1, 3))
    high = np.where(np.isin(np.arange(3), fixed), -1.0, 1.0)
    program = LeastSquares(E, np.zeros(4), A, np.zeros(equality), -np.ones(3), high, C, np.zeros(1))
    for side, is_held in ((1.1e-8, True), (-1.1e-8, True), (0.9e-8, False)):
        bound = np.where(np.isin(np.arange(3), held), side, 0.0)
        if is_held or not held:
            assert _is_unique(program, np.array([multiplier]), bound) == unique
        elif rank + equality + (multiplier > 1e-8) + len(fixed) < 3:
            assert not _is_unique(program, np.array([multiplier]), bound)
    thin = replace(program, E=np.diag([1.0, 1.0, 1e-13]), A=np.zeros((0, 3)), b=np.zeros(0))
    assert not _is_unique(thin, np.zeros(1), np.zeros(3)) or fixed
    assert _is_unique(replace(thin, E=np.diag([1.0, 1.0, 1e-11])), np.zeros(1), np.zeros(3))


def test_the_residual_is_off_by_twice_the_gap_over_itself_at_most():
    def answer(residual, gap, kkt=0.0):
        none = np.zeros(0)
        return Solution(none, np.array(residual), none, none, none, kkt, gap, True)

    assert answer([3.0, 4.0], 0.5).residual_gap == 0.2
    assert answer([0.3, 0.4], 0.05).residual_gap == pytest.approx(0.2, rel=1e-15)
    assert answer([0.3, 0.4], 9.0).residual_gap == 0.5
    assert answer([0.0], 0.0).residual_gap == 0.0
    assert answer([3.0, 4.0], 50.0).residual_gap == 5.0
    assert answer([0.0, 0.0], 1.0).residual_gap == 0.0
    assert answer([1.0], 0.0, 0.9e-8).is_optimal
    assert not answer([1.0], 0.0, 1.1e-8).is_optimal


@pytest.mark.parametrize("pull", [0.9e-8, -0.9e-8, 0.0])
def test_a_pull_of_rounding_without_a_bound_adds_nothing_to_the_gap(pull):
    """One variable, z = 0, that is pulled to d = -pull: ½ r² + ½ r² + r d is zero."""
    none, rows = np.zeros(0), np.zeros((0, 1))
    program = LeastSquares(np.eye(1), np.array([-pull]), rows, none, np.array([-INF]), np.array([INF]), rows, none)
    answer = judged(program, np.zeros(1), none, none)
    assert answer.gap < 1e-20
    assert answer.kkt == abs(pull)
