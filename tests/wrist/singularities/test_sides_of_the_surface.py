"""Sides of the singular surface: of the hanging arm, of starts, of ranges; and when limbs count as folded."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import random_mechanism

from exo_pin import InvalidInput, wrist
from exo_pin.design import WristGeometry, preset
from exo_pin.load_case.ranges_of_motion import ADL_BOX, grid_rotation, share_of_volume
from exo_pin.wrist import daily_crossings, free_region, locus_function
from exo_pin.wrist.singularities.measures import kind_of
from exo_pin.wrist.singularities.singularity_free_region import _label_of, side_of_rest


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
        free_region(geometry, step_deg=45.0)
    with pytest.raises(InvalidInput, match="single rotation"):
        free_region(geometry, Rotation.random(2, rng=0), step_deg=45.0)
    for step in (40.0, 89.0):
        with pytest.raises(InvalidInput, match="divides 90"):
            free_region(preset("prototype").geometry, step_deg=step)


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("start", [None, Rotation.from_rotvec([0.0, -1.2, 0.0])])
def test_shares_of_a_range_are_those_of_its_nodes(start):
    """Beyond the surface, not reached, and close to it, by the same rule of volumes."""
    geometry, step = preset("prototype").geometry, 30.0
    (found,) = daily_crossings(geometry, [ADL_BOX], step, start=start)
    poses, axes = ADL_BOX.poses(step), ADL_BOX.axes(step)
    smooth, determinant = locus_function(geometry, poses)
    here, _ = locus_function(geometry, Rotation.identity() if start is None else start)
    region = free_region(geometry, start, step)
    assert found.range is ADL_BOX
    for share, member in (
        (found.across, smooth * here < 0.0),
        (found.unreachable, ~region.contains(poses)),
        (found.close, np.abs(determinant) < 0.05),
    ):
        expected = share_of_volume(member, axes)
        assert float(share) == float(expected)
        assert 0.0 < float(share) < 1.0
    assert found.unreachable >= found.across


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


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("step", [30.0, 22.5])
def test_the_region_of_a_start_is_its_side_of_the_grid(step):
    """The prototype's surface has two sides: their nodes and shares make up all of the rotation group."""
    geometry = preset("prototype").geometry
    here, there = (free_region(geometry, pose, step) for pose in (None, Rotation.from_rotvec([0.6, 0.0, 0.0])))
    for region in (here, there):
        flexion, abduction, internal = region.axes
        np.testing.assert_array_equal(flexion, np.arange(-180.0, 180.0, step))
        np.testing.assert_array_equal(internal, flexion)
        np.testing.assert_array_equal(abduction, np.arange(-90.0, 90.0 + step / 2, step))
        assert region.components == 2
        assert region.inside.shape == (len(flexion), len(abduction), len(flexion))
    smooth, _ = locus_function(geometry, grid_rotation(*here.axes, side="left"))
    assert (here.sign, there.sign) == (-1.0, 1.0)
    # Between sheets closer than a step a node may be cut off.
    for region, side in ((here, smooth < 0.0), (there, smooth > 0.0)):
        assert (region.inside <= side).all()
        assert (region.inside != side).mean() < 3e-3
    assert float(here.share) + float(there.share) == pytest.approx(1.0, abs=5e-3)
    # Nodes by the volume they stand for, cos of abduction; of half a step at the poles.
    weights = np.broadcast_to(np.cos(np.radians(here.axes[1]))[None, :, None], smooth.shape)
    assert float(here.share) == pytest.approx((weights * here.inside).sum() / weights.sum(), abs=0.02)
    assert here.contains(Rotation.identity())
    assert not there.contains(Rotation.identity())


@pytest.mark.usefixtures("plain")
def test_a_pose_has_the_label_of_the_nearest_node_on_its_side():
    """Each node has a label of its own here."""
    geometry = preset("prototype").geometry
    region = free_region(geometry, step_deg=30.0)
    smooth, _ = locus_function(geometry, grid_rotation(*region.axes, side="left"))
    nodes = grid_rotation(*region.axes, side="left").as_quat().reshape(-1, 4)
    side, labels = replace(region, inside=smooth < 0.0), np.arange(smooth.size).reshape(smooth.shape)
    asked = 0
    for pose in Rotation.random(12, rng=np.random.default_rng(312)):
        if not side.contains(pose):
            with pytest.raises(InvalidInput, match="too coarse"):
                _label_of(side, labels, pose)
            continue
        away = (Rotation.from_quat(nodes) * pose.inv()).magnitude()
        away[smooth.ravel() >= 0.0] = np.inf
        found = _label_of(side, labels, pose)
        assert away[found] == pytest.approx(away.min(), abs=1e-9)
        asked += 1
    assert asked > 3
    with pytest.raises(InvalidInput, match="too coarse"):
        _label_of(replace(region, inside=np.zeros_like(region.inside)), labels, Rotation.identity())
