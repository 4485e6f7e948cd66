"""A wrist asked as a closed chain has the answer of its closed form, and every device's arm is in balance."""

from pathlib import Path

import numpy as np
import pytest
from mechanisms import random_wrist

import exo_pin as ep
from exo_pin.device import ChainDevice, WristDevice

URDF = Path(__file__).parents[2] / "urdf"
ANGLES = np.array([[20.0, 30.0, 0.0], [60.0, 10.0, 10.0], [-20.0, 40.0, 20.0]])
CASES = {
    "rest": {},
    "load": {"load": ep.Load((3.0, 2.0, -10.0), moment=(0.2, 0.1, -0.3), at=(0.0, 0.0, -0.3), frame="arm")},
    "motion": {"motion": ep.Motion([1.0, 2.0, 0.5], [3.0, -2.0, 1.0])},
    "offset": {"centre_offset": ep.CentreOffset([0.005, 0.01, -0.01], [0.0, 0.004, 0.002])},
}


def both_ways(exo, split, case, poses):
    """The closed form's answer and the chain's; what of the arm is the device's is told to both."""
    arm = exo.arm
    device = ChainDevice.from_chain(exo.chain, exo.side).replace(arm=arm)
    question = ep.Case(poses, **case), ep.Assumptions(split, "none")
    return exo.reaction(poses, split=split, limits="none", **case), ep.solve(device, *question)


def assert_same(one, other, names=("shoulder_force", "cuff_wrench", "harness_wrench", "actuator_forces")):
    scale = max(float(np.abs(one.limb_wrenches).max()), 1.0)
    assert (other.equilibrium_status == "ok").all()
    for name in names:
        np.testing.assert_allclose(getattr(other, name), getattr(one, name), atol=1e-9 * scale, err_msg=name)
    assert other.residual.max() < 1e-9


# Rigid limbs with two universal joints do not close off their centre: the next test says so.
PRESETS_AND_CASES = [
    (name, case)
    for name in ("prototype", "four-linear-actuators", "four-cables")
    for case in CASES
    if (name, case) != ("prototype", "offset")
]


@pytest.mark.parametrize(("name", "case"), PRESETS_AND_CASES)
@pytest.mark.parametrize("split", ["spherical", "minimal"])
def test_a_preset_as_a_chain_has_its_own_answer(name, case, split):
    exo = ep.load(name)
    assert_same(*both_ways(exo, split, CASES[case], exo.pose(*ANGLES.T)))


def test_rigid_limbs_do_not_close_off_their_centre():
    answer = both_ways(ep.load("prototype"), "spherical", CASES["offset"], ep.load("prototype").pose(60, 30))[1]
    assert answer.status == "out_of_reach"
    assert answer.verdict.startswith("The device cannot hold this pose: the device does not reach it. Its loops do not")
    assert np.isnan(answer.shoulder_force).all()


@pytest.mark.parametrize("split", ["spherical", "minimal"])
@pytest.mark.parametrize("kinds", ["UUU", "SUUS", pytest.param("UUUU", marks=pytest.mark.full)])
def test_limbs_that_may_twist_follow_an_offset_of_their_centre_as_their_wrist_says(kinds, split):
    exo = ep.ShoulderExo.from_device(random_wrist(7, kinds))
    chain = ep.ShoulderExo.from_device(exo.device.as_chain())
    questions = {"limits": "none", "split": split, **CASES["offset"], **CASES["load"]}
    one, other = (device.reaction(device.pose(*ANGLES.T), **questions) for device in (exo, chain))
    assert_same(one, other)
    assert np.abs(one.constraint_forces).max() > 1.0 or split == "spherical"
    assert (other.certificate.undetermined == one.certificate.undetermined).all()


def test_a_wrist_without_a_shoulder_stands_alone_in_both():
    exo = ep.load("prototype")
    one, other = both_ways(exo, "standalone", {}, exo.pose(*ANGLES.T))
    assert_same(one, other)
    assert np.abs(other.shoulder_force).max() < 1e-9 * np.abs(other.limb_wrenches).max()


@pytest.mark.parametrize("kinds", ["UUU", "SSS", "SSSS", "USUSU", "SSSSSSS"])
@pytest.mark.parametrize("side", ["left", "right"])
def test_a_random_wrist_with_heavy_limbs_has_its_own_answer_on_both_sides(kinds, side):
    mechanism = random_wrist(7, kinds, with_masses=True).on_side(side)
    # An SPS limb may spin at any rate: what its own spin would weigh is not part of the question.
    mechanism = mechanism.replace(limbs=[limb.without_spin() for limb in mechanism.limbs])
    exo = ep.ShoulderExo.from_mechanism(mechanism)
    # Least |F_s| is the same; where it is zero, more than one set of limb forces has it.
    several = len(kinds) > 3 and "U" in kinds
    names = ("shoulder_force", "cuff_wrench") + (() if several else ("actuator_forces",))
    assert_same(*both_ways(exo, "minimal", CASES["motion"], exo.pose(10.0, 15.0, 5.0)), names)


@pytest.mark.parametrize("name", ["four-cables", "four-linear-actuators-worn"])
def test_limits_of_the_drives_choose_the_same_forces(name):
    exo = ep.load(name)
    device = ChainDevice.from_chain(exo.chain).replace(arm=exo.arm)
    limits = (0.0, 400.0) if name == "four-cables" else (-120.0, 120.0)
    poses = exo.pose(*np.meshgrid([0.0, 45.0, 90.0], [0.0, 30.0, 60.0]))
    one = exo.reaction(poses, limits=limits)
    other = ep.solve(device, ep.Case(poses), ep.Assumptions(limits=limits))
    np.testing.assert_array_equal(one.held, other.held)
    scale = np.abs(one.actuator_forces).max()
    np.testing.assert_allclose(other.shoulder_force[one.held], one.shoulder_force[one.held], atol=1e-8 * scale)


@pytest.mark.parametrize("name", ["serial-y-x-z", "nesm", "spherical-3rrr", "spring-support"])
def test_arm_and_device_are_in_balance_at_rest_and_in_motion(name):
    exo = ep.load(URDF / f"{name}.urdf")
    poses = exo.pose(*(ANGLES + np.array([20.0, 5.0, 0.0])).T)
    for case in ("rest", "load", "motion"):
        answer = ep.solve(exo, ep.Case(poses, **CASES[case]), ep.Assumptions(limits="none"))
        assert answer.residual.max() < 1e-9
        if case == "motion":
            continue
        # Torso and shoulder carry all weight and the load, whatever the device is.
        model, gravity = exo.chain.model, np.array([0.0, 0.0, -9.81])
        mass = sum(inertia.mass for inertia in list(model.inertias)[1:])
        load = np.zeros(3) if case == "rest" else poses.apply([3.0, 2.0, -10.0])
        total = answer.harness_wrench[:, :3] - answer.shoulder_force
        np.testing.assert_allclose(total, np.broadcast_to(mass * gravity + load, total.shape), atol=1e-8)


def test_poses_at_rest_and_in_motion_are_answered_as_each_alone():
    exo = ep.load(URDF / "serial-y-x-z.urdf")
    poses, turning = exo.pose(*ANGLES[:2].T), np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 0.5]])
    both = exo.reaction(poses, motion=ep.Motion(turning, 2.0 * turning), limits="none")
    for k, w in enumerate(turning):
        alone = exo.reaction(poses[k], motion=ep.Motion(w, 2.0 * w), limits="none")
        np.testing.assert_allclose(both.shoulder_force[k], alone.shoulder_force, atol=1e-9)
    at_rest = exo.reaction(poses, limits="none").shoulder_force
    assert (np.abs(at_rest - both.shoulder_force).max(axis=1) > 0.1).tolist() == [False, True]


def test_the_cuff_pulls_across_and_puts_no_couple_that_is_not_asked_for():
    exo = ep.load(URDF / "serial-y-x-z.urdf")
    poses = exo.pose(*ANGLES.T)
    answer = exo.reaction(poses)
    cuff = (
        poses.apply(np.array([0.0, 0.0, 1.0])) * exo.chain.placement(exo.chain.neutral(), "cuff_middle").translation[2]
    )
    # Of the cuff, with the weight of the links that are welded to the arm.
    wrench = answer.cuff_wrench
    couple = wrench[:, 3:] - np.cross(cuff, wrench[:, :3])
    along = cuff / np.linalg.norm(cuff, axis=1, keepdims=True)
    # Only what a force at the cuff cannot make is left as a couple: what turns about the arm itself.
    np.testing.assert_allclose(couple, (couple * along).sum(axis=1, keepdims=True) * along, atol=1e-9)
    np.testing.assert_allclose((wrench[:, :3] * along).sum(axis=1), 0.0, atol=1e-9)
    assert (answer.certificate.undetermined == 3).all()
    assert not answer.certificate.shoulder_force.any()
    assert answer.certificate.actuator_forces.all()


def test_out_of_reach_beyond_limits_and_singular_are_told_apart():
    exo = ep.load(URDF / "serial-y-x-z.urdf")
    # At 90° of abduction its first and third axis are in line: the arm cannot turn about one axis.
    locked = exo.singularity(exo.pose([0.0, 0.0], [30.0, 90.0]))
    assert locked.kind.tolist() == ["regular", "serial"]
    assert locked.freedom[1] < 1e-7
    weak = exo.replace(drives=[d.__class__(d.name, d.joint, lower=-1.0, upper=1.0) for d in exo.device.drives])
    answer = weak.reaction(exo.pose([0.0, 90.0], 0.0))
    assert answer.status[1] == "beyond_limits"
    assert "a drive would have to give more than it can" in answer.verdict
    assert "flexion would have to give" in weak.reaction(exo.pose(90, 0)).verdict
    narrow = exo.replace(drives=[d.__class__(d.name, d.joint, least=-0.1, greatest=0.1) for d in exo.device.drives])
    assert narrow.reaction(exo.pose(60, 0)).status == "out_of_stroke"
    assert "beyond its range" in narrow.reaction(exo.pose(60, 0)).verdict


@pytest.mark.parametrize("name", ["prototype", pytest.param("four-linear-actuators", marks=pytest.mark.full)])
@pytest.mark.parametrize("offset", [None, [0.004, -0.003, 0.005]])
def test_every_door_has_one_margin(name, offset):
    """That of the singular values of the moments; of a device that gives way, at its equilibrium."""
    cuff = ep.Interfaces(cuff=ep.Interface.upper_arm_cuff(distance=0.19))
    exo = ep.load(name).replace(interfaces=cuff)
    alone = ep.ShoulderExo.from_device(exo.device.as_chain())
    poses = exo.pose(*ANGLES.T)
    question = {"limits": "none", "split": "elastic", "centre_offset": offset}
    soft = [each.reaction(poses, **question) for each in (exo, alone)]
    np.testing.assert_allclose(soft[1].margin, soft[0].margin, rtol=1e-8)
    np.testing.assert_array_equal(soft[1].status, soft[0].status)
    if offset is not None:
        return
    values = np.linalg.svd(exo.jacobian(poses), compute_uv=False)
    margin = 3.0 / np.sqrt((values**2).sum(axis=1) * (values**-2.0).sum(axis=1))
    for each in (exo, alone):
        found = each.reaction(poses, limits="none")
        for other in (found, each.reaction_map(poses, limits="none"), each.singularity(poses)):
            np.testing.assert_allclose(other.margin, margin, rtol=1e-8)
        table = each.compare(each, poses)
        np.testing.assert_allclose(table["least_margin"], margin.min(), rtol=1e-8)
        assert np.isfinite(soft[0].margin).any()


@pytest.mark.parametrize(
    ("name", "offset"),
    # Universal joints of a rigid chain follow no displaced arm.
    [
        ("prototype", None),
        ("appendix-d", None),
        ("four-linear-actuators", None),
        ("four-linear-actuators", [0.004, -0.003, 0.005]),
    ],
)
def test_the_workspace_of_a_wrist_is_singular_where_that_of_its_chain_is(name, offset):
    """The margin of the reaction, on the side of the singular surface that rest is on, and the way there."""
    exo = ep.load(name)
    question = {"criteria": ["singularity", "connected"], "centre_offset": offset}
    poses = ep.adl_box(24.0)
    one, other = (
        each.workspace(poses, **question) for each in (exo, ep.ShoulderExo.from_device(exo.device.as_chain()))
    )
    for criterion in one.margins:
        np.testing.assert_allclose(other.margins[criterion], one.margins[criterion], atol=1e-9)
    answer = exo.reaction(poses, limits="none", centre_offset=offset)
    np.testing.assert_allclose(np.abs(one.margin), answer.margin, atol=1e-9)
    sign = np.sign(answer.determinant * exo.singularity(exo.pose()).determinant)
    expected = answer.margin * (1.0 if exo.geometry.limb_count > 3 else sign)
    if offset is None:
        np.testing.assert_allclose(one.margins["singularity"], expected - 0.05, atol=1e-9)


@pytest.mark.parametrize(("name", "words"), [("prototype", "limb 2 would be 39 mm too short"), ("four-cables", "")])
def test_a_wrist_and_its_chain_are_told_in_the_same_words(name, words):
    exo = ep.load(name)
    chain = ep.ShoulderExo.from_device(WristDevice.of(exo.mechanism).as_chain())
    several = exo.pose([0.0, 40.0, 80.0, 120.0], [0.0, 30.0, 60.0, 90.0])
    for poses in (exo.pose(60.0, 30.0), several):
        one, other = exo.reaction(poses), chain.reaction(poses)
        assert one.verdict == other.verdict
        assert words in one.verdict or poses is several
        assert one.drive_units == other.drive_units
