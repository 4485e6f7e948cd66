"""Parts that readers of several formats share: XML, YAML, numbers, what is left out, and the data of joints."""

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from exo_pin import FileFormatError, InvalidInput, UnknownName
from exo_pin.chain import JointProperties
from exo_pin.chain.formats.joint_data import joint_bounds, joint_data, repair_limits
from exo_pin.chain.formats.leaving_out import LeftOut
from exo_pin.chain.formats.parallel_robots import parse_yaml
from exo_pin.chain.formats.xml_elements import number, numbers_of, parse_xml, read_source, vector

pytestmark = pytest.mark.usefixtures("plain")

INF = np.inf


def same(ours, theirs):
    """Whether an element is what ElementTree read."""
    return (
        (ours.tag, ours.attributes, ours.text) == (theirs.tag, theirs.attrib, (theirs.text or "").strip())
        and len(ours.children) == len(theirs)
        and all(same(one, other) for one, other in zip(ours.children, theirs, strict=True))
    )


TEXT = """<robot name="r"><link name="a"> some <!-- note --> text </link>
  <joint name="j"><axis xyz="0 0&#9;1"/>
    <axis xyz="0 1 0"/></joint><link/></robot>"""


def test_elements_are_those_of_elementtree_with_their_lines():
    root = parse_xml(TEXT)
    theirs = ET.fromstring(TEXT.replace(" some <!-- note --> text ", "some  text"))
    assert same(root, theirs)
    joint = root.first("joint")
    assert [child.line for child in (root, joint, *joint.all("axis"))] == [1, 2, 2, 3]
    assert [child.place for child in (root, joint, joint.first("axis"), root.all("link")[1])] == [
        "robot",
        "joint 'j'",
        "joint 'j': axis",
        "link",
    ]
    assert str(joint.all("axis")[1].error("bad", "xyz")) == "line 3: joint 'j': axis xyz: bad"
    assert (root.first("mesh"), root.all("mesh")) == (None, [])


def test_elements_that_say_the_same():
    one = parse_xml("<a k='1'><b>x</b><c/></a>")
    for text, alike in (
        ("<a k='1'>\n<b> x </b><c/></a>", True),
        ("<a k='2'><b>x</b><c/></a>", False),
        ("<a k='1'><b>x</b></a>", False),
        ("<a k='1'><b>y</b><c/></a>", False),
        ("<a k='1'><b>x</b><c/><c/></a>", False),
        ("<d k='1'><b>x</b><c/></d>", False),
    ):
        assert one.says_as(parse_xml(text)) == parse_xml(text).says_as(one) == alike


@pytest.mark.parametrize(("depth", "read"), [(199, True), (200, True), (201, False)])
def test_elements_are_nested_two_hundred_deep_at_most(depth, read):
    text = "<a>" * depth + "</a>" * depth
    if read:
        assert parse_xml(text).tag == "a"
        return
    with pytest.raises(FileFormatError, match="line 1: elements are nested more than 200 deep"):
        parse_xml(text)


def test_xml_is_given_or_in_a_file(tmp_path):
    assert read_source("\ufeff \n<a/>") == ("<a/>", None)
    path = tmp_path / "a.xml"
    path.write_bytes(b"<a/>")
    for source in (path, str(path)):
        assert read_source(source) == (b"<a/>", path)


@pytest.mark.parametrize(("depth", "read"), [(31, True), (32, True), (33, False)])
def test_yaml_is_nested_thirty_two_deep_at_most(depth, read):
    text = "[" * depth + "]" * depth
    if not read:
        with pytest.raises(FileFormatError, match="line 1: nested deeper than 32 levels"):
            parse_yaml(text)
        return
    value = parse_yaml(text)
    for _ in range(depth - 1):
        (value,) = value
    assert value == []


def test_yaml_is_texts_and_nothing():
    assert parse_yaml("a: [1, ~, '', null, 'null', no]\nb: {c: 2.5}\n1: x") == {
        "a": ["1", None, "", None, "null", "no"],
        "b": {"c": "2.5"},
        "1": "x",
    }
    assert parse_yaml("") is None
    for text, said in (
        ("a: 1\n\na: 2", "line 3: 'a' is given twice"),
        ("a: &x 1\nb: *x", "line 2: the alias"),
        ("a: 1\n? [b]\n: 2", "line 2: expected a text"),
        ("a: 1\nb: !!int 2", "line 2: the tag"),
        ("a\n---\nb", "expected one YAML document"),
    ):
        with pytest.raises(FileFormatError, match=said):
            parse_yaml(text)


def test_numbers_of_attributes_and_their_defaults():
    element = parse_xml('<a one="1.5" three=" 1\t-2 .3e1 "/>')
    assert (number(element, "one"), number(element, "two", 7.0), number(element, "one", 7.0)) == (1.5, 7.0, 1.5)
    np.testing.assert_array_equal(vector(element, "three", (0.0,) * 3), [1.0, -2.0, 3.0])
    for source, attribute in ((element, "four"), (None, "three")):
        np.testing.assert_array_equal(vector(source, attribute, (1.0, 2.0)), [1.0, 2.0])
    assert numbers_of(element, " ", 0) == []
    for text, count, said in (
        ("1 2", 3, "expected 3 numbers, got '1 2'"),
        ("", 1, "expected a number, got"),
        ("1,5", 1, "decimals come after a point"),
        ("$x", 1, "xacro"),
        ("1e999", 1, "expected a finite number"),
        ("0x1", 1, "expected a decimal number"),
        ("1_0", 1, "decimal number"),
    ):
        with pytest.raises(FileFormatError, match=said):
            numbers_of(element, text, count)
    with pytest.raises(FileFormatError, match="the attribute 'two' is missing"):
        number(element, "two")


@pytest.mark.parametrize(("count", "said"), [(1, "0"), (6, "0; 1; 2; 3; 4; 5"), (7, "0; 1; 2; 3; 4; and 2 more")])
def test_of_many_things_that_are_left_out_the_first_are_said(count, said):
    left = LeftOut(["fluid"])
    for k in (*range(count), 0):
        left.say("geoms", str(k))
    left.named("fluid", "air", "breathe")
    assert left.report == (
        f"geoms: {said} (no effect: shapes that are not drawn)",
        "fluid: air (may change forces: forces of air and water)",
    )
    assert [left.has("geoms"), left.has("x", "fluid"), left.has("gravcomp"), left.has()] == [True, True, False, False]
    with pytest.raises(FileFormatError, match=r'wind: stop it, or leave it out with leave_out=\["gravcomp"\]'):
        left.named("gravcomp", "wind", "stop it")
    for given, error in (("gravity", InvalidInput), (["gravity"], UnknownName)):
        with pytest.raises(error):
            LeftOut(given)


def hinge(**limits):
    """An endless hinge, a hinge and a ball."""
    model = pin.Model()
    for k, joint in enumerate((pin.JointModelRUBZ(), pin.JointModelRX(), pin.JointModelSpherical())):
        model.addJoint(k, joint, pin.SE3.Identity(), f"joint_{k}")
        model.appendBodyToJoint(k + 1, pin.Inertia(1.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
    for key, value in limits.items():
        setattr(model, key, np.array(value, dtype=float))
    return model


def test_data_of_joints_are_listed_where_there_are_some():
    for data in joint_data(hinge(), ()):
        assert data.present == ()
        assert data.stiffness == 0.0
    model = hinge(
        damping=[0, 0, 0, 0, 2],
        armature=[0, 3, 0, 0, 0],
        upperDryFrictionLimit=[4, 0, 0, 0, 0],
        lowerDryFrictionLimit=[-4, 0, 0, 0, 0],
        upperEffortLimit=[INF, 5, INF, INF, INF],
        upperVelocityLimit=[INF, INF, 6, INF, INF],
        lowerPositionLimit=[-INF, -INF, -1, -INF, -INF, -INF, -INF],
    )
    _, *found = joint_data(model, [JointProperties("joint_1", 7.0, (0.3,))])
    assert [data.present for data in found] == [
        ("friction",),
        ("armature", "spring", "effort limits", "position limits"),
        ("damping", "velocity limits"),
    ]
    assert [data.unit for data in found] == ["rad"] * 3
    np.testing.assert_array_equal(found[1].position, [[-1, INF]])
    assert (found[1].rest(0), found[0].rest(0)) == (0.3, 0.0)
    assert found[2].damping.tolist() == [0, 0, 2]
    np.testing.assert_array_equal(joint_bounds(model, 1)[6:], [[-4], [4], [0]])


def test_data_about_one_axis_of_a_ball_are_there():
    one = [0, 0, 0, 1, 0]
    for key, said in (
        ("damping", "damping"), ("armature", "armature"), ("upperEffortLimit", "effort limits"),
        ("upperVelocityLimit", "velocity limits"), ("upperDryFrictionLimit", "friction"),
    ):  # fmt: skip
        given = {key: np.where(one, 2.0, INF if key.endswith("tLimit") or "Velocity" in key else 0.0)}
        if said == "friction":
            given = {key: np.array(one), "lowerDryFrictionLimit": -np.array(one)}
        _, *found = joint_data(hinge(**given), ())
        assert [data.present for data in found] == [(), (), (said,)]


@pytest.mark.parametrize(("value", "read"), [(9.9e299, 9.9e299), (1e300, INF), (np.finfo(float).max, INF), (INF, INF)])
def test_limits_of_1e300_are_none(value, read):
    model = hinge(
        upperEffortLimit=[value] * 5,
        lowerEffortLimit=[-value] * 5,
        upperVelocityLimit=[4] * 5,
        lowerVelocityLimit=[4] * 5,
    )
    data = joint_data(model, ())[2]
    np.testing.assert_array_equal(data.effort, [[-read, read]])
    # Pinocchio's reader of URDF has the upper limit of velocity twice.
    np.testing.assert_array_equal(data.velocity, [[-4, 4]])
    repair_limits(model)
    np.testing.assert_array_equal(model.lowerEffortLimit, [-read] * 5)
    np.testing.assert_array_equal(model.upperEffortLimit, [read] * 5)
    np.testing.assert_array_equal(model.lowerVelocityLimit, [-4] * 5)


@pytest.mark.parametrize(
    ("low", "high", "larger"), [(-3.0, 3.0, 3.0), (-3.0, 2.0, 3.0), (-1.0, 2.0, 2.0), (-INF, 2.0, INF)]
)
def test_one_number_for_limits_of_both_directions(low, high, larger):
    data = replace(joint_data(hinge(), ())[2], effort=np.array([[low, high]]))
    assert data.symmetric("effort", "j", "X", larger=True) == larger
    if low == -high:
        assert data.symmetric("effort", "j", "X") == high
        return
    with pytest.raises(InvalidInput, match="X has one effort limit for both directions; joint 'j' has"):
        data.symmetric("effort", "j", "X")


def test_friction_of_two_sizes_and_rotors_of_pinocchio_are_refused():
    for limits, said in (
        ({"upperDryFrictionLimit": [0, 1, 0, 0, 0]}, "'joint_1': expected a friction"),
        ({"rotorInertia": [0, 0, 0, 1, 0]}, "'joint_2'.*armature"),
    ):
        with pytest.raises(InvalidInput, match=said):
            joint_data(hinge(**limits), ())
