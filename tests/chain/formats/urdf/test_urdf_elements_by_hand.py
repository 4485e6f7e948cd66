"""Single elements of URDF: their values against closed forms, and what is written as other programs read it."""

import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation
from written_robots import urdf_of

from exo_pin.chain import ClosedChain, Closures
from exo_pin.chain.formats.urdf.urdf_writing import Document, Picture

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
    text, _ = urdf_of(two_bodies())
    axes = {joint.get("name"): joint.find("axis").get("xyz") for joint in ET.fromstring(text).iter("joint")}
    assert axes == {"free": "1.0 0.0 0.0", "hinge": "0.0 1.0 0.0", "tip_weld": "1.0 0.0 0.0"}
    place = ET.fromstring(text).find("joint[@name='tip_weld']/origin")
    np.testing.assert_array_equal(numbers(place, "xyz"), [0.1, 0.2, 0.3])


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
