"""Shares of the rotation group: exact volumes, and errors that cover."""

import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from exo_pin.load_case.ranges_of_motion import ADL_BOX, Share, grid_rotation, share_of_volume


def whole(step):
    """Axes of the whole group, closed in flexion and rotation."""
    quarter = round(90.0 / step)
    circle = step * np.arange(4 * quarter) - 180.0
    return circle, step * np.arange(2 * quarter + 1) - 90.0, circle


def volume_up_to(angles):
    """The integral of |cos| from 0 to at most 180°, degrees in."""
    sine = np.sin(np.radians(angles))
    return np.where(np.abs(angles) <= 90.0, sine, 2.0 - sine)


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


def test_a_share_is_a_number_with_its_error():
    share = Share(0.892, 0.004)
    assert share.percent == "89.2 ± 0.4 %"
    # A grid that is too small for an estimate of the error has none in words.
    assert Share(0.9081, float("nan")).percent == "90.8 %"
    back = pickle.loads(pickle.dumps(share))
    assert (back, back.error) == (share, 0.004)
