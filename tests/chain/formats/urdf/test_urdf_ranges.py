"""The edges of what numbers of a URDF may be: inertias of few digits, limits, axes, origins, versions and depths."""

import itertools
import re

import numpy as np
import pinocchio as pin
import pytest
from urdf_knee import BARE, GOOD

from exo_pin import FileFormatError
from exo_pin.chain import ClosedChain, Closure, Closures
from exo_pin.chain.formats.joint_data import joint_data
from exo_pin.chain.formats.leaving_out import LeftOut
from exo_pin.chain.formats.urdf.urdf_loading import DEEPEST, checked_urdf
from exo_pin.chain.formats.urdf.urdf_values import check_joint, inertia_of
from exo_pin.chain.formats.xml_elements import parse_xml

pytestmark = pytest.mark.usefixtures("plain")

INF = np.inf


def inertial(mass, *moments):
    given = "".join(f' {key}="{value}"' for key, value in zip(("ixx", "iyy", "izz"), moments, strict=True))
    return parse_xml(f'<inertial><mass value="{mass}"/><inertia{given} ixy="0" ixz="0" iyz="0"/></inertial>')


@pytest.mark.parametrize(
    ("mass", "moments", "is_a_bodys"),
    [
        # 1e-11 is 5e-12 or more before printing. Two moments of a noise each, and a noise of its own, make three: those
        # of 2 kg explain it, those of 1 kg do not.
        ("1", ("0", "0", "1e-11"), False), ("2", ("0", "0", "1e-11"), True),
        # Without noise one digit is half of the moment, and 1 is 0.5 or more: the other one may miss it by rounding.
        ("1e-20", ("0.49999999999999", "0", "1e0"), True), ("1e-20", ("0.4999999999999", "0", "1e0"), False),
        ("1e-20", ("0.5", "0", "1e0"), True), ("1e-20", ("0.3", "0.1", "1e0"), False),
        ("1e-20", ("4.9999999999999e-4", "0", "1e-3"), True), ("1e-20", ("4.999999999999e-4", "0", "1e-3"), False),
        ("1e-20", ("4.9999999999999e2", "0", "1e3"), True), ("1e-20", ("4.999999999999e2", "0", "1e3"), False),
    ],
)  # fmt: skip
def test_moments_of_one_digit_are_a_bodys_if_half_a_unit_makes_them_so(mass, moments, is_a_bodys):
    left = LeftOut()
    if is_a_bodys:
        np.testing.assert_array_equal(np.diag(inertia_of(inertial(mass, *moments), left)[1]), np.array(moments, float))
        assert left.has("rounding")
        return
    with pytest.raises(FileFormatError, match="larger than the sum of the other two"):
        inertia_of(inertial(mass, *moments), left)


@pytest.mark.parametrize(
    ("moments", "said"),
    [
        (("0", "1", "1"), False), (("1", "2", "3"), False), (("0", "1e3", "1e3"), False),
        (("0", "1e-6", "1e-6"), False),
        (("1e-3", "1e-3", "2.000000000001e-3"), True), (("1e3", "1e3", "2.000000000001e3"), True),
        (("1.0", "1.0", "2.0"), False), (("-4e-13", "1e-12", "1e-12"), True),
    ],
)  # fmt: skip
def test_moments_that_miss_the_rules_by_their_digits_are_said_whatever_their_size(moments, said):
    left = LeftOut()
    inertia_of(inertial("1", *moments), left)
    assert left.has("rounding") == said


@pytest.mark.parametrize("size", ["1e-9", "1", "1e9"])
@pytest.mark.parametrize(("product", "allowed"), [("0.500000000000", True), ("1.500000000000", False)])
def test_products_of_inertia_are_bounded_by_the_moments_whatever_the_size(product, allowed, size):
    """Moments of one and a product p have principal moments 1 - p, 1 and 1 + p."""
    power = size.partition("e")[2] or "0"
    one, p = f"1.000000000000e{power}", f"{product}e{power}"
    given = f'ixx="{one}" iyy="{one}" izz="{one}" ixy="{p}" ixz="0" iyz="0"'
    found = parse_xml(f'<inertial><mass value="1e-20"/><inertia {given}/></inertial>')
    if allowed:
        assert inertia_of(found)[1][0, 1] == 0.5 * float(size)
        return
    shown = ", ".join(f"{moment * float(size):g}" for moment in (-0.5, 1.0, 2.5))
    with pytest.raises(FileFormatError, match=re.escape(f"negative principal moment of inertia; they are {shown} kg")):
        inertia_of(found)


@pytest.mark.parametrize(
    ("lower", "upper", "said"),
    [
        # Less than a turn is a limit that is not kept; a turn, as 3.1416 either way, is none, and nor is none at all.
        ("-3.1416", "3.1416", False), ("0", "6.2832", False), ("-3.14", "3.14", True), ("-3", "3", True),
        ("0", "1e-3", True), ("0", "0", False), ("0.5", "0.5", False), ("-7", "7", False), ("-4", "4", False),
    ],
)  # fmt: skip
def test_limits_of_less_than_a_turn_are_said_of_a_continuous_joint(lower, upper, said):
    text = (
        GOOD.replace('"revolute"', '"continuous"')
        .replace('"-1"', f'"{lower}"')
        .replace('upper="1"', f'upper="{upper}"')
    )
    left = LeftOut()
    checked_urdf(parse_xml(text), left)
    assert left.has("limits") == said


@pytest.mark.parametrize(
    ("given", "limits"),
    [('upper="0.5"', (0.0, 0.5)), ('lower="-0.5"', (-0.5, 0.0)), ("", (0.0, 0.0)), ('lower="0.5"', None)],
)
def test_a_limit_that_is_left_out_is_zero(given, limits):
    text = GOOD.replace('lower="-1" upper="1"', given)
    if limits is None:
        with pytest.raises(FileFormatError, match=r"lower <= upper, got 0\.5 and 0"):
            ClosedChain.from_urdf(text, BARE)
        return
    model = ClosedChain.from_urdf(text, BARE).model
    assert (model.lowerPositionLimit[0], model.upperPositionLimit[0]) == limits


def test_joints_without_limits_have_none_on_either_side():
    crossed = ClosedChain.from_urdf(GOOD.replace('lower="-1"', 'lower="1.5"'), BARE, leave_out=["empty_limits"]).model
    gear = Closures("r", closures=(Closure("gear", "coupling", "universe", "knee", polynomial=(0.1,)),))
    counting = ClosedChain.from_urdf(GOOD.replace('"revolute"', '"continuous"'), gear).model
    for model in (crossed, counting):
        assert (model.nq, model.lowerPositionLimit[0], model.upperPositionLimit[0]) == (1, -INF, INF)
        assert (model.lowerEffortLimit[0], model.upperEffortLimit[0]) == (-3.0, 3.0)


@pytest.mark.parametrize("version", [None, "1", "1.0", "1.1", "1.2"])
def test_what_a_version_has(version):
    """Quaternions came with 1.1, joints without an effort and limits without a default with 1.2."""
    stated = "" if version is None else f' version="{version}"'
    text, number = GOOD.replace('name="r"', f'name="r"{stated}'), float(version or 1)
    for other, since, until in (
        (text, 1.0, 1.2), (text.replace('rpy="0 0 0.5"', 'quat_xyzw="0 0 0 1"'), 1.1, 1.2),
        (text.replace('effort="3" ', ""), 1.2, 1.2), (text.replace('velocity="4"', ""), 1.2, 1.2),
        (text.replace('lower="-1"', ""), 1.0, 1.1), (text.replace('upper="1"', 'upper="1" jerk="1"'), 1.0, 1.2),
    ):  # fmt: skip
        left = LeftOut()
        try:
            found = checked_urdf(parse_xml(other), left)
        except FileFormatError:
            assert not since <= number <= until
            continue
        # What is wrong with a picture is said.
        assert (since <= number <= until) != left.has("pictures")
        assert f'version="{number}"' in found.text


@pytest.mark.parametrize(
    "axis", ["0 0 1", "0 0 8", "0 0 1e-3", "0 0 1e200", "0 1e-5 0", "-0.6 0 0.8", "3e200 0 -4e200", "1 2 3"]
)
def test_an_axis_of_any_length_is_a_direction(axis):
    chain = ClosedChain.from_urdf(GOOD.replace('xyz="0 0 1"', f'xyz="{axis}"'), BARE)
    direction = np.array(axis.split(), dtype=float)
    direction /= np.abs(direction).max()
    turn = pin.AngleAxis(0.7, direction / np.linalg.norm(direction)).toRotationMatrix()
    there = chain.model.jointPlacements[1].rotation.T @ chain.placement(np.array([0.7]), "b").rotation
    np.testing.assert_allclose(there, turn, atol=1e-15)
    # Nothing is rounded where Pinocchio reads it, too.
    if "e" not in axis:
        plain = pin.buildModelFromXML(GOOD.replace('xyz="0 0 1"', f'xyz="{axis}"'))
        data = [each.createData() for each in (chain.model, plain)]
        for one, each in zip(data, (chain.model, plain), strict=True):
            pin.forwardKinematics(each, one, np.array([0.7]))
        np.testing.assert_array_equal(data[0].oMi[1].homogeneous, data[1].oMi[1].homogeneous)


@pytest.mark.parametrize(
    ("axis", "said"),
    [
        ("0 0 1", None), ("0 0 0.5", None), ("1 0 0", "axis .0 0 1. only"), ("0 0 -1", "only"), ("0 1 1", "only"),
        ("1 0 1", "only"), ("0 0 0", "direction"), ("0 0 9e-7", "direction"), ("0 0 2e-6", None),
    ],
)  # fmt: skip
def test_a_plane_is_that_of_x_and_y(axis, said):
    joint = parse_xml(f'<joint name="j" type="planar"><axis xyz="{axis}"/></joint>')
    if said is None:
        check_joint(joint, (1, 0), LeftOut())
        return
    with pytest.raises(FileFormatError, match=said):
        check_joint(joint, (1, 0), LeftOut())


def test_the_axis_that_urdf_gives_a_joint_makes_no_plane():
    with pytest.raises(FileFormatError, match=r"got \[1\.0, 0\.0, 0\.0\]"):
        check_joint(parse_xml('<joint name="j" type="planar"/>'), (1, 0), LeftOut())


@pytest.mark.parametrize("kind", ["planar", "floating"])
@pytest.mark.parametrize(
    ("dynamics", "said"),
    [
        ("", None), ('damping="0"', None), ('friction="0.0"', None), ('damping="1"', "damping is not read"),
        ('friction="1e-9"', "friction is not read; it has to be zero, got 1e-09"),
    ],
)  # fmt: skip
def test_joints_of_several_axes_have_neither_damping_nor_friction(kind, dynamics, said):
    text = f'<joint name="j" type="{kind}"><axis xyz="0 0 1"/><dynamics {dynamics}/></joint>'
    if said is None:
        check_joint(parse_xml(text), (1, 0), LeftOut())
        return
    with pytest.raises(FileFormatError, match=said):
        check_joint(parse_xml(text), (1, 0), LeftOut())


@pytest.mark.parametrize("kind", ["fixed", "floating"])
def test_joints_without_an_axis_may_have_any(kind):
    check_joint(parse_xml(f'<joint name="j" type="{kind}"><axis xyz="0 0 0"/></joint>'), (1, 0), LeftOut())


@pytest.mark.parametrize(
    ("origin", "moved"), [("", False), ('xyz="0 0 0" rpy="0 0 0"', False), ('xyz="1 0 0"', True), ('rpy="0 0 1"', True)]
)
def test_a_link_has_no_origin_of_its_own(origin, moved):
    text = GOOD.replace('<link name="a"/>', f'<link name="a"><origin {origin}/></link>')
    if not moved:
        assert ClosedChain.from_urdf(text, BARE).model.nv == 1
        return
    with pytest.raises(FileFormatError, match="no origin of its own"):
        ClosedChain.from_urdf(text, BARE)


@pytest.mark.parametrize(
    ("element", "said"),
    [
        ('<calibration rising="0.1" reference_position="any"/>', None), ('<calibration x:rising="any"/>', None),
        ('<calibration rising="any"/>', "joint 'j': calibration rising"), ('<calibration falling="1,0"/>', "falling"),
        ('<safety_controller k_velocity="1"/>', None), ('<safety_controller k_velocity="any"/>', "k_velocity"),
    ],
)  # fmt: skip
def test_numbers_of_calibrations_and_safety_controllers_are_checked(element, said):
    joint = parse_xml(f'<robot><joint name="j" type="fixed">{element}</joint></robot>').children[0]
    if said is None:
        check_joint(joint, (1, 0), LeftOut())
        return
    with pytest.raises(FileFormatError, match=said):
        check_joint(joint, (1, 0), LeftOut())


def links(names, joints):
    """A URDF of links and of fixed joints from one to another."""
    text = "".join(f'<link name="{name}"/>' for name in names)
    for parent, child in joints:
        text += f'<joint name="{parent}-{child}" type="fixed"><parent link="{parent}"/><child link="{child}"/></joint>'
    return parse_xml(f'<robot name="r">{text}</robot>')


@pytest.mark.parametrize(
    ("names", "joints", "said"),
    [
        ("abc", ["ab", "bc"], None), ("abc", ["ab", "ac"], None), ("a", [], None),
        ("ab", ["bb"], "1 links hang on each other in a circle"), ("abc", ["bc", "cb"], "2 links hang on each other"),
        ("abc", ["ab", "cb"], "link 'b' is the child of joint 'a-b' already"),
        ("ab", ["ab", "ab"], "a name of its own"), ("", [], "at least one link"),
        ("ab", [], "one root link, got 2 links that are no joint's child: 'a', 'b'$"),
        ("abcdefg", ["ab"], "got 6 links that are no joint's child: 'a', 'c', 'd', 'e', 'f'$"),
    ],
)  # fmt: skip
def test_links_make_one_tree(names, joints, said):
    if said is None:
        assert checked_urdf(links(names, joints), LeftOut()).text.count("<link ") == len(names)
        return
    with pytest.raises(FileFormatError, match=said):
        checked_urdf(links(names, joints), LeftOut())


@pytest.mark.parametrize("count", [DEEPEST, DEEPEST + 1])
def test_a_thousand_links_are_one_on_the_other_at_most(count):
    names = [str(k) for k in range(count)]
    chain = links(names, list(itertools.pairwise(names)))
    if count == 1000:
        assert checked_urdf(chain, LeftOut()).text.count("<joint ") == 999
        return
    with pytest.raises(FileFormatError, match="more than 1000 links"):
        checked_urdf(chain, LeftOut())


JOINED = """<robot name="r"><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
<joint name="turn" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint>
<joint name="fly" type="floating"><parent link="b"/><child link="c"/></joint>
<joint name="slip" type="planar"><parent link="c"/><child link="d"/><axis xyz="0 0 1"/></joint></robot>"""


def test_pinocchios_limits_of_cosines_and_quaternions_are_none():
    for model in (pin.buildModelFromXML(JOINED), ClosedChain.from_urdf(JOINED, BARE).model):
        assert [data.present for data in joint_data(model, ())] == [()] * 4
    assert np.isfinite(model.upperPositionLimit).any()
