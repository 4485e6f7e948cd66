"""Singularity: the closed form against Pinocchio's constraint Jacobians, brute force and finite displacements."""

import numpy as np
import pytest
from locked_chains import LockedChains
from scipy.spatial import HalfspaceIntersection
from scipy.spatial.transform import Rotation
from wrists import random_mechanism

import exo_pin as ep
from exo_pin import InvalidInput, thesis_rotation, wrist
from exo_pin.design import preset
from exo_pin.load_case import ADL_BOX

DEGREES = {"degrees": True}


def folded_pose(geometry, limb):
    turn, _ = Rotation.align_vectors(
        geometry.base_points[limb : limb + 1].copy(), geometry.platform_points[limb : limb + 1].copy()
    )
    return turn


@pytest.mark.parametrize("name", ["prototype", "scenario-one", "optimised-table-c-2"])
def test_pinocchio_says_the_same(name):
    exo = ep.load(name)
    chains = LockedChains(exo.mechanism)
    rng = np.random.default_rng(0)
    singular = [exo.nearest_singularity(pose).pose for pose in Rotation.random(2, rng)]
    for pose in [*Rotation.random(5, rng), *singular]:
        closed, chain = exo.singularity(pose), chains.singularity(pose)
        # The ball joint hides the loss from the closures alone.
        assert chain.rank == 15
        lost = int(closed.kind == "singular")
        assert chain.rank_locked == 18 - lost
        assert chain.rank_alone == 18 - lost
        assert chain.freedoms_locked == chain.freedoms_alone == lost
        assert closed.actuation == closed.constraint == bool(lost)
        assert abs(closed.lost_direction @ chain.lost_direction) == pytest.approx(1, abs=1e-9)
        if lost:
            assert chain.smallest_singular_value < 1e-12
            assert chain.centre_shift == closed.centre_shift == np.inf
        else:
            assert chain.smallest_singular_value == pytest.approx(closed.smallest_singular_value, rel=1e-9)
            assert chain.amplification == pytest.approx(closed.amplification, rel=1e-9)
            assert chain.centre_shift == pytest.approx(closed.centre_shift, rel=1e-9)


def test_a_folded_limb_lets_the_arm_go():
    exo = ep.load("prototype")
    pose = folded_pose(exo.geometry, 0)
    closed, chain = exo.singularity(pose), LockedChains(exo.mechanism).singularity(pose)
    assert closed.kind == "folded"
    assert closed.folded.tolist() == [True, False, False]
    assert closed.actuation
    assert closed.actuation_determinant == 0
    assert np.isnan(closed.determinant)
    assert chain.rank_locked == 17
    assert chain.smallest_singular_value < 1e-12
    assert abs(closed.lost_direction @ chain.lost_direction) == pytest.approx(1, abs=1e-9)
    # The limb may swivel about its own line, so the pose does not say in which plane it holds O.
    assert closed.centre_shift == np.inf


def test_determinants_are_tied():
    geometry = random_mechanism(np.random.default_rng(1), 3).geometry
    state = wrist.singularity(geometry, Rotation.random(200, np.random.default_rng(2)))
    tied = -state.reach.prod(axis=-1) * state.determinant
    np.testing.assert_allclose(state.actuation_determinant, tied, rtol=1e-8, atol=1e-18)
    assert (state.condition >= 1).all()
    # The rows of the constraint, by their own definition: unit normals of the planes through O, A_i and B_i.
    poses = Rotation.random(200, np.random.default_rng(2))
    ends = np.einsum("kij,nj->kni", poses.as_matrix(), geometry.platform_points)
    normals = np.cross(geometry.base_points, ends)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    np.testing.assert_allclose(state.constraint_condition, np.linalg.cond(normals), rtol=1e-8)


def test_condition_and_amplification_by_definition():
    geometry = preset("prototype").geometry
    pose = thesis_rotation(20, -30, 10, **DEGREES)
    state, J = wrist.singularity(geometry, pose), wrist.limb_jacobian(geometry, pose)
    assert state.condition == pytest.approx(np.linalg.cond(J), rel=1e-10)
    # The moment that a unit of force balances worst is about the lost axis.
    force = np.linalg.solve(J.T, state.lost_direction)
    assert np.linalg.norm(force) == pytest.approx(state.amplification, rel=1e-9)


def test_centre_shift_is_the_farthest_corner_of_the_play():
    rng = np.random.default_rng(3)
    for n in (3, 5):
        geometry = random_mechanism(rng, n).geometry
        for pose in Rotation.random(10, rng):
            X = wrist.inverse_kinematics(geometry, pose).normals
            halves = np.vstack([np.hstack([X, -np.ones((n, 1))]), np.hstack([-X, -np.ones((n, 1))])])
            corners = HalfspaceIntersection(halves, np.zeros(3)).intersections
            farthest = np.linalg.norm(corners, axis=1).max()
            assert wrist.singularity(geometry, pose).centre_shift == pytest.approx(farthest, rel=1e-9)


@pytest.mark.parametrize(
    ("name", "samples"),
    [("prototype", 30_000), *(pytest.param(k, 100_000, marks=pytest.mark.full) for k in ("prototype", "appendix-d"))],
)
def test_nearest_singular_pose_against_sampling(name, samples):
    geometry = preset(name).geometry
    rng = np.random.default_rng(4)
    poses = Rotation.random(4, rng)
    nearest = wrist.nearest_singularity(geometry, poses)
    assert np.abs(wrist.singularity(geometry, nearest.pose).determinant).max() < 1e-9
    np.testing.assert_allclose((nearest.pose * poses.inv()).magnitude(), nearest.distance, atol=1e-12)
    for pose, distance in zip(poses, nearest.distance, strict=True):
        side = np.sign(wrist.singularity(geometry, pose).determinant)
        axes = rng.normal(size=(samples, 3))
        axes /= np.linalg.norm(axes, axis=1)[:, None]
        # A ball a little larger than the answer: no pose inside the answer is on the other side, some beyond are.
        angle = 1.15 * distance * rng.random(samples) ** (1 / 3)
        turned = Rotation.from_rotvec(axes * angle[:, None]) * pose
        other = np.linalg.det(np.nan_to_num(wrist.inverse_kinematics(geometry, turned).normals)) * side < 0
        assert not other[angle < distance * (1 - 1e-9)].any()
        assert other.any()


def test_distance_to_folding_is_the_angle_between_two_lines():
    geometry = preset("prototype").geometry
    pose = thesis_rotation(20, -30, 10, **DEGREES)
    nearest = wrist.nearest_singularity(geometry, pose)
    b = wrist.inverse_kinematics(geometry, pose).platform_points
    for i in range(3):
        cosine = abs(geometry.base_points[i] @ b[i]) / (np.linalg.norm(geometry.base_points[i]) * np.linalg.norm(b[i]))
        assert nearest.fold_distance[i] == pytest.approx(np.arccos(cosine), rel=1e-9)
    assert (nearest.distance <= nearest.fold_distance).all()
    with pytest.raises(InvalidInput, match="three limbs"):
        wrist.nearest_singularity(random_mechanism(np.random.default_rng(5), 4).geometry, pose)


@pytest.mark.parametrize(
    ("name", "negative", "close"),
    [("prototype", 0.620, 0.284), ("optimised-table-5-3", 0.606, 0.691), ("optimised-table-c-2", 0.640, 0.124)],
)
def test_known_shares_of_the_daily_life_box(name, negative, close):
    poses = ADL_BOX.poses(5.0)
    determinant = wrist.singularity(preset(name).geometry, poses).determinant
    assert (determinant < 0).mean() == pytest.approx(negative, abs=6e-4)
    assert (np.abs(determinant) < 0.05).mean() == pytest.approx(close, abs=6e-4)


def test_daily_ranges_across_the_locus():
    geometry = preset("prototype").geometry
    found = {item.range.name: item for item in wrist.daily_crossings(geometry)}
    share = found["daily-life box"].across
    assert share == pytest.approx(0.399, abs=2e-3)
    own = [item.range for item in found.values()]
    assert len(own) == 4
    assert own[1].intervals == ((14.7, 111.9), (-20.1, 39.7), (18.7, 85.9))  # Table 2-1
    for item in found.values():
        determinant = wrist.singularity(geometry, item.range.poses(5.0)).determinant
        # Poses of a grid, each counted once, are not its volume, but nearly.
        assert item.across == pytest.approx((determinant > 0).mean(), abs=0.03)
        if item.range.name == "daily-life box":
            assert (determinant > 0).mean() == pytest.approx(0.380, abs=6e-4)
        assert 0.05 < item.across < 0.95
