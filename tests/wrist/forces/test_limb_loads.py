"""Limbs with mass at rest: the torso carries each one's weight, and limbs without mass load nothing."""

import numpy as np
import pytest
from wrists import heavy_limbs, random_mechanism, regular_poses

from exo_pin.load_case.pose_stacks import as_query
from exo_pin.wrist.forces.side_forces import limb_loads


@pytest.mark.parametrize("seed", [1, 2])
def test_the_torso_carries_the_weight_of_each_limb_at_rest(seed):
    rng = np.random.default_rng(seed)
    mechanism = heavy_limbs(random_mechanism(rng, 4, ["UPU", "SPS", "SPS", "UPU"]), rng)
    light = mechanism.limbs[1].__class__()
    mechanism = mechanism.replace(limbs=[mechanism.limbs[0], light, *mechanism.limbs[2:]])
    poses = regular_poses(mechanism, rng, 5)
    none, folded = np.zeros((5, 3)), np.array([False, False, True, False, False])
    closure, share = limb_loads(mechanism, as_query(poses), none, none, folded)
    assert (closure[:, 1] == 0).all()
    assert (share[:, 1] == 0).all()
    assert (closure[2] == 0).all()
    assert (share[2] == 0).all()
    ends = np.einsum("kij,nj->kni", poses.as_matrix(), mechanism.geometry.platform_points)
    for i in (0, 2, 3):
        limb, a, b = mechanism.limbs[i], mechanism.geometry.base_points[i], ends[~folded, i]
        along = (b - a) / np.linalg.norm(b - a, axis=-1, keepdims=True)
        total = np.zeros((4, 6))
        for mass, centre in (
            (limb.base_body.mass, a + limb.base_body.centre * along),
            (limb.platform_body.mass, b - limb.platform_body.centre * along),
        ):
            lift = np.array([0.0, 0.0, 9.81 * mass])
            total += np.concatenate([np.tile(lift, (4, 1)), np.cross(centre, lift)], axis=1)
        np.testing.assert_allclose(share[~folded, i], total, rtol=1e-9, atol=1e-12)
        # The joint at A passes no moment of a limb with ball joints, nor does that at B, on the arm's side.
        torso, arm = closure[~folded, i], closure[~folded, i] - share[~folded, i]
        if limb.kind == "SPS":
            assert np.abs(torso[:, 3:] - np.cross(a, torso[:, :3])).max() < 1e-12
            assert np.abs(arm[:, 3:] - np.cross(b, arm[:, :3])).max() < 1e-12
        # Nothing holds the slide: only the weight of the outer half acts along it, and the arm carries that.
        slope = 9.81 * limb.platform_body.mass * along[:, 2]
        np.testing.assert_allclose((arm[:, :3] * along).sum(axis=-1), -slope, atol=1e-12)
