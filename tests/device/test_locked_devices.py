"""Devices that give way while their drives are locked: as their closed forms, and against a linear spring."""

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin.device import WristDevice

OFFSET = ep.CentreOffset([0.002, 0.0, 0.001], [0.0, 0.001, 0.0])
HAND = ep.Load([5.0, 3.0, -10.0], at=[0.0, 0.0, -0.3])
SHOULDER = ep.Shoulder(stiffness=1e5)
LOCKED = ep.Assumptions("elastic_locked", "none")


def wrist(count, kind="SPS", guide=None, **parts):
    four = ep.load("four-linear-actuators-worn")
    ends = (points[:count] for points in (four.geometry.base_points, four.geometry.platform_points))
    limbs = (ep.Limb(kind, actuator=own.actuator, stroke=own.stroke, guide=guide) for own in four.limbs[:count])
    return four.replace(geometry=ep.WristGeometry(*ends), limbs=tuple(limbs), **parts)


def soft_cuff(times):
    own = ep.Interface.upper_arm_cuff(0.19)
    return ep.Interface(times * own.stiffness, own.at)


WRISTS = {
    "shoulder": lambda: wrist(4, shoulder=SHOULDER),
    "cuff": lambda: wrist(4, interfaces=ep.Interfaces(cuff=soft_cuff(20.0))),
    "guides": lambda: wrist(3, "UPU", ep.LimbGuide(60.0, 40.0), shoulder=SHOULDER),
}


@pytest.mark.parametrize(
    "name", ["cuff", *(pytest.param(each, marks=pytest.mark.full) for each in ("shoulder", "guides"))]
)
def test_a_locked_wrist_is_its_locked_chain(name):
    exo = WRISTS[name]()
    case = ep.Case(exo.pose(40.0, 30.0, 10.0), load=HAND, centre_offset=OFFSET)
    one, other = (ep.solve(device, case, LOCKED) for device in (exo, WristDevice.of(exo.mechanism).as_chain()))
    assert one.status == other.status == "ok"
    np.testing.assert_allclose(other.actuator_forces, one.actuator_forces, atol=1e-8)
    np.testing.assert_allclose(other.shoulder_force, one.shoulder_force, atol=1e-8)
    np.testing.assert_allclose(other.arm_orientation, one.arm_orientation, atol=1e-12)
    np.testing.assert_allclose(other.centre_displacement, one.centre_displacement, atol=1e-12)
    # Both say as much of what equilibrium alone determines.
    first, second = (answer.certificate for answer in (one, other))
    assert first.undetermined == second.undetermined == {"guides": 3}.get(name, 1)
    for key in ("actuator_forces", "constraint_forces", "shoulder_force"):
        assert getattr(first, key).tolist() == getattr(second, key).tolist()
    # It is no held device: the arm turns, and four tensions are not those of least norm.
    held = ep.solve(exo, case, ep.Assumptions("elastic", "none"))
    assert np.abs(held.actuator_forces - one.actuator_forces).max() > 0.1
    assert np.abs(one.arm_orientation - case.poses.as_matrix()).max() > 1e-4


def test_an_arm_in_a_soft_cuff_on_locked_motors_turns_as_on_a_spring():
    """The motors hold the cuff, the ball holds the arm, and a light arm turns in the cuff by its linear stiffness."""
    cuff = ep.Interface.upper_arm_cuff(0.19)
    arm = ep.Arm(0.05, [0.02, 0.01, -0.3], 1e-3 * np.eye(3))
    exo = ep.load(URDF / "serial-y-x-z.urdf").replace(arm=arm, interfaces=ep.Interfaces(cuff=cuff))
    pose = exo.pose(50.0, 20.0)
    answer = exo.reaction(pose, split="elastic_locked", limits="none")
    r, K, R = cuff.at, cuff.stiffness, pose.as_matrix()
    cross = np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])
    weight = R.T @ [0.0, 0.0, -9.81 * arm.mass]
    # In the arm's axes: for a turn t of the arm the cuff moves against it by (r x t, -t).
    moved = np.vstack([cross, -np.eye(3)])
    of_force, of_moment = (K @ moved)[:3], (K @ moved)[3:]
    turn = np.linalg.solve(of_moment + cross @ of_force, -np.cross(arm.centre_of_mass, weight))
    force = -(weight + of_force @ turn)
    np.testing.assert_allclose(R.T @ answer.shoulder_force, force, rtol=5e-3, atol=1e-3)
    own = R.T @ answer.arm_orientation
    found = 0.5 * np.array([own[2, 1] - own[1, 2], own[0, 2] - own[2, 0], own[1, 0] - own[0, 1]])
    np.testing.assert_allclose(found, turn, rtol=5e-3, atol=1e-6)
    assert np.abs(force + weight).max() > 0.05
    # The motors bear the moment of the weight about their axes, as in a rigid device.
    rigid = exo.replace(interfaces=ep.Interfaces()).reaction(pose, limits="none")
    np.testing.assert_allclose(answer.actuator_forces, rigid.actuator_forces, rtol=2e-2, atol=2e-3)
