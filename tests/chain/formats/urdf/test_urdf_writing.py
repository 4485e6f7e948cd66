"""URDF that is written and read again."""

import re

import numpy as np
import pinocchio as pin
import pytest
from closed_chains import CHAINS, off
from massive_chains import MASSIVE
from scipy.spatial.transform import Rotation
from written_robots import urdf_of

from exo_pin import InvalidInput
from exo_pin.chain import ClosedChain, Closure, Closures, read_closures


@pytest.fixture(params=MASSIVE)
def case(request):
    return MASSIVE[request.param]


def test_writing_urdf_and_reading_it_again(case, tmp_path):
    chain, q = case
    again = ClosedChain.from_urdf(chain.to_urdf(tmp_path))
    assert list(again.model.names) == list(chain.model.names)
    assert again.closures == chain.closures
    assert again.roles == chain.roles
    np.testing.assert_allclose(again.residual(q), chain.residual(q), atol=1e-13)
    there = off(chain, q, np.random.default_rng(9), 0.3)
    np.testing.assert_allclose(again.residual(there), chain.residual(there), atol=1e-13)
    masses = [pin.crba(item.model, item.model.createData(), there) for item in (chain, again)]
    np.testing.assert_allclose(masses[0], masses[1], atol=1e-13)
    np.testing.assert_array_equal(again.model.gravity.linear, chain.model.gravity.linear)
    np.testing.assert_allclose(again.model.upperPositionLimit, chain.model.upperPositionLimit)


@pytest.mark.parametrize("pitch", [0.3, np.pi / 2, np.pi / 2 - 1e-9, -np.pi / 2, np.pi / 2 + 1e-5, 3.0])
def test_turned_joints_keep_their_digits(pitch, tmp_path):
    model = pin.Model()
    turn = Rotation.from_euler("ZYX", [0.7, pitch, -0.4]).as_matrix()
    joint = model.addJoint(0, pin.JointModelRX(), pin.SE3(turn, np.array([0.1, 0.2, 0.3])), "hinge")
    model.addJointFrame(joint, -1)
    model.addBodyFrame("link", joint, pin.SE3.Identity(), -1)
    again = ClosedChain.from_urdf(ClosedChain(model, Closures("turned")).to_urdf(tmp_path))
    np.testing.assert_allclose(again.placement(again.neutral(), "link").rotation, turn, atol=1e-15)


def test_closures_with_axes_and_distances_come_back(tmp_path):
    for name in ("loop-revolute", "loop-cylindrical", "loop-distance", "delta"):
        chain, _ = CHAINS[name]
        path = chain.to_urdf(tmp_path)
        assert read_closures(path.with_suffix(".closures.toml")).closures == chain.closures


def test_a_welded_link_beside_a_joint_called_like_its_weld(tmp_path):
    body = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    hinge = (
        '<joint name="tip_weld" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="1 0 0"/></joint>'
    )
    weld = '<joint name="fix" type="fixed"><origin xyz="0 0 1"/><parent link="arm"/><child link="tip"/></joint>'
    links = f'<link name="base"/><link name="arm">{body}</link><link name="tip"/>'
    chain = ClosedChain.from_urdf(f'<robot name="r">{links}{hinge}{weld}</robot>', Closures("r"))
    again = ClosedChain.from_urdf(chain.to_urdf(tmp_path))
    assert list(again.model.names)[1:] == ["tip_weld"]
    np.testing.assert_array_equal(again.placement(again.neutral(), "tip").translation, [0, 0, 1])


@pytest.mark.parametrize("armature", [(0.1, 0.0, 0.0), (0.0, 0.0, 0.2), (0.1, 0.2, 0.3), (0.0, 0.0, 0.0)])
def test_rotors_of_a_root_joint_are_in_the_closures_file(armature, tmp_path):
    model = pin.Model()
    model.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
    model.appendBodyToJoint(
        1, pin.Inertia(2.0, np.array([0.1, 0.2, 0.3]), np.diag([0.3, 0.4, 0.5])), pin.SE3.Identity()
    )
    model.addFrame(pin.Frame("body", 1, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    model.armature = np.array(armature)
    again = ClosedChain.from_urdf(ClosedChain(model, Closures("ball")).to_urdf(tmp_path))
    np.testing.assert_array_equal(again.model.armature, armature)
    assert len(again.description.joints) == (1 if any(armature) else 0)
    M, N = (pin.crba(one, one.createData(), pin.neutral(one)) for one in (model, again.model))
    np.testing.assert_allclose(M, N, atol=1e-14)


def hung(joint, place=(0.0, 0.0, 0.0), angle=0.0, bodies=1):
    """Bodies on the world, each on a joint of its own kind."""
    model = pin.Model()
    for k in range(bodies):
        turn = pin.SE3(Rotation.from_euler("z", angle).as_matrix(), np.array(place))
        model.addJoint(0, joint(), turn, f"joint_{k}")
        model.appendBodyToJoint(k + 1, pin.Inertia(1.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
        model.addFrame(pin.Frame(f"body_{k}", k + 1, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    return ClosedChain(model, Closures("hung"))


ROOTS = {
    "spherical": pin.JointModelSpherical,
    "planar": pin.JointModelPlanar,
    "translation": pin.JointModelTranslation,
    "free_flyer": pin.JointModelFreeFlyer,
}


@pytest.mark.parametrize("root", ROOTS)
@pytest.mark.parametrize(
    ("place", "angle", "bodies"), [((0, 0, 0), 0.0, 1), ((0.3, 0, 0), 0.0, 1), ((0, 0, 0), 0.5, 1), ((0, 0, 0), 0.0, 2)]
)
def test_a_root_joint_stands_in_the_closures_file_if_it_is_alone_at_the_worlds_origin(root, place, angle, bodies):
    chain = hung(ROOTS[root], place, angle, bodies)
    if place[0] or angle or bodies > 1:
        if root == "free_flyer":
            # URDF has a joint for it, which stands anywhere.
            again = ClosedChain.from_urdf(*urdf_of(chain))
            for k in range(bodies):
                one, other = (each.placement(each.neutral(), f"body_{k}") for each in (chain, again))
                np.testing.assert_allclose(one.homogeneous, other.homogeneous, atol=1e-15)
            return
        with pytest.raises(InvalidInput, match="URDF has no joint for 'joint_0'"):
            urdf_of(chain)
        return
    text, closures = urdf_of(chain)
    assert (closures.root.joint, closures.root.name) == (root, "joint_0")
    again = ClosedChain.from_urdf(text, closures)
    assert again.model.joints[1].shortname() == chain.model.joints[1].shortname()
    assert again.model.nv == chain.model.nv


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0)])
def test_damping_of_a_free_body_is_not_written_silently(place):
    model = hung(pin.JointModelFreeFlyer, place).model
    model.damping = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.1])
    with pytest.raises(InvalidInput, match="URDF cannot hold the damping of joint 'joint_0'"):
        urdf_of(ClosedChain(model, Closures("hung")))


@pytest.mark.parametrize("effort", [np.inf, 5.0, 0.0])
@pytest.mark.parametrize("velocity", [np.inf, 2.0])
@pytest.mark.parametrize(("damping", "friction"), [(0.0, 0.0), (0.3, 0.0), (0.0, 0.2), (0.3, 0.2)])
@pytest.mark.parametrize("joint", [pin.JointModelRX, pin.JointModelPX, pin.JointModelRUBX])
def test_what_a_joint_has_comes_back_and_nothing_else(effort, velocity, damping, friction, joint):
    model = hung(joint).model
    for name, value in (("Effort", effort), ("Velocity", velocity), ("DryFriction", friction)):
        setattr(model, f"upper{name}Limit", np.array([value]))
        setattr(model, f"lower{name}Limit", np.array([-value]))
    model.damping = np.array([damping])
    text, closures = urdf_of(ClosedChain(model, Closures("hung")))
    endless = joint is pin.JointModelRUBX
    # A joint with an end needs a limit in URDF, an endless one only where there is something to say.
    assert ("<limit" in text) == (not endless or np.isfinite([effort, velocity]).any())
    assert ("<dynamics" in text) == (damping > 0.0 or friction > 0.0)
    again = ClosedChain.from_urdf(text, closures).model
    for name in ("upperEffortLimit", "lowerEffortLimit", "upperVelocityLimit", "lowerVelocityLimit", "damping"):
        np.testing.assert_array_equal(getattr(again, name), getattr(model, name), name)
    for name in ("upperDryFrictionLimit", "lowerDryFrictionLimit"):
        np.testing.assert_array_equal(getattr(again, name), getattr(model, name), name)
    if not endless:
        assert (again.lowerPositionLimit[0], again.upperPositionLimit[0]) == (-np.inf, np.inf)


TWO = """<robot name="r"><link name="a"/><link name="b"/><link name="c"/>
<joint name="one" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint>
<joint name="two" type="{kind}"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/>{limit}
<mimic joint="one" {given}/></joint></robot>"""


@pytest.mark.parametrize(
    ("given", "numbers"),
    [
        ("", (0.0, 1.0)),
        ('multiplier="2"', (0.0, 2.0)),
        ('offset="0.4"', (0.4, 1.0)),
        ('offset="1" multiplier="-3"', (1, -3)),
    ],
)
@pytest.mark.parametrize("kind", ["continuous", "revolute", "prismatic"])
def test_a_mimic_joint_follows_with_urdfs_defaults(given, numbers, kind):
    limit = '<limit lower="-9" upper="9" effort="1" velocity="1"/>' if kind != "continuous" else ""
    chain = ClosedChain.from_urdf(TWO.format(kind=kind, limit=limit, given=given), Closures("r"))
    assert chain.model.nq == 2
    offset, multiplier = numbers
    for q in (-4.0, 0.0, 7.0):
        # It counts turns.
        np.testing.assert_allclose(chain.residual(np.array([q, offset + multiplier * q])), 0.0, atol=1e-15)
        gap = chain.residual(np.array([q, offset + multiplier * q + 0.25]))
        np.testing.assert_allclose(np.abs(gap), 0.25, atol=1e-15)


@pytest.mark.parametrize(
    ("stated", "said"),
    [
        ((0.4, 2.0), None), ((0.4 + 1e-13, 2.0), None), ((0.4 + 1e-11, 2.0), "mimics"), ((0.4, 2.0 + 1e-11), "mimics"),
        ((0.4,), "mimics"), ((0.4, 2.0, 1e-9), "mimics"),
    ],
)  # fmt: skip
def test_a_closure_that_says_the_same_stands_for_the_mimic(stated, said):
    text = TWO.format(kind="continuous", limit="", given='multiplier="2" offset="0.4"')
    closures = Closures("r", closures=(Closure("gear", "coupling", "one", "two", polynomial=stated),))
    if said is None:
        assert [closure.name for closure in ClosedChain.from_urdf(text, closures).closures] == ["gear"]
        return
    with pytest.raises(InvalidInput, match=f"joint 'two' {said} 'one' .* closure 'gear' couples them otherwise"):
        ClosedChain.from_urdf(text, closures)


def test_a_closure_of_other_joints_or_another_kind_is_no_mimic():
    text = TWO.format(kind="continuous", limit="", given='multiplier="2"')
    others = (
        Closure("back", "coupling", "two", "one", polynomial=(0.0, 0.5)),
        Closure("two_mimic", "spherical", "a", "c"),
        Closure("lock", "coupling", "universe", "two", polynomial=(0.0,)),
    )
    chain = ClosedChain.from_urdf(text, Closures("r", closures=others))
    assert [closure.name for closure in chain.closures] == ["back", "two_mimic", "lock", "two_mimic_"]
    assert [closure.type for closure in chain.closures].count("coupling") == 3


@pytest.mark.parametrize(
    ("polynomial", "references", "expected"),
    [
        # q_b - r_b = c_0 + c_1 (q_a - r_a), as a URDF's mimic joint counts from zero.
        ((0.1, 3.0), (0.2, 0.5), (0.5 + 0.1 - 0.6, 3.0)), ((0.1, 0.0), (0.3, 0.2), (0.3, 0.0)),
        ((0.1, 2.0, 0.0), (0.0, 0.0), (0.1, 2.0)), ((0.1, 2.0, 0.0, 0.0, 0.0), (0.1, 0.0), (-0.1, 2.0)),
        ((0.1,), (0.0, 0.0), (0.1, 0.0)), ((0.1, 2.0, 1e-9), (0.0, 0.0), None),
        ((0.0, 1.0, 0.0, 0.0, 0.5), (0.0, 0.0), None), ("held", (0.0, 0.0), None),
    ],
)  # fmt: skip
def test_a_coupling_is_written_as_a_mimic_if_it_is_linear(polynomial, references, expected):
    text = TWO.format(kind="continuous", limit="", given="").replace('<mimic joint="one" />', "")
    leader, numbers = ("universe", (0.1,)) if polynomial == "held" else ("one", polynomial)
    gear = Closure("gear", "coupling", leader, "two", polynomial=numbers, references=references)
    written, _ = urdf_of(ClosedChain.from_urdf(text, Closures("r", closures=(gear,))))
    found = re.findall(r'<mimic joint="one" multiplier="(.*?)" offset="(.*?)" />', written)
    if expected is None:
        assert found == []
        assert "<mimic" not in written
        return
    np.testing.assert_allclose([float(word) for word in found[0][::-1]], expected, atol=1e-15)
