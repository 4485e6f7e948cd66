"""The edges of what is read of SDF: which joints close a loop, limits, axes, frames, numbers of the geometry."""

import math

import numpy as np
import pinocchio as pin
import pytest

from exo_pin import FileFormatError
from exo_pin.chain import ClosedChain, Closures

INF = np.inf
FREEDOMS = {"revolute": 1, "prismatic": 1, "continuous": 1, "universal": 2, "revolute2": 2, "ball": 3}
SAME = {"continuous": "revolute", "revolute2": "universal", "ball": "spherical"}


def joint(name, kind, axis="", parent="world", child="b", place=""):
    axes = f"<axis>{axis}<xyz>1 0 0</xyz></axis>" if kind != "ball" else ""
    axes += "<axis2><xyz>0 1 0</xyz></axis2>" if FREEDOMS[kind] == 2 else ""
    return f'<joint name="{name}" type="{kind}">{place}<parent>{parent}</parent><child>{child}</child>{axes}</joint>'


def model(*joints, links='<link name="b"/>'):
    return f'<sdf version="1.11"><model name="m">{links}{"".join(joints)}</model></sdf>'


@pytest.mark.parametrize("second", FREEDOMS)
@pytest.mark.parametrize("first", FREEDOMS)
def test_of_two_joints_that_close_a_loop_the_one_with_fewer_freedoms_is_in_the_tree(first, second):
    chain = ClosedChain.from_sdf(model(joint("one", first), joint("two", second)))
    (closure,) = chain.closures
    kept, closing = ("two", "one") if FREEDOMS[second] < FREEDOMS[first] else ("one", "two")
    kind = {"one": first, "two": second}[closing]
    assert (closure.name, closure.type) == (closing, SAME.get(kind, kind))
    assert (closure.frame_a, closure.frame_b) == ("b", "universe")
    freedoms = FREEDOMS[{"one": first, "two": second}[kept]]
    assert chain.model.nv == freedoms
    # Hinges and slides are driven, and no axis of a cross.
    assert chain.roles.actuated == ((kept,) if freedoms == 1 else ())
    assert len(chain.residual(chain.neutral())) == 6 - FREEDOMS[kind]
    np.testing.assert_allclose(chain.residual(chain.neutral()), 0.0, atol=1e-15)


@pytest.mark.parametrize("first", ["one", "two", "three"])
def test_a_joint_that_is_asked_for_is_in_the_tree_before_all_others(first):
    limited = "<limit><upper>1</upper></limit>"
    text = model(joint("one", "ball"), joint("two", "revolute", limited), joint("three", "revolute"))
    chain = ClosedChain.from_sdf(text, first_joint=first)
    assert set(chain.model.names) == {"universe", "two", first}
    # The others close loops, that with a limit by an end of its own.
    left = [f"{name}_closure" if name == "two" else name for name in ("one", "two", "three") if name != first]
    assert [closure.name for closure in chain.closures] == left
    np.testing.assert_allclose(chain.residual(chain.neutral()), 0.0, atol=1e-15)
    with pytest.raises(FileFormatError, match="unknown first joint of the tree 'four'"):
        ClosedChain.from_sdf(text, first_joint="four")


@pytest.mark.parametrize(
    "axis",
    [
        "<limit><lower>-1</lower></limit>", "<limit><upper>1</upper></limit>", "<limit><velocity>3</velocity></limit>",
        "<limit><effort>0.5</effort></limit>", "<dynamics><damping>1</damping></dynamics>",
        "<dynamics><friction>1</friction></dynamics>", "<dynamics><spring_stiffness>1</spring_stiffness></dynamics>",
    ],
)  # fmt: skip
def test_a_joint_with_data_is_in_the_tree_before_one_without(axis):
    chain = ClosedChain.from_sdf(model(joint("bare", "revolute"), joint("rich", "universal", axis)))
    assert list(chain.model.names)[1:] == ["rich_axis", "rich_axis2"]
    assert [closure.name for closure in chain.closures] == ["bare"]
    # With data in both, what closes the loop is a joint of the tree on an end without mass.
    both = ClosedChain.from_sdf(model(joint("one", "revolute", axis), joint("two", "universal", axis)))
    assert sorted(both.model.names) == ["one", "two_axis", "two_axis2", "universe"]
    assert [(closure.name, closure.type, closure.frame_b) for closure in both.closures] == [
        ("two_closure", "rigid", "two_end")
    ]
    np.testing.assert_allclose(both.residual(both.neutral()), 0.0, atol=1e-15)
    for each in (chain, both):
        assert_frames_hang_on_their_joints(each.model)


@pytest.mark.parametrize(
    "axis", ["<limit><effort>0</effort></limit>", "<limit><lower>-inf</lower><upper>1e16</upper></limit>"]
)
def test_a_joint_without_strength_or_end_is_bare(axis):
    chain = ClosedChain.from_sdf(model(joint("rich", "revolute", axis), joint("bare", "revolute")))
    assert [closure.name for closure in chain.closures] == ["bare"]
    other = ClosedChain.from_sdf(model(joint("bare", "revolute"), joint("rich", "revolute", axis)))
    assert [closure.name for closure in other.closures] == ["rich"]


def assert_frames_hang_on_their_joints(model):
    """As in a tree that Pinocchio reads itself."""
    for frame in list(model.frames)[1:]:
        above = model.frames[frame.parentFrame].parentJoint
        if frame.type == pin.FrameType.JOINT:
            assert above == model.parents[frame.parentJoint], frame.name
        else:
            assert above == frame.parentJoint, frame.name


@pytest.mark.parametrize(("angle", "is_closure"), [(0.5 * np.pi, True), (0.5 * np.pi + 1e-6, False), (1.0, False)])
def test_a_cross_closes_a_loop_if_its_axes_are_at_right_angles(angle, is_closure):
    """A universal closure holds its axes at right angles; others are two hinges with an end of their own."""
    cross = joint("two", "universal").replace("0 1 0", f"{math.cos(angle)!r} {math.sin(angle)!r} 0")
    chain = ClosedChain.from_sdf(model(joint("one", "revolute"), cross))
    (closure,) = chain.closures
    assert (closure.type, closure.name) == (("universal", "two") if is_closure else ("rigid", "two_closure"))
    # The hinge about x turns in the cross, whose first axis is the same.
    q = chain.neutral()
    assert chain.mobility(q, actuated=()).degrees_of_freedom == 1
    turned = chain.close(pin.integrate(chain.model, q, np.full(chain.model.nv, 0.3)))
    assert np.abs(turned[chain.configuration_slice("one")])[0] > 0.05


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ("", None), ("<lower>-inf</lower><upper>inf</upper>", None), ("<lower>-1e16</lower><upper>1e17</upper>", None),
        ("<effort>1</effort><velocity>2</velocity>", None), ("<lower>-1</lower>", "no limits"),
        ("<upper>1</upper>", "no limits"), ("<lower>-inf</lower><upper>1</upper>", "no limits"),
        ("<lower>-1</lower><upper>inf</upper>", "no limits"), ("<lower>-1</lower><upper>1</upper>", "no limits"),
    ],
)  # fmt: skip
def test_a_continuous_joint_has_no_end_on_either_side(limits, said):
    text = model(joint("j", "continuous", f"<limit>{limits}</limit>"))
    if said is None:
        found = ClosedChain.from_sdf(text).model
        assert (found.nq, found.lowerPositionLimit[0], found.upperPositionLimit[0]) == (1, -INF, INF)
        return
    with pytest.raises(FileFormatError, match=f"a continuous joint has {said}"):
        ClosedChain.from_sdf(text)


def test_limits_of_effort_and_velocity_are_for_both_directions():
    limit = "<limit><effort>5</effort><velocity>3</velocity><lower>-0.5</lower><upper>0.7</upper></limit>"
    dynamics = "<dynamics><damping>0.1</damping><friction>0.2</friction></dynamics>"
    for forward in (True, False):
        # Gone through from its child to its parent, too, as on a free base.
        pair = {"parent": "a", "child": "b"} if forward else {"parent": "b", "child": "a"}
        links = '<link name="a"/><link name="b"><pose>0 0 1 0 0 0</pose></link>'
        ground = '<joint name="weld" type="fixed"><parent>world</parent><child>a</child></joint>'
        text = model(ground, joint("j", "revolute", limit + dynamics, **pair), links=links)
        found = ClosedChain.from_sdf(text).model
        for name, value in (("Effort", 5.0), ("Velocity", 3.0), ("DryFriction", 0.2)):
            assert getattr(found, f"upper{name}Limit")[0] == -getattr(found, f"lower{name}Limit")[0] == value
        assert (found.lowerPositionLimit[0], found.upperPositionLimit[0], found.damping[0]) == (-0.5, 0.7, 0.1)
        motion = np.reshape(pin.computeJointJacobians(found, found.createData(), np.zeros(1)), (6, 1))
        np.testing.assert_allclose(motion[3:, 0], [1.0 if forward else -1.0, 0.0, 0.0], atol=1e-15)


@pytest.mark.parametrize("mass", [0.0, 0.5, 2.0])
def test_the_world_is_a_link_if_it_has_mass(mass, tmp_path):
    body = '<inertial><mass value="{}"/><inertia ixx="{m}" iyy="{m}" izz="{m}" ixy="0" ixz="0" iyz="0"/></inertial>'
    base = body.format(mass, m=mass)
    text = f"""<robot name="r"><link name="base">{base}</link><link name="arm">{body.format(1, m=1)}</link>
    <joint name="j" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint></robot>"""
    written = ClosedChain.from_urdf(text, Closures("r")).to_sdf(tmp_path, np.array([1.0, 0.0])).read_text()
    assert ('joint name="ground_weld" type="fixed"' in written) == ('<link name="base">' in written) == (mass > 0.0)
    again = ClosedChain.from_sdf(written)
    assert [inertia.mass for inertia in again.model.inertias] == [mass, 1.0]
