"""Single elements of SDF: what is left out has the specification's default, and what is written is where it was."""

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from rubbing_chains import slide
from scipy.spatial.transform import Rotation
from written_robots import text_of

from exo_pin import FileFormatError
from exo_pin.chain import ClosedChain, Closures, JointProperties

pytestmark = pytest.mark.usefixtures("plain")


def arm(axis="", kind="revolute", more=""):
    """A link on a joint with the world."""
    return f"""<sdf version="1.11"><model name="arm"><link name="link"><pose>0 0 1 0 0.3 0</pose></link>{more}
    <joint name="j" type="{kind}"><parent>world</parent><child>link</child>{axis}</joint></model></sdf>"""


def numbers(element, tag):
    return np.array(element.findtext(tag).split(), dtype=float)


@pytest.mark.parametrize(
    ("given", "direction"),
    [
        ("", (0, 0, 1)),
        ("<xyz>0 2 0</xyz>", (0, 1, 0)),
        ("<xyz>3 0 -4</xyz>", (0.6, 0, -0.8)),
        ("<xyz>-1e-3 0 0</xyz>", (-1, 0, 0)),
    ],
)
@pytest.mark.parametrize("kind", ["revolute", "prismatic", "continuous"])
def test_an_axis_is_along_z_of_the_joint_or_as_stated(given, direction, kind):
    chain = ClosedChain.from_sdf(arm(f"<axis>{given}</axis>", kind))
    motion = np.reshape(pin.computeJointJacobians(chain.model, chain.model.createData(), chain.neutral()), (6, 1))
    turned = Rotation.from_euler("y", 0.3).apply(direction)
    part = motion[:3, 0] if kind == "prismatic" else motion[3:, 0]
    np.testing.assert_allclose(part, turned, atol=1e-12)


@pytest.mark.parametrize(("effort", "drives"), [("0.5", True), ("1e-6", True), ("0", False), ("-1", True)])
def test_a_joint_is_driven_unless_its_effort_is_zero(effort, drives):
    limit = f"<limit><effort>{effort}</effort><velocity>0</velocity></limit>"
    chain = ClosedChain.from_sdf(arm(f"<axis>{limit}</axis>"))
    assert chain.roles.actuated == (("j",) if drives else ())
    # Below zero means none.
    expected = np.inf if float(effort) < 0.0 else float(effort)
    assert (-chain.model.lowerEffortLimit[0], chain.model.upperEffortLimit[0]) == (expected, expected)
    assert (chain.model.lowerVelocityLimit[0], chain.model.upperVelocityLimit[0]) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("text", "value"), [("inf", np.inf), ("+INF", np.inf), ("1e16", np.inf), ("9e15", 9e15), ("0.25", 0.25), ("0", 0.0)]
)
def test_limits_without_end_are_spelt_in_several_ways(text, value):
    chain = ClosedChain.from_sdf(arm(f"<axis><limit><upper>{text}</upper></limit></axis>"))
    assert (chain.model.lowerPositionLimit[0], chain.model.upperPositionLimit[0]) == (-np.inf, value)
    lower = ClosedChain.from_sdf(arm(f"<axis><limit><lower>-{text.strip('+')}</lower></limit></axis>"))
    assert (lower.model.lowerPositionLimit[0], lower.model.upperPositionLimit[0]) == (-value, np.inf)


def test_equal_limits_hold_a_joint_and_crossed_ones_are_refused():
    limits = "<axis><limit><lower>{}</lower><upper>0.2</upper></limit></axis>"
    chain = ClosedChain.from_sdf(arm(limits.format("0.2")))
    assert chain.model.lowerPositionLimit[0] == chain.model.upperPositionLimit[0] == 0.2
    with pytest.raises(FileFormatError, match=r"expected lower <= upper, got 0\.3 and 0\.2"):
        ClosedChain.from_sdf(arm(limits.format("0.3")))


@pytest.mark.parametrize("reference", [None, (0.3,)])
@pytest.mark.parametrize("here", [0.0, 0.25])
@pytest.mark.parametrize("stiffness", [50.0, 1.0])
def test_springs_and_limits_count_from_where_the_file_stands(reference, here, stiffness):
    chain = slide(0.4, limits=(-0.5, np.inf))
    spring = JointProperties("slide", stiffness, reference)
    chain = ClosedChain(chain.model, replace(chain.description, joints=(spring,)))
    text = text_of(chain, "sdf", np.array([here]))
    again = ClosedChain.from_sdf(text)
    slack = 0.0 if reference is None else reference[0]
    for q in (-0.2, 0.5):
        found = again._state.passive.energy(np.array([q - here]))
        assert found == pytest.approx(0.5 * stiffness * (q - slack) ** 2)
    axis = ET.fromstring(text).find("model/joint/axis")
    assert float(axis.findtext("limit/lower")) == -0.5 - here
    assert axis.find("limit/upper") is None
    np.testing.assert_allclose(numbers(axis, "xyz"), [np.cos(0.4), 0.0, np.sin(0.4)], atol=1e-15)


@pytest.mark.parametrize("q", [(0.0, 0.0), (0.5, -0.7)])
def test_both_axes_of_a_cross_are_told_in_the_frame_of_the_body(q):
    """The first hinge turns about x of the world, the second about y of the cross."""
    model = pin.Model()
    model.addJoint(0, pin.JointModelRX(), pin.SE3(np.eye(3), np.array([0.0, 0.0, 1.0])), "roll")
    model.addJoint(1, pin.JointModelRY(), pin.SE3.Identity(), "pitch")
    model.appendBodyToJoint(2, pin.Inertia(1.0, np.array([0.0, 0.0, -0.3]), np.eye(3)), pin.SE3.Identity())
    model.addFrame(pin.Frame("rod", 2, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    text = text_of(ClosedChain(model, Closures("rod")), "sdf", np.array(q))
    (joint,) = ET.fromstring(text).findall("model/joint")
    assert (joint.get("type"), joint.findtext("parent"), joint.findtext("child")) == ("universal", "world", "rod")
    np.testing.assert_allclose(numbers(joint, "axis/xyz"), [np.cos(q[1]), 0.0, np.sin(q[1])], atol=1e-15)
    np.testing.assert_array_equal(numbers(joint, "axis2/xyz"), [0.0, 1.0, 0.0])
    pose = numbers(ET.fromstring(text).find("model/link"), "pose")
    np.testing.assert_allclose(pose[:3], [0.0, 0.0, 1.0])
    turn = Rotation.from_euler("XY", q)
    np.testing.assert_allclose(Rotation.from_quat(pose[3:]).as_matrix(), turn.as_matrix(), atol=1e-15)


def test_a_link_without_inertia_has_that_of_the_specification():
    body = ClosedChain.from_sdf(arm("<axis/>")).model.inertias[1]
    assert body.mass == 1.0
    np.testing.assert_allclose(body.inertia, np.eye(3), atol=1e-12)
    np.testing.assert_array_equal(body.lever, 0.0)


@pytest.mark.parametrize(
    ("given", "offset", "multiplier", "reference"),
    [("", 0.0, 1.0, 0.0), ("<multiplier>3</multiplier><offset>0.1</offset><reference>0.2</reference>", 0.1, 3.0, 0.2)],
)
def test_a_mimic_follows_by_the_defaults_of_the_specification(given, offset, multiplier, reference):
    more = '<link name="b"/><joint name="k" type="revolute"><parent>link</parent><child>b</child>'
    more += f'<axis><mimic joint="j">{given}</mimic></axis></joint>'
    chain = ClosedChain.from_sdf(arm("<axis/>", more=more))
    index = [chain.configuration_slice(name).start for name in ("j", "k")]
    q = np.zeros(2)
    for leader in (0.0, 0.7):
        q[index] = leader, offset + multiplier * (leader - reference)
        np.testing.assert_allclose(chain.residual(q), 0.0, atol=1e-15)
    q[index[1]] += 0.1
    np.testing.assert_allclose(np.abs(chain.residual(q)), 0.1)


@pytest.mark.parametrize(
    ("apart", "along", "tilt", "meet"),
    [
        (0.0, 0.0, 0.0, True),
        (1e-12, 5.0, 0.0, True),
        (1e-6, 0.0, 0.0, False),
        (-0.5, 0.0, 0.0, False),
        (0.0, 2.0, 1e-6, False),
    ],
)
def test_hinges_that_meet_at_right_angles_are_a_cross(apart, along, tilt, meet):
    """About x, and about y at a distance along z, wherever they stand along their lines."""
    model = pin.Model()
    model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "roll")
    axis = np.array([np.sin(tilt), np.cos(tilt), 0.0])
    place = pin.SE3(np.eye(3), np.array([along, -along, apart]))
    model.addJoint(1, pin.JointModelRevoluteUnaligned(axis), place, "pitch")
    model.appendBodyToJoint(2, pin.Inertia(1.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
    model.addFrame(pin.Frame("rod", 2, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    joints = ET.fromstring(text_of(ClosedChain(model, Closures("rod")), "sdf", np.zeros(2))).findall("model/joint")
    assert [joint.get("type") for joint in joints] == (["universal"] if meet else ["revolute", "revolute"])
