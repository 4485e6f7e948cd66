"""A planar linkage of forty loops: close, mobility by hand, inverse after forward dynamics, energy.

Its tree has 120 coordinates, so that pages of its Data are given back.
"""

import sys
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "benchmarks"))

from large_chains import ladder, state_of

LOOPS = 40


@pytest.fixture(scope="module")
def linkage():
    """The chain and a motion that keeps its loops closed."""
    chain = ladder(LOOPS)
    return chain, *state_of(chain)


def test_it_closes_from_an_open_configuration(linkage):
    """A hundredth of a radian off in every joint."""
    chain, q, _, _ = linkage
    off = pin.integrate(chain.model, q, np.random.default_rng(1).uniform(-0.01, 0.01, chain.model.nv))
    assert np.abs(chain.residual(off)).max() > 1e-3
    closed = chain.close(off)
    assert np.abs(chain.residual(closed)).max() <= 1e-12
    assert np.abs(closed - off).max() < 0.1


def test_its_mobility_is_that_by_hand(linkage):
    """3 bodies and 4 hinges a loop in the plane: 3 120 - 2 160 = 40, and one of a pin's three rows is redundant."""
    chain, q, _, _ = linkage
    found = chain.mobility(q, actuated=())
    assert (found.rows, found.rank, found.degrees_of_freedom, found.redundant) == (120, 80, 40, 40)
    assert dict(found.redundant_closures) == {f"loop_{k}": 1 for k in range(LOOPS)}
    assert found.kinds == ()


def test_inverse_after_forward_dynamics_is_the_identity(linkage):
    """With one motor a loop the efforts are unique."""
    chain, q, v, _ = linkage
    rails = [f"rail_{k}" for k in range(LOOPS)]
    tau = np.zeros(chain.model.nv)
    tau[chain.velocity_indices(rails)] = np.random.default_rng(2).normal(size=LOOPS)
    motion = chain.forward_dynamics(q, v, tau)
    forces = chain.inverse_dynamics(q, v, motion.a, actuated=rails)
    assert forces.effort_is_unique.all()
    np.testing.assert_allclose(forces.tau, tau, atol=1e-9 * np.abs(forces.multipliers).max())


def test_it_keeps_its_energy(linkage):
    """A twentieth of a second of free fall of the tower, with its loops closed."""
    chain, q, v, _ = linkage
    found = chain.simulate(q, v, [0.0, 0.025, 0.05])
    assert found.opening.max() <= 1e-12
    assert found.kinetic_energy.max() > 10.0 * found.kinetic_energy[0]
    assert found.energy_drift <= 1e-8 * found.kinetic_energy.max()
