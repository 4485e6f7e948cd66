"""Multipliers of loops from their rows alone, against pseudo-inverses and null spaces in scaled units."""

import numpy as np
import pytest
import scipy

from exo_pin.chain.dynamics.equations.solution_kernels import efforts_and_residual, largest_of_loops, solutions
from exo_pin.chain.kinematics.rank import rank_tolerance

pytestmark = pytest.mark.usefixtures("plain")


def loops(rng, rows, nv, length, metres_of_rows, metres):
    """One block of loops: scales, owners and the open tree's wrenches."""
    row_scale, column = np.where(metres_of_rows, 1.0 / length, 1.0), np.where(metres, length, 1.0)
    blocks = np.arange(rows), np.arange(nv), np.array([0, rows]), np.array([0, nv])
    return (row_scale, column, blocks), np.arange(1, nv + 1), rng.normal(size=(nv + 1, 6))


@pytest.mark.parametrize("length", [1e-3, 0.7, 1e4])
@pytest.mark.parametrize(
    ("rows", "passive"), [(3, [0, 2, 3]), (5, [0, 1, 4]), (2, [1, 2, 3, 4]), (1, [0, 2, 3]), (2, [1])]
)
def test_multipliers_are_least_in_scaled_units_and_the_rest_is_self_stress(length, rows, passive):
    """Rows and joints in metres and in radians; the numbers of a mechanism of any size."""
    rng = np.random.default_rng(250 + rows)
    nv, passive = 5, np.array(passive)
    metres_of_rows, metres = rng.random(rows) < 0.5, rng.random(nv) < 0.5
    scales, owners, tree = loops(rng, rows, nv, length, metres_of_rows, metres)
    row_scale, column, _ = scales
    scaled = rng.normal(size=(rows, nv))
    J, tau = scaled / row_scale[:, None] / column, rng.normal(size=nv) / column
    found, null, _, left, sizes, share, weakest = solutions(J, tau, tree, owners, passive, scales, length, 0.0)
    A, right = scaled[:, passive].T, (column * tau)[passive]
    expected = np.linalg.pinv(A) @ right
    np.testing.assert_allclose(found / row_scale, expected, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(left, right - A @ expected, atol=1e-12)
    N = null / row_scale[:, None] / length
    assert N.shape == (rows, max(0, rows - len(passive)))
    np.testing.assert_allclose(N.T @ N, np.eye(N.shape[1]), atol=1e-12)
    np.testing.assert_allclose(A @ N, 0.0, atol=1e-12)
    least = scipy.linalg.svdvals(A).min()
    assert least / np.sqrt(max(rows, len(passive))) <= weakest * (1 + 1e-12)
    assert weakest <= least * (1 + 1e-12)
    # What is missing, against the forces there.
    if len(passive) > rows:
        assert share == pytest.approx((np.abs(left) / sizes).max())
        assert 0.0 < share <= 1.0
    else:
        assert share < 1e-12


@pytest.mark.parametrize("length", [1e-4, 1.0, 1e4])
@pytest.mark.parametrize(("weak", "free"), [(1e-9, 0), (1e-17, 1)])
def test_a_rank_does_not_change_with_the_size_of_a_mechanism(length, weak, free):
    """Two rows in metres; the second joint hardly moves the second."""
    rng = np.random.default_rng(253)
    scales, owners, tree = loops(rng, 2, 3, length, np.ones(2, dtype=bool), np.zeros(3, dtype=bool))
    J = length * np.array([[1.0, 0.0, 0.3], [0.0, weak, -0.4]])
    tau = np.array([0.2, weak * 0.5, 0.1])
    found, null, *_, weakest = solutions(J, tau, tree, owners, np.array([0, 1]), scales, length, 0.0)
    assert null.shape[1] == free
    assert found[0] == pytest.approx(0.2 / length)
    assert found[1] == pytest.approx(0.0 if free else 0.5 / length, abs=1e-6 / length)
    assert weakest == pytest.approx(1.0 if free else weak, rel=1e-6)
    # A row counts as closed to the residual of the loops.
    assert solutions(J, tau, tree, owners, np.array([0, 1]), scales, length, 1e-8)[1].shape[1] == 1


def test_a_tolerance_is_the_rounding_of_every_joint_on_the_way_and_the_gap():
    assert rank_tolerance((3, 7), 2.0, 0, 1e-5) == pytest.approx(7 * 2.0 * 1e-5)
    assert rank_tolerance((7, 3), 2.0, 0, 1e-5) == pytest.approx(7 * 2.0 * 1e-5)
    one = rank_tolerance((1, 1), 1.0, 1, 0.0)
    assert 1e-16 < one < 1e-14
    assert rank_tolerance((1, 1), 1.0, 5, 0.0) == pytest.approx(5.0 * one)


@pytest.mark.parametrize("gap", [0.0, 1e-11, 1e-9, 1e-8, 1.1e-8, 1e-6, 1e-3])
@pytest.mark.parametrize("weak", [1.0, 0.01])
def test_self_stresses_turn_by_the_error_of_the_rows_over_the_weakest_of_them(gap, weak):
    """Ten times that is rounding, of closed loops up to 1e-6; never less than 1e-10 nor more than a tenth."""
    rng = np.random.default_rng(255)
    scales, owners, tree = loops(rng, 3, 3, 1.0, np.ones(3, dtype=bool), np.zeros(3, dtype=bool))
    J = np.array([[1.0, 0.0, 0.0], [0.0, weak, 0.0], [0.0, 0.0, 0.0]])
    J[2] = -0.3 * J[0]
    _, null, sharpness, *_, weakest = solutions(J, np.zeros(3), tree, owners, np.arange(3), scales, 1.0, gap)
    assert null.shape[1] == 1
    assert weakest == pytest.approx(1.0 / np.hypot(1.0, 1.0 / weak))
    turn = 10.0 * rank_tolerance((3, 3), 1.0, len(tree), gap) / weakest
    assert sharpness == pytest.approx(np.clip(turn, 1e-10, 1e-6 if gap <= 1e-8 else 0.1))


@pytest.mark.parametrize("unit", [1.0, 1e-3])
def test_sizes_of_a_block_are_its_largest(unit):
    sizes = unit * np.array([1.0, 5.0, 2.0, 7.0, 3.0])
    largest_of_loops(sizes, np.array([0, 2, 1, 4]), np.array([0, 2, 4]))
    np.testing.assert_array_equal(sizes, unit * np.array([2.0, 5.0, 2.0, 7.0, 5.0]))


def test_efforts_are_what_the_loops_leave_and_unique_where_no_self_stress_acts():
    rng = np.random.default_rng(254)
    J, tau, multipliers = rng.normal(size=(3, 4)), rng.normal(size=4), rng.normal(size=3)
    null, unit = rng.normal(size=(3, 2)), np.array([1.0, 1.0, 0.5, 1.0])
    J[:, 1] = np.cross(null[:, 0], null[:, 1])  # no self-stress moves it
    left = tau - J.T @ multipliers
    efforts, residual, unique = efforts_and_residual(J, tau, multipliers, null, np.array([3]), unit, 1e-9)
    np.testing.assert_allclose(efforts, [*left[:3], 0.0], atol=1e-13)
    assert residual == pytest.approx(abs(left[3]))
    # Without an actuator the effort is known: none.
    assert unique.tolist() == [False, True, False, True]
    push = np.abs(J.T @ null).max(axis=1) * unit
    for sharpness, known in ((0.99 * push[2], False), (1.01 * push[2], True)):
        assert efforts_and_residual(J, tau, multipliers, null, np.array([3]), unit, sharpness)[2][2] == known
