"""Values of idle joints that the user gives, against the closed form of motors in series through the shoulder."""

import numpy as np
import pinocchio as pin
import pytest
from idle_devices import Builder
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput

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
