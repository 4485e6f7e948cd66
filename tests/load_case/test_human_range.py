import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.load_case.case import outside_human_range


@pytest.fixture(scope="module")
def left():
    return ep.load("prototype")


@pytest.fixture(scope="module")
def right():
    return ep.load("prototype", side="right")


@pytest.mark.parametrize("side", ["left", "right"])
def test_daily_poses_are_within_the_range(side):
    assert not outside_human_range(ep.adl_box(8, side).as_matrix().reshape(-1, 3, 3), side).any()


def test_pose_is_on_the_designs_own_side(left, right):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert left.pose(60, 30, 10).approx_equal(ep.shoulder_rotation(60, 30, 10, "left", degrees=True))
        assert right.pose(60, 30, 10).approx_equal(ep.shoulder_rotation(60, 30, 10, "right", degrees=True))
        assert left.pose(flexion=[0, 30, 60], abduction=[[0], [20]]).shape == (2, 3)


def test_pose_of_the_other_side_is_noticed(right):
    left_pose = ep.shoulder_rotation(0, 60, 0, "left", degrees=True)
    angles = ep.shoulder_angles(left_pose, "right", degrees=True)
    with pytest.warns(ep.OutsideHumanRange, match='a left shoulder does: load the design with side="left"'):
        right.pose(*angles)


@pytest.mark.parametrize(
    ("angles", "words"),
    [
        ({"flexion": np.pi / 3}, "60° in radians"),
        ({"abduction": [0.0, np.radians(45)]}, "45° in radians"),
        ({"flexion": 1.05}, "60° in radians"),
        ({"abduction": -1.571}, "-90° in radians"),
        ({"flexion": np.linspace(0.0, 1.57, 50)}, "90° in radians"),
        ({"flexion": np.linspace(0.0, -0.7, 50)}, "-40° in radians"),
        ({"flexion": 200}, "beyond half a turn"),
        ({"flexion": -90}, "check the signs"),
    ],
)
def test_suspicious_angles_are_noticed(left, angles, words):
    with pytest.warns(ep.OutsideHumanRange, match=words):
        left.pose(**angles)


@pytest.mark.parametrize(
    "flexion", [0, 1, 2, 3, 0.5, 1.5, 57.29577951308232, [0, 1, 2], [0, 1, 2, 3], np.linspace(0, 6, 40)]
)
def test_small_angles_in_degrees_pass(left, flexion):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        left.pose(flexion)


def test_range_of_both_sides_is_mirrored():
    rotations = Rotation.random(200, rng=np.random.default_rng(3)).as_matrix()
    mirror = np.diag([1.0, -1.0, 1.0])
    assert np.array_equal(
        outside_human_range(rotations, "left"), outside_human_range(mirror @ rotations @ mirror, "right")
    )
