"""Shares of the rotation group: exact volumes, and errors that cover."""

import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from exo_pin.load_case.ranges_of_motion import ADL_BOX, Share, cell_volumes, grid_axes, grid_rotation, share_of_volume
from exo_pin.study import adl_box


def whole(step):
    """Axes of the whole group, closed in flexion and rotation."""
    quarter = round(90.0 / step)
    circle = step * np.arange(4 * quarter) - 180.0
    return circle, step * np.arange(2 * quarter + 1) - 90.0, circle


def volume_up_to(angles):
    """The integral of |cos| from 0 to at most 180°, degrees in."""
    sine = np.sin(np.radians(angles))
    return np.where(np.abs(angles) <= 90.0, sine, 2.0 - sine)


def test_cells_fill_the_box_and_are_exact():
    axes = ADL_BOX.axes(7.0)
    volumes = cell_volumes(axes)
    assert volumes.sum() == pytest.approx(1.0, abs=1e-14)
    # Cells up to an edge between two nodes of abduction have the volume of that slab, exactly.
    middle = 0.5 * (axes[1][4] + axes[1][5])
    ends = volume_up_to(np.array([axes[1][0], middle, axes[1][-1]]))
    assert volumes[:, :5].sum() == pytest.approx((ends[1] - ends[0]) / (ends[2] - ends[0]), abs=1e-14)
    closed = cell_volumes(whole(15.0), closed=True)
    assert closed.sum() == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(closed[0], closed[7], rtol=1e-13)


@pytest.mark.parametrize("count", [20, pytest.param(200, marks=pytest.mark.full)])
def test_balls_of_known_volume(count):
    """All rotations within an angle α of a pose: (α - sin α)/π of the group."""
    rng, axes = np.random.default_rng(1), whole(10.0)
    matrices = grid_rotation(*axes).as_matrix()
    for _ in range(count):
        centre, angle = Rotation.random(rng=rng).as_matrix(), rng.uniform(0.5, 2.8)
        member = np.einsum("...ij,ij->...", matrices, centre) >= 1.0 + 2.0 * np.cos(angle)
        share = share_of_volume(member, axes, closed=True)
        assert abs(share - (angle - np.sin(angle)) / np.pi) <= share.error < 0.03


@pytest.mark.parametrize(("count", "step"), [(200, 6.0), pytest.param(2000, 4.0, marks=pytest.mark.full)])
def test_errors_of_boxes_cover(count, step):
    """Boxes along the axes of the grid are the worst case: all cells of a face are cut alike."""
    rng, axes = np.random.default_rng(2), ADL_BOX.axes(step)
    grids = np.meshgrid(*axes, indexing="ij")
    covered = 0
    for _ in range(count):
        member, true = np.ones(grids[0].shape, dtype=bool), 1.0
        for k, (nodes, grid) in enumerate(zip(axes, grids, strict=True)):
            low = rng.uniform(nodes[0], nodes[-1] - 20.0)
            high = rng.uniform(low + 15.0, nodes[-1])
            member &= (grid >= low) & (grid <= high)
            ends = np.array([nodes[0], low, high, nodes[-1]])
            ends = volume_up_to(ends) if k == 1 else ends
            true *= (ends[2] - ends[1]) / (ends[3] - ends[0])
        share = share_of_volume(member, axes)
        covered += abs(share - true) <= share.error
    assert covered >= 0.95 * count


@pytest.mark.parametrize("side", ["left", "right"])
def test_axes_of_a_grid_come_back(side):
    flexion, abduction, internal = grid_axes(adl_box(20.0, side), side)
    np.testing.assert_allclose(flexion, np.arange(110.0, 0.0, -20.0), atol=1e-9)
    np.testing.assert_allclose(abduction, np.arange(-4.0, 97.0, 20.0), atol=1e-9)
    np.testing.assert_allclose(internal, np.arange(85.0, -20.0, -20.0), atol=1e-9)
    assert grid_axes(Rotation.random(8, rng=0), side) is None
    scattered = Rotation.from_quat(Rotation.random(27, rng=0).as_quat().reshape(3, 3, 3, 4))
    assert grid_axes(scattered, side) is None


def test_a_share_is_a_number_with_its_error():
    share = Share(0.892, 0.004)
    assert share.percent == "89.2 ± 0.4 %"
    # A grid that is too small for an estimate of the error has none in words.
    assert Share(0.9081, float("nan")).percent == "90.8 %"
    back = pickle.loads(pickle.dumps(share))
    assert (back, back.error) == (share, 0.004)
