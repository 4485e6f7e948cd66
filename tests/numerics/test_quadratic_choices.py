"""Which of several answers of a quadratic program is taken, and that each is computed as often as it has to be."""

import itertools

import numpy as np
import pytest

from exo_pin.numerics import LeastSquares, Solution, judged, quadratic, solve
from exo_pin.numerics.quadratic import _from, _on_working_set, _proxqp, _solve, _walk

NONE = np.zeros(0)


def free_program(E, d, low=-np.inf, high=np.inf):
    size = E.shape[1]
    rows = np.zeros((0, size))
    return LeastSquares(E, d, rows, NONE, np.full(size, low), np.full(size, high), rows, NONE)


def answer(name, kkt, gap):
    return Solution(np.array([name]), NONE, NONE, NONE, NONE, kkt, gap, True)


@pytest.mark.parametrize(
    ("walked", "started", "again", "taken"),
    [
        ((1e-16, 1e-16), (1e-10, 1e-10), (1e-15, 1e-15), 3.0),
        # Of the two before, the one that meets the conditions better, and of equal ones that of the lesser gap.
        ((1e-6, 0.0), (1e-9, 1.0), (1.0, 0.0), 2.0),
        ((1e-9, 1.0), (1e-6, 0.0), (1.0, 0.0), 1.0),
        ((1e-6, 1e-6), (1e-6, 1e-9), (1.0, 0.0), 2.0),
        ((1e-6, 1e-9), (1e-6, 1e-6), (1.0, 0.0), 1.0),
        # The one of the working set alone, if it is as good: to a factor of ten, and to 1e-12.
        ((1e-6, 1e-6), (1.0, 1.0), (9e-6, 9e-6), 3.0),
        ((1e-6, 1e-6), (1.0, 1.0), (1.1e-5, 1e-6), 1.0),
        ((1e-6, 1e-6), (1.0, 1.0), (1e-6, 1.1e-5), 1.0),
        ((1e-6, 1e-6), (1.0, 1.0), (1.9e-5, 1e-6), 1.0),
        ((1e-6, 1e-6), (1.0, 1.0), (1e-6, 1.9e-5), 1.0),
        ((0.0, 0.0), (1.0, 1.0), (0.9e-12, 0.9e-12), 3.0),
        ((0.0, 0.0), (1.0, 1.0), (1.1e-12, 0.0), 1.0),
        ((0.0, 0.0), (1.0, 1.0), (0.0, 1.1e-12), 1.0),
    ],
)
def test_the_better_answer_is_taken_and_of_equal_ones_that_of_the_working_set(
    monkeypatch, walked, started, again, taken
):
    side, rows = np.zeros(1, dtype=int), np.zeros(0, dtype=bool)
    monkeypatch.setattr(quadratic, "_walk", lambda *given: (answer(1.0, *walked), side, rows))
    monkeypatch.setattr(quadratic, "judged", lambda *given: answer(2.0, *started))
    monkeypatch.setattr(quadratic, "_on_working_set", lambda *given: answer(3.0, *again))
    assert _from(free_program(np.eye(1), np.ones(1)), np.zeros(1), NONE, NONE, np.zeros(1)).z[0] == taken


@pytest.mark.parametrize(
    ("first", "second", "starts", "taken"),
    [((0.9e-12, 1.0), (0.0, 0.0), 1, 1.0), ((1.1e-12, 0.0), (1e-13, 0.0), 2, 2.0), ((1e-9, 0.0), (1e-8, 0.0), 2, 1.0)],
)
def test_a_rounded_start_that_leads_nowhere_is_followed_by_the_start_itself(monkeypatch, first, second, starts, taken):
    given, answers = [], [answer(1.0, *first), answer(2.0, *second)]
    exact = np.array([0.3 - 1e-9, 0.5 + 1e-12, 0.7 + 1e-9]), NONE, NONE, np.array([1e-12, 0.25, 0.0])
    monkeypatch.setattr(quadratic, "_proxqp", lambda program: exact)
    monkeypatch.setattr(quadratic, "_from", lambda program, *start: given.append(start) or answers[len(given) - 1])
    assert _solve(free_program(np.eye(3), np.ones(3), 0.3, 0.7)).z[0] == taken
    assert len(given) == starts
    np.testing.assert_array_equal(given[0][0], [0.3, 0.5, 0.7])
    np.testing.assert_array_equal(given[0][3], [0.0, 0.25, 0.0])
    for part, expected in zip(given[1] if starts == 2 else (), exact, strict=starts == 2):
        np.testing.assert_array_equal(part, expected)


@pytest.mark.parametrize(
    ("first", "second", "taken"),
    [(0.0, 0.9e-10, 2), (0.0, 1.1e-10, 1), (1e-9, 9e-9, 2), (1e-9, 1.1e-8, 1), (1e-9, 1.9e-8, 1), (0.0, 1e-6, 1)],
)
def test_the_shortest_answer_is_taken_if_it_is_as_good(monkeypatch, first, second, taken):
    """To a factor of ten or 1e-10; and it says that it is one of many."""
    one = answer(1.0, first, 0.0)._replace(unique=False)
    monkeypatch.setattr(quadratic, "_solve", lambda program: one)
    monkeypatch.setattr(quadratic, "judged", lambda *given: answer(2.0, second, 0.0))
    found = solve(free_program(np.eye(1), np.ones(1)))
    assert found.z[0] == taken
    assert not found.unique


def test_what_is_unique_or_not_optimal_or_wanted_as_it_is_is_solved_once(monkeypatch):
    asked = []
    for unique, kkt, shortest, times in (
        (True, 0.0, True, 1), (False, 0.0, True, 2), (False, 0.0, False, 1), (False, 1e-6, True, 1),
        (True, 1e-6, True, 1), (True, 0.0, False, 1),
    ):  # fmt: skip
        asked.clear()
        one = answer(1.0, kkt, 0.0)._replace(unique=unique)
        monkeypatch.setattr(quadratic, "_solve", lambda program, one=one: asked.append(program) or one)
        solve(free_program(np.eye(1), np.ones(1)), shortest)
        assert len(asked) == times


def test_multipliers_of_dependent_rows_are_the_least_ones():
    """Two rows of one direction, of lengths 1 and 2, share what one alone would hold; so do two equalities."""
    C, none = np.array([[1.0, 0.0], [2.0, 0.0]]), np.zeros((0, 2))
    program = LeastSquares(
        np.eye(2), np.array([3.0, 0.5]), none, NONE, np.full(2, -9.0), np.full(2, 9.0), C, np.array([1.0, 2.0])
    )
    found = _on_working_set(program, np.zeros(2, dtype=int), np.array([True, True]))
    np.testing.assert_allclose(found.z, [1.0, 0.5], atol=1e-15)
    np.testing.assert_allclose(found.inequality, [0.4, 0.8], atol=1e-15)
    program = LeastSquares(
        np.eye(2), np.array([3.0, 0.5]), C, np.array([1.0, 2.0]), np.full(2, -9.0), np.full(2, 9.0), none, NONE
    )
    found = _on_working_set(program, np.zeros(2, dtype=int), np.zeros(0, dtype=bool))
    np.testing.assert_allclose(found.equality, [0.4, 0.8], atol=1e-15)


def test_the_bound_with_the_largest_multiplier_is_released_first(monkeypatch):
    """From wrong bounds on either side: multipliers of 1 to 4 times the distance that each is off."""
    E, d = np.eye(4), np.array([2.0, -1.0, 4.0, -3.0])
    program, sides = free_program(E, d, -9.0, 9.0), []
    kernel = quadratic._step
    monkeypatch.setattr(quadratic, "_step", lambda *given: sides.append(given[2].copy()) or kernel(*given))
    start, bound = np.array([-9.0, 9.0, -9.0, 9.0]), np.array([-1.0, 1.0, -1.0, 1.0])
    best, side, _ = _walk(program, start, NONE, NONE, bound)
    np.testing.assert_array_equal(best.z, d)
    np.testing.assert_array_equal(side, 0)
    # Off by 11, 10, 13 and 12.
    order = [int(np.flatnonzero(b & ~a)[0]) for a, b in itertools.pairwise(sides)]
    assert order == [2, 3, 0, 1]


@pytest.mark.parametrize("first", [True, False])
def test_of_a_bound_and_a_row_the_one_with_the_larger_multiplier_is_released(monkeypatch, first):
    C = np.array([[0.0, 1.0]])
    program = LeastSquares(
        np.eye(2), np.array([2.0, -3.0]) if first else np.array([2.0, -1.0]), np.zeros((0, 2)), NONE,
        np.array([-0.5, -9.0]), np.full(2, 9.0), C, np.array([0.5]),
    )  # fmt: skip
    seen, kernel = [], quadratic._step
    monkeypatch.setattr(quadratic, "_step", lambda *given: seen.append((given[2][0], given[3][0])) or kernel(*given))
    best, _, rows = _walk(program, np.array([-0.5, 0.5]), NONE, np.ones(1), np.array([-1.0, 0.0]))
    np.testing.assert_array_equal(best.z, program.d)
    assert not rows[0]
    assert seen[0] == (False, True)
    assert seen[1] == ((False, False) if first else (True, True))


def test_proxqp_is_given_every_limit():
    """Its answer on each limit alone, of either side, with and without rows."""
    for low, high, goal, expected in ((-1.0, 2.0, 5.0, 2.0), (-1.0, 2.0, -5.0, -1.0), (-np.inf, 2.0, -5.0, -5.0),
                                      (-1.0, np.inf, 5.0, 5.0), (0.5, 0.5, 3.0, 0.5)):  # fmt: skip
        z, _, _, bound = _proxqp(free_program(np.eye(1), np.array([goal]), low, high))
        assert z[0] == pytest.approx(expected, abs=1e-8)
        assert bound[0] == pytest.approx(goal - expected, abs=1e-8)
    for c, expected in ((0.5, 0.5), (7.0, 5.0), (np.inf, 5.0)):
        program = LeastSquares(
            np.eye(1), np.array([5.0]), np.zeros((0, 1)), NONE, np.full(1, -np.inf), np.full(1, np.inf), np.eye(1),
            np.array([c]),
        )  # fmt: skip
        z, _, inequality, _ = _proxqp(program)
        assert z[0] == pytest.approx(expected, abs=1e-8)
        assert inequality[0] == pytest.approx(5.0 - expected, abs=1e-8)
        assert judged(program, z, NONE, inequality).kkt < 1e-8


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
def test_equalities_count_by_their_share_of_the_largest(size):
    rng = np.random.default_rng(172)
    A = rng.normal(size=(2, 4))
    for row, count in ((A[0] + 1e-14 * A[1], 1), (A[0] + 1e-9 * A[1], 2), (A[1], 2)):
        rows = size * np.vstack([A[0], row])
        program = LeastSquares(
            np.eye(4), np.zeros(4), rows, rows @ np.ones(4), np.full(4, -9.0), np.full(4, 9.0), np.zeros((0, 4)), NONE
        )
        found = quadratic._orthonormal(program)
        assert len(found.A) == count
        np.testing.assert_allclose(found.A @ np.ones(4), found.b, rtol=1e-6)
