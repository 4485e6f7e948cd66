"""Offsets of the device's centre in stacks of poses, in the forms that a user gives them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.workspace.optimisation.search_poses import as_centres, centre_text, shifted
from exo_pin.workspace.pose_offsets import PoseOffsets

PATH = ep.CentrePath(np.radians([0.0, 60.0, 120.0]), [[0.0] * 3, [-0.01, 0.0, 0.01], [-0.02, -0.01, 0.03]])
TURNS = Rotation.from_rotvec(np.radians([0.0, 30.0, 60.0])[:, None] * [0.0, -1.0, 0.0])
SHIFT = ep.CentreOffset.together([0.0, 0.01, 0.0])


def test_one_offset_for_all_poses_is_kept_once():
    """Both ends must be the same everywhere; of a path each pose has its own, and others are known, too."""
    shift = np.array([0.01, 0.0, 0.02])
    one = PoseOffsets.of(shift, TURNS)
    assert one.base.shape == one.cuff.shape == (1, 3)
    assert one.path is None
    stack = np.arange(9.0).reshape(3, 3) / 1e3
    for base, cuff in ((stack, shift), (shift, stack), (stack, stack)):
        found = PoseOffsets.of(ep.CentreOffset(base, cuff), TURNS)
        np.testing.assert_array_equal(found.base, np.broadcast_to(base, (3, 3)))
        np.testing.assert_array_equal(found.cuff, np.broadcast_to(cuff, (3, 3)))
        assert not found.is_aligned
        # Poses that are not in the stack have the offsets of the one that is named.
        near = found.at(TURNS[:2].as_matrix(), 2)
        np.testing.assert_array_equal(near.base, np.broadcast_to(base, (3, 3))[2:])
        np.testing.assert_array_equal(near.cuff, np.broadcast_to(cuff, (3, 3))[2:])
    for side in ("base", "cuff"):
        assert not PoseOffsets(**{"base": np.zeros((1, 3)), "cuff": np.zeros((1, 3)), side: shift[None]}).is_aligned
    moving = PoseOffsets.of(PATH, TURNS)
    assert moving.path is PATH
    np.testing.assert_allclose(moving.base, -PATH.at(np.radians([0.0, 30.0, 60.0])), atol=1e-12)
    between = Rotation.from_rotvec([[0.0, -np.radians(45.0), 0.0]])
    elsewhere = moving.at(between.as_matrix(), 0)
    np.testing.assert_allclose(elsewhere.base, -PATH.at(np.radians([45.0])), atol=1e-12)
    assert moving.rows(np.array([2])).path is PATH
    assert PoseOffsets.none().is_aligned
    assert one.rows(np.array([1, 2])) is one
    assert [side.shape for side in one.spread(3)] == [(3, 3)] * 2
    joined = PoseOffsets.joined([moving, PoseOffsets.none()], 3)
    assert joined.path is PATH
    np.testing.assert_array_equal(joined.base, np.concatenate([moving.base, np.zeros((3, 3))]))
    assert PoseOffsets.joined([PoseOffsets.none()] * 2, 3).base.shape == (1, 3)


@pytest.mark.parametrize("ends", [(np.zeros((2, 3)), np.zeros(3)), (np.zeros(3), np.zeros((2, 3)))])
def test_a_search_takes_no_stack_at_either_end(ends):
    with pytest.raises(InvalidInput, match="one offset or a CentrePath"):
        as_centres(ep.CentreOffset(*ends))


def test_forms_of_offsets():
    assert as_centres(None) == (None,)
    assert as_centres(PATH) == (PATH,)
    assert as_centres([None, PATH, SHIFT]) == (None, PATH, SHIFT)
    (given,) = as_centres([0.0, 0.01, 0.0])
    np.testing.assert_array_equal([given.base, given.cuff], [SHIFT.base, SHIFT.cuff])
    both = shifted(ep.CentreOffset([0.01, 0.0, 0.0], [0.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.002]))
    np.testing.assert_allclose([both.base, both.cuff], [[0.01, 0.0, 0.002], [0.0, 0.0, 0.002]])
    assert "(0, 10, 0) mm at the base and (0, 10, 0) mm" in centre_text(SHIFT)
    assert "off by (0, 0, 2) mm at rest" in centre_text(shifted(PATH, np.array([0.0, 0.0, 0.002])))
