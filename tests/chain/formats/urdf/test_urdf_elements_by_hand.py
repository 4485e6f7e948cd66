"""Single elements of URDF: their values against closed forms, and what is written as other programs read it."""

import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from exo_pin import FileFormatError
from exo_pin.chain import ClosedChain, Closures
from exo_pin.chain.formats.leaving_out import LeftOut
from exo_pin.chain.formats.urdf.urdf_shapes import write_urdf_shape
from exo_pin.chain.formats.urdf.urdf_values import inertia_of
from exo_pin.chain.formats.urdf.urdf_writing import Document, Picture, urdf_text
from exo_pin.chain.formats.xml_elements import parse_xml
from exo_pin.chain.structure.description import Shape

pytestmark = pytest.mark.usefixtures("plain")


def numbers(element, key):
    return np.array(element.get(key).split(), dtype=float)


@pytest.mark.parametrize(
    "end", [(0.4, -0.2, 1.5), (0.1, 0.2, -0.7), (-0.5, 0.2, 0.3), (0.1, 0.9, 0.3), (0.1, 0.2, 2.3)]
)
def test_a_drawn_rod_ends_where_it_is_said_to(end):
    start = np.array([0.1, 0.2, 0.3])
    document = Document("rods")
    document.link("rod", None, [Picture("bone", 0.02, tuple(start), end), Picture("bone", 0.05, tuple(start))])
    rod, ball = ET.fromstring(document.text()).findall("link/visual")
    length = float(rod.find("geometry/cylinder").get("length"))
    along = Rotation.from_euler("xyz", numbers(rod.find("origin"), "rpy")).apply([0.0, 0.0, 0.5 * length])
    middle = numbers(rod.find("origin"), "xyz")
    np.testing.assert_allclose([middle - along, middle + along], [start, end], atol=1e-12)
    assert rod.find("geometry/cylinder").get("radius") == "0.02"
    np.testing.assert_array_equal(numbers(ball.find("origin"), "xyz"), start)
    assert ball.find("geometry/sphere").get("radius") == "0.05"


def test_a_capsule_is_a_cylinder_with_a_ball_at_either_end():
    turn = Rotation.from_euler("xyz", [0.3, -0.4, 0.9])
    place = pin.SE3(turn.as_matrix(), np.array([0.1, -0.2, 0.3]))
    link = ET.Element("link")
    assert write_urdf_shape(link, Shape.at("arm", "capsule", (0.05, 0.4), place, None, (1.0, 0.0, 0.0, 0.5), "visual"))
    cylinder, *balls = link.findall("visual")
    assert [cylinder.find("geometry/cylinder").get(key) for key in ("radius", "length")] == ["0.05", "0.4"]
    assert [ball.find("geometry/sphere").get("radius") for ball in balls] == ["0.05", "0.05"]
    found = [numbers(part.find("origin"), "xyz") for part in (cylinder, *balls)]
    expected = [turn.apply([0.0, 0.0, z]) + place.translation for z in (0.0, -0.2, 0.2)]
    np.testing.assert_allclose(found, expected, atol=1e-12)
    angles = numbers(cylinder.find("origin"), "rpy")
    np.testing.assert_allclose(Rotation.from_euler("xyz", angles).as_matrix(), turn.as_matrix(), atol=1e-12)
    colours = [numbers(part.find("material/color"), "rgba").tolist() for part in (cylinder, *balls)]
    assert colours == [[1.0, 0.0, 0.0, 0.5]] * 3


@pytest.mark.parametrize(
    ("mass", "moments", "allowed"),
    [
        # Rounding of the largest moment, and of a point of the mass a micrometre away.
        (1e-20, ("-5e-15", "1", "1"), True), (1e-20, ("-5e-14", "1", "1"), False),
        (1.0, ("-4e-13", "1e-12", "1e-12"), True), (1.0, ("-4e-12", "1e-11", "1e-11"), False),
        (4.0, ("-4e-12", "1e-11", "1e-11"), True), (1.0, ("-1e-12", "1", "1"), True),
        # A moment about an axis of the link's is known to its own half unit, however coarse the others are.
        (1e-20, ("-0.01", "1.0", "1.0"), False), (1e-20, ("1.0", "1.0", "-0.01"), False),
    ],
)  # fmt: skip
def test_moments_of_inertia_below_zero_are_rounding_or_refused(mass, moments, allowed):
    given = "".join(f' {key}="{value}"' for key, value in zip(("ixx", "iyy", "izz"), moments, strict=True))
    text = f'<inertial><mass value="{mass!r}"/><inertia{given} ixy="0" ixz="0" iyz="0"/></inertial>'
    if allowed:
        np.testing.assert_array_equal(
            inertia_of(parse_xml(text), LeftOut())[1], np.diag(np.array(moments, dtype=float))
        )
        return
    with pytest.raises(FileFormatError, match="negative principal moment"):
        inertia_of(parse_xml(text), LeftOut())


def two_bodies():
    """A free body and one on a hinge, with a site."""
    model = pin.Model()
    model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Random(), "free")
    model.addJoint(0, pin.JointModelRY(), pin.SE3.Identity(), "hinge")
    for joint in (1, 2):
        model.appendBodyToJoint(joint, pin.Inertia(1.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
        model.addFrame(pin.Frame(f"body_{joint}", joint, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    site = pin.SE3(np.eye(3), np.array([0.1, 0.2, 0.3]))
    model.addFrame(pin.Frame("tip", 2, 0, site, pin.FrameType.OP_FRAME))
    return ClosedChain(model, Closures("two"))


def test_joints_without_an_axis_have_that_which_urdf_gives_them():
    text, _ = urdf_text(two_bodies()._state)
    axes = {joint.get("name"): joint.find("axis").get("xyz") for joint in ET.fromstring(text).iter("joint")}
    assert axes == {"free": "1.0 0.0 0.0", "hinge": "0.0 1.0 0.0", "tip_weld": "1.0 0.0 0.0"}
    place = ET.fromstring(text).find("joint[@name='tip_weld']/origin")
    np.testing.assert_array_equal(numbers(place, "xyz"), [0.1, 0.2, 0.3])


@pytest.mark.parametrize("kind", ["revolute", "prismatic", "continuous", "fixed", "floating"])
@pytest.mark.parametrize("limits", [None, (-1.0, 2.0)])
def test_a_joint_without_strength_is_passive(kind, limits):
    """Neither effort nor damping nor friction; the velocity that URDF asks for is one that no joint comes near."""
    document = Document("joints")
    for name in "ab":
        document.link(name, None)
    document.joint("j", kind, "a", "b", [1.0, 2.0, 3.0], [0.0, 1.0, 0.0], limits, mimic=("k", -2.0, 0.5))
    joint = ET.fromstring(document.text()).find("joint")
    assert (joint.get("name"), joint.get("type")) == ("j", kind)
    assert [joint.find(end).get("link") for end in ("parent", "child")] == ["a", "b"]
    assert joint.find("origin").attrib == {"xyz": "1.0 2.0 3.0"}
    assert joint.find("mimic").attrib == {"joint": "k", "multiplier": "-2.0", "offset": "0.5"}
    assert joint.find("dynamics") is None
    if kind in ("fixed", "floating"):
        assert joint.find("limit") is None
        return
    ends = {} if limits is None else {"lower": "-1.0", "upper": "2.0"}
    assert joint.find("limit").attrib == {**ends, "effort": "0.0", "velocity": "100.0"}


def test_materials_that_are_used_are_stated_once_at_the_head():
    document = Document("arm", ["first -- note"])
    document.note("second")
    document.link("arm", None, [Picture("arm", 0.1, (0.0, 0.0, 0.0)), Picture("cross", 0.1, (0.0, 0.0, 0.0))])
    document.link("base", None, [Picture("arm", 0.1, (0.0, 0.0, 0.0))])
    text = document.text()
    assert [child.tag for child in ET.fromstring(text)] == ["material", "material", "link", "link"]
    assert [child.get("name") for child in ET.fromstring(text)[:2]] == ["arm", "cross"]
    assert text.splitlines()[1:3] == ["<!-- first - - note -->", "<!-- second -->"]
    # It may be written again.
    assert document.text() == text
