"""Distances of segments and gaps of limbs against a bounded minimisation and sampled capsules; a body's numbers."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import wrist
from exo_pin.wrist.clearance.clearance import limb_gaps, limb_radii, segment_distance
from exo_pin.wrist.clearance.gaps import beyond_elbow

pytestmark = pytest.mark.usefixtures("plain")

WEARER = ep.Wearer(1.75, 75, "male")


def distance(p, q, r, t):
    """Least |p + u (q - p) - r - v (t - r)| with u and v within 0 and 1, by SciPy."""
    A, b = np.stack([q - p, r - t], axis=1), r - p
    return np.linalg.norm(A @ lsq_linear(A, b, (0.0, 1.0), tol=1e-15).x - b)


def found(*ends):
    return segment_distance(*(tuple(np.asarray(end, dtype=float).tolist()) for end in ends))


@pytest.mark.parametrize("size", [1e-3, 1.0])
def test_segments_anywhere(size):
    rng = np.random.default_rng(90)
    for _ in range(60):
        p, q, r, t = size * rng.normal(size=(4, 3)) * [1.0, 1.0, rng.choice([0.0, 1.0])]
        assert found(p, q, r, t) == pytest.approx(distance(p, q, r, t), rel=1e-6, abs=1e-7 * size)


def test_points_parallel_and_touching_segments_by_hand():
    o, x, y = np.zeros(3), np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
    assert found(o, o, y, y) == 1.0
    for far in (-3.0, 0.4, 3.0):  # a point beside, before and behind a segment
        at = far * x + 2.0 * y
        away = np.hypot(2.0, max(0.0, -far, far - 1.0))
        assert found(at, at, o, x) == pytest.approx(away, rel=1e-15)
        assert found(o, x, at, at) == pytest.approx(away, rel=1e-15)
        # Parallel segments of other lengths, in both senses.
        for other in (at + 0.5 * x, at - 0.5 * x, at + 5.0 * x):
            gap = max(0.0, min(at[0], other[0]) - 1.0, -max(at[0], other[0]))
            assert found(o, x, at, other) == pytest.approx(np.hypot(2.0, gap), rel=1e-14)
            assert found(at, other, o, x) == pytest.approx(np.hypot(2.0, gap), rel=1e-14)
    assert found(-x, x, -y, y) == 0.0
    assert found(o, 1e-6 * x, y, y + 1e-6 * x) == pytest.approx(1.0, rel=1e-15)
    # Nearly parallel ones: the sine is 1e-5, and the lines cross far outside.
    assert found(o, x, 0.1 * y, x + (0.1 - 1e-5) * y) == pytest.approx(0.1 - 1e-5, rel=1e-9)


def test_gaps_are_those_of_the_segments_of_limbs_and_body():
    rng = np.random.default_rng(91)
    base, platform = rng.uniform(-0.3, 0.3, (4, 3)), rng.uniform(-0.1, 0.1, (4, 3)) - [0.0, 0.0, 0.2]
    radii = rng.uniform(0.002, 0.02, 4)
    body = ep.BodyShape.of(WEARER)
    held, carried = rng.uniform(-0.03, 0.03, (2, 3, 3))
    poses = Rotation.random(3, rng=rng)
    for offset in (None, (held, carried), (held[:1], carried[:1])):
        gaps = wrist.clearances(poses.as_matrix(), base, platform, radii, body, offset)
        each = limb_gaps(poses.as_matrix(), four(base, platform), radii, body, offset)
        np.testing.assert_allclose(each.min(axis=0), gaps.min(axis=0), atol=1e-12)
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


def four(base, platform):
    """A mechanism of four limbs."""
    return ep.load("four-cables").mechanism.replace(geometry=ep.WristGeometry(base, platform))


def test_radii_are_those_of_the_family_unless_one_is_given():
    mechanism = ep.load("four-cables").mechanism
    np.testing.assert_array_equal(limb_radii(mechanism), np.full(4, 0.003))
    np.testing.assert_array_equal(limb_radii(mechanism, 0.02), np.full(4, 0.02))
    bare = mechanism.replace(limbs=[ep.Limb("SPS"), *mechanism.limbs[1:]])
    np.testing.assert_array_equal(np.isnan(limb_radii(bare)), [True, False, False, False])


def test_joints_beyond_the_elbow_are_counted_for_the_shortest_wearer():
    mechanism = ep.load("four-cables").mechanism
    length = WEARER.upper_arm_length
    platform = np.array(mechanism.geometry.platform_points)
    assert beyond_elbow(mechanism, ()) == ""
    for below, words in (((-1e-3,) * 4, ""), ((2e-3, -1e-3, -1e-3, -1e-3), "1 of 4 joints on the upper arm lies"),
                         ((2e-3, 25e-3, -1e-3, -1e-3), "2 of 4 joints on the upper arm lie")):  # fmt: skip
        platform[:, 2] = -length - np.array(below)
        lower = mechanism.replace(geometry=mechanism.geometry.replace(platform_points=platform))
        told = beyond_elbow(lower, (replace(WEARER, height=1.9), WEARER))
        assert told.startswith(words)
        assert bool(told) == bool(words)
        if words:
            assert told.endswith(f"by up to {'25' if max(below) > 0.01 else '2'} mm")


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


def test_girth_and_clothing_thicken_a_body():
    thick = replace(WEARER, arm_girth=1.1 * WEARER.dimensions()["upper arm girth"])
    plain, thicker = ep.BodyShape.of(WEARER), ep.BodyShape.of(thick)
    np.testing.assert_array_equal(thicker.torso, plain.torso)
    np.testing.assert_allclose(thicker.arm[:, 6], 1.1 * plain.arm[:, 6], rtol=1e-12)
    dressed = ep.BodyShape.of(replace(WEARER, clothing=0.005))
    for own, other in ((dressed.torso, plain.torso), (dressed.arm, plain.arm)):
        np.testing.assert_allclose(own - other, 0.005 * np.eye(7)[[6] * len(own)], atol=1e-15)
    for wrong in ({"clothing": 5.0}, {"clothing": -0.001}, {"arm_girth": 41.8}, {"arm_girth": 0.0}):
        with pytest.raises(ep.InvalidInput, match=next(iter(wrong))):
            replace(WEARER, **wrong)


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
    for wrong in ("sofa", "wall:far", "wall:-3"):
        with pytest.raises(ep.InvalidInput):
            ep.Criteria(obstacles=(wrong,))
    with pytest.raises(ep.InvalidInput, match="body of your own"):
        ep.Criteria(obstacles=("bed",), body=ep.BodyShape.of(man))
    with pytest.raises(ep.MissingData, match="obstacles"):
        exo.replace(arm=None).workspace(rest, criteria=ep.Criteria(obstacles=("bed",)))
    chair = ep.BodyShape.of(man, obstacles=("chair",)).torso[7:]
    seat = 0.182 * 1.755 - man.dimensions()["sitting height"]
    assert chair[:, [2, 5]].max() + chair[0, 6] == pytest.approx(seat + 0.42)
    assert np.ptp(chair[:-2, 1]) + 2 * chair[0, 6] == pytest.approx(0.455)


@pytest.mark.parametrize(
    ("low", "high", "count"), [(0.0, 0.0, 1), (0.0, np.radians(10.0), 2), (0.0, 0.2, 3), (0.3, 1.9, 11)]
)
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


def test_bodies_that_do_not_fit_are_refused():
    body = ep.BodyShape.of(WEARER)
    for off, fits in ((4e-3, True), (-4e-3, True), (6e-3, False), (-6e-3, False)):
        other = replace(WEARER, height=WEARER.height * (1.0 + off / WEARER.upper_arm_length))
        if fits:
            body.require_fit([WEARER, other])
        else:
            with pytest.raises(ep.InvalidInput, match="upper arm"):
                body.require_fit([WEARER, other])
    # A body without an upper arm from O fits everybody.
    ep.BodyShape(torso=body.torso, arm=[[0.1, 0, 0, 0, 0, -0.3, 0.05]]).require_fit([replace(WEARER, height=2.0)])
    for arguments in ({"torso": [[0, 0, 0, 0, 0, 1, -0.1]], "arm": body.arm}, {"torso": [[0.0] * 6], "arm": body.arm}):
        with pytest.raises(ep.InvalidInput):
            ep.BodyShape(**arguments)
    with pytest.raises(ep.InvalidInput, match=r"radii of zero or more in arm, got -0\.01 m"):
        ep.BodyShape(body.torso, [[0, 0, 0, 0, 0, 1, 0.1], [0, 0, 0, 0, 0, 1, -0.01]])
    # Of two persons at once each has an arm that fits.
    both = ep.BodyShape.of([WEARER, replace(WEARER, height=1.6)])
    both.require_fit([replace(WEARER, height=1.6), WEARER])
    for wearers in ([], ["somebody"], [WEARER, None]):
        with pytest.raises(ep.InvalidInput, match="Wearer"):
            ep.BodyShape.of(wearers)
    with pytest.raises(ep.InvalidInput):
        ep.BodyShape.of(WEARER, "middle")
