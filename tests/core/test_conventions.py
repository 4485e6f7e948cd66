import numpy as np
import pytest

from exo_pin import shoulder_angles, shoulder_rotation, thesis_angles, thesis_rotation

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
    right, mirror = shoulder_rotation(*angles, side="right"), np.diag([1.0, -1.0, 1.0])
    np.testing.assert_allclose(right.as_matrix(), mirror @ left.as_matrix() @ mirror, atol=1e-15)


@pytest.mark.parametrize("side", ["left", "right"])
def test_angles_come_back(side):
    angles = np.random.default_rng(2).uniform(-1.5, 1.5, (30, 3))
    back = shoulder_angles(shoulder_rotation(*angles.T, side=side), side=side)
    np.testing.assert_allclose(back, angles, atol=1e-13)
    np.testing.assert_allclose(thesis_angles(thesis_rotation(*angles.T)), angles, atol=1e-13)
