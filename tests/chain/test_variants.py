"""Chains with joints locked, beside the same chains with those joints held by a closure."""

import numpy as np
import pytest
from closed_chains import CHAINS

from exo_pin.chain import Closure


def hinges(chain):
    """Joints whose position is one number."""
    return [str(name) for name, nq in zip(chain.model.names, chain.model.nqs, strict=True) if nq == 1]


def movable(chain, q, count):
    """A joint that may be locked without locking the mechanism."""
    for name in hinges(chain)[::-1]:
        held = chain.locked([name], q)
        if held.mobility(reduced(chain, [name], q)).degrees_of_freedom >= count:
            return name
    return None


def reduced(chain, joints, q):
    gone = {index for name in joints for index in range(*chain.configuration_slice(name).indices(chain.model.nq))}
    return np.array([value for index, value in enumerate(q) if index not in gone])


@pytest.mark.parametrize(
    "name", ["five_bar", "delta-rigid", "stewart", "loop-spherical", "loop-coupling", "wrist-floating"]
)
def test_a_locked_joint_moves_as_one_that_a_closure_holds(name):
    chain, q = CHAINS[name]
    joint = movable(chain, q, 1)
    assert joint is not None
    locked = chain.locked([joint], q)
    place = float(q[chain.configuration_slice(joint)][0])
    held = chain.with_closure(Closure("lock", "coupling", "universe", joint, polynomial=(place,)))
    rng, own = np.random.default_rng(3), chain.velocity_slice(joint)
    others = np.setdiff1d(np.arange(chain.model.nv), [own.start])
    v = held.project_velocity(q, rng.normal(size=chain.model.nv))
    tau = rng.normal(size=chain.model.nv)
    expected = held.forward_dynamics(q, v, tau).a
    found = locked.forward_dynamics(reduced(chain, [joint], q), v[others], tau[others]).a
    np.testing.assert_allclose(found, expected[others], atol=1e-8 * np.abs(expected).max())
    assert joint not in list(locked.model.names)
    assert held.closures[-1].name == "lock"
    assert chain.row_count == held.row_count - 1
