"""Gaps of limbs against a bounded minimisation; the numbers of a body and of what stands about it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import wrist

pytestmark = pytest.mark.usefixtures("plain")

WEARER = ep.Wearer(1.75, 75, "male")


def distance(p, q, r, t):
    """Least |p + u (q - p) - r - v (t - r)| with u and v within 0 and 1, by SciPy."""
    A, b = np.stack([q - p, r - t], axis=1), r - p
    return np.linalg.norm(A @ lsq_linear(A, b, (0.0, 1.0), tol=1e-15).x - b)


def test_gaps_are_those_of_the_segments_of_limbs_and_body():
    rng = np.random.default_rng(91)
    base, platform = rng.uniform(-0.3, 0.3, (4, 3)), rng.uniform(-0.1, 0.1, (4, 3)) - [0.0, 0.0, 0.2]
    radii = rng.uniform(0.002, 0.02, 4)
    body = ep.BodyShape.of(WEARER)
    held, carried = rng.uniform(-0.03, 0.03, (2, 3, 3))
    poses = Rotation.random(3, rng=rng)
    for offset in (None, (held, carried), (held[:1], carried[:1])):
        gaps = wrist.clearances(poses.as_matrix(), base, platform, radii, body, offset)
        for k in (0, 2):
            h, c = (np.zeros(3), np.zeros(3)) if offset is None else (part[min(k, len(part) - 1)] for part in offset)
            limbs = [(base[i] + h, poses[k].apply(platform[i] + c)) for i in range(4)]
            # The torso goes with the base's offset against the cuff's; the shoulder itself stays.
            ends = body.torso[:, :6].reshape(-1, 2, 3)
            ends = np.where((ends == 0.0).all(axis=-1, keepdims=True), 0.0, ends + h - c)
            torso = list(zip(ends, body.torso[:, 6], strict=True))
            arm = [(poses[k].apply(np.array(row[:6]).reshape(2, 3)), row[6]) for row in body.arm]
            for part, capsules in ((0, arm), (1, torso)):
                away = [distance(*limbs[i], *pair) - size - radii[i] for i in range(4) for pair, size in capsules]
                assert gaps[k, part] == pytest.approx(min(away), abs=1e-7)
            away = [distance(*limbs[i], *limbs[j]) - radii[i] - radii[j] for i in range(4) for j in range(i)]
            assert gaps[k, 2] == pytest.approx(min(away), abs=1e-7)


def test_a_body_is_made_of_shares_of_stature_and_of_girths():
    """Half shoulder breadth, chin and shoulder height of Drillis and Contini place the neck and the head."""
    body, sizes = ep.BodyShape.of(WEARER), WEARER.dimensions()
    torso, arm = body.torso, body.arm
    assert torso.shape == (7, 7)
    for rows, part in ((torso[:2], "chest"), (torso[2:4], "waist")):
        np.testing.assert_allclose(rows[:, 1].mean(), -0.129 * 1.75, rtol=1e-12)
        np.testing.assert_allclose(np.ptp(rows[:, 1]) + 2 * rows[0, 6], sizes[f"{part} breadth"], rtol=1e-12)
        np.testing.assert_allclose(2 * rows[:, 6], sizes[f"{part} depth"], rtol=1e-12)
    np.testing.assert_allclose(torso[4:, 1], -0.129 * 1.75, rtol=1e-12)
    np.testing.assert_allclose(torso[5:, 4], -0.129 * 1.75, rtol=1e-12)
    np.testing.assert_allclose(2 * np.pi * torso[5:, 6], [sizes["neck girth"], sizes["head girth"]], rtol=1e-12)
    np.testing.assert_allclose(torso[4, 6], 0.031 * 1.75, rtol=1e-12)
    np.testing.assert_array_equal(torso[0, 5], torso[2, 2])  # the belly begins where the chest ends
    np.testing.assert_allclose(torso[2:4, 5], -0.28 * 1.75, rtol=1e-12)
    # From the shoulder to the chin and to the top of the head.
    assert torso[6, 2] - torso[6, 6] < (0.870 - 0.818) * 1.75 < torso[6, 5]
    assert torso[6, 5] + torso[6, 6] == pytest.approx((1.0 - 0.818) * 1.75, rel=1e-12)
    np.testing.assert_allclose(2 * np.pi * arm[:, 6], [sizes["upper arm girth"], sizes["forearm girth"]], rtol=1e-12)
    np.testing.assert_allclose(arm[0, :6], [0, 0, 0, 0, 0, -WEARER.upper_arm_length], atol=1e-15)
    np.testing.assert_allclose(arm[1, 3:6], [0, 0, -WEARER.upper_arm_length - WEARER.forearm_length], atol=1e-15)
    right = ep.BodyShape.of(WEARER, "right")
    np.testing.assert_array_equal(right.torso * [1, -1, 1, 1, -1, 1, 1], body.torso)
    np.testing.assert_array_equal(right.arm, arm)


@pytest.mark.parametrize("sex", ["male", "female"])
def test_girths_of_persons_are_those_of_ansur(sex):
    """Medians of 4,082 men and 1,986 women, and 5th and 95th percentiles by the spread of persons of one size."""
    biceps = {"male": (0.303, 0.357, 0.418), "female": (0.259, 0.304, 0.360)}[sex]
    spread = {"male": 0.051, "female": 0.045}[sex]
    persons = [each for each in ep.Wearer.drawn(4000, seed=1) if each.sex == sex]
    mean = np.array([each.dimensions()["upper arm girth"] for each in persons])
    girths = mean * (1 + spread * np.random.default_rng(0).standard_normal(len(mean)))
    np.testing.assert_allclose(np.percentile(girths, [5, 50, 95]), biceps, rtol=0.02)


def test_obstacles_stand_about_the_person():
    man = ep.Wearer(1.755, 85, "male")
    exo = ep.load("four-linear-actuators-worn")
    plain = ep.Criteria(wearers=(man,))
    rest = exo.pose([0])
    own, base = exo.workspace(rest, criteria=plain).gaps[0, 1], exo.geometry.base_points
    depth = 0.5 * man.dimensions()["chest depth"]
    # The frame's joints that are farthest behind the back and above the head, and the radius of a limb.
    back, top = -depth - base[:, 0].min() + 0.016, base[:, 2].max() + 0.016 - 0.182 * man.height
    for name, into in (("bed", back), ("wall:100", back - 0.1), ("ceiling:20", top - 0.02), ("wall:900", -own)):
        gap = exo.workspace(rest, criteria=replace(plain, obstacles=(name,))).gaps[0, 1]
        assert gap == pytest.approx(-into, abs=1e-3)
    chair = ep.BodyShape.of(man, obstacles=("chair",)).torso[7:]
    seat = 0.182 * 1.755 - man.dimensions()["sitting height"]
    assert chair[:, [2, 5]].max() + chair[0, 6] == pytest.approx(seat + 0.42)
    assert np.ptp(chair[:-2, 1]) + 2 * chair[0, 6] == pytest.approx(0.455)


@pytest.mark.parametrize(("low", "high", "count"), [(0.0, 0.0, 1), (0.3, 1.9, 11)])
def test_an_elbow_that_bends_is_in_all_places_between(low, high, count):
    body = ep.BodyShape.of([WEARER, replace(WEARER, height=1.6)], elbow_range=(low, high))
    assert body.torso.shape == (14, 7)
    fore = body.arm[1 : 1 + count]
    assert body.arm.shape == (2 * (1 + count), 7)
    for row, bend in zip(fore, np.linspace(low, high, count), strict=True):
        np.testing.assert_array_equal(row[:3], body.arm[0, 3:6])
        hand = WEARER.forearm_length * np.array([np.sin(bend), 0.0, -np.cos(bend)])
        np.testing.assert_allclose(row[3:6] - row[:3], hand, atol=1e-15)
    own = ep.BodyShape.of(replace(WEARER, elbow_flexion=low))
    np.testing.assert_array_equal(own.arm[1], fore[0])


def test_a_limb_through_the_arm_is_counted_by_hand():
    exo = ep.load("four-cables").worn_by(WEARER)
    # Joint 1 on the axis of the upper arm: its limb ends inside the arm, by the radii of arm and cable.
    platform = np.array(exo.geometry.platform_points)
    platform[0] = [0.0, 0.0, -0.15]
    inside = exo.replace(geometry=exo.geometry.replace(platform_points=platform))
    answer = inside.reaction(inside.pose(0, 0))
    deep = WEARER.dimensions()["upper arm girth"] / (2.0 * np.pi) + 0.003
    assert answer.clearance == pytest.approx(-deep)
    assert f"limb 1 passes through the wearer's arm ({1e3 * deep:.0f} mm deep)" in answer.verdict
    assert answer.as_dict()["clearance"] == answer.clearance


def test_a_torso_is_one_body_in_the_frontal_plane_that_the_shoulder_belongs_to():
    for side, outward in (("left", 1.0), ("right", -1.0)):
        torso = ep.BodyShape.of(WEARER, side).torso
        ends, radii = torso[:, :6].reshape(-1, 2, 3), torso[:, 6]
        assert (ends[..., 0] == 0.0).all()
        assert (outward * ends[..., 1] <= 0.0).all()
        assert (ends == 0.0).all(axis=2).sum() == 1  # the shoulder
        # Points along each capsule, near enough to each other.
        points = ends[:, :1] + np.linspace(0.0, 1.0, 40)[:, None] * (ends[:, 1:] - ends[:, :1])
        away = np.linalg.norm(points[:, None, :, None] - points[None, :, None], axis=-1).min(axis=(2, 3))
        touch = (away < radii[:, None] + radii).astype(float)
        assert (np.linalg.matrix_power(touch, len(torso)) > 0.0).all()
