import numpy as np
import pytest
from contact_enumeration import every_active_set

from exo_pin import SolverFailed
from exo_pin.numerics.complementarity import bounded_complementarity


@pytest.mark.parametrize("seed", range(100))
def test_answers_are_those_of_all_active_sets(seed):
    rng = np.random.default_rng(seed)
    n, k = rng.integers(1, 5, size=2)
    B = rng.normal(size=(n, k))  # redundant where n > k
    A, c = B @ B.T, B @ rng.normal(size=k) * rng.uniform(0, 3)
    if seed % 3 == 0:
        c = c + 0.3 * rng.normal(size=n)  # accelerations that no force can change
    low = -rng.uniform(0, 1, n)
    high = -low
    stop = rng.random(n) < 0.3
    low[stop], high[stop] = 0.0, np.inf
    found, other = bounded_complementarity(A, c, low, high), every_active_set(A, c, low, high)
    assert found.bounded == (other is not None)
    if other is not None:
        np.testing.assert_allclose(found.rate, other[1], atol=1e-9)
        np.testing.assert_allclose(found.force[found.unique], other[0][found.unique], atol=1e-9)
        assert found.residual <= 1e-12
        assert ((low <= found.force) & (found.force <= high)).all()


def test_numbers_that_are_not_finite_give_no_answer():
    with pytest.raises(SolverFailed):
        bounded_complementarity(np.eye(1) * np.nan, np.ones(1), -np.ones(1), np.ones(1))
    for low, high in ((np.nan, 1.0), (-1.0, np.nan)):
        with pytest.raises(SolverFailed, match="NaN"):
            bounded_complementarity(np.eye(1), np.ones(1), np.array([low]), np.array([high]))


def test_which_forces_are_the_same_in_every_answer():
    """Two that are redundant are not; one that is pressed onto its bound, or cannot move, is."""
    wide, one = np.full(4, 9.0), np.ones((2, 2))
    A = np.zeros((4, 4))
    A[:2, :2], A[2, 2], A[3, 3] = one, 2.0, 3.0
    found = bounded_complementarity(A, np.array([-1.0, -1.0, 0.6, 30.0]), -wide, wide)
    np.testing.assert_array_equal(found.unique, [False, False, True, True])
    assert found.force[:2].sum() == pytest.approx(1.0, rel=1e-14)
    np.testing.assert_allclose(found.force[2:], [-0.3, -9.0], rtol=1e-14)
    np.testing.assert_allclose(found.rate, [0.0, 0.0, 0.0, 3.0], atol=1e-14)
    fixed = np.array([0.5, 9.0, 9.0, 9.0])
    found = bounded_complementarity(A, np.array([-1.0, -1.0, 0.6, 30.0]), np.array([0.5, -9, -9, -9]), fixed)
    np.testing.assert_array_equal(found.unique, [True, True, True, True])
    idle = bounded_complementarity(np.zeros((1, 1)), np.zeros(1), -np.ones(1), np.ones(1))
    np.testing.assert_array_equal(idle.unique, [False])
    assert idle.force[0] == 0.0  # no force that nothing asks for
    assert idle.residual == 0.0


@pytest.mark.parametrize("seed", range(6))
def test_units_of_the_forces_change_nothing_but_themselves(seed):
    """Forces in units from 1e-6 to 1e6 of one another, with A and c to fit."""
    rng = np.random.default_rng(200 + seed)
    B = rng.normal(size=(4, 4))
    A, c = B @ B.T + 0.1 * np.eye(4), 3.0 * rng.normal(size=4)
    low, high = -rng.uniform(0, 1, 4), np.where(rng.random(4) < 0.3, np.inf, rng.uniform(0, 1, 4))
    unit = 10.0 ** rng.uniform(-6, 6, 4)
    force, rate = every_active_set(A, c, low, high)
    found = bounded_complementarity(A * unit * unit[:, None], c * unit, low / unit, high / unit)
    np.testing.assert_allclose(found.force * unit, force, atol=1e-11)
    np.testing.assert_allclose(found.rate / unit, rate, atol=1e-11)
    assert found.unique.all()
    assert found.residual < 1e-13


def test_a_row_that_no_force_moves_stays_out_of_the_others():
    """Its own inertia is rounding beside the largest, and huge beside the least one."""
    A = np.diag([4.0, 1e-12, 1e-26])
    A[0, 2] = A[2, 0] = 1e-14
    wide = np.full(3, 1e9)
    found = bounded_complementarity(A, np.array([-8.0, 3e-12, 0.0]), -wide, wide)
    np.testing.assert_allclose(found.force, [2.0, -3.0, 0.0], rtol=1e-12)
    np.testing.assert_array_equal(found.unique, [True, True, False])


@pytest.mark.parametrize("other", [[[1.0, 2.0], [0.0, 1.0]], [[1.0, -3.0], [3.0, 1.0]], [[2.0, 1.0], [-1.0, 2.0]]])
def test_a_matrix_that_is_not_symmetric_gives_no_wrong_answer(other):
    with pytest.raises(SolverFailed, match="residual"):
        bounded_complementarity(np.array(other), np.array([-1.0, -0.5]), np.full(2, -9.0), np.full(2, 9.0))


def test_of_no_forces_there_is_an_answer():
    found = bounded_complementarity(np.zeros((0, 0)), *np.zeros((3, 0)))
    assert (found.force.shape, found.rate.shape, found.residual, found.bounded) == ((0,), (0,), 0.0, True)
