"""URDF that is written and read again."""

import numpy as np
import pinocchio as pin
import pytest
from closed_chains import CHAINS, off
from massive_chains import MASSIVE
from scipy.spatial.transform import Rotation

from exo_pin.chain import ClosedChain, Closure, Closures, read_closures
from exo_pin.chain.formats.urdf.urdf_mimic import linear


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


def test_a_linear_coupling_is_an_offset_and_a_multiplier():
    """q_b - r_b = c_0 + c_1 (q_a - r_a), as a URDF's mimic joint counts from zero."""
    given = Closure("gear", "coupling", "a", "b", polynomial=(0.1, 3.0), references=(0.2, 0.5))
    offset, multiplier = linear(given)
    for q_a in (-1.0, 0.7):
        assert offset + multiplier * q_a == pytest.approx(0.5 + 0.1 + 3.0 * (q_a - 0.2))
