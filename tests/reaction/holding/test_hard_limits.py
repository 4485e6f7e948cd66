"""Answers within limits where earlier versions failed: six limbs, aligned side forces, cones of stacks."""

import dataclasses

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


@pytest.mark.full
def test_an_offset_of_a_nanometre_balances_nothing_with_huge_side_forces():
    exo, poses = cables(4, 50.0), Rotation.random(60, random_state=1)
    found = exo.reaction(poses, split="minimal", centre_offset=[1e-9, 0.0, 0.0])
    assert (found.residual[found.status == "ok"] < 1e-6).all()


def test_each_pose_of_an_elastic_stack_has_its_own_cone():
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    person = ep.Person(1.75, 75, "male")
    exo = ep.load("four-linear-actuators")
    exo = exo.replace(arm=person.arm, shoulder=ep.Shoulder(stiffness=20e3))
    poses = exo.pose([0, 60], [5, 20], [0, -10])
    options = {"split": "elastic", "limits": "none", "cone": person.glenoid_cone()}
    stack = exo.reaction(poses, **options)
    for k in range(2):
        alone = exo.reaction(poses[k], **options)
        np.testing.assert_allclose(stack.actuator_forces[k], alone.actuator_forces, rtol=1e-7)


def test_a_displaced_device_has_the_forces_of_least_sum_of_squares():
    rng = np.random.default_rng(4)
    for count, split in [(4, "minimal"), (5, "minimal"), (4, "standalone"), (6, "standalone")]:
        angles = rng.uniform(0.0, 5.0, count)
        geometry = ep.WristGeometry.from_circles(0.2, 0.1, 0.1, 0.15, angles, angles + rng.uniform(-1.0, 1.0, count))
        exo = ep.ShoulderExo(geometry, ep.Arm(3.0, [0.02, 0.0, -0.25]), limbs=[ep.Limb("UPU")] * count)
        found = exo.reaction(
            Rotation.random(random_state=count), split=split, centre_offset=rng.uniform(-0.02, 0.02, 3)
        )
        state = found.source.poses.state.row(0)
        balance = np.hstack([state.moment_of_f, state.moment_of_g])
        shoulder = np.hstack([state.shoulder_of_f, state.shoulder_of_g])
        # F_s = 0 can be reached in all of these: the shortest forces that balance arm and shoulder.
        rows, target = np.vstack([balance, shoulder]), np.concatenate([state.moment, -state.shoulder])
        shortest = np.linalg.lstsq(rows, target, rcond=1e-12)[0]
        forces = np.concatenate([found.actuator_forces, found.constraint_forces])
        np.testing.assert_allclose(forces, shortest, rtol=1e-8, atol=1e-8 * np.abs(shortest).max())


def test_six_locked_limbs_between_similar_hexagons_are_singular():
    angles = np.arange(6) * np.pi / 3.0
    shoulder, poses = ep.Shoulder(stiffness=20e3), Rotation.random(5, random_state=2)
    for turned, expected in [(angles + 0.3, "singular"), (angles + 0.3 * (-1.0) ** np.arange(6), "ok")]:
        geometry = ep.WristGeometry.from_circles(0.2, 0.1, 0.1, 0.15, angles, turned)
        arm = ep.Arm(3.0, [0.02, 0.0, -0.25])
        exo = ep.ShoulderExo(geometry, arm, limbs=[ep.Limb("SPS")] * 6, shoulder=shoulder)
        found = exo.reaction(poses, split="elastic_locked", limits="none")
        # Loads that such a device cannot take have no equilibrium.
        assert np.isin(found.status, [expected, "no_equilibrium"]).all()
        assert (found.status == expected).any()
        assert "singular" not in exo.reaction(poses[0], split="elastic", limits="none").status


def test_forces_of_locked_limbs_beyond_their_limits_are_not_the_closest_within():
    exo = ep.load("four-linear-actuators")
    limb = dataclasses.replace(exo.mechanism.limbs[0], actuator=ep.Actuator("linear", pull_limit=5.0, push_limit=5.0))
    exo = exo.replace(limbs=[limb] * 4, shoulder=ep.Shoulder(stiffness=20e3))
    found = exo.reaction(exo.pose(60, 20), split="elastic_locked")
    assert found.status == "beyond_limits"
    assert np.isnan(found.closest.actuator_forces).all()


def test_limits_that_exclude_each_other_hold_nothing_and_give_no_push():
    exo = ep.load("four-cables")
    pose = exo.pose(60, 30)
    # The cables give 400 N.
    asked = exo.reaction(pose, limits=(500.0, 1000.0))
    own = [dataclasses.replace(limb.actuator, least_tension=20.0, power_limit=5.0) for limb in exo.mechanism.limbs]
    slow = exo.replace(
        limbs=[dataclasses.replace(limb, actuator=actuator) for limb, actuator in zip(exo.limbs, own, strict=True)]
    )
    moving = slow.reaction(pose, ep.Motion([0.0, -3.0, 0.0], [0.0, 0.0, 0.0]))
    for answer in (asked, moving):
        assert answer.status == "out_of_stroke"
        assert not answer.can_hold
        assert not (answer.closest.actuator_forces < 0.0).any()
    assert exo.reaction_map(pose, limits=(500.0, 1000.0)).status == "out_of_stroke"


def test_a_limb_with_one_body_is_answered_off_centre():
    limb = ep.Limb(base_body=ep.LimbBody.rod(0.2, 0.15, 0.01))
    exo = ep.load("prototype").replace(limbs=[limb] * 3, shoulder=ep.Shoulder(stiffness=20e3))
    poses = exo.pose([30, 40, 50, 60])
    stack = exo.reaction(poses, limits="none", centre_offset=[0.005, 0.0, 0.0])
    single = [exo.reaction(pose, limits="none", centre_offset=[0.005, 0.0, 0.0]).shoulder_force for pose in poses]
    np.testing.assert_allclose(stack.shoulder_force, single, rtol=1e-10, atol=1e-9)
    assert exo.reaction(poses[0], limits="none", split="elastic").status == "ok"
