"""Devices that give way against the wrist's own equations, and springs that may stand in each other's place."""

from dataclasses import replace

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin.device import ChainDevice, GuidedSlide, SoftLink

STIFFNESS = np.array([[20e3, 1e3, 0.0], [1e3, 30e3, 2e3], [0.0, 2e3, 25e3]])
HARNESS = ep.Interface.of([8e3, 9e3, 7e3], [300.0, 400.0, 200.0], (0.0, -0.1, 0.05))
CUFF = ep.Interface.upper_arm_cuff(0.15, times=3.0)
OFFSET = ep.CentreOffset([0.005, 0.01, -0.01], [0.0, 0.004, 0.002])
CASES = {
    "offset": {"centre_offset": OFFSET},
    "load": {"load": ep.Load((3.0, 2.0, -10.0), moment=(0.2, 0.1, -0.3), at=(0.0, 0.0, -0.3), frame="arm")},
    "motion": {"motion": ep.Motion([1.0, 2.0, 0.5], [3.0, -2.0, 1.0])},
}


def as_chain(exo):
    """The wrist as a chain with the same stiffness."""
    mechanism = exo.mechanism
    device = ChainDevice.from_chain(exo.chain, exo.side).replace(arm=exo.arm)
    pairs = zip(exo.chain.roles.limbs, mechanism.limbs, strict=True)
    slides = [GuidedSlide(role.slide, limb.guide) for role, limb in pairs if limb.kind == "UPU"]
    return device.replace(shoulder=mechanism.shoulder, interfaces=mechanism.interfaces, guided_slides=slides)


def soft_wrist(name, stiffness=STIFFNESS, **parts):
    return ep.load(name).replace(shoulder=ep.Shoulder(stiffness=stiffness), interfaces=ep.Interfaces(**parts))


def assert_same(one, other, tolerance=1e-9):
    scale = np.abs(one.limb_wrenches).max()
    assert (other.status == one.status).all()
    for name in ("shoulder_force", "cuff_wrench", "harness_wrench", "actuator_forces"):
        np.testing.assert_allclose(getattr(other, name), getattr(one, name), atol=tolerance * scale, err_msg=name)
    for name in ("interface_displacements", "centre_displacement"):
        np.testing.assert_allclose(getattr(other, name), getattr(one, name), atol=1e-10, err_msg=name)
    assert other.residual < 1e-9


@pytest.mark.parametrize(
    ("parts", "case"),
    [({}, "offset"), ({"harness": HARNESS}, "load"), ({"cuff": CUFF}, "motion"), ({"cuff": CUFF}, "offset")],
)
def test_a_soft_wrist_as_a_chain_has_its_own_answer(parts, case):
    exo = soft_wrist("four-linear-actuators", **parts)
    pose = exo.pose(20, 30, 10)
    one = exo.reaction(pose, split="elastic", limits="none", **CASES[case])
    assert_same(one, ep.solve(as_chain(exo), ep.Case(pose, **CASES[case]), ep.Assumptions("elastic", "none")))


TUBE = ep.LimbGuide(65.0, 50.0)
JOINTED = ep.LimbGuide(40.0, 30.0, joint_stiffness=2e5, joint_twist_stiffness=800.0)
GUIDED = [
    pytest.param("prototype", [TUBE] * 3, STIFFNESS, {}, id="prototype"),
    pytest.param("appendix-d", [JOINTED] * 3, None, {}, id="appendix-d-rigid-shoulder"),
    pytest.param("optimised-table-c-2", [TUBE, None, JOINTED], STIFFNESS, {"cuff": CUFF}, id="table-c-2-one-bare"),
    pytest.param("appendix-d", [None] * 3, None, {"harness": HARNESS, "cuff": CUFF}, id="appendix-d-bare"),
    pytest.param("scenario-one", [JOINTED] * 3, STIFFNESS, {}, id="scenario-one", marks=pytest.mark.full),
    pytest.param("optimised-table-5-3", [TUBE] * 3, None, {}, id="table-5-3", marks=pytest.mark.full),
    pytest.param("optimised-table-c-2", [TUBE] * 3, None, {"harness": HARNESS}, id="c-2", marks=pytest.mark.full),
]


@pytest.mark.parametrize(("name", "guides", "stiffness", "parts"), GUIDED)
def test_guides_bend_in_a_chain_as_in_the_wrist(name, guides, stiffness, parts):
    """The chain turns its universal joints and the ends of the guides itself; the wrist solves each limb alone."""
    exo = soft_wrist(name, stiffness, **parts).replace(limbs=[ep.Limb(guide=guide) for guide in guides])
    if exo.arm is None:
        exo = exo.replace(arm=ep.load("prototype").arm)
    pose = exo.pose(20, 30, 10)
    one = exo.reaction(pose, split="elastic", limits="none", **CASES["offset"])
    other = ep.solve(as_chain(exo), ep.Case(pose, **CASES["offset"]), ep.Assumptions("elastic", "none"))
    assert one.has_answer
    if any(guides):
        # The turns of the ends count: forces of straight guides are off by more than the tolerance.
        assert one.guide_bending.max() > 1e-4
        assert np.abs(one.constraint_forces).max() > 5.0
    scale = np.abs(one.limb_wrenches).max()
    for each in ("shoulder_force", "cuff_wrench", "harness_wrench", "actuator_forces"):
        np.testing.assert_allclose(getattr(other, each), getattr(one, each), atol=1e-9 * scale, err_msg=each)
    np.testing.assert_allclose(other.interface_displacements, one.interface_displacements, atol=1e-10)
    np.testing.assert_allclose(other.centre_displacement, one.centre_displacement, atol=1e-10)
    # Slides are at zero in the neutral pose.
    longer = one.limb_lengths - exo.inverse_kinematics(exo.geometry.neutral).lengths
    np.testing.assert_allclose(other.source.poses.lengths[0], longer, atol=1e-10)


@pytest.fixture(scope="module")
def serial():
    """The serial device on an arm that carries all weight itself."""
    exo = ep.load(URDF / "serial-y-x-z.urdf")
    arm = exo.arm
    return exo.replace(arm=ep.Arm(arm.mass, arm.centre_of_mass, arm.inertia))


def test_a_spring_does_the_same_in_the_cuff_and_in_the_link_that_turns_on_the_arm(serial):
    # The hinge between the two turns about the axis about which the spring is round.
    spring = ep.Interface.of([3000.0, 3000.0, 2000.0], [11.0, 11.0, 5.0], (0.0, 0.0, -0.19))
    pose, case = (
        serial.pose(40, 30, 20),
        {"split": "elastic", "centre_offset": ep.CentreOffset([0.005, 0.01, -0.01], np.zeros(3))},
    )
    in_cuff = serial.replace(interfaces=ep.Interfaces(cuff=spring)).reaction(pose, **case)
    place = serial.chain.placement(serial.chain.neutral(), "link_2").translation
    at_link = ep.Interface.of([3000.0, 3000.0, 2000.0], [11.0, 11.0, 5.0], spring.at - place)
    soft = serial.replace(soft_links=[SoftLink("link_2", at_link)])
    in_link = soft.reaction(pose, **case)
    assert in_link.certificate.undetermined == in_cuff.certificate.undetermined == 3
    np.testing.assert_allclose(in_link.shoulder_force, in_cuff.shoulder_force, atol=1e-7)
    np.testing.assert_allclose(in_link.actuator_forces, in_cuff.actuator_forces, atol=1e-7)


def test_a_rigid_device_in_line_with_a_soft_shoulder_carries_the_arm_alone(serial):
    soft = serial.replace(shoulder=ep.Shoulder(stiffness=2e4))
    answer = soft.reaction(soft.pose(40, 30), split="elastic")
    assert answer.status == "ok"
    np.testing.assert_allclose(answer.shoulder_force, 0.0, atol=1e-9)
    np.testing.assert_allclose(answer.cuff_wrench[:3], [0.0, 0.0, 9.81 * serial.arm.mass], atol=1e-9)
    assert (answer.centre_displacement == 0.0).all()


def test_points_of_springs_are_counted_from_the_shoulder_wherever_the_world_has_it(serial):
    away = np.array([0.3, -0.2, 1.4])
    model, description = serial.chain.model.copy(), serial.chain.description
    placement = model.jointPlacements[serial.device.arm_index]
    placement.translation = placement.translation + away
    (loop,) = description.closures
    end = replace(loop.placement_b, translation=tuple((np.array(loop.placement_b.translation) + away).tolist()))
    chain = ep.ClosedChain(model, replace(description, closures=(replace(loop, placement_b=end),), shapes=()))
    parts = {"interfaces": ep.Interfaces(HARNESS, CUFF), "shoulder": ep.Shoulder(stiffness=STIFFNESS)}
    pose, case = serial.pose(50, 40, 10), {"split": "elastic", "centre_offset": OFFSET}
    here = serial.replace(**parts).reaction(pose, **case)
    there = serial.replace(chain=chain, **parts).reaction(pose, **case)
    assert np.linalg.norm(here.interface_displacements[0, :3]) > 1e-3
    for name in ("shoulder_force", "cuff_wrench", "harness_wrench", "actuator_forces"):
        np.testing.assert_allclose(getattr(there, name), getattr(here, name), atol=1e-8, err_msg=name)
    np.testing.assert_allclose(there.interface_displacements, here.interface_displacements, atol=1e-10)
