"""Each part of the walk over working sets alone, by its definition or by hand."""

from dataclasses import replace

import numpy as np
import pytest
import scipy

from exo_pin.numerics import LeastSquares, quadratic
from exo_pin.numerics.quadratic import (
    _blocks_equalities,
    _multipliers,
    _orthonormal,
    _proxqp,
    _ratio_test,
    _step,
    _walk,
)

INF = np.inf


def drawn(rng, equalities=1, inequalities=2, rank=5):
    E, A, C = rng.normal(size=(rank, 5)), rng.normal(size=(equalities, 5)), rng.normal(size=(inequalities, 5))
    ends = -np.ones(5), np.ones(5)
    return LeastSquares(
        E, rng.normal(size=rank), A, 0.1 * rng.normal(size=equalities), *ends, C, rng.uniform(0.2, 1.0, inequalities)
    )


def test_the_first_working_set_is_that_of_reached_limits_with_multipliers(monkeypatch):
    """Reached to 1e-6, held by more than 1e-9; what cannot move is on its bound, whatever its multiplier."""
    monkeypatch.setattr(quadratic, "_STEPS", 0)
    low, high = -np.ones(9), np.ones(9)
    low[8] = high[8] = 0.5
    C = np.zeros((4, 9))
    C[:, 0] = 1.0
    c = np.array([0.5e-6, 2e-6, -1.0, 0.0]) - 1.0
    z = np.array([-1.0, -1.0 + 0.5e-6, -1.0 + 2e-6, -1.0, 1.0, 1.0 - 0.5e-6, 1.0 - 2e-6, 1.0, 0.5])
    bound = np.array([-2e-9, -2e-9, -1.0, -0.5e-9, 2e-9, 2e-9, 1.0, 0.5e-9, 1.0])
    program = LeastSquares(np.eye(9), np.zeros(9), np.zeros((0, 9)), np.zeros(0), low, high, C, c)
    best, side, rows = _walk(program, z, np.zeros(0), np.array([2e-9, 1.0, 2e-9, 0.5e-9]), bound)
    np.testing.assert_array_equal(np.sign(side), [-1, -1, 0, 0, 1, 1, 0, 0, -1])
    np.testing.assert_array_equal(rows, [True, False, True, False])
    np.testing.assert_array_equal(best.z, z)  # no step was made


def test_what_bounds_without_multipliers_hold_is_not_on_the_first_working_set(monkeypatch):
    monkeypatch.setattr(quadratic, "_STEPS", 0)
    program = drawn(np.random.default_rng(73))
    for z, bound in ((program.low, np.ones(5)), (program.high, -np.ones(5)), (program.low, np.zeros(5))):
        assert (_walk(program, z, np.zeros(1), np.zeros(2), bound)[1] == 0).all()


def test_equalities_become_orthonormal_and_keep_their_solutions():
    rng = np.random.default_rng(74)
    for equalities, dependent in ((1, 0), (3, 0), (3, 1), (3, 2)):
        program = drawn(rng, equalities)
        A = program.A.copy()
        for k in range(dependent):
            A[k + 1] = (k + 2.0) * A[0] * (1.0 + 1e-14 * rng.normal(size=5))
        solution = rng.normal(size=5)
        program = replace(program, A=A, b=A @ solution)
        found = _orthonormal(program)
        assert found.A.shape == (equalities - dependent, 5)
        np.testing.assert_allclose(found.A @ found.A.T, np.eye(equalities - dependent), atol=1e-14)
        np.testing.assert_allclose(found.A @ solution, found.b, atol=1e-12)
        np.testing.assert_allclose(A - A @ found.A.T @ found.A, 0.0, atol=1e-12)
    none = drawn(rng, 0)
    assert _orthonormal(none) is none


def test_rows_that_are_nearly_dependent_still_count():
    A = np.diag([1.0, 3e-12, 3e-13])
    program = LeastSquares(
        np.eye(3), np.ones(3), A, np.zeros(3), -np.ones(3), np.ones(3), np.zeros((0, 3)), np.zeros(0)
    )
    assert len(_orthonormal(program).A) == 2


@pytest.mark.parametrize("rank", [5, 2])
@pytest.mark.parametrize("rows", [(), (1,), (0, 1)])
@pytest.mark.parametrize("equalities", [0, 1])
def test_steps_are_the_shortest_to_the_minimiser_on_the_working_set(rank, rows, equalities):
    rng = np.random.default_rng(75)
    program = drawn(rng, equalities, rank=rank)
    z, held = rng.normal(size=5), np.isin(np.arange(2), rows)
    for free in (np.array([True, True, False, True, True]), np.ones(5, dtype=bool), np.eye(5, dtype=bool)[2]):
        if free.sum() <= equalities + held.sum():
            continue
        step = _step(program, z, free, held)
        assert (step[~free] == 0.0).all()
        after = z + step
        kept = np.vstack([program.A, program.C[held]])
        np.testing.assert_allclose(kept @ after, np.concatenate([program.b, program.c[held]]), atol=1e-12)
        ways = scipy.linalg.null_space(kept[:, free]) if len(kept) else np.eye(free.sum())
        gradient = program.E.T @ (program.E @ after - program.d)
        np.testing.assert_allclose(ways.T @ gradient[free], 0.0, atol=1e-12)
        idle = scipy.linalg.null_space(np.vstack([kept, program.E])[:, free])
        np.testing.assert_allclose(idle.T @ step[free], 0.0, atol=1e-12)
    assert (_step(program, z, np.zeros(5, dtype=bool), held) == 0.0).all()


def test_rows_without_a_free_variable_make_no_step_and_dependent_rows_do_no_harm():
    program = drawn(np.random.default_rng(76))
    free = np.array([True, False, False, False, False])
    A, C = program.A.copy(), program.C.copy()
    A[:, 0], C[0, 0] = 0.0, 0.0
    step = _step(replace(program, A=A, C=C), np.zeros(5), free, np.array([True, False]))
    least = program.E[:, 0] @ program.d / (program.E[:, 0] @ program.E[:, 0])
    np.testing.assert_allclose(step, [least, 0, 0, 0, 0], atol=1e-13)
    twice = replace(program, C=np.vstack([program.A, program.A]), c=np.repeat(program.b, 2))
    plain = _step(program, np.zeros(5), np.ones(5, dtype=bool), np.zeros(2, dtype=bool))
    np.testing.assert_allclose(
        _step(twice, np.zeros(5), np.ones(5, dtype=bool), np.ones(2, dtype=bool)), plain, atol=1e-12
    )


def limits(low, high, C, c):
    size = len(low)
    none = np.zeros((0, size)), np.zeros(0)
    return LeastSquares(
        np.eye(size), np.zeros(size), *none, np.array(low), np.array(high), np.atleast_2d(C), np.array(c)
    )


@pytest.mark.parametrize(
    ("step", "side", "rows", "expected"),
    [
        ([2.0, 0.0], [0, 0], [False], (0.5, 0, -1)),  # the upper bound of 1
        ([-8.0, 0.0], [0, 0], [False], (0.25, 0, -1)),  # the lower bound of -2
        ([2.0, 6.0], [0, 0], [False], (1.0 / 6.0, 1, -1)),
        ([2.0, -3.0], [1, -1], [False], (1.0, -1, -1)),  # those on bounds stop no step
        ([0.5, 0.5], [0, 0], [False], (1.0, -1, -1)),
        ([1e-14, 0.0], [0, 0], [False], (1.0, -1, -1)),
        ([2.0, 2.0], [1, 1], [True], (1.0, -1, -1)),
        ([3.0, 3.0], [1, 1], [False], (0.25, -1, 0)),  # the row z_1 + z_2 <= 1.5
        ([3.0, 3.0], [0, 1], [False], (0.25, -1, 0)),
        ([3.0, -3.0], [0, 0], [True], (1.0 / 3.0, 0, -1)),
        ([-1.0, -1.0], [0, 0], [False], (1.0, -1, -1)),  # away from the row
    ],
)
def test_a_step_ends_at_the_first_limit(step, side, rows, expected):
    program = limits([-2.0, -2.0], [1.0, 1.0], [1.0, 1.0], [1.5])
    found = _ratio_test(program, np.zeros(2), np.array(step), np.array(side), np.array(rows))
    assert found == pytest.approx(expected, rel=1e-15)


def test_a_limit_that_is_passed_already_stops_at_once():
    program = limits([-2.0, -2.0], [1.0, INF], [[0.0, 1.0], [0.0, -1.0]], [1.5, INF])
    free, none = np.zeros(2, dtype=int), np.zeros(2, dtype=bool)
    assert _ratio_test(program, np.array([1.1, 0.0]), np.ones(2), free, none) == (0.0, 0, -1)
    assert _ratio_test(program, np.array([0.0, 1.6]), np.array([0.5, 1.0]), free, none) == (0.0, -1, 0)
    # Climbs of rounding size are none.
    assert _ratio_test(program, np.array([0.0, 1.5]), np.array([0.0, 0.9e-13]), free, none)[0] == 1.0
    assert _ratio_test(program, np.array([0.0, 1.5]), np.array([0.0, 1.1e-13]), free, none) == (0.0, -1, 0)
    assert _ratio_test(program, np.array([1.0, 0.0]), np.array([0.9e-13, 0.0]), free, none)[0] == 1.0
    assert _ratio_test(program, np.array([1.0, 0.0]), np.array([1.1e-13, 0.0]), free, none) == (0.0, 0, -1)


def test_the_variable_that_helps_the_equalities_most_is_released():
    A, none = np.array([[1.0, 2.0, -3.0, 0.0]]), np.zeros(4, dtype=bool)
    program = LeastSquares(
        np.eye(4), np.zeros(4), A, np.array([1.0]), -np.ones(4), np.ones(4), np.zeros((0, 4)), np.zeros(0)
    )
    z = np.zeros(4)  # A z is too small by 1: z_2 helps most when it leaves its lower bound, z_3 its upper one
    for side, fixed, expected in (
        ([-1, -1, 1, -1], none, 2), ([-1, -1, -1, -1], none, 1), ([-1, 1, -1, 0], none, 0), ([1, 1, -1, 1], none, -1),
        ([0, 0, 0, 0], none, -1), ([-1, -1, 1, -1], np.arange(4) == 2, 1), ([0, 0, 0, -1], none, -1),
    ):  # fmt: skip
        assert _blocks_equalities(program, z, np.array(side), fixed) == expected
    other = replace(program, b=-program.b)  # too large: the sides change places
    assert _blocks_equalities(other, z, np.array([1, 1, -1, 1]), none) == 2
    # Rounding of the equalities is no miss: 1e-13 of the largest of 1 and z.
    for size, miss, expected in ((0.0, 0.9e-13, -1), (0.0, 1.1e-13, 2), (10.0, 0.9e-12, -1), (10.0, 1.1e-12, 2)):
        near = replace(program, b=np.array([miss]))
        assert _blocks_equalities(near, np.array([0, 0, 0, size]), np.array([-1, -1, 1, -1]), none) == expected
    # A part of 1e-10 of the equality does not help.
    for part, expected in ((0.9e-10, -1), (1.1e-10, 3)):
        weak = replace(program, A=np.array([[1.0, 0.0, 0.0, part]]))
        assert _blocks_equalities(weak, z, np.array([0, 0, 0, -1]), none) == expected


@pytest.mark.parametrize("free", [(0, 1, 2, 3, 4), (1, 4), (2,)])
def test_multipliers_make_the_free_variables_stationary_and_stay_near(free):
    """With fewer free variables than multipliers, those that are nearest to the given ones."""
    rng = np.random.default_rng(77)
    program, z = drawn(rng), rng.normal(size=5)
    free, rows = np.isin(np.arange(5), free), np.array([True, True])
    before = rng.normal(size=1), rng.normal(size=2)
    equality, inequality = _multipliers(program, z, free, rows, *before)
    gradient = program.E.T @ (program.E @ z - program.d)
    pull = np.vstack([program.A, program.C])[:, free].T
    found = np.concatenate([equality, inequality])
    expected = np.linalg.lstsq(pull, -gradient[free], rcond=None)[0]
    np.testing.assert_allclose(pull @ found, pull @ expected, atol=1e-13)
    # What is changed lies across the multipliers that change nothing.
    idle = scipy.linalg.null_space(pull)
    np.testing.assert_allclose(idle.T @ (found - np.concatenate(before)), 0.0, atol=1e-13)


def test_rows_that_are_not_held_have_no_multiplier():
    rng = np.random.default_rng(78)
    program = drawn(rng, 0)
    _, inequality = _multipliers(
        program, rng.normal(size=5), np.ones(5, dtype=bool), np.array([False, True]), np.zeros(0), np.ones(2)
    )
    assert inequality[0] == 0.0
    assert inequality[1] != 1.0
    none = np.zeros(5, dtype=bool)
    kept = _multipliers(program, np.zeros(5), none, np.array([True, True]), np.zeros(0), np.array([3.0, 4.0]))
    np.testing.assert_array_equal(kept[1], [3.0, 4.0])


def test_the_start_by_proxqp_is_that_of_its_tolerance():
    """1e-10, so that the walk starts on the working set of the optimum; one-sided limits and no rows among them."""
    rng = np.random.default_rng(79)
    for case in range(12):
        program = drawn(rng, case % 2, (case // 2) % 2 * 2)
        if case % 3:
            program = replace(program, low=np.where(rng.random(5) < 0.4, -INF, -0.5), high=np.full(5, 0.5))
        z, equality, inequality, bound = _proxqp(program)
        best, _, _ = _walk(program, z, equality, inequality, bound)
        assert best.kkt < 1e-12
        np.testing.assert_allclose(z, best.z, atol=2e-9)
        np.testing.assert_allclose(equality, best.equality, atol=2e-9)
        np.testing.assert_allclose(inequality, best.inequality, atol=2e-9)
        np.testing.assert_allclose(bound, best.bound, atol=2e-9)


def test_multipliers_are_refined_once(monkeypatch):
    """One solution, and one for its rounding, which beside a nearly dependent row is large."""
    asked, lstsq = [], np.linalg.lstsq

    def noted(*arguments, **options):
        asked.append(arguments[1].copy())
        return lstsq(*arguments, **options)

    monkeypatch.setattr(np.linalg, "lstsq", noted)
    rng = np.random.default_rng(80)
    program = drawn(rng)
    C = program.C.copy()
    C[1] = C[0] + 1e-7 * rng.normal(size=5)
    program, z = replace(program, C=C), 1e3 * rng.normal(size=5)
    none, both = np.zeros(1), np.array([True, True])
    equality, inequality = _multipliers(program, z, np.ones(5, dtype=bool), both, none, np.zeros(2))
    assert len(asked) == 2
    gradient = program.E.T @ (program.E @ z - program.d)
    np.testing.assert_array_equal(asked[0], gradient)
    # What the first leaves beyond the part that no multiplier can take.
    held = np.vstack([program.A, program.C])
    basis, _ = np.linalg.qr(held.T)
    left = gradient + held.T @ np.concatenate([equality, inequality])
    assert np.linalg.norm(basis.T @ left) < 1e-9 * np.linalg.norm(gradient)
    asked.clear()
    _multipliers(program, z, np.zeros(5, dtype=bool), both, none, np.zeros(2))
    assert not asked


def test_steps_on_the_working_set_are_repeated_until_nothing_changes(monkeypatch):
    """Twice more at most, for the rounding of an ill-conditioned step; here each step is off by a part in 1e5."""
    rng, exact, asked = np.random.default_rng(81), quadratic._step, []
    program = drawn(rng, 0, 0)
    best = np.linalg.solve(program.E, program.d)
    for error, steps in ((1e-5, 3), (0.0, 2)):
        asked.clear()

        def off(*arguments, error=error):
            asked.append(arguments[1].copy())
            return (1.0 + error) * exact(*arguments)

        monkeypatch.setattr(quadratic, "_step", off)
        answer = quadratic._on_working_set(program, np.zeros(5, dtype=int), np.zeros(0, dtype=bool))
        assert 2 <= len(asked) <= 3
        assert len(asked) >= steps
        np.testing.assert_allclose(answer.z, best, rtol=1e-12)


@pytest.mark.parametrize("size", [1e-9, 1e9])
def test_held_rows_count_whatever_their_unit(size):
    rng = np.random.default_rng(82)
    program, z, free = drawn(rng, 0), rng.normal(size=5), np.ones(5, dtype=bool)
    other = replace(program, C=size * program.C, c=size * program.c)
    both = np.array([True, True])
    step = _step(program, z, free, both)
    np.testing.assert_allclose(_step(other, z, free, both), step, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(program.C @ (z + step), program.c, atol=1e-12)
    # Rows of zeros hold nothing.
    empty = replace(program, C=0.0 * program.C, c=0.0 * program.c)
    alone = _step(program, z, free, np.array([False, False]))
    np.testing.assert_allclose(_step(empty, z, free, both), alone, atol=1e-12)
