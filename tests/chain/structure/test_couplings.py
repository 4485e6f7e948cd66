"""Couplings of joints' positions: geometry, rank, files, and what is refused."""

import numpy as np
import pytest
from geared_arms import arm, geared

from exo_pin.chain import ClosedChain, Closure, Closures

CUBE = Closure("gear", "coupling", "joint_0", "joint_2", polynomial=(0.1, 1.0, 0.0, 2.0), references=(0.2, -0.1))


def chain_of(*closures, seed=0):
    return ClosedChain.from_urdf(arm(seed), Closures("geared", closures=closures))


def test_residual_jacobian_and_drift_by_hand():
    chain = chain_of(CUBE)
    q, v = np.array([0.5, 0.3, 0.7, 0.1, -0.2]), np.array([2.0, 1.0, 3.0, -1.0, 0.5])
    # x = 0.3: p = 0.1 + 0.3 + 2 0.027, p' = 1 + 6 0.09, p'' = 12 0.3.
    np.testing.assert_allclose(chain.residual(q), [0.7 + 0.1 - 0.454], atol=1e-15)
    np.testing.assert_allclose(chain.constraint_jacobian(q), [[-1.54, 0, 1, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(chain.constraint_drift(q, v), [-3.6 * 4.0], atol=1e-14)


@pytest.mark.parametrize("seed", range(6))
def test_a_closed_arm_has_a_freedom_less_for_each_coupling(seed):
    urdf, closures = geared(seed)
    chain = ClosedChain.from_urdf(urdf, closures)
    start = np.random.default_rng(seed).uniform(-0.5, 0.5, chain.model.nv)
    q = chain.close(start)
    assert np.abs(chain.residual(q)).max() < 1e-12
    found = chain.mobility(q)
    assert (found.rows, found.rank, found.degrees_of_freedom, found.kinds) == (2, 2, 3, ())
    # The step to closed positions is a least one: nothing else moves.
    np.testing.assert_array_equal(q[3], start[3])
