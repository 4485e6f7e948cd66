"""Shares of the rotation group: exact volumes, and errors that cover."""

import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from exo_pin.load_case.ranges_of_motion import ADL_BOX, Share, cell_volumes, grid_axes, grid_rotation, share_of_volume


def whole(step):
    """Axes of the whole group, whose first and last flexion and rotation are one."""
    quarter = round(90.0 / step)
    circle = step * np.arange(4 * quarter + 1) - 180.0
    return circle, step * np.arange(2 * quarter + 1) - 90.0, circle


def volume_up_to(angles):
    """The integral of |cos| from 0 to at most 180°, degrees in."""
    sine = np.sin(np.radians(angles))
    return np.where(np.abs(angles) <= 90.0, sine, 2.0 - sine)


def test_volumes_of_cells_by_hand():
    """Widths of flexion and rotation times differences of the sine; an axis of one node does not count."""
    axes = np.array([0.0, 30.0, 40.0]), np.array([60.0, 120.0, 150.0]), np.array([5.0])
    flexion = np.array([15.0, 20.0, 5.0]) / 40.0
    ends = volume_up_to(np.array([60.0, 90.0, 135.0, 150.0]))
    abduction = np.diff(ends) / (ends[-1] - ends[0])
    volumes = cell_volumes(axes)
    np.testing.assert_allclose(volumes[:, :, 0], np.outer(flexion, abduction), atol=1e-15)
    # Falling axes are the same cells.
    down = cell_volumes((axes[0][::-1], axes[1][::-1], axes[2]))
    np.testing.assert_allclose(down[::-1, ::-1], volumes, atol=1e-15)
    # Below -90° and beyond 90° the cosine is counted by its size: symmetric cells are alike.
    wide = cell_volumes((np.zeros(1), np.array([-150.0, -90.0, -30.0, 30.0, 90.0, 150.0]), np.zeros(1))).ravel()
    np.testing.assert_allclose(wide, wide[::-1], atol=1e-15)
    half = 1.0 - np.sin(np.radians(60.0))  # from 120° to 150° and to 180°
    assert wide[0] / wide[2] == pytest.approx((np.sin(np.radians(120.0)) - 0.5) / np.sin(np.radians(60.0)))
    assert wide[1] / wide[2] == pytest.approx(2.0 * half / np.sin(np.radians(60.0)))


def test_error_of_a_share_by_hand():
    """Half the spread of the shares of the three coarser grids, whose end cells reach to the ends."""
    nodes, member = np.arange(7.0), np.array([1, 0, 0, 1, 0, 1, 0], dtype=bool)
    axes = nodes, np.zeros(1), np.zeros(1)
    share = share_of_volume(member[:, None, None], axes)
    assert share == pytest.approx((0.5 + 1.0 + 1.0) / 6.0)
    # Nodes 0, 3, 6 with cells of 1.5, 3, 1.5; 1, 4 with 2.5, 3.5; 2, 5 with 3.5, 2.5.
    coarse = [(1.5 + 3.0) / 6.0, 0.0, 2.5 / 6.0]
    assert share.error == pytest.approx(0.5 * (max(coarse) - min(coarse)))
    assert np.isnan(share_of_volume(member[:5, None, None], (nodes[:5], *axes[1:])).error)


@pytest.mark.parametrize("count", [20, pytest.param(200, marks=pytest.mark.full)])
def test_balls_of_known_volume(count):
    """All rotations within an angle α of a pose: (α - sin α)/π of the group."""
    rng, axes = np.random.default_rng(1), whole(10.0)
    matrices = grid_rotation(*axes).as_matrix()
    for _ in range(count):
        centre, angle = Rotation.random(rng=rng).as_matrix(), rng.uniform(0.5, 2.8)
        member = np.einsum("...ij,ij->...", matrices, centre) >= 1.0 + 2.0 * np.cos(angle)
        share = share_of_volume(member, axes)
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
def test_a_grid_is_known_by_its_poses(side):
    """Also beyond 90° of abduction, falling, and of quaternions of either sign, which turn alike."""
    axes = np.array([100.0, 55.0, 10.0]), np.array([5.0, 60.0, 110.0]), np.array([-35.0, 15.0])
    quats = grid_rotation(*axes, side=side).as_quat()
    quats[:, 1] *= -1.0
    for own, found in zip(axes, grid_axes(Rotation.from_quat(quats), side), strict=True):
        np.testing.assert_allclose(found, own, atol=1e-9)
    for one in (np.s_[:1], np.s_[:, :1], np.s_[:, :, :1]):
        for own, found in zip(axes, grid_axes(Rotation.from_quat(quats[one]), side), strict=True):
            np.testing.assert_allclose(found, own[: len(found)], atol=1e-9)
    moved = Rotation.from_quat(quats[1, 2, 1]) * Rotation.from_rotvec([0.0, 0.0, 1e-3])
    quats[1, 2, 1] = moved.as_quat()
    assert grid_axes(Rotation.from_quat(quats), side) is None


def test_a_share_is_a_number_with_its_error():
    share = Share(0.892, 0.004)
    assert share.percent == "89.2 ± 0.4 %"
    # A grid that is too small for an estimate of the error has none in words.
    assert Share(0.9081, float("nan")).percent == "90.8 %"
    back = pickle.loads(pickle.dumps(share))
    assert (back, back.error) == (share, 0.004)
