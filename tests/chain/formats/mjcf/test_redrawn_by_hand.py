"""Places and directions of MuJoCo's compiled model, moved within the rounding of their file."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from exo_pin.chain.formats.digits import Redrawn
from exo_pin.chain.formats.mjcf.mjcf_reading import _turn, _turned, redrawn

HALF = np.sqrt(0.5)
ROUNDING = 5e-5


@pytest.mark.parametrize(
    "quaternion",
    [(1, 0, 0, 0), (0, 1, 0, 0), (-1, 0, 0, 0), (HALF, HALF, 0, 0), (0, HALF, 0, -HALF), (HALF, 0, 0, -HALF)],
)
def test_multiples_of_a_right_angle_about_an_axis_stay(quaternion):
    given = np.array(quaternion, dtype=float)
    np.testing.assert_array_equal(_turned(given, Redrawn(0), ROUNDING), given)


@pytest.mark.parametrize(
    "quaternion", [(0.6, 0.8, 0, 0), (0.5, 0.5, 0.5, 0.5), (0.1, 0.2, 0.3, 0.9), (0.99995, 0.01, 0, 0)]
)
def test_other_turns_are_turned_within_the_rounding_about_any_axis(quaternion):
    given = np.array(quaternion) / np.linalg.norm(quaternion)
    start = Rotation.from_quat(given, scalar_first=True)
    moved = [_turned(given, Redrawn(seed), ROUNDING) for seed in range(50)]
    vectors = (Rotation.from_quat(moved, scalar_first=True) * start.inv()).as_rotvec()
    assert 0.9 * ROUNDING < np.abs(vectors).max() <= ROUNDING * (1 + 1e-6)
    assert (np.abs(vectors).max(axis=0) > 0.8 * ROUNDING).all()
    assert (vectors.max(axis=0) > 0.5 * ROUNDING).all()
    assert (vectors.min(axis=0) < -0.5 * ROUNDING).all()


def test_turns_are_within_the_rounding_on_each_axis():
    vectors = np.array([_turn(Redrawn(seed), 0.1).as_rotvec() for seed in range(100)])
    assert 0.09 < np.abs(vectors).max() <= 0.1


def test_a_redrawn_model_has_other_places_with_the_same_digits():
    text = """<mujoco><compiler autolimits="true"/><worldbody>
      <body name="one" pos="0.1234 0 1" euler="10 0 0">
        <joint name="hinge" axis="0 0.6 0.8"/><joint name="slide" type="slide" axis="1 0 0"/>
        <geom size="0.1"/><site name="tip" pos="0.2345 0.1 0"/></body>
      <body name="two"><joint axis="0 1 0"/><geom size="0.1"/></body></worldbody>
      <equality><connect name="pin" body1="one" body2="two" anchor="0.3456 0 0.5"/></equality></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    before = {
        name: np.array(getattr(model, name)) for name in ("body_pos", "body_quat", "jnt_axis", "eq_data", "site_pos")
    }
    other = redrawn(model, Redrawn(1), ROUNDING)
    for name, value in before.items():
        np.testing.assert_array_equal(getattr(model, name), value)
    off = other.body_pos - before["body_pos"]
    assert 0.0 < abs(off[1, 0]) <= ROUNDING
    np.testing.assert_array_equal(np.delete(off.ravel(), 3), 0.0)
    # A direction along an axis stays, another one turns and keeps its length.
    np.testing.assert_array_equal(other.jnt_axis[[1, 2]], before["jnt_axis"][[1, 2]])
    turned = other.jnt_axis[0]
    assert np.linalg.norm(turned) == pytest.approx(1.0)
    assert 0.0 < np.abs(turned - before["jnt_axis"][0]).max() <= 2.0 * ROUNDING
    np.testing.assert_array_equal(other.body_quat[2], before["body_quat"][2])
    assert 0.0 < np.abs(other.body_quat[1] - before["body_quat"][1]).max() <= ROUNDING
    moved = other.eq_data[0, :6] - before["eq_data"][0, :6]
    assert 0.0 < np.abs(moved).max() <= ROUNDING
    np.testing.assert_array_equal(other.eq_data[0, 6:], before["eq_data"][0, 6:])
