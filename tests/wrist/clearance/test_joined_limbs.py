"""Limbs whose joints are one: clear of each other outside the fitting, by closed forms, continuous as joints part."""

import itertools

import numpy as np
import pytest
from scipy.optimize import lsq_linear

import exo_pin as ep

pytestmark = pytest.mark.usefixtures("plain")

CABLE = 0.003
#: Radius of a fitting of two cables in one point, m.
FITTING = 3.0 * 2.0 * CABLE + 0.03


def two_from_one_point(angle, away=0.0, length=0.3, radius=CABLE, below=False):
    """Gap between two limbs of one length, at an angle, with joints on the base or on the arm ``away`` side by side."""
    side = np.array([0.5 * away, 0.0, 0.0])
    along = [np.array([sign * np.sin(angle / 2.0), 0.0, -np.cos(angle / 2.0)]) for sign in (-1.0, 1.0)]
    point = np.array([0.1, 0.3, 0.0])
    near = np.array([point - side, point + side, [0.1, -0.3, 0.0]])
    far = np.array([near[0] + length * along[0], near[1] + length * along[1], [0.1, -0.3, -0.2]])
    if below:
        near, far = far, near
    exo = ep.ShoulderExo(ep.WristGeometry(near, far), ep.Arm(3.0, [0.0, 0.0, -0.3]))
    body = ep.BodyShape(torso=[[0.0, 0.0, 5.0, 0.0, 0.0, 6.0, 0.1]], arm=[[0.0, 0.0, 7.0, 0.0, 0.0, 8.0, 0.1]])
    limits = ep.Criteria(names=("clearance",), body=body, limb_radius=radius)
    return float(exo.workspace(exo.pose([0.0]), limits).gaps[0, 2])


@pytest.mark.parametrize("below", [False, True])
@pytest.mark.parametrize("radius", [CABLE, 0.016])
def test_two_limbs_from_one_point_are_as_far_apart_as_where_their_fitting_ends(radius, below):
    both = 2.0 * radius
    fitting = min(3.0 * both + 0.03, 0.15)  # at most half a limb of 0.3 m
    for angle in np.radians([3.0, 10.0, 30.0, 60.0, 90.0]):
        expected = 2.0 * fitting * np.sin(angle / 2.0) - both
        assert two_from_one_point(angle, radius=radius, below=below) == pytest.approx(expected, abs=1e-9)
    limit = 2.0 * np.arcsin(both / (2.0 * fitting))
    assert two_from_one_point(1.01 * limit, radius=radius) > 0.0 > two_from_one_point(0.99 * limit, radius=radius)
    # Folded onto each other they are as deep as they can be, and not clear.
    assert two_from_one_point(0.0, radius=radius) == pytest.approx(-both, abs=1e-12)


def test_gaps_have_no_jump_as_joints_part():
    """From one point to side by side, with the sign of one point until the joints are apart."""
    steps = np.linspace(0.0, 0.012, 241)
    for angle in np.radians([4.0, 20.0, 60.0]):
        gaps = np.array([two_from_one_point(angle, away) for away in steps])
        # No faster than the ends of the fitting move.
        assert np.abs(np.diff(gaps)).max() < 1.01 * (1.0 + FITTING / CABLE) * steps[1]
        near = steps < 2.0 * CABLE
        share = 1.0 - steps[near] / (2.0 * CABLE)
        expected = share * (2.0 * FITTING * np.sin(angle / 2.0) - 2.0 * CABLE)
        np.testing.assert_allclose(gaps[near], expected, atol=1e-9)
        # Apart, whole limbs count.
        np.testing.assert_allclose(gaps[~near], steps[~near] - 2.0 * CABLE, atol=1e-9)


def test_a_platform_of_three_pairs_of_joints_is_as_clear_as_its_limbs_one_by_one():
    """6-3: limbs that do not share a joint and the wearer decide, but for cables that fold onto each other."""
    base = ep.WristGeometry.from_circles(0.28, 0.1, 0.05, 0.2, np.radians([0, 60, 120, 180, 240, 300])).base_points
    ring = np.radians([30.0, 150.0, 270.0])
    three = np.stack([0.12 * np.cos(ring), 0.12 * np.sin(ring), np.full(3, -0.2)], axis=1)
    platform = three[[0, 0, 1, 1, 2, 2]]
    exo = ep.load("six-cables")
    exo = exo.replace(geometry=ep.WristGeometry(base, platform))
    poses = ep.adl_box(30.0)
    gaps = exo.workspace(poses, ["clearance"]).gaps
    R = poses.as_matrix()
    least, folded = np.full(poses.shape, np.inf), np.zeros(poses.shape, dtype=bool)
    ends = np.einsum("...ij,nj->...ni", R, platform)
    for place in np.ndindex(poses.shape):
        for i, j in itertools.combinations(range(6), 2):
            if np.array_equal(platform[i], platform[j]):
                along = [(ends[place][k] - base[k]) / np.linalg.norm(ends[place][k] - base[k]) for k in (i, j)]
                folded[place] |= FITTING * np.linalg.norm(along[0] - along[1]) < 2.0 * CABLE
            else:
                A = np.stack([ends[place][i] - base[i], base[j] - ends[place][j]], axis=1)
                fit = lsq_linear(A, base[j] - base[i], (0.0, 1.0), tol=1e-14)
                away = np.linalg.norm(A @ fit.x - (base[j] - base[i])) - 2.0 * CABLE
                least[place] = min(least[place], away)
    clear = gaps[..., 2] >= 0.0
    sure = np.abs(least) > 1e-5
    np.testing.assert_array_equal(clear[sure], ((least >= 0.0) & ~folded)[sure])
    assert clear.mean() > 0.5
