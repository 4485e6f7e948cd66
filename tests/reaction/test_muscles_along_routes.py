"""Answers of muscles, as limbs and as routes of a chain."""

from dataclasses import replace

import numpy as np
import pytest
from arm_alone import arm_alone

import exo_pin as ep
from exo_pin.device import ChainDevice, Drive, Route
from exo_pin.muscle import muscle_model

LAW, LONG = muscle_model("best", 0.2), 0.2
LOAD = {"load": ep.Load((2.0, 1.0, -5.0), (0.1, 0.2, -0.1), at=(0.02, 0.0, -0.3), frame="arm")}
CASES = {
    "rest": {},
    "load": LOAD,
    "motion": {"motion": ep.Motion([1.0, 2.0, 0.5], [3.0, -2.0, 1.0])},
    "offset": {"centre_offset": ep.CentreOffset([0.005, 0.01, -0.01], [0.0, 0.004, 0.002])},
}


@pytest.fixture(scope="module")
def exo():
    """Four muscles with their laws; at the pose of their length they are 9 % shorter than at rest."""
    own = ep.load("four-cables")
    lengths = own.inverse_kinematics(own.pose(30, 30)).lengths
    law = ep.Actuator("pneumatic muscle", force_law="best", supply_pressure=4e5)
    strokes = [ep.Stroke(LONG, 0.75, 1.0, float(length) - 0.18) for length in lengths]
    return own.replace(limbs=[ep.Limb("SPS", stroke=stroke, actuator=law) for stroke in strokes])


@pytest.fixture(scope="module")
def device(exo):
    """The same muscles as routes from torso to arm, on a chain without any link of a device."""
    ends = zip(exo.geometry.base_points, exo.geometry.platform_points, exo.mechanism.limbs, strict=True)
    drives = tuple(
        Drive(f"muscle_{k}", route=Route.over(("universe", a), ("arm", b)), actuator=limb.actuator, stroke=limb.stroke)
        for k, (a, b, limb) in enumerate(ends)
    )
    return ep.ShoulderExo.from_device(ChainDevice(arm_alone(), drives, arm=exo.arm))


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("split", ["spherical", "minimal"])
def test_routes_have_the_answer_of_limbs(exo, device, case, split):
    poses = exo.pose([[30.0, 60.0], [33.0, -20.0]], [[30.0, 10.0]])
    for limits in ("none", "pull"):
        one = exo.reaction(poses, split=split, limits=limits, **CASES[case])
        other = device.reaction(poses, split=split, limits=limits, **CASES[case])
        np.testing.assert_array_equal(other.held, one.held)
        rows = one.held
        for name in ("actuator_forces", "shoulder_force", "cuff_wrench", "harness_wrench"):
            np.testing.assert_allclose(getattr(other, name)[rows], getattr(one, name)[rows], atol=1e-7, err_msg=name)
        assert other.residual[rows].max(initial=0.0) < 1e-9
        np.testing.assert_array_equal(other.status[~rows], one.status[~rows])


def test_limits_cone_weights_and_speeds_choose_as_for_limbs(exo, device):
    pose = exo.pose(30.0, 30.0)
    moving = {"motion": ep.Motion([0.2, -0.1, 0.1], np.zeros(3))}
    facing = ep.glenoid_orientation(35, 0, -10, retroversion=5, inclination=8, degrees=True)
    cone = ep.GlenoidCone(orientation=facing, penalty=10.0)
    for asked in ({"limits": (0.0, 60.0)}, {"limits": (5.0, np.inf)}, {"limits": (0.0, 60.0), "split": "spherical"}):
        one, other = exo.reaction(pose, **asked), device.reaction(pose, **asked)
        assert one.held == other.held
        np.testing.assert_allclose(other.actuator_forces, one.actuator_forces, atol=1e-6)
    one, other = (own.reaction(pose, split="minimal", limits="none", cone=cone) for own in (exo, device))
    assert one.held
    assert other.held
    free = device.reaction(pose, split="minimal", limits="none")
    np.testing.assert_allclose(other.shoulder_force, one.shoulder_force, atol=1e-6)
    assert np.linalg.norm(other.shoulder_force - free.shoulder_force) > 1.0
    slow = [replace(limb.actuator, speed_limit=0.01) for limb in exo.mechanism.limbs]
    limbs = exo.replace(
        limbs=[replace(limb, actuator=own) for limb, own in zip(exo.mechanism.limbs, slow, strict=True)]
    )
    routes = device.replace(drives=[replace(drive, speed_limit=0.01) for drive in device.device.drives])
    one, other = limbs.reaction(pose, **moving), routes.reaction(pose, **moving)
    assert one.status == other.status == "beyond_limits"
    np.testing.assert_allclose(other.limits.excess_speed, one.limits.excess_speed, atol=1e-9)
    assert other.limits.excess_speed.max() > 0.01
    assert routes.reaction(pose).held == limbs.reaction(pose).held
    with pytest.raises(ep.InvalidInput, match=r'in N for a device that is not a wrist, got "actuator"'):
        device.reaction(pose, split="minimal", constraint_bounds="actuator")
    with pytest.raises(ep.MissingData, match="gives way"):
        device.reaction(pose, split="elastic_locked")
    massless = device.replace(arm=ep.Arm(3.0, [0.0, 0.0, -0.25]))
    assert massless.reaction(pose, limits="none").held
    with pytest.raises(ep.MissingData, match="inertia"):
        massless.reaction(pose, **moving)
