"""Quadratic programs against the optimum that an enumeration of all active sets finds."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
import scipy.optimize

from exo_pin.numerics import LeastSquares, judged, quadratic, solve


def random_program(rng, rank):
    """Four variables within bounds, one equality and two inequalities that some feasible point meets."""
    E = rng.normal(size=(rank, 4))
    A, C = rng.normal(size=(1, 4)), rng.normal(size=(2, 4))
    inside = rng.uniform(-0.8, 0.8, 4)
    low = np.where(rng.uniform(size=4) < 0.2, -np.inf, -1.0)
    slack = rng.uniform(0.0, 0.5, 2)
    return LeastSquares(E, 3.0 * rng.normal(size=rank), A, A @ inside, low, np.ones(4), C, C @ inside + slack)


def by_enumeration(program):
    """The best feasible minimiser of all working sets, with the set: sides of the variables and rows that are held."""
    best = np.inf, None, None, None
    for side in itertools.product((-1, 0, 1), repeat=4):
        side = np.array(side)
        bound = np.where(side < 0, program.low, program.high)
        if np.isinf(bound[side != 0]).any():
            continue
        for rows in itertools.product((False, True), repeat=2):
            rows = np.array(rows)
            held = np.vstack([program.A, program.C[rows], np.eye(4)[side != 0]])
            right = np.concatenate([program.b, program.c[rows], bound[side != 0]])
            if len(held) > 4:
                continue
            # Stationarity and the held constraints, as one linear system.
            n = len(held)
            K = np.block([[program.E.T @ program.E, held.T], [held, np.zeros((n, n))]])
            z = np.linalg.lstsq(K, np.concatenate([program.E.T @ program.d, right]), rcond=None)[0][:4]
            value = 0.5 * np.sum((program.E @ z - program.d) ** 2)
            if program.violation(z) < 1e-9 and value < best[0] - 1e-12:
                best = value, z, side, rows
    return best


@pytest.fixture(scope="module")
def cases():
    rng = np.random.default_rng(41)
    programs = [random_program(rng, 4) for _ in range(12)]
    return [(program, *by_enumeration(program)) for program in programs]


def value_of(program, z):
    return 0.5 * np.sum((program.E @ z - program.d) ** 2)


def test_the_answer_is_the_best_of_all_active_sets(cases):
    held = 0
    for program, value, z, side, rows in cases:
        answer = solve(program)
        assert answer.is_optimal
        assert answer.unique
        np.testing.assert_allclose(answer.z, z, atol=1e-10)
        assert value_of(program, answer.z) == pytest.approx(value, rel=1e-12, abs=1e-12)
        assert answer.gap <= 1e-12
        held += (side != 0).sum() + rows.sum()
    assert held > len(cases)  # constraints matter


def test_from_a_rough_answer_with_any_working_set_the_walk_ends_in_the_optimum(cases):
    """Also from bounds on which the equality has no solution, as ProxQP may leave them near singular poses."""
    rng = np.random.default_rng(43)
    for program, _, z, side, _ in cases:
        whole = quadratic._orthonormal(program)
        for case in range(6):
            near = np.clip(z + 1e-7 * rng.normal(size=4), program.low, program.high)
            bound = side + rng.choice([0.0, 1.0, -1.0], 4) * (case > 2)
            rows = rng.uniform(-1.0, 1.0, 2)
            found = quadratic._from(whole, near, rng.normal(size=1), rows, bound)
            np.testing.assert_allclose(found.z, z, atol=1e-10)
    tight = LeastSquares(
        np.eye(3), np.array([0.0, 0.0, 1.0]), np.array([[0.6, 0.8, 0.0]]), np.array([1.1]),
        np.zeros(3), np.array([1.0, 2.0, 3.0]), np.zeros((0, 3)), np.zeros(0),
    )  # fmt: skip
    for start in (np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 2.0, 3.0]), np.array([1.0, 2.0, 3.0])):
        found = quadratic._from(tight, start, np.zeros(1), np.zeros(0), np.where(start > 0.0, 1.0, -1.0))
        np.testing.assert_allclose(found.z, [0.66, 0.88, 1.0], atol=1e-12)


def test_from_the_wrong_inequality_the_walk_ends_in_the_optimum(cases):
    for program, *_ in cases:
        free = quadratic._orthonormal(replace(program, low=np.full(4, -np.inf), high=np.full(4, np.inf)))
        best, held = solve(free).z, np.vstack([free.A, free.C])
        for on in np.eye(2):
            start = np.linalg.lstsq(held, np.concatenate([free.b, free.c - (1.0 - on)]), rcond=None)[0]
            found = quadratic._from(free, start, np.zeros(1), on, np.zeros(4))
            np.testing.assert_allclose(found.z, best, atol=1e-10)


def test_of_many_best_answers_the_shortest_is_taken():
    """The shortest point of the optimal face, by an enumeration of its own."""
    rng, seen = np.random.default_rng(42), set()
    for case in range(10):
        program = random_program(rng, 2)
        if case % 2:  # a force that all limits allow
            program = replace(program, d=0.1 * program.d)
        value, *_ = by_enumeration(program)
        answer = solve(program)
        assert value_of(program, answer.z) == pytest.approx(value, rel=1e-10, abs=1e-10)
        any_one = solve(program, shortest=False)
        assert value_of(program, any_one.z) == pytest.approx(value, rel=1e-10, abs=1e-10)
        # Unique: no way is left on which the force and the equality stay, within all limits.
        way = rng.normal(size=4)
        same, kept = np.vstack([program.E, program.A]), np.concatenate([program.E @ any_one.z, program.b])
        room = np.stack([program.low - 1e-9, program.high + 1e-9], axis=1)
        ends = [scipy.optimize.linprog(s * way, program.C, program.c + 1e-9, same, kept, room).fun for s in (1, -1)]
        assert answer.unique == any_one.unique == (-ends[0] - ends[1] < 1e-6)
        seen.add(answer.unique)
        assert np.linalg.norm(answer.z) <= np.linalg.norm(any_one.z) + 1e-9
        # Among points with the least residual: the shortest by the first-order condition along every way within.
        shorter = LeastSquares(
            np.eye(4), np.zeros(4), same, np.concatenate([program.E @ answer.z, program.b]),
            program.low, program.high, program.C, program.c,
        )  # fmt: skip
        _, z, _, _ = by_enumeration_of_many(shorter)
        np.testing.assert_allclose(answer.z, z, atol=1e-7)
    assert seen == {True, False}


@pytest.mark.parametrize(
    ("goal", "pull", "limits", "error"),
    [
        (0.5, 0.3, {"c": 0.9}, 0.3), (0.5, 0.3, {"c": 0.3}, 0.1), (0.0, -0.2, {"c": 0.9}, 0.2),
        (0.5, 0.0, {"high": 0.9}, 0.3), (0.5, 0.0, {"high": 0.25}, 0.05), (0.5, 0.0, {"high": 0.2}, 0.0),
        (-0.1, 0.0, {"low": -0.9}, 0.3), (-0.1, 0.0, {"low": 0.15}, 0.05), (-0.1, 0.0, {"low": 0.2}, 0.0),
        (0.2, 0.0, {"c": 0.12}, 0.08), (0.2, 0.0, {"high": 0.13}, 0.07), (0.2, 0.0, {"low": 0.26}, 0.06),
    ],
)  # fmt: skip
def test_how_far_a_candidate_is_from_the_conditions(goal, pull, limits, error):
    """Of one number at 0.2: multipliers away from their limits, of the wrong sign, and limits that are not kept."""
    low, high, c = (limits.get(name, end) for name, end in (("low", -1.0), ("high", 1.0), ("c", 1.0)))
    one, none = np.ones((1, 1)), np.zeros((0, 1))
    program = LeastSquares(one, goal * one[0], none, none[:, 0], low * one[0], high * one[0], one, c * one[0])
    found = judged(program, np.array([0.2]), np.zeros(0), np.array([pull]))
    assert found.kkt == pytest.approx(error, abs=1e-15)
    for miss in (-0.7, 0.6):
        held = replace(program, A=one, b=np.array([0.2 + miss]))
        assert held.violation(np.array([0.2])) == pytest.approx(abs(miss))


def test_where_the_shortest_is_not_found_exactly_another_best_answer_is_taken():
    """Of limits that differ in the ninth digit both are met."""
    row, ends = np.array([2.0, -2.0, 1.0, -1.0, -2.0, 1.0, 2.0]), np.full(4, np.inf)
    program = LeastSquares(
        np.array([[0.0, -0.2, 0.0003, 0.0, 0.0, 0.0, 0.0]]), np.array([2.0]),
        np.array([[-2.0, -1.0, -1.0, -1.0, 1.0, 2.0, 1.0]]), np.array([7.0]),
        np.array([*-ends, 0.0, 2.0, 0.0]), np.array([-1.8, 1.6, np.inf, np.inf, 0.18, np.inf, np.inf]),
        np.array([row, row * (1.0 + 1e-9), [0.0, 2.0, -1.0, -1.0, 1.0, -2.0, -2.0]]),
        np.array([-6.0, -6.0 + 1e-7, -2.0]),
    )  # fmt: skip
    answer = solve(program)
    assert answer.is_optimal
    assert not answer.unique
    np.testing.assert_allclose(answer.residual, 0.0, atol=1e-12)


def by_enumeration_of_many(program):
    """As :func:`by_enumeration`, of a program with several equalities, which may have dependent rows held."""
    best = np.inf, None, None, None
    for side in itertools.product((-1, 0, 1), repeat=4):
        side = np.array(side)
        bound = np.where(side < 0, program.low, program.high)
        if np.isinf(bound[side != 0]).any():
            continue
        for rows in itertools.product((False, True), repeat=2):
            rows = np.array(rows)
            held = np.vstack([program.A, program.C[rows], np.eye(4)[side != 0]])
            right = np.concatenate([program.b, program.c[rows], bound[side != 0]])
            z = np.linalg.lstsq(held, right, rcond=1e-9)[0]
            if np.abs(held @ z - right).max() < 1e-9 and program.violation(z) < 1e-8 and z @ z < best[0] - 1e-12:
                best = z @ z, z, side, rows
    return best
