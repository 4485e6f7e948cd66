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


def test_violations_are_how_far_each_constraint_is_missed(program):
    assert program.violation(Z) < 1e-14
    far = 0.25
    for change in (
        {"b": program.b + far}, {"b": program.b - far}, {"low": LOW + far}, {"high": HIGH - far},
        {"c": program.c - [far, 0.0, 0.0]}, {"c": program.c - [0.0, 0.0, 0.6 + far]},
    ):  # fmt: skip
        changed = replace(program, **change)
        assert changed.violation(Z) == pytest.approx(far, rel=1e-12)
        assert judged(changed, Z, EQUALITY, INEQUALITY).kkt == pytest.approx(far, rel=1e-12)
    # Room is no violation, and nothing to violate is none.
    assert replace(program, c=program.c + far, low=LOW - far, high=HIGH + far).violation(Z) < 1e-14
    none, rows = np.zeros(0), np.zeros((0, 0))
    assert LeastSquares(rows, none, rows, none, none, none, rows, none).violation(none) == 0.0


@pytest.mark.parametrize("size", [1e-3, 0.1])
def test_wrong_multipliers_are_measured(program, size):
    """Each alone: a sign, or the lesser of multiplier and room where both are there."""
    # A negative multiplier of an inequality; E is changed so that bound multipliers stay.
    for row, value, expected in ((2, -size, size), (2, size, size), (2, 5.0, 0.6)):
        inequality = INEQUALITY.copy()
        inequality[row] = value
        residual = np.linalg.solve(program.E.T, -(program.A.T @ EQUALITY + program.C.T @ inequality + BOUND))
        changed = replace(program, d=program.E @ Z - residual)
        assert judged(changed, Z, EQUALITY, inequality).kkt == pytest.approx(expected, rel=1e-9)
    # Multipliers of bounds that are not reached, and of the wrong sign: the lesser of them and the room.
    for variable, value, expected in (
        (0, size, size), (0, -size, size), (0, 9.0, 1.8), (0, -9.0, 1.2), (2, size, size), (2, 9.0, 3.0),
        (3, -size, size), (3, -9.0, 3.0), (4, -5.0, 0.0), (5, size, size), (5, -size, size),
    ):  # fmt: skip
        bound = BOUND.copy()
        bound[variable] = value
        residual = np.linalg.solve(program.E.T, -(program.A.T @ EQUALITY + program.C.T @ INEQUALITY + bound))
        changed = replace(program, d=program.E @ Z - residual)
        assert judged(changed, Z, EQUALITY, INEQUALITY).kkt == pytest.approx(expected, rel=1e-9, abs=1e-13)


def test_no_number_is_no_optimum(program):
    spoilt = np.where(np.arange(6) == 1, np.nan, Z)
    assert judged(program, spoilt, EQUALITY, INEQUALITY).kkt == INF


def test_the_gap_is_that_of_the_dual_by_corners_of_the_box(program):
    """For every z and all multipliers, those of inequalities not negative: the least of the Lagrangian over the box."""
    rng = np.random.default_rng(71)
    bounded = replace(program, low=np.where(np.isinf(LOW), -9.0, LOW), high=np.where(np.isinf(HIGH), 9.0, HIGH))
    for _ in range(20):
        z, equality, inequality = rng.uniform(bounded.low, bounded.high), rng.normal(size=1), rng.normal(size=3)
        answer = judged(bounded, z, equality, inequality)
        positive = np.maximum(inequality, 0.0)
        r = bounded.E @ z - bounded.d
        slope = bounded.E.T @ r + bounded.A.T @ equality + bounded.C.T @ positive
        least = np.minimum(slope * bounded.low, slope * bounded.high).sum()
        dual = -0.5 * r @ r - r @ bounded.d - equality @ bounded.b - positive @ bounded.c + least
        assert answer.gap == pytest.approx(max(0.0, 0.5 * r @ r - dual), rel=1e-12)


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


def test_an_inequality_without_a_limit_has_no_part_in_the_gap(program):
    """Nor has one with a limit and no multiplier; a multiplier without a limit has no dual bound."""
    bounded = replace(program, low=np.where(np.isinf(LOW), -9.0, LOW), high=np.where(np.isinf(HIGH), 9.0, HIGH))
    for z in (Z, 0.9 * Z):
        gap = judged(bounded, z, EQUALITY, INEQUALITY).gap
        absent = replace(bounded, c=np.where(INEQUALITY == 0.0, INF, bounded.c))
        assert judged(absent, z, EQUALITY, INEQUALITY).gap == gap
        pulled = np.where(INEQUALITY == 0.0, 0.1, INEQUALITY)
        assert judged(absent, z, EQUALITY, pulled).gap == INF
        assert judged(bounded, z, EQUALITY, pulled).gap < INF
    assert gap > 0.0


@pytest.mark.parametrize("pull", [0.9e-8, -0.9e-8, 0.0])
def test_a_pull_of_rounding_without_a_bound_adds_nothing_to_the_gap(pull):
    """One variable, z = 0, that is pulled to d = -pull: ½ r² + ½ r² + r d is zero."""
    none, rows = np.zeros(0), np.zeros((0, 1))
    program = LeastSquares(np.eye(1), np.array([-pull]), rows, none, np.array([-INF]), np.array([INF]), rows, none)
    answer = judged(program, np.zeros(1), none, none)
    assert answer.gap < 1e-20
    assert answer.kkt == abs(pull)
