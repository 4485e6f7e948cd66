"""Each part of the walk over working sets alone, by its definition or by hand."""

from dataclasses import replace

import numpy as np
import pytest

from exo_pin.numerics import LeastSquares, quadratic
from exo_pin.numerics.quadratic import (
    _blocks_equalities,
    _orthonormal,
    _proxqp,
    _ratio_test,
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


def test_rows_that_are_nearly_dependent_still_count():
    A = np.diag([1.0, 3e-12, 3e-13])
    program = LeastSquares(
        np.eye(3), np.ones(3), A, np.zeros(3), -np.ones(3), np.ones(3), np.zeros((0, 3)), np.zeros(0)
    )
    assert len(_orthonormal(program).A) == 2


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
