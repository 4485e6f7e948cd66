"""A wrist asked as a closed chain has the answer of its closed form, and every device's arm is in balance."""

from pathlib import Path

import numpy as np
import pytest
from mechanisms import random_wrist

import exo_pin as ep
from exo_pin.device import ChainDevice

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


@pytest.mark.full
def test_a_singular_wrist_lacks_the_same_moment_as_a_chain():
    exo = ep.load("prototype")
    pose = exo.nearest_singularity(exo.pose(30, 20)).pose
    one, other = (each.reaction(pose) for each in (exo, ep.ShoulderExo.from_device(exo.chain_device)))
    assert one.equilibrium_status == other.equilibrium_status == "singular"
    assert one.verdict == other.verdict
    assert "about an axis 45° from the vertical axis" in one.verdict


@pytest.mark.parametrize("name", ["serial-y-x-z", "spherical-3rrr"])
def test_a_device_that_centres_itself_puts_forces_along_the_base_axes_on_the_shoulder(name):
    exo = ep.load(URDF / f"{name}.urdf")
    poses = exo.pose(*(ANGLES + np.array([20.0, 5.0, 0.0])).T)
    minimal, spherical = (exo.reaction(poses, limits="none", split=split) for split in ("minimal", "spherical"))
    moved = minimal.shoulder_force - spherical.shoulder_force
    np.testing.assert_allclose(minimal.constraint_forces, moved, atol=1e-10)
    assert np.abs(moved).max() > 1.0
