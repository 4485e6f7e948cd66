"""Where a search judges: poses and their weights."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.load_case import ADL_BOX
from exo_pin.workspace import lifting_poses

SearchPoses = type(lifting_poses())


@pytest.mark.parametrize("side", ["left", "right"])
def test_poses_of_a_search(side):
    found = lifting_poses(side, counts=(3, 2, 2), lifting_weight=0.4)
    lines = found.poses[12:22], found.poses[22:]
    assert len(found.poses) == 12 + 20
    np.testing.assert_allclose(found.weights[:12], 0.6 / 12)
    np.testing.assert_allclose(found.weights[12:], 0.4 / 20)
    corners = [ep.shoulder_rotation(f, a, i, side, degrees=True) for f in np.linspace(*ADL_BOX.intervals[0], 3)
               for a in ADL_BOX.intervals[1] for i in ADL_BOX.intervals[2]]  # fmt: skip
    for one, other in zip(found.poses[:12], corners, strict=True):
        assert (one * other.inv()).magnitude() < 1e-12
    # Rows of zeros and of angles: forward turns the arm towards x, sideways towards the side.
    out = 1.0 if side == "left" else -1.0
    for line, aside in zip(lines, ([1.0, 0.0, 0.0], [0.0, out, 0.0]), strict=True):
        angles = np.radians(np.linspace(0.0, 90.0, 10))[:, None]
        arm = line.apply([0.0, 0.0, -1.0])
        np.testing.assert_allclose(arm, np.sin(angles) * aside - np.cos(angles) * [0.0, 0.0, 1.0], atol=1e-12)
    default = lifting_poses(side)
    assert len(default.poses) == 7 * 6 * 6 + 20
    assert default.weights[-20:].sum() == pytest.approx(0.3)


def test_weights_of_poses():
    turns = Rotation.from_rotvec(np.eye(3))
    np.testing.assert_allclose(SearchPoses(turns, [1.0, 0.0, 3.0]).weights, [0.25, 0.0, 0.75])
    np.testing.assert_allclose(SearchPoses.of(turns).weights, 1.0 / 3.0)
    assert SearchPoses.of(turns[0]).weights.tolist() == [1.0]
    grid = Rotation.from_quat(np.tile(turns.as_quat(), (2, 1)).reshape(2, 3, 4))
    assert SearchPoses.of(grid).poses.shape == (6,)
    for weights in ([1.0, 1.0], [1.0, -1.0, 3.0], [0.0, 0.0, 0.0]):
        with pytest.raises(InvalidInput, match="one weight of zero or more a pose"):
            SearchPoses(turns, weights)
    for given in (turns.as_quat(), turns[:0]):
        with pytest.raises(InvalidInput, match="stack of rotations"):
            SearchPoses.of(given)
    shift = ep.CentreOffset.together([0.01, 0.02, 0.03])
    twice = SearchPoses(turns, [1.0, 2.0, 1.0]).at_centres((None, shift))
    np.testing.assert_allclose(twice.weights, [0.125, 0.25, 0.125] * 2)
    np.testing.assert_allclose(twice.offsets.base, [[0.0] * 3] * 3 + [[0.01, 0.02, 0.03]] * 3)
    assert (twice.poses[:3] * twice.poses[3:].inv()).magnitude().max() < 1e-12
