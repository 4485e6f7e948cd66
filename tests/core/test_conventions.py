import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from exo_pin import InvalidInput, UnknownName, shoulder_angles, shoulder_rotation, thesis_angles, thesis_rotation
from exo_pin.core.conventions import MIRROR, mirrored

DOWN = np.array([0.0, 0.0, -1.0])


def test_thesis_rotation_is_the_printed_matrix():
    # (4-7) entry by entry.
    x, y, z = 0.3, -0.7, 1.1
    cx, sx, cy, sy, cz, sz = np.cos(x), np.sin(x), np.cos(y), np.sin(y), np.cos(z), np.sin(z)
    printed = [
        [cy * cz, -cy * sz, sy],
        [cx * sz + sx * sy * cz, cx * cz - sx * sy * sz, -cy * sx],
        [sx * sz - cx * sy * cz, sx * cz + cx * sy * sz, cx * cy],
    ]
    np.testing.assert_allclose(thesis_rotation(x, y, z).as_matrix(), printed, atol=1e-15)


def test_clinical_signs_of_the_left_arm():
    forward = shoulder_rotation(90, 0, 0, degrees=True).apply(DOWN)
    outward = shoulder_rotation(0, 90, 0, degrees=True).apply(DOWN)
    inward = shoulder_rotation(0, 0, 90, degrees=True).apply([1.0, 0.0, 0.0])
    np.testing.assert_allclose(forward, [1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(outward, [0, 1, 0], atol=1e-15)
    # What points forward on the left arm points to the body's middle, -y, after internal rotation.
    np.testing.assert_allclose(inward, [0, -1, 0], atol=1e-15)


def test_right_shoulder_is_the_mirror_image():
    angles = np.random.default_rng(1).uniform(-1, 1, (3, 20))
    left = shoulder_rotation(*angles)
    right = shoulder_rotation(*angles, side="right")
    np.testing.assert_allclose(right.as_matrix(), MIRROR @ left.as_matrix() @ MIRROR, atol=1e-15)
    np.testing.assert_allclose(mirrored(left).as_matrix(), right.as_matrix(), atol=1e-15)


@pytest.mark.parametrize("side", ["left", "right"])
def test_angles_come_back(side):
    angles = np.random.default_rng(2).uniform(-1.5, 1.5, (30, 3))
    back = shoulder_angles(shoulder_rotation(*angles.T, side=side), side=side)
    np.testing.assert_allclose(back, angles, atol=1e-13)
    np.testing.assert_allclose(thesis_angles(thesis_rotation(*angles.T)), angles, atol=1e-13)


def test_the_two_orders_differ_and_agree_only_without_the_first_angle():
    assert (thesis_rotation(0.4, 0.5, 0.1).inv() * shoulder_rotation(-0.5, 0.4, -0.1)).magnitude() > 0.1
    assert (thesis_rotation(0.0, 0.5, 0.1).inv() * shoulder_rotation(-0.5, 0.0, -0.1)).magnitude() < 1e-15


def test_gimbal_lock_keeps_the_rotation():
    locked = shoulder_rotation(20, 90, 30, degrees=True)
    again = shoulder_rotation(*shoulder_angles(locked))
    # At the lock SciPy splits the sum of the two angles to about the square root of machine accuracy.
    assert (locked.inv() * again).magnitude() < 1e-7


def test_stacks_broadcast():
    rng = np.random.default_rng(4)
    x, z = rng.uniform(-1.0, 1.0, (4, 5)), rng.uniform(-1.0, 1.0, 5)
    found = thesis_rotation(x, 0.1, z)
    assert found.shape == (4, 5)
    one_by_one = Rotation.from_euler("XYZ", [[a, 0.1, b] for row in x for a, b in zip(row, z, strict=True)])
    assert (found.as_matrix().reshape(20, 3, 3) == one_by_one.as_matrix()).all()


@pytest.mark.parametrize("bad", [np.nan, np.inf, "a", None, 1j])
def test_bad_angles_are_named(bad):
    with pytest.raises(InvalidInput, match="theta_y"):
        thesis_rotation(0.0, bad, 0.0)


def test_bad_side_and_shapes():
    with pytest.raises(UnknownName, match="left, right"):
        shoulder_rotation(0, 0, 0, side="links")
    with pytest.raises(InvalidInput, match="broadcast"):
        thesis_rotation(np.zeros(2), np.zeros(3), 0)
    with pytest.raises(InvalidInput, match="Rotation"):
        thesis_angles(np.eye(3))
    assert isinstance(thesis_rotation(0, 0, 0), Rotation)
