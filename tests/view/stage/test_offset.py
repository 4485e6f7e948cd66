"""A device whose centre is not the shoulder's: what its arrows show is in balance."""

import dataclasses

import numpy as np
import pytest
from scenes import PERSON, commands, place, placements, pose

import exo_pin as ep
from exo_pin.design import LimbGuide
from exo_pin.view import Scene

HARNESS, CUFF = np.array([0.004, -0.01, 0.012]), np.array([-0.006, 0.0, 0.015])


@pytest.fixture(scope="module")
def exo():
    return ep.load("prototype").worn_by(PERSON)


def test_the_drawn_forces_balance_the_arm(exo):
    """Side forces of stiff limbs, too: what the arrows show adds up to nothing."""
    tube = LimbGuide.tube(outer_radius=0.012, inner_radius=0.010, youngs_modulus=70e9, shear_modulus=26e9)
    guided = exo.replace(
        limbs=[dataclasses.replace(limb, guide=tube) for limb in exo.limbs], shoulder=ep.Shoulder(stiffness=2e4)
    )
    # A scale at which no arrow is cut.
    scene = Scene(guided, human=False, metres_per_newton=1e-4)
    answer = scene.show(pose(60, 30, 0), split="elastic", centre_offset=ep.CentreOffset(HARNESS, CUFF))
    assert np.abs(answer.constraint_forces).max() > 10.0
    total = np.zeros(3)
    for item in commands(scene):
        path = item.get("path", "")
        # The cuff's pull is between arm and device, whose forces are drawn.
        own = path.startswith("/meshcat/forces") and not path.startswith("/meshcat/forces/cuff")
        if item["type"] == "set_object" and own and path.endswith("head_0"):
            head = place(scene, path)
            size = np.linalg.norm(head[:3, 2])
            if size > 1e-5:
                total += drawn_force(scene, path.removesuffix("/head_0"))
    np.testing.assert_allclose(total / scene.metres_per_newton, 0.0, atol=0.02 * answer.magnitude)


def drawn_force(scene, path):
    """The vector of an arrow, m: from its shaft's foot to its last head's tip."""
    shaft = place(scene, f"{path}/shaft")
    last = "head_1" if f"{path}/head_1" in placements(scene) else "head_0"
    head = place(scene, f"{path}/{last}")
    start = shaft[:3, 3]
    return head[:3, 3] + head[:3, 2] - start
