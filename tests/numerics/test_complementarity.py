import numpy as np
import pytest
from contact_enumeration import every_active_set

from exo_pin.core.errors import SolverFailed
from exo_pin.numerics.complementarity import bounded_complementarity


@pytest.mark.parametrize("seed", range(200))
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


def test_without_variables_and_without_curvature():
    none = bounded_complementarity(np.zeros((0, 0)), np.zeros(0), np.zeros(0), np.zeros(0))
    assert none.bounded
    assert none.force.shape == (0,)
    still = bounded_complementarity(np.zeros((1, 1)), np.array([2.0]), np.array([-3.0]), np.array([3.0]))
    np.testing.assert_array_equal(still.force, [-3.0])
    jammed = bounded_complementarity(np.zeros((1, 1)), np.array([-2.0]), np.zeros(1), np.array([np.inf]))
    assert not jammed.bounded


def test_numbers_that_are_not_finite_give_no_answer():
    with pytest.raises(SolverFailed):
        bounded_complementarity(np.eye(1) * np.nan, np.ones(1), -np.ones(1), np.ones(1))
    for low, high in ((np.nan, 1.0), (-1.0, np.nan)):
        with pytest.raises(SolverFailed, match="NaN"):
            bounded_complementarity(np.eye(1), np.ones(1), np.array([low]), np.array([high]))
