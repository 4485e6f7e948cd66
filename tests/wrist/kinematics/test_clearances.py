"""Distances of limbs from the arm and from each other."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

import exo_pin as ep
from exo_pin import wrist
from exo_pin.core import errors
from exo_pin.study import StudyTable, non_dominated
from exo_pin.wrist.kinematics.clearances import _segment_distance

POSES = ep.shoulder_rotation([0, 30, 60], [0, 20, 70], [0, 10, -20], degrees=True)


def searched(p, q, r, s):
    """Distance of two segments as a bounded least-squares problem, solved on active sets."""
    ways = np.stack([q - p, r - s], axis=1)
    return np.linalg.norm(lsq_linear(ways, r - p, bounds=(0, 1), method="bvls", tol=1e-15).fun)


def test_distance_is_the_least_over_both_segments():
    ends = np.random.default_rng(2).normal(size=(4, 300, 3))
    found = _segment_distance(*ends)
    expected = [searched(*ends[:, k]) for k in range(300)]
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_parallel_crossing_and_short_segments():
    zero, x, y = np.zeros(3), np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
    assert _segment_distance(zero, x, y, x + y) == pytest.approx(1.0)
    assert _segment_distance(zero, x, 3 * x, 4 * x) == pytest.approx(2.0)
    assert _segment_distance(-x, x, -y, y) == 0.0
    assert _segment_distance(-x, x, 0.3 * x + 0.1 * y, 5 * y) == pytest.approx(0.1)


@pytest.mark.parametrize("count", [3, 4])
def test_clearances_of_a_wrist(count):
    exo = ep.load("prototype")
    geometry = exo.geometry
    if count == 4:
        circles = geometry.circles
        geometry = geometry.replace(alpha_A=np.append(circles.alpha_A, 3.0), alpha_B=np.append(circles.alpha_B, 3.5))
    arm, other = wrist.arm_clearance(geometry, POSES), wrist.limb_clearance(geometry, POSES)
    assert arm.shape == other.shape == (3, count)
    for k, R in enumerate(POSES):
        a, b = geometry.base_points, geometry.platform_points @ R.as_matrix().T
        hand = R.as_matrix() @ [0, 0, -0.3]
        for i in range(count):
            assert arm[k, i] == pytest.approx(searched(a[i], b[i], np.zeros(3), hand), abs=1e-9)
            nearest = min(searched(a[i], b[i], a[j], b[j]) for j in range(count) if j != i)
            assert other[k, i] == pytest.approx(nearest, abs=1e-9)
    np.testing.assert_array_equal(wrist.arm_clearance(geometry, POSES[1]), arm[1])
    with pytest.raises(errors.InvalidInput, match="length"):
        wrist.arm_clearance(geometry, POSES, length=0.0)


def test_designs_that_none_betters():
    rng = np.random.default_rng(4)
    table = StudyTable([{"held": h, "peak": p, "margin": m} for h, p, m in rng.integers(0, 6, (80, 3)).astype(float)])
    front = non_dominated(table, largest=("held", "margin"), smallest=("peak",))
    rows = np.stack([table["held"], table["margin"], -table["peak"]], axis=-1)
    for row, kept in zip(rows, front, strict=True):
        assert kept == (not any((rival >= row).all() and (rival > row).any() for rival in rows))
    assert 0 < front.sum() < 80


def test_a_row_without_a_figure_is_in_no_front():
    table = {"held": [1.0, np.nan, 0.5], "peak": [10.0, 1.0, 20.0]}
    np.testing.assert_array_equal(non_dominated(table, ["held"], ["peak"]), [True, False, False])
    with pytest.raises(errors.InvalidInput, match="at least one column"):
        non_dominated(table)
    with pytest.raises(errors.UnknownName, match="hold"):
        non_dominated(StudyTable([{"held": 1.0}]), largest=["hold"])
