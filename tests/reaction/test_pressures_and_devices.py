"""Pressures and answers of muscles, as limbs and as routes of a chain, from laws and free bodies."""

from dataclasses import replace

import numpy as np
import pytest
from arm_alone import arm_alone
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.device import ChainDevice, Drive, Route
from exo_pin.muscle import Muscle, muscle_model

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


def never_vented(exo):
    """Muscles of the limbs whose least pressure is 1.5 bar, so that all have a stiffness."""
    ends = [limb.stroke.end_fitting for limb in exo.mechanism.limbs]
    return [Muscle(model=LAW, end_fitting=end, supply_pressure=4e5, least_pressure=1.5e5) for end in ends]


def moment_on_arm(exo, pose, pressures, load):
    """Moment about O of muscles at their pressures, weight and load, N m, by hand."""
    on_arm = pose.apply(np.array(exo.geometry.platform_points))
    lines = exo.geometry.base_points - on_arm
    lengths = np.linalg.norm(lines, axis=1)
    ends = np.array([limb.stroke.end_fitting for limb in exo.mechanism.limbs])
    pull = np.array([float(LAW.force(LONG - own, p)) for own, p in zip(lengths - ends, pressures, strict=True)])
    weight = exo.arm.mass * np.array([0.0, 0.0, -9.81])
    moment = np.cross(on_arm, pull[:, None] * lines / lengths[:, None]).sum(axis=0)
    moment += np.cross(pose.apply(np.array(exo.arm.centre_of_mass)), weight)
    if load is None:
        return moment
    force, couple = (pose.apply(np.array(part)) for part in (load.force, load.moment))
    return moment + couple + np.cross(pose.apply(np.array(load.at)), force)


@pytest.mark.parametrize("of", ["limbs", "routes"])
@pytest.mark.parametrize("case", ["rest", "load"])
def test_pressures_and_stiffness_are_those_of_the_law_and_of_small_turns(exo, device, of, case):
    asked = exo if of == "limbs" else device
    poses = exo.pose([[30.0], [33.0]], [[30.0, 28.0, 10.0]])
    plan = asked.pressures(poses, never_vented(exo), **CASES[case])
    load = CASES[case].get("load")
    assert plan.pressures.shape == (2, 3, 4)
    assert plan.stiffness.shape == (2, 3, 3, 3)
    rows = [index for index in np.ndindex(2, 3) if plan.has_answer[index]]
    assert rows
    for index in rows:
        pose, own = Rotation.from_quat(poses.as_quat()[index]), plan.pressures[index]
        assert np.abs(moment_on_arm(exo, pose, own, load)).max() < 1e-6
        turned = np.empty((3, 3))
        for axis in range(3):
            ends = [
                moment_on_arm(exo, Rotation.from_rotvec(turn * np.eye(3)[axis]) * pose, own, load)
                for turn in (1e-5, -1e-5)
            ]
            turned[:, axis] = (ends[1] - ends[0]) / 2e-5
        # The law's pressure follows the length: at the pressures of the plan it pulls with the tensions of the plan.
        np.testing.assert_allclose(plan.stiffness[index], turned, rtol=2e-5, atol=2e-4)
        np.testing.assert_allclose(plan.pressures_bar[index], own / 1e5)
        half = 0.5 * (turned + turned.T)
        least = min(np.roots(np.poly(half)).real)
        assert plan.least_stiffness[index] == pytest.approx(least, rel=1e-4)
        assert plan.is_stable[index] == (least > 0.0)
        lengths = np.linalg.norm(pose.apply(np.array(exo.geometry.platform_points)) - exo.geometry.base_points, axis=1)
        for k, limb in enumerate(exo.mechanism.limbs):
            short = LONG - lengths[k] + limb.stroke.end_fitting
            change = (LAW.force(short - 1e-6, own[k]) - LAW.force(short + 1e-6, own[k])) / 2e-6
            assert plan.axial_stiffness[(*index, k)] == pytest.approx(float(change), rel=1e-4)
            assert LAW.force(short, own[k]) == pytest.approx(plan.reaction.actuator_forces[(*index, k)], abs=1e-5)
    lost = ~plan.has_answer
    assert np.isnan(plan.least_stiffness[lost]).all()
    assert not plan.is_stable[lost].any()
    assert not plan.reaction.held.all()
    assert np.isnan(plan.pressures[~plan.reaction.held]).all()


@pytest.mark.parametrize("of", ["limbs", "routes"])
def test_the_muscles_of_a_design_are_the_default_and_doubts_are_counted(exo, device, of):
    asked = exo if of == "limbs" else device
    poses = exo.pose([30.0, 33.0], [30.0, 30.0])
    plan = asked.pressures(poses)
    ends = [limb.stroke.end_fitting for limb in exo.mechanism.limbs]
    same = asked.pressures(poses, [Muscle(model=LAW, end_fitting=end, supply_pressure=4e5) for end in ends])
    np.testing.assert_array_equal(plan.pressures, same.pressures)
    # A muscle that pulls nothing has no pressure, and no stiffness is known.
    held, known = int(plan.reaction.held.sum()), int(plan.has_answer.sum())
    assert known < held
    assert plan.cautions[0].startswith(f"{held - known} of {held} held poses need a state")
    assert plan.cautions[1:] == plan.reaction.cautions
    taut = asked.pressures(poses[:1], never_vented(exo))
    assert taut.cautions == taut.reaction.cautions
    nowhere = asked.pressures(exo.pose(30.0, 170.0))
    assert not nowhere.reaction.held
    assert np.isnan(nowhere.pressures).all()
    assert nowhere.cautions == nowhere.reaction.cautions


def test_what_pressures_need(exo, device):
    pose, wearer = exo.pose(30, 30), ep.Wearer(1.75, 75.0, "male")
    with pytest.raises(ep.InvalidInput, match="no centre_offset"):
        ep.reaction.plan_pressures(exo, ep.Case(pose, **CASES["offset"]), None, ep.Assumptions())
    with pytest.raises(ep.InvalidInput, match="without displacement"):
        ep.reaction.plan_pressures(exo, ep.Case(pose), None, ep.Assumptions(split="elastic"))
    with pytest.raises(ep.InvalidInput, match="Device"):
        ep.reaction.plan_pressures(object(), ep.Case(pose), None, ep.Assumptions())
    few = device.replace(drives=device.device.drives[:2])
    with pytest.raises(ep.InvalidInput, match="hold the arm"):
        few.pressures(pose)
    bare = device.replace(drives=[Drive(own.name, route=own.route) for own in device.device.drives])
    with pytest.raises(ep.MissingData, match="muscle 1"):
        bare.pressures(pose)
    worn = ep.reaction.plan_pressures(exo, ep.Case(pose, wearer=wearer), never_vented(exo), ep.Assumptions())
    own = exo.worn_by(wearer).pressures(pose, never_vented(exo))
    np.testing.assert_allclose(worn.pressures, own.pressures, rtol=1e-12)


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


def test_offsets_of_several_kinds_are_answered_pose_by_pose(exo, device):
    poses = exo.pose([30.0, 32.0, 28.0], [30.0, 25.0, 35.0])
    base = np.array([[0.005, 0.0, 0.0], [0.0, 0.01, 0.0], [0.005, 0.0, 0.0]])
    cuff = np.array([[0.0, 0.004, 0.0], [0.002, 0.0, 0.0], [0.0, 0.004, 0.0]])
    asked = {"limits": "none", "split": "minimal"}
    every = device.reaction(poses, centre_offset=ep.CentreOffset(base, cuff), **asked)
    for k in range(3):
        one = device.reaction(poses[k], centre_offset=ep.CentreOffset(base[k], cuff[k]), **asked)
        wrist = exo.reaction(poses[k], centre_offset=ep.CentreOffset(base[k], cuff[k]), **asked)
        for name in ("actuator_forces", "shoulder_force", "limb_wrenches"):
            np.testing.assert_allclose(getattr(every, name)[k], getattr(one, name), atol=1e-9)
        np.testing.assert_allclose(every.shoulder_force[k], wrist.shoulder_force, atol=1e-7)


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
