"""How the bent shape of a guide is searched: from any start the same minimum, and no saddle of the energy."""

import numpy as np
import pytest
from wrists import random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.wrist.forces.bent_guides import _ends, _Guides, _guides_of, _newton, _roughly, bent_wrenches
from exo_pin.wrist.forces.side_forces import guide_flexibility, side_wrenches, straight_guides

pytestmark = pytest.mark.usefixtures("plain")


def guides_of(guide, shift, seed=300, count=6, kinds=("UPU", "UPU", "UPU", "SPS")):
    rng = np.random.default_rng(seed)
    mechanism = random_mechanism(rng, len(kinds), list(kinds))
    poses = regular_poses(mechanism, rng, count, margin=0.1)
    mechanism = mechanism.replace(limbs=[ep.Limb(kind, guide=guide) for kind in kinds])
    base, cuff = shift * rng.normal(size=(2, count, 3))
    points = mechanism.geometry
    straight = straight_guides(points.base_points, points.platform_points, poses.as_matrix(), base, cuff)
    return mechanism, straight, guide_flexibility(mechanism), (poses.as_matrix(), base, cuff)


@pytest.mark.parametrize("wrong", ["all", "some", "a zero"])
def test_a_start_that_leads_nowhere_is_left_for_the_straight_guide(wrong):
    """One guide's bad start spoils no other, and the answer is that without a start."""
    mechanism, straight, (flexibility, resists), _ = guides_of(ep.LimbGuide(2.0, 200.0), 0.02)
    cold, ends = bent_wrenches(straight, flexibility, resists, mechanism.is_upu)
    assert np.isfinite(ends).all()
    start = ends.copy()
    bad = np.array([2.5, -2.0, 3.0, 1.5])
    if wrong == "all":
        start[:] = bad
    else:
        start[::2, 1] = bad
        if wrong == "a zero":
            start[1, 0, 2] = 0.0
    warm, again = bent_wrenches(straight, flexibility, resists, mechanism.is_upu, start)
    own = _guides_of(straight, flexibility, np.broadcast_to(mechanism.is_upu, (6, 4)))
    _, _, good = _newton(own, start[:, :3].reshape(-1, 4).T)
    assert not good.all()
    assert good.any() == (wrong != "all")
    np.testing.assert_allclose(again, ends, atol=1e-9)
    np.testing.assert_allclose(warm.forces, cold.forces, atol=1e-9)
    np.testing.assert_allclose(warm.deflection, cold.deflection, rtol=1e-7, atol=1e-12)


def test_minima_are_told_from_saddles():
    """By the second derivatives of the energy, from differences of its slopes; from far away both are arrived at."""
    _, straight, (flexibility, _), _ = guides_of(ep.LimbGuide(10.0, 200.0), 0.02)
    own = _guides_of(straight, flexibility, np.broadcast_to(np.arange(4) < 3, (6, 4)))
    rng, h = np.random.default_rng(301), 1e-6
    kept, left, saddles = 0, 0, 0
    for size in (0.0, 0.5, 0.5, 0.5, 0.5):
        turns, second, good = _newton(own, _roughly(own, np.zeros((4, 18))) + size * rng.normal(size=(4, 18)))
        slopes = _ends(own, turns).slopes
        ends = [[_ends(own, turns + s * h * way[:, None]).slopes for s in (1, -1)] for way in np.eye(4)]
        by_differences = np.moveaxis(np.array([(a - b) / (2 * h) for a, b in ends]), 2, 0)
        for k in range(18):
            if not (np.isfinite(turns[:, k]).all() and np.abs(slopes[:, k]).max() < 1e-8):
                assert not good[k]
                continue
            np.testing.assert_allclose(second[k], by_differences[k], atol=1e-4 * np.abs(second[k]).max())
            least = np.linalg.eigvalsh(by_differences[k])[:2]
            if least[0] < 0.0:
                assert not good[k]
                saddles += least[1] > 0.0
            else:
                kept, left = kept + good[k], left + (not good[k])
    assert kept >= 18
    assert saddles > 0
    # The last of twelve steps may be a little long.
    assert left <= 2


def test_bending_alone_is_straightened_in_one_step():
    """Without torsion the energy is quadratic, and its minimum the straight guide."""
    _, straight, (flexibility, _), _ = guides_of(ep.LimbGuide(60.0, 50.0), 0.02)
    own = _guides_of(straight, flexibility, np.broadcast_to(np.arange(4) < 3, (6, 4)))
    free = own._replace(torsion=0.0 * own.torsion)
    start = np.random.default_rng(302).normal(size=(4, 18)) * 0.1
    np.testing.assert_allclose(_roughly(free, start), 0.0, atol=1e-15)
    # With torsion the rough steps come closer to the minimum.
    exact, _, good = _newton(own, _roughly(own, 0.0 * start))
    assert good.all()
    rough = _roughly(own, 0.0 * start)
    assert np.abs(rough - exact).max() < 0.05 * np.abs(exact).max()
    few = _Guides(*(part[..., :2] for part in own))
    np.testing.assert_allclose(_newton(few, rough[:, :2])[0], exact[:, :2], atol=1e-12)


@pytest.mark.parametrize("soft", [1.0, 1e-6])
def test_side_forces_of_bent_guides_are_proportional_to_their_stiffness(soft):
    """However soft: bending and torsion together, joints rigid, so that the shape is the same."""
    guide = ep.LimbGuide(60.0, 50.0)
    mechanism, straight, (flexibility, resists), _ = guides_of(guide, 0.02)
    stiff, ends = bent_wrenches(straight, flexibility, resists, mechanism.is_upu)
    weak, same = bent_wrenches(straight, flexibility / soft, resists, mechanism.is_upu)
    np.testing.assert_allclose(same, ends, atol=1e-9)
    np.testing.assert_allclose(weak.stiffness, soft * stiff.stiffness, rtol=1e-8)
    np.testing.assert_allclose(weak.deflection, stiff.deflection, rtol=1e-6, atol=1e-12)
    assert (np.abs(stiff.deflection[:, :3]) > 1e-6).all()
    assert (stiff.deflection[:, 3] == 0.0).all()


def test_guides_without_one_of_their_rigidities_resist_nothing():
    limbs = [ep.Limb("UPU", guide=guide) for guide in (None, ep.LimbGuide(0.0, 1.0), ep.LimbGuide(1.0, 0.0))]
    limbs += [ep.Limb("UPU", guide=ep.LimbGuide(1.0, 1.0)), ep.Limb("SPS", guide=ep.LimbGuide(1.0, 1.0))]
    rng = np.random.default_rng(303)
    mechanism = random_mechanism(rng, 5)
    poses = regular_poses(mechanism, rng, 2)
    mechanism = mechanism.replace(limbs=limbs)
    flexibility, resists = guide_flexibility(mechanism)
    np.testing.assert_array_equal(resists, [False, False, False, True, True])
    np.testing.assert_array_equal(flexibility[3:], [[1.0, 1.0, 0.0, 0.0]] * 2)
    assert not flexibility[:3].any()
    side = side_wrenches(mechanism, poses.as_matrix(), np.zeros((2, 3)), np.zeros((2, 3)))
    np.testing.assert_array_equal(side.stiffness != 0.0, [[False, False, False, True, False]] * 2)


@pytest.mark.parametrize("at_base", [True, False])
@pytest.mark.parametrize("kind", ["UPU", "SPS"])
def test_a_limb_along_the_axis_of_either_joint_is_folded(at_base, kind):
    """Off the centre, where the other joint is not; one limb is enough, if it has a side force at all."""
    rng = np.random.default_rng(304)
    mechanism = random_mechanism(rng, 3, [kind, "UPU", "UPU"])
    points, pose = mechanism.geometry, regular_poses(mechanism, rng, 1)
    a, b = points.base_points[0], pose.as_matrix()[0] @ points.platform_points[0]
    # The offset of the base that lays the first limb along a, or along b.
    base = b - a - (0.4 * a if at_base else 0.3 * b)
    zero = np.zeros((1, 3))
    guides = straight_guides(points.base_points, points.platform_points, pose.as_matrix(), base[None], zero)
    np.testing.assert_array_equal(guides.folded, [[True, False, False]])
    side = side_wrenches(mechanism, pose.as_matrix(), base[None], zero)
    np.testing.assert_array_equal(side.folded, [kind == "UPU"])
    assert (side.forces[0, 0] == 0.0).all()
    assert (side.stiffness == 0.0).all()
    assert np.abs(side.forces[0, 1:]).max() > 0.1
