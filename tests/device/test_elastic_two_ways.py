"""Devices that give way against the wrist's own equations, and springs that may stand in each other's place."""

from dataclasses import replace

import numpy as np
import pytest
from mechanisms import random_wrist
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


@pytest.mark.parametrize("part", ["harness", "cuff"])
def test_a_wrist_with_a_rigid_shoulder_has_the_answer_of_its_chain(part):
    exo = soft_wrist("four-linear-actuators", None, **{part: {"harness": HARNESS, "cuff": CUFF}[part]})
    case = ep.Case(exo.pose(20, 30, 10), **CASES["load"], **CASES["offset"])
    ways = [ep.solve(device, case, ep.Assumptions("elastic", "none")) for device in (exo, as_chain(exo))]
    assert_same(*ways)
    other = {"harness": "cuff", "cuff": "harness"}[part]
    for answer in ways:
        assert (answer.centre_displacement == 0.0).all()
        assert np.linalg.norm(answer.shoulder_force) > 1.0
        named = [text for text in answer.cautions if text.startswith("Taken as rigid")]
        assert named == [f"Taken as rigid, because no stiffness is given: shoulder and {other}."]


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


def test_guided_slides_come_back_from_a_device_file(tmp_path):
    exo = soft_wrist("prototype").replace(limbs=[ep.Limb(guide=guide) for guide in (TUBE, None, JOINTED)])
    device = as_chain(exo)
    ep.ShoulderExo.from_device(device).save(tmp_path / "mine.toml")
    again = ep.load(tmp_path / "mine.toml").chain_device
    assert again.guided_slides == device.guided_slides
    assert [part.guide for part in again.guided_slides] == [TUBE, None, JOINTED]


def test_a_guided_slide_is_that_of_a_limb():
    device = as_chain(soft_wrist("prototype"))
    for slide, error in (("limb_1_base_x", ep.InvalidInput), ("limb_9_slide", ep.UnknownName)):
        with pytest.raises(error):
            ep.solve(
                device.replace(guided_slides=[GuidedSlide(slide, TUBE)]),
                ep.Case(ep.load("prototype").pose(20)),
                ep.Assumptions("elastic", "none"),
            )
    with pytest.raises(ep.InvalidInput, match="one guide"):
        ep.solve(
            device.replace(guided_slides=[GuidedSlide("limb_1_slide", TUBE)] * 2),
            ep.Case(ep.load("prototype").pose(20)),
            ep.Assumptions("elastic", "none"),
        )
    spring = SoftLink("limb_1_base_body", ep.Interface.of(1e5, 1e3))
    with pytest.raises(ep.InvalidInput, match="guide or a spring"):
        ep.solve(
            device.replace(guided_slides=[GuidedSlide("limb_1_slide", TUBE)], soft_links=[spring]),
            ep.Case(ep.load("prototype").pose(20)),
            ep.Assumptions("elastic", "none"),
        )
    for slide, guide in (("", TUBE), (3, None), ("limb_1_slide", 5.0)):
        with pytest.raises(ep.InvalidInput):
            GuidedSlide(slide, guide)


def test_what_has_no_stiffness_at_all_has_no_elastic_answer():
    exo = soft_wrist("four-linear-actuators", None)
    case = ep.Case(exo.pose(20, 30))
    for device in (exo, as_chain(exo)):
        with pytest.raises(ep.MissingData, match="shoulder stiffness"):
            ep.solve(device, case, ep.Assumptions("elastic", "none"))


@pytest.mark.full
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("kinds", ["SSS", "SSSSS"])
def test_a_random_soft_wrist_with_heavy_limbs_has_its_own_answer(kinds, case):
    mechanism = random_wrist(7, kinds, with_masses=True).replace(
        shoulder=ep.Shoulder(stiffness=STIFFNESS), interfaces=ep.Interfaces(HARNESS, CUFF)
    )
    exo = ep.ShoulderExo.from_mechanism(mechanism.replace(limbs=[limb.without_spin() for limb in mechanism.limbs]))
    pose = exo.pose(10, 15, 5)
    one = exo.reaction(pose, split="elastic", limits="none", **CASES[case])
    assert_same(one, ep.solve(as_chain(exo), ep.Case(pose, **CASES[case]), ep.Assumptions("elastic", "none")))


def test_efforts_within_limits_are_chosen_at_the_geometry_to_which_they_lead():
    exo = soft_wrist("four-cables", cuff=CUFF)
    pose = exo.pose(20, 30)
    one = exo.reaction(pose, split="elastic", limits=(5.0, 400.0))
    other = ep.solve(as_chain(exo), ep.Case(pose), ep.Assumptions("elastic", (5.0, 400.0)))
    assert one.actuator_forces.min() == pytest.approx(5.0)
    assert_same(one, other, 1e-8)


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


@pytest.mark.full
def test_the_twist_of_a_soft_limb_is_that_of_its_guide():
    guide, offset = ep.LimbGuide(1e9, 50.0), [0.0, 0.004, 0.004]
    exo = ep.load("prototype").replace(limbs=[ep.Limb(guide=guide)] * 3, shoulder=ep.Shoulder(stiffness=20e3))
    pose = exo.pose(30, 30)
    own = exo.reaction(pose, split="elastic", centre_offset=offset, limits="none")
    chain, missing = exo.chain, []
    for stiff in (1e5, 1e6):
        links = []
        for limb, length in enumerate(own.limb_lengths, start=1):
            slide = chain.model.joints[chain.model.getJointId(f"limb_{limb}_slide")]
            data = slide.createData()
            slide.calc(data, np.zeros(1))
            along = np.array(data.S).reshape(6)[:3]
            twist = (50.0 / length - stiff) * np.outer(along, along) + stiff * np.eye(3)
            links.append(SoftLink(f"limb_{limb}_base_body", ep.Interface(_blocks(stiff * np.eye(3), twist))))
        soft = as_chain(exo).replace(soft_links=links, guided_slides=())
        answer = ep.solve(soft, ep.Case(pose, centre_offset=offset), ep.Assumptions("elastic", "none"))
        missing.append(float(np.linalg.norm(answer.shoulder_force - own.shoulder_force)))
    assert np.linalg.norm(own.shoulder_force - own.spherical_force) > 1.0
    assert missing[1] < 0.15 * missing[0] < 1.0


def _blocks(one, other):
    return np.block([[one, np.zeros((3, 3))], [np.zeros((3, 3)), other]])


def test_a_link_that_gives_way_is_one_of_the_device(serial):
    spring = ep.Interface.of(1e3, 10.0)
    for link, words in (("arm", "part of the arm"), ("cuff", "part of the arm"), ("universe", "part of the torso")):
        with pytest.raises(ep.InvalidInput, match=words):
            serial.replace(soft_links=[SoftLink(link, spring)])
    with pytest.raises(ep.InvalidInput, match="one body"):
        serial.replace(soft_links=[SoftLink("link_1", spring), SoftLink("link_1", spring)])
    with pytest.raises(ep.UnknownName):
        serial.replace(soft_links=[SoftLink("elbow", spring)])
    for link, own in ((5, spring), ("", spring), ("link_1", None)):
        with pytest.raises(ep.InvalidInput):
            SoftLink(link, own)
    with pytest.raises(ep.InvalidInput, match="interfaces"):
        serial.replace(interfaces=3)


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
