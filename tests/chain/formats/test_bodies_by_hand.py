"""Bodies of a chain as formats need them: kinds of joints, names of links and joints without a place in a format."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from exo_pin.chain import ClosedChain, Closures
from exo_pin.chain.formats.bodies import (
    axis_joint,
    free_name,
    joined_bodies,
    link_frames,
    one_sided,
    tree_bodies,
    world_link,
)
from exo_pin.core.errors import InvalidInput

pytestmark = pytest.mark.usefixtures("plain")

KINDS = {
    "hinge": pin.JointModelRevoluteUnaligned(np.array([0.6, 0.0, 0.8])),
    "slide": pin.JointModelPrismaticUnaligned(np.array([0.6, 0.8, 0.0])),
    "ball": pin.JointModelSpherical(),
    "free": pin.JointModelFreeFlyer(),
    "translation": pin.JointModelTranslation(),
    "planar": pin.JointModelPlanar(),
}


def chain_of(*joints, masses=None):
    model = pin.Model()
    for k, joint in enumerate(joints):
        model.addJoint(k, joint, pin.SE3(np.eye(3), np.array([0.0, 0.1 * k, 0.2])), f"joint_{k}")
        mass = 1.0 if masses is None else masses[k]
        inertia = pin.Inertia(mass, np.zeros(3), mass * np.eye(3)) if mass else pin.Inertia.Zero()
        model.appendBodyToJoint(k + 1, inertia, pin.SE3.Identity())
        model.addFrame(pin.Frame(f"link_{k}", k + 1, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    return ClosedChain(model, Closures("bodies"))


@pytest.mark.parametrize("kind", KINDS)
def test_kinds_and_axes_of_joints(kind):
    (body,) = tree_bodies(chain_of(KINDS[kind])._state)
    assert (body.kind, body.name, body.joint, body.index, body.parent) == (kind, "link_0", "joint_0", 1, 0)
    axis = {"hinge": [0.6, 0.0, 0.8], "slide": [0.6, 0.8, 0.0]}.get(kind)
    assert (body.axis is None) == (axis is None)
    if axis is not None:
        np.testing.assert_allclose(body.axis, axis)
    assert body.limits is None


@pytest.mark.parametrize(
    "screw", [pin.JointModelHZ(0.1), pin.JointModelHelicalUnaligned(np.array([0.6, 0.0, 0.8]), 0.1)]
)
def test_a_screw_is_neither_hinge_nor_slide(screw):
    with pytest.raises(InvalidInput, match=r"joint 'joint_0' .* cannot be written"):
        tree_bodies(chain_of(screw)._state)


def test_a_joint_of_two_hinges_is_none_of_them():
    cross = pin.JointModelUniversal(np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    with pytest.raises(InvalidInput, match=r"joint 'joint_0' \(JointModelUniversal\) cannot be written"):
        tree_bodies(chain_of(cross)._state)


def test_what_a_format_cannot_hold_is_refused_by_name():
    model = chain_of(pin.JointModelRX()).model
    model.damping, model.armature = np.array([1.0]), np.array([2.0])
    (body,) = tree_bodies(ClosedChain(model, Closures("rough"))._state)
    body.refuse("X", but=("damping", "armature"))
    body.refuse("X", ("friction", "spring"))
    body.refuse("X", ("damping", "friction"), ("damping",))
    for what, but, named in (
        (None, (), "damping and armature"), (None, ("damping",), "armature"), (("damping", "spring"), (), "damping"),
    ):  # fmt: skip
        with pytest.raises(InvalidInput, match=f"X cannot hold the {named} of joint 'joint_0'"):
            body.refuse("X", what, but)


def test_the_link_of_a_joint_is_the_first_in_its_frame():
    model = pin.Model()
    model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "one")
    model.addJoint(1, pin.JointModelRX(), pin.SE3.Identity(), "two")
    off = pin.SE3(np.eye(3), np.array([1e-3, 0.0, 0.0]))
    for name, joint, place, kind in (
        ("site", 1, pin.SE3.Identity(), pin.FrameType.OP_FRAME), ("off", 1, off, pin.FrameType.BODY),
        ("own", 1, pin.SE3.Identity(), pin.FrameType.BODY), ("more", 1, pin.SE3.Identity(), pin.FrameType.BODY),
        ("far", 2, off, pin.FrameType.BODY), ("farther", 2, off * off, pin.FrameType.BODY),
        ("ground", 0, pin.SE3.Identity(), pin.FrameType.BODY),
    ):  # fmt: skip
        model.addFrame(pin.Frame(name, joint, 0, place, kind))
    assert {joint: frame.name for joint, frame in link_frames(model).items()} == {1: "own", 2: "far"}
    # A body without a link in its joint's frame is called after the joint.
    assert [body.name for body in tree_bodies(ClosedChain(model, Closures("links"))._state)] == ["own", "two"]


@pytest.mark.parametrize(
    ("efforts", "said"),
    [((-5.0, 5.0), ""), ((-5.0, 2.0), "j -5 to 2 N"), ((-np.inf, 0.0), "j -inf to 0 N"), ((-np.inf, np.inf), "")],
)
def test_limits_of_effort_that_are_written_wider_are_said(efforts, said):
    model = chain_of(pin.JointModelPX()).model
    model.lowerEffortLimit, model.upperEffortLimit = np.array(efforts[:1]), np.array(efforts[1:])
    (body,) = tree_bodies(ClosedChain(model, Closures("limb"))._state)
    limb = replace(body, joint="j", is_limb=True)
    expected = f"Limits of effort are for both directions here, and really: {said}." if said else ""
    assert one_sided([limb]) == expected
    assert one_sided([body]) == one_sided([]) == ""


@pytest.mark.parametrize(("low", "high"), [(-1.0, np.inf), (-np.inf, 2.0), (-0.5, 0.5)])
def test_a_limit_on_one_side_is_one(low, high):
    chain = chain_of(pin.JointModelRX())
    chain.model.lowerPositionLimit, chain.model.upperPositionLimit = np.array([low]), np.array([high])
    assert tree_bodies(chain._state)[0].limits == (low, high)


def test_an_endless_hinge_has_no_limits():
    assert tree_bodies(chain_of(pin.JointModelRUBZ())._state)[0].limits is None


@pytest.mark.parametrize(("masses", "held", "before"), [
    ((0.0, 0.0, 1.0), (), {3: ["joint_0", "joint_1"]}),
    ((1.0, 0.0, 1.0), (), {1: [], 3: ["joint_1"]}),
    ((0.0, 0.0, 1.0), (2,), {2: ["joint_0"], 3: []}),
    ((1.0, 1.0, 0.0), (), {1: [], 2: [], 3: []}),
])  # fmt: skip
def test_hinges_of_massless_bodies_are_on_the_next_with_mass(masses, held, before):
    chain = chain_of(pin.JointModelRX(), pin.JointModelRY(), pin.JointModelRZ(), masses=masses)
    found = joined_bodies(tree_bodies(chain._state), set(held))
    assert {each.body.index: [joint.joint for joint, _ in each.before] for each in found} == before
    data = chain.model.createData()
    pin.forwardKinematics(chain.model, data, np.zeros(3))
    for each in found:
        here = data.oMi[each.parent].actInv(data.oMi[each.body.index])
        np.testing.assert_allclose(each.placement.homogeneous, here.homogeneous, atol=1e-15)
        for joint, place in each.before:
            there = data.oMi[each.body.index].actInv(data.oMi[joint.index])
            np.testing.assert_allclose(place.homogeneous, there.homogeneous, atol=1e-15)


@pytest.mark.parametrize(
    "axis", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.6, 0.0, 0.8), (1.0, 1e-17, 0.0)]
)
@pytest.mark.parametrize("slides", [True, False])
def test_joints_along_an_axis(axis, slides):
    joint, model = axis_joint(slides, np.array(axis)), pin.Model()
    model.addJoint(0, joint, pin.SE3.Identity(), "joint")
    data = model.createData()
    pin.forwardKinematics(model, data, np.array([0.4]))
    moved = pin.exp6(np.concatenate([axis, np.zeros(3)] if slides else [np.zeros(3), axis]) * 0.4)
    np.testing.assert_allclose(data.oMi[1].homogeneous, moved.homogeneous, atol=1e-15)
    assert ("Unaligned" in joint.shortname()) == (np.count_nonzero(axis) > 1 or min(axis) < 0.0)


def test_names_are_lengthened_until_they_are_free():
    taken = {"a", "a_"}
    assert [free_name("a", taken), free_name("b", taken), free_name("b", taken, "_x")] == ["a__", "b", "b_x"]
    assert taken == {"a", "a_", "a__", "b", "b_x"}


def test_the_link_of_the_world_is_one_in_its_frame():
    model = chain_of(pin.JointModelRX()).model
    moved = pin.SE3(np.eye(3), np.array([0.0, 0.0, 1.0]))
    assert world_link(ClosedChain(model, Closures("none"))._state) == "ground"
    model.addFrame(pin.Frame("table", 0, 0, moved, pin.FrameType.BODY))
    model.addFrame(pin.Frame("mark", 0, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    assert world_link(ClosedChain(model, Closures("none"))._state) == "ground"
    model.addFrame(pin.Frame("floor", 0, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    assert world_link(ClosedChain(model, Closures("none"))._state) == "floor"
