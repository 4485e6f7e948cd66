"""Answers within limits where earlier versions failed: six limbs, aligned side forces, cones of stacks."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep


def cables(count, pull_limit, **arm):
    angles = np.arange(count) * 2.0 * np.pi / count + 0.2
    geometry = ep.WristGeometry.from_circles(0.2, 0.1, 0.1, 0.15, angles, angles + 0.3)
    limb = ep.Limb("UPU", actuator=ep.Actuator("cable", pull_limit=pull_limit))
    return ep.ShoulderExo(geometry, ep.Arm(3.0, [0.02, 0.0, -0.25], **arm), limbs=[limb] * count)


@pytest.mark.parametrize("count", [4, 5, 6, 7])
def test_maps_of_many_cables_agree_with_single_poses(count):
    exo, poses = cables(count, 200.0), Rotation.random(60, random_state=count)
    found, single = exo.reaction_map(poses), exo.reaction(poses)
    np.testing.assert_array_equal(found.status, single.status)
    np.testing.assert_allclose(found.actuator_forces, single.actuator_forces, rtol=1e-7, atol=1e-6)


def test_a_side_force_through_the_centre_holds_nothing():
    exo, poses = cables(4, 50.0), Rotation.random(200, random_state=1)
    aligned = exo.reaction(poses, split="minimal")
    for other in (
        exo.reaction(poses, split="minimal", centre_offset=[0.0, 0.0, 0.0]),
        exo.reaction_map(poses, split="minimal"),
    ):
        np.testing.assert_array_equal(other.status, aligned.status)
    assert (aligned.status == "infeasible").any()


def test_an_offset_of_a_nanometre_balances_nothing_with_huge_side_forces():
    exo, poses = cables(4, 50.0), Rotation.random(60, random_state=1)
    found = exo.reaction(poses, split="minimal", centre_offset=[1e-9, 0.0, 0.0])
    assert (found.residual[found.status == "ok"] < 1e-6).all()


def test_each_pose_of_an_elastic_stack_has_its_own_cone():
    person = ep.Person(1.75, 75, "male")
    exo = ep.load("four-linear-actuators")
    exo = exo.replace(arm=person.arm, shoulder=ep.Shoulder(stiffness=20e3))
    poses = exo.pose([0, 60], [5, 20], [0, -10])
    options = {"split": "elastic", "limits": "none", "cone": person.glenoid_cone()}
    stack = exo.reaction(poses, **options)
    for k in range(2):
        alone = exo.reaction(poses[k], **options)
        np.testing.assert_allclose(stack.actuator_forces[k], alone.actuator_forces, rtol=1e-7)
