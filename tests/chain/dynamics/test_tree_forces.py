"""The oracle of tree forces itself, against balances by hand and the package's own reactions."""

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import random_wrist
from tree_forces import tree_forces

from exo_pin.chain import ClosedChain
from exo_pin.design import preset
from exo_pin.wrist_chain import mechanism_urdf

MECHANISMS = {
    "prototype": preset("prototype"),
    "heavy limbs": random_wrist(21, "UUU", with_masses=True),
    "mixed": random_wrist(22, "USUSU", with_masses=True),
}


def moving(mechanism, part="whole", seed=0):
    """A chain in random closed motion with random multipliers."""
    rng = np.random.default_rng(seed)
    chain = ClosedChain.from_urdf(*mechanism_urdf(mechanism, part))
    q = chain.close(pin.integrate(chain.model, chain.neutral(), rng.uniform(-0.3, 0.3, chain.model.nv)))
    v, a = rng.normal(size=(2, chain.model.nv))
    return chain, q, v, a, rng.normal(size=chain.row_count)


@pytest.mark.parametrize("name", MECHANISMS)
@pytest.mark.parametrize("part", ["whole", "floating"])
def test_the_whole_is_in_balance(name, part):
    # Rate of momentum about O = root joint + closures + weight + load.
    chain, q, v, a, multipliers = moving(MECHANISMS[name], part, seed=2)
    load = np.array([3.0, -5.0, 2.0, 0.4, 0.1, -0.7])
    point = chain.placement(q, "arm").translation
    forces = tree_forces(chain, q, v, a, multipliers, external={"arm": load})
    data = chain.model.createData()
    rate = pin.computeCentroidalMomentumTimeVariation(chain.model, data, q, v, a)
    centre = data.com[0]
    total = forces.joint_wrench("root_joint", at=(0.0, 0.0, 0.0))
    for closure in chain.closures:
        assert closure.frame_b == "universe"
        total = total + forces.closure_wrench(closure.name, at=(0.0, 0.0, 0.0))
    weight = data.mass[0] * chain.model.gravity.linear
    total[:3] += weight + load[:3]
    total[3:] += np.cross(centre, weight) + load[3:] + np.cross(point, load[:3])
    expected = np.concatenate([rate.linear, rate.angular + np.cross(centre, rate.linear)])
    np.testing.assert_allclose(total, expected, atol=1e-11)
