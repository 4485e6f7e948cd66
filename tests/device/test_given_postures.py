"""Values of idle joints that the user gives, against the closed form of motors in series through the shoulder."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from idle_devices import Builder
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput, UnknownName

G = 9.81


class FourMotors:
    """Four hinges in series through O; only the arm weighs."""

    def __init__(self, seed=0):
        build = Builder(np.random.default_rng(seed))
        build.hinges(4, [True] * 4)
        for joint in range(2, 6):
            build.model.inertias[joint] = pin.Inertia.Zero()
        self.device = build.device()
        self.exo = ep.ShoulderExo.from_device(self.device)
        joints = [build.model.joints[build.model.getJointId(f"hinge_{k}")] for k in range(1, 5)]
        self.axes = [np.array(joint.createData().S).ravel()[3:] for joint in joints]
        self.places = [joint.idx_q for joint in joints]

    def angles(self, pose, posture=None):
        """Angles of the hinges in an answer, by the configuration that it stands in."""
        answer = self.exo.reaction(pose, limits="none", posture=posture)
        return answer, answer.source.poses.placed.q[:, self.places]

    def efforts(self, pose, angles):
        """Virtual work: each motor carries the moment of the arm's weight about its own axis."""
        weight = np.array([0.0, 0.0, -G * self.device.arm.mass])
        moment = np.cross(pose.apply(np.array(self.device.arm.centre_of_mass)), weight)
        turn, out = Rotation.identity(), []
        for axis, angle in zip(self.axes, angles, strict=True):
            out.append(-turn.apply(axis) @ moment)
            turn = turn * Rotation.from_rotvec(angle * axis)
        np.testing.assert_allclose(turn.as_matrix(), pose.as_matrix(), atol=1e-8)
        return np.array(out)


@pytest.fixture(scope="module")
def motors():
    return FourMotors()


POSES = Rotation.from_rotvec([[0.5, -0.7, 0.3], [0.2, 0.4, -0.1]])


@pytest.mark.parametrize("step", [-0.6, 0.25])
def test_motors_carry_the_weight_in_the_posture_that_is_asked_for(motors, step):
    _, free = motors.angles(POSES)
    asked = {"hinge_2_deg": np.degrees(free[:, 1] + step)}
    answer, angles = motors.angles(POSES, asked)
    np.testing.assert_allclose(angles[:, 1], free[:, 1] + step, atol=1e-9)
    expected = [motors.efforts(pose, own) for pose, own in zip(POSES, angles, strict=True)]
    np.testing.assert_allclose(answer.actuator_forces, expected, atol=1e-7)
    assert np.abs(answer.actuator_forces - motors.exo.reaction(POSES, limits="none").actuator_forces).max() > 0.05
    # Motors through O put no force on the shoulder beyond the arm's weight.
    np.testing.assert_allclose(answer.shoulder_force, [[0.0, 0.0, G * motors.device.arm.mass]] * 2, atol=1e-7)
    assert "Posture: hinge_2 as asked for" in " ".join(answer.cautions)
    one = motors.exo.reaction(POSES[0], limits="none", posture={"hinge_2": float(free[0, 1] + step)})
    np.testing.assert_allclose(one.actuator_forces, answer.actuator_forces[0], atol=1e-7)
    assert f"hinge_2 at {free[0, 1] + step:.4g} as asked for" in " ".join(one.cautions)


def test_a_posture_stays_on_its_assembly_mode(motors):
    """There and back again is where it was; the posture of no posture is its own."""
    answer, free = motors.angles(POSES)
    _, back = motors.angles(POSES, {"hinge_2": free[:, 1]})
    np.testing.assert_allclose(back, free, atol=1e-9)
    q = answer.source.poses.placed.q
    away = motors.exo.reaction(POSES, limits="none", posture={"hinge_2": free[:, 1] + 0.4}).source.poses.placed.q
    # Whole configurations are postures, too.
    same = motors.exo.reaction(POSES, limits="none", posture=away)
    np.testing.assert_allclose(same.source.poses.placed.q, away, atol=1e-9)
    with pytest.raises(InvalidInput, match="closed configuration"):
        motors.exo.reaction(POSES, posture=away[::-1])
    np.testing.assert_allclose(motors.exo.reaction(POSES, limits="none", posture=q).actuator_forces,
                               answer.actuator_forces, atol=1e-7)  # fmt: skip


def test_a_posture_beyond_reach_is_out_of_reach(motors):
    answer = motors.exo.reaction(POSES[0], limits="none", posture={"hinge_2": 40.0})
    assert str(answer.status) in ("out_of_reach", "beyond_singular")
    assert not answer.held


def test_a_posture_is_said_with_the_values_that_all_poses_share(motors):
    """In the caption of an answer: joints with their values, those that differ by their names, or a configuration."""
    q = motors.exo.reaction(POSES, limits="none").source.poses.placed.q
    for posture, words in (
        ({"hinge_2": 0.25}, "hinge_2 at 0.25 as asked for (rad, m), reached from the straight turn with the arm held"),
        ({"hinge_2_deg": 10.0}, "hinge_2 at 0.1745 as asked for"),
        ({"hinge_2": [0.2, *[0.25] * (len(POSES) - 1)]}, "hinge_2 as asked for"),
        (q, "the configuration that was asked for"),
    ):
        answer = motors.exo.reaction(POSES, limits="none", posture=posture)
        assert any(words in text for text in answer.cautions), (words, answer.cautions)
    assert not any("asked for" in text for text in motors.exo.reaction(POSES, limits="none").cautions)


def test_what_is_no_posture(motors):
    for posture, error, words in (
        ({"knee": 0.1}, UnknownName, "hinge_1"),
        ({"hinge_1_mm": 0.1}, UnknownName, "hinge_1"),
        ({"hinge_1": 0.1, "hinge_1_deg": 3.0}, InvalidInput, "once"),
        ({"hinge_1": 0.1, "hinge_2": 0.2}, InvalidInput, "of 1 such freedom"),
        ({"hinge_1": [0.1, 0.2, 0.3]}, InvalidInput, "broadcast"),
        ({"hinge_1": np.nan}, InvalidInput, "finite"),
        ({}, InvalidInput, "empty"),
        (np.zeros(3), InvalidInput, "posture"),
    ):
        with pytest.raises(error, match=words):
            motors.exo.reaction(POSES, posture=posture)
    serial = ep.load(URDF / "serial-y-x-z.urdf").worn_by(ep.Wearer(1.75, 75.0, "male"))
    with pytest.raises(InvalidInput, match="no such freedom"):
        serial.reaction(serial.pose(30), posture={"flexion": 0.1})
    with pytest.raises(InvalidInput, match=r"no such freedom|of one coordinate"):
        ep.load("prototype").reaction(serial.pose(30), posture={"limb_1_slide": 0.1})


def test_the_range_over_postures_has_every_posture(motors):
    """Each of its ends is an answer in that posture, and no posture by name is beyond them."""
    spring = ep.device.Spring("strut", ep.device.LinearSpring(300.0, slack=0.05), route=ep.device.Route.over(
        ("arm", [0.1, 0.2, -0.1]), ("hinge_2_link", [0.1, 0.0, -0.2])
    ))  # fmt: skip
    device = motors.device.replace(springs=[spring])
    pose, assumed = POSES[0], ep.Assumptions(limits="none")
    found = ep.reaction.posture_range(device, ep.Case(pose), assumed)
    assert found.greatest > found.least + 1.0
    for size, q in ((found.least, found.at_least), (found.greatest, found.at_greatest)):
        there = ep.solve(device, ep.Case(pose, posture=q), assumed)
        assert float(there.magnitude) == pytest.approx(size, rel=1e-9)
    values = motors.angles(POSES)[1][0, 1] + np.linspace(-0.8, 0.8, 33)
    stack = Rotation.concatenate([pose] * len(values))
    sizes = ep.solve(device, ep.Case(stack, posture={"hinge_2": values}), assumed)
    inside = sizes.magnitude[sizes.has_answer]
    assert len(inside) > 10
    assert found.least <= inside.min() + 1e-6
    assert found.greatest >= inside.max() - 1e-6
    assert "joints that move while the arm rests" in str(found)


def test_the_range_over_a_link_that_hangs_on_the_arm():
    """A pendulum on the arm that no drive holds, drawn by a spring: held anywhere on its circle, in closed form."""
    build = Builder(np.random.default_rng(2))
    place, com, anchor, end = (np.array(v) for v in ([0.02, 0, -0.25], [0.1, 0, 0], [0.3, 0.2, 0.2], [0.12, 0, 0.03]))
    build.add(build.arm, pin.JointModelRY(), place, "pendulum", 0.5, com)
    build.hinges(3, [True] * 3)
    law = ep.device.LinearSpring(200.0, slack=0.05)
    way = ep.device.Route.over(("universe", anchor), ("pendulum_link", end))
    device = build.device().replace(springs=[ep.device.Spring("cord", law, route=way)])
    pose = POSES[0]
    found = ep.reaction.posture_range(device, ep.Case(pose), ep.Assumptions(limits="none"))
    angles = np.linspace(0.0, 2.0 * np.pi, 20_001)
    ends = pose.apply(place + Rotation.from_rotvec(angles[:, None] * [0.0, 1.0, 0.0]).apply(end))
    length = np.linalg.norm(anchor - ends, axis=1, keepdims=True)
    pull = 200.0 * (length - 0.05) * (anchor - ends) / length
    sizes = np.linalg.norm([0.0, 0.0, G * (device.arm.mass + 0.5)] - pull, axis=1)
    assert [found.least, found.greatest] == pytest.approx([sizes.min(), sizes.max()], rel=1e-5)
    assert sizes.max() > 1.2 * sizes.min()
    assert "pendulum held where no drive holds it" in found.rule
    # Where it hangs is one of them.
    hanging = ep.solve(device, ep.Case(pose), ep.Assumptions(limits="none"))
    assert found.least <= float(hanging.magnitude) <= found.greatest
    with pytest.raises(InvalidInput, match="empty stack"):
        ep.reaction.posture_range(device, ep.Case(POSES[:0]))


@pytest.mark.full
def test_the_range_of_a_stack_is_that_of_each_pose_and_of_a_soft_device_that_of_its_equilibria():
    build = Builder(np.random.default_rng(2))
    build.add(build.arm, pin.JointModelRY(), np.array([0.02, 0.0, -0.25]), "pendulum", 0.5, np.array([0.1, 0.0, 0.0]))
    build.hinges(3, [True] * 3)
    way = ep.device.Route.over(("universe", [0.3, 0.2, 0.2]), ("pendulum_link", [0.12, 0.0, 0.03]))
    cord = ep.device.Spring("cord", ep.device.LinearSpring(200.0, slack=0.05), route=way)
    device, plain = build.device().replace(springs=[cord]), ep.Assumptions(limits="none")
    loads = ep.Load([[0.0, 0.0, -10.0], [5.0, 0.0, 0.0]])
    case = ep.Case(POSES[:2], load=loads)
    found = ep.reaction.posture_range(device, case, plain)
    assert found.least.shape == found.held.shape == (2,)
    for k in range(2):
        one = ep.reaction.posture_range(device, ep.Case(POSES[k], load=ep.Load(loads.force[k])), plain)
        assert (float(one.least), float(one.greatest)) == (found.least[k], found.greatest[k])
        np.testing.assert_array_equal(one.at_least, found.at_least[k])
    soft = device.replace(interfaces=ep.Interfaces(harness=ep.Interface.upper_arm_cuff(0.1)))
    elastic = ep.Assumptions("elastic", "none")
    near = ep.reaction.posture_range(soft, replace(case.row(0), centre_offset=[0.003, 0.0, 0.002]), elastic)
    assert near.greatest > near.least + 0.1
    for size, q in ((near.least, near.at_least), (near.greatest, near.at_greatest)):
        there = replace(case.row(0), centre_offset=[0.003, 0.0, 0.002], posture=q)
        held = soft.replace(brakes=[ep.device.Brake("pendulum", "pendulum")])
        assert float(ep.solve(held, there, elastic).magnitude) == pytest.approx(float(size), rel=1e-6)


def test_other_doors_ask_in_the_posture_that_is_given(motors, tmp_path, capsys):
    from exo_pin.cli import main

    _, free = motors.angles(POSES)
    asked = {"hinge_2_deg": np.degrees(free[:, 1]) - 20.0}
    answer = motors.exo.reaction(POSES, limits="none", posture=asked)
    mapped = motors.exo.reaction_map(POSES, limits="none", posture=asked)
    np.testing.assert_allclose(mapped.actuator_forces, answer.actuator_forces, atol=1e-9)
    known = ("offset_mm", "pose_deg", "centre_of_mass_mm")
    uncertain = dict.fromkeys(known, 0.0) | {"mass_percent": 5.0}
    sure = motors.exo.uncertainty(POSES, limits="none", posture=asked, uncertainties=uncertain)
    np.testing.assert_allclose(sure.answer.actuator_forces, answer.actuator_forces[sure.at], atol=1e-9)
    space = motors.exo.workspace(POSES, ["stroke"], posture=asked)
    np.testing.assert_allclose(space.lengths, answer.source.poses.placed.coordinates, atol=1e-9)
    build = Builder(np.random.default_rng(0))
    build.hinges(4, [True] * 4)
    heavy = ep.ShoulderExo.from_device(build.device())
    path = tmp_path / "four.xml"
    heavy.export(path)
    value = float(np.degrees(motors.angles(heavy.pose(20.0))[1][0, 1])) - 10.0
    assert main(["reaction", str(path), "--limits", "none", "--flexion", "20", "--over-postures", "--posture",
                 f"hinge_2_deg={value}"]) == 0  # fmt: skip
    text = " ".join(capsys.readouterr().out.split())
    assert "Posture: hinge_2 at" in text
    assert "over all postures of joints that move while the arm rests" in text


@pytest.mark.full
def test_nearby_poses_and_the_wearers_muscles_are_asked_in_the_posture_too(motors):
    pose, (_, free) = POSES[0], motors.angles(POSES)
    asked = {"hinge_2": float(free[0, 1]) - 0.3}
    device = motors.device
    most = 0.9 * float(np.abs(motors.exo.reaction(pose, limits="none", posture=asked).actuator_forces).max())
    exo = ep.ShoulderExo.from_device(
        device.replace(drives=[replace(drive, lower=-most, upper=most) for drive in device.drives])
    )
    found = exo.remedy(pose, posture=asked)
    assert found.nearest.distance > 0.0
    assert exo.reaction(found.nearest.pose, posture=asked).held
    with pytest.raises(InvalidInput, match="configuration"):
        exo.remedy(pose, posture=np.zeros(3))
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    man = ep.Person(1.75, 75.0, "male")
    answer = motors.exo.reaction(pose, limits="none", posture=asked)
    one = motors.exo.joint_contact(pose, man, answer.actuator_forces, posture=asked, outside="mark")
    other = motors.exo.joint_contact(pose, man, answer, outside="mark")
    assert one.magnitude == pytest.approx(float(other.magnitude), rel=1e-6)
    elsewhere = motors.exo.joint_contact(pose, man, answer.actuator_forces, outside="mark")
    assert abs(float(elsewhere.magnitude) - float(one.magnitude)) > 1e-3
    with pytest.raises(InvalidInput, match="its own centre_offset, bounds and posture"):
        motors.exo.joint_contact(pose, man, answer, posture=asked)
