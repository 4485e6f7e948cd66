"""Bodies of a chain as formats need them: kinds of joints, names of links and joints without a place in a format."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest

from exo_pin import InvalidInput
from exo_pin.chain import ClosedChain, Closure, Closures, Placement
from exo_pin.chain.formats.bodies import (
    add_frame,
    add_joint,
    axis_joint,
    free_name,
    joined_bodies,
    link_frames,
    loose_ends,
    one_sided,
    refuse_massless,
    tree_bodies,
    world_link,
)
from exo_pin.chain.formats.mjcf.mjcf_writing import mjcf_text
from exo_pin.chain.formats.sdf.sdf_writing import sdf_text

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


@pytest.mark.parametrize(("mass", "moments", "joined"), [
    (0.0, (0.0, 0.0, 0.0), True), (0.0, (0.0, 0.0, 1e-3), False), (0.0, (1e-3, 1e-3, 1e-3), False),
    (1.0, (0.0, 0.0, 0.0), False), (1e-9, (0.0, 0.0, 0.0), False),
])  # fmt: skip
def test_a_body_with_mass_or_with_a_moment_is_one(mass, moments, joined):
    chain = chain_of(pin.JointModelRX(), pin.JointModelRY())
    bodies = tree_bodies(chain._state)
    first = replace(bodies[0], inertia=SimpleNamespace(mass=mass, inertia=np.diag(moments)))
    assert len(joined_bodies([first, bodies[1]], set())) == (1 if joined else 2)


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


def square(masses, closures):
    """Two hinges on the world with a hinge on each: bodies 1 and 2, then 3 and 4."""
    model = pin.Model()
    for k, parent in enumerate((0, 1, 0, 3)):
        place = pin.SE3(np.eye(3), np.array([0.0, 0.1 * k, 0.2]))
        model.addJoint(parent, pin.JointModelRX(), place, f"joint_{k}")
        mass = masses[k]
        inertia = pin.Inertia(mass, np.zeros(3), mass * np.eye(3)) if mass else pin.Inertia.Zero()
        model.appendBodyToJoint(k + 1, inertia, pin.SE3.Identity())
        model.addFrame(pin.Frame(f"link_{k}", k + 1, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    made = tuple(Closure(f"c{k}", kind, a, b) for k, (kind, a, b) in enumerate(closures))
    return ClosedChain(model, Closures("square", closures=made))


LIGHT_ENDS = (1.0, 0.0, 1.0, 0.0)


@pytest.mark.parametrize(
    ("masses", "closures", "ends"),
    [
        # The end of the second hinge is the body that it is welded to, whichever way round.
        (LIGHT_ENDS, [("rigid", "link_1", "link_2")], {2: (0, 3)}),
        (LIGHT_ENDS, [("rigid", "link_2", "link_1")], {2: (0, 3)}),
        # A ball is no weld, the world is no body, and two welds hold more than one joint.
        (LIGHT_ENDS, [("spherical", "link_1", "link_2")], {}), (LIGHT_ENDS, [("rigid", "link_1", "universe")], {}),
        (LIGHT_ENDS, [("rigid", "link_1", "link_2"), ("rigid", "link_1", "link_0")], {}), (LIGHT_ENDS, [], {}),
        # With mass, or with a body on it, it is a body of its own.
        ((1.0, 1.0, 1.0, 1.0), [("rigid", "link_1", "link_2")], {}),
        ((0.0, 1.0, 1.0, 1.0), [("rigid", "link_0", "link_2")], {}),
        # Of two ends that are welded to each other one is left.
        (LIGHT_ENDS, [("rigid", "link_1", "link_3")], {2: (0, 4)}),
        (LIGHT_ENDS, [("rigid", "link_1", "link_2"), ("rigid", "link_3", "link_0")], {2: (0, 3), 4: (1, 1)}),
        (
            LIGHT_ENDS,
            [("spherical", "link_0", "universe"), ("rigid", "link_1", "link_2"), ("rigid", "link_3", "link_0")],
            {2: (1, 3), 4: (2, 1)},
        ),
    ],
)  # fmt: skip
def test_a_massless_end_that_is_welded_to_a_body_is_that_body(masses, closures, ends):
    chain = square(masses, closures)
    assert loose_ends(chain._state, tree_bodies(chain._state)) == ends


@pytest.mark.parametrize("closures", [[("rigid", "link_1", "link_3")], [
    ("spherical", "link_0", "universe"), ("rigid", "link_1", "link_2"), ("rigid", "link_3", "link_0")
]])  # fmt: skip
def test_loops_that_massless_ends_close_come_back(closures):
    chain, made = square(LIGHT_ENDS, closures), []
    q = chain.neutral()
    for closure in chain.closures:
        place = chain.placement(q, closure.frame_b).actInv(chain.placement(q, closure.frame_a))
        made.append(replace(closure, placement_b=Placement(tuple(place.translation.tolist()))))
    chain = ClosedChain(chain.model, Closures("square", closures=tuple(made)))
    freedoms = chain.mobility(q, actuated=()).degrees_of_freedom
    again = ClosedChain.from_sdf(sdf_text(chain._state, q))
    assert again.mobility(again.neutral(), actuated=()).degrees_of_freedom == freedoms == (1 if len(made) == 1 else 0)
    if len(made) == 1:
        # Neither end has mass to share.
        with pytest.raises(InvalidInput, match="needs mass for every body; link_3 has none"):
            mjcf_text(chain._state, q)
        return
    again = ClosedChain.from_mjcf(mjcf_text(chain._state, q))
    assert again.mobility(again.neutral(), actuated=()).degrees_of_freedom == freedoms


def test_bodies_without_mass_are_named():
    bodies = tree_bodies(square((1.0, 0.0, 0.5, 0.0), [])._state)
    refuse_massless([bodies[0], bodies[2]], "Engine")
    with pytest.raises(InvalidInput, match="Engine needs mass for every body; link_1, link_3 have none"):
        refuse_massless(bodies, "Engine")
    with pytest.raises(InvalidInput, match="every body; link_1 has none"):
        refuse_massless(bodies[:3], "Engine")


def test_a_joint_is_added_with_its_frame_and_both_limits_of_velocity():
    model = pin.Model()
    values = (-1.0, 1.0, -2.0, 3.0, -4.0, 5.0, -6.0, 6.0, 7.0)
    for k, parent in enumerate((0, 1, 0)):
        index = add_joint(
            model, parent, pin.JointModelRX(), pin.SE3.Identity(), f"j{k}", *(np.array([x]) for x in values)
        )
        assert index == k + 1
        add_frame(model, f"site{k}", index, pin.SE3.Identity(), pin.FrameType.OP_FRAME)
    add_frame(model, "ground", 0, pin.SE3.Identity(), pin.FrameType.BODY)
    names = ("lowerEffort", "upperEffort", "lowerVelocity", "upperVelocity", "lowerPosition", "upperPosition")
    for name, value in zip((*names, "lowerDryFriction", "upperDryFriction"), values, strict=False):
        np.testing.assert_array_equal(getattr(model, f"{name}Limit"), [value] * 3)
    np.testing.assert_array_equal(model.damping, [7.0] * 3)
    rng = np.random.default_rng(2)
    for joint in (1, 2, 3):
        body = pin.Inertia(rng.uniform(), rng.normal(size=3), np.diag([0.3, 0.4, 0.5]))
        model.appendBodyToJoint(joint, body, pin.SE3(np.eye(3), rng.normal(size=3)))
    before = [inertia.copy() for inertia in model.inertias]
    for joint in (1, 2, 3):
        add_frame(
            model, f"mark{joint}", joint, pin.SE3.Identity(), pin.FrameType.OP_FRAME
        ).inertia = pin.Inertia.Random()
    assert list(model.inertias) == before
    above = {frame.name: model.frames[frame.parentFrame].name for frame in list(model.frames)[1:]}
    assert above == {
        "j0": "universe", "j1": "j0", "j2": "universe",
        "mark1": "j0", "mark2": "j1", "mark3": "j2", "site0": "j0", "site1": "j1", "site2": "j2", "ground": "universe",
    }  # fmt: skip
