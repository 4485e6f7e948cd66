"""Sides of the singular surface: of the hanging arm, of starts, of ranges; and when limbs count as folded."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import random_mechanism

from exo_pin import InvalidInput, wrist
from exo_pin.design import WristGeometry, preset
from exo_pin.load_case.ranges_of_motion import ADL_BOX, share_of_volume
from exo_pin.wrist import daily_crossings
from exo_pin.wrist.singularities.measures import kind_of, locus_function
from exo_pin.wrist.singularities.singular_surface import side_of_rest


def flat():
    """All joints in the frontal plane: the limbs' normals are parallel in the hanging pose."""
    base, platform = np.random.default_rng(310).uniform(0.1, 0.3, (2, 3, 3))
    base[:, 0] = platform[:, 0] = 0.0
    return WristGeometry(base * [1, 1, -1], platform * [1, -1, 1])


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("seed", range(6))
def test_the_side_of_rest_is_the_sign_of_the_hanging_arms_determinant(seed):
    geometry = random_mechanism(np.random.default_rng(seed), 3).geometry
    normals = wrist.inverse_kinematics(geometry, Rotation.identity()).normals
    assert side_of_rest(geometry) == np.sign(np.linalg.det(normals))
    other = geometry.replace(
        base_points=geometry.base_points[[1, 0, 2]], platform_points=geometry.platform_points[[1, 0, 2]]
    )
    assert side_of_rest(other) == -side_of_rest(geometry)


@pytest.mark.usefixtures("plain")
def test_a_singular_pose_of_rest_has_no_side_and_is_no_start():
    geometry = flat()
    assert side_of_rest(geometry) == 0
    with pytest.raises(InvalidInput, match="singular pose"):
        daily_crossings(geometry, step_deg=45.0)
    with pytest.raises(InvalidInput, match="single"):
        daily_crossings(geometry, step_deg=45.0, start=Rotation.random(2, rng=0))


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("start", [None, Rotation.from_rotvec([0.0, -1.2, 0.0])])
def test_shares_of_a_range_are_those_of_its_nodes(start):
    """Beyond the surface, and close to it, by the same rule of volumes."""
    geometry, step = preset("prototype").geometry, 30.0
    (found,) = daily_crossings(geometry, [ADL_BOX], step, start=start)
    poses, axes = ADL_BOX.poses(step), ADL_BOX.axes(step)
    smooth, determinant = locus_function(geometry, poses)
    here, _ = locus_function(geometry, Rotation.identity() if start is None else start)
    assert found.range is ADL_BOX
    for share, member in (
        (found.across, smooth * here < 0.0),
        (found.close, np.abs(determinant) < 0.05),
    ):
        expected = share_of_volume(member, axes)
        assert float(share) == float(expected)
        assert 0.0 < float(share) < 1.0


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("size", [0.05, 1.0, 5.0])
def test_limbs_are_folded_by_their_angle_and_not_by_their_reach(size):
    """At a line through O within a billionth or so, of a wrist of any size."""
    one = random_mechanism(np.random.default_rng(311), 3).geometry
    geometry = one.replace(base_points=size * one.base_points, platform_points=size * one.platform_points)
    a, b = np.array(one.base_points[0]), np.array(one.platform_points[0])
    folded, _ = Rotation.align_vectors(-a[None], b[None])
    across = np.cross(a, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    for angle, expected in ((0.0, True), (1e-4, False), (1e-6, False)):
        state = wrist.singularity(geometry, Rotation.from_rotvec(angle * across) * folded)
        assert state.folded.tolist() == [expected, False, False]
        assert (state.kind == "folded") == expected
        assert np.isnan(state.determinant) == expected


def test_kinds_of_poses_by_margin():
    margin, folded = np.array([0.0, 0.9e-3, 1.1e-3, 1.0, 1.0]), np.array([False] * 4 + [True])
    assert kind_of(margin, folded).tolist() == ["singular", "near", "regular", "regular", "folded"]
