"""Sentences on limbs that pass through something, of single poses and of stacks, from gaps that are known."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import wrist
from exo_pin.wrist.clearance.clearance import limb_gaps, limb_radii, segment_distance
from exo_pin.wrist.clearance.gaps import LimbGaps, depth

pytestmark = pytest.mark.usefixtures("plain")

WEARER = ep.Wearer(1.75, 75, "male")
DEEP = WEARER.dimensions()["upper arm girth"] / (2.0 * np.pi) + 0.003


def clash(*given):
    return LimbGaps(*given).words


def wearer_gaps(*given):
    return LimbGaps(*given).least


def unknown_for_gaps(mechanism):
    return LimbGaps(mechanism, np.eye(3)[None]).unknown


def worn(joint=None):
    """Four cables; the first one's joint on the arm moved to a place, arm frame."""
    mechanism = ep.load("four-cables").worn_by(WEARER).mechanism
    if joint is None:
        return mechanism
    platform = np.array(mechanism.geometry.platform_points)
    platform[0] = joint
    return mechanism.replace(geometry=mechanism.geometry.replace(platform_points=platform))


@pytest.mark.parametrize(
    ("gap", "words"),
    [
        (-0.1234, "123 mm"),
        (-0.0555, "56 mm"),
        (-0.011, "11 mm"),
        (-0.0099, "9.9 mm"),
        (-0.00123, "1.2 mm"),
        (-0.0101, "10 mm"),
    ],
)
def test_depths_have_two_digits_or_whole_millimetres(gap, words):
    assert depth(gap) == words


def test_a_single_pose_names_limbs_and_depths_and_a_stack_counts_poses():
    free, inside = worn(), worn([0.0, 0.0, -0.15])
    poses = ep.shoulder_rotation([0.0, 60.0, 30.0], [0.0, 30.0, 10.0], 0.0, degrees=True).as_matrix()
    assert clash(free, poses[1:]) == ""
    deep = f"{1e3 * DEEP:.0f} mm"
    assert clash(inside, poses[:1]) == f"As it is worn, limb 1 passes through the wearer's arm ({deep} deep)."
    gaps = wearer_gaps(inside, poses)
    np.testing.assert_allclose(gaps[:, 0], -DEEP, atol=1e-12)
    assert (gaps[:, 1:] > 0.0).all()
    told = clash(inside, poses)
    assert told == f"In 3 of 3 poses limbs pass through the wearer's arm, by up to {deep}."
    # An offset of one pose alone, which moves limbs of the free device into the body.
    away = np.array([[0.0] * 3, [0.1, 0.0, 0.0], [0.0] * 3])
    single = [wearer_gaps(free, poses[[k]], (away[[k]], away[[k]]))[0] for k in range(3)]
    through = np.array(single) < 0.0
    assert through.any(axis=1).tolist() == [False, True, False]
    parts = np.array(["the wearer's arm", "the wearer's torso", "another limb"])[through.any(axis=0)]
    told = clash(free, poses, (away, away))
    assert told.startswith(f"In 1 of 3 poses limbs pass through {' or '.join(parts)}, by up to ")


def test_joints_beyond_the_elbow_are_told_beside_what_passes_through():
    low = worn([0.0, 0.12, -WEARER.upper_arm_length - 0.02])
    pose = ep.shoulder_rotation(60.0, 30.0, 0.0, degrees=True).as_matrix()[None]
    told = clash(low, pose)
    assert told.endswith("1 of 4 joints on the upper arm lies beyond the wearer's elbow, by up to 20 mm.")
    inside = worn([0.0, 0.0, -WEARER.upper_arm_length - 0.02])
    both = clash(inside, pose)
    assert both.startswith("As it is worn, limb 1 passes through the wearer's arm (")
    assert both.endswith("deep). 1 of 4 joints on the upper arm lies beyond the wearer's elbow, by up to 20 mm.")


def test_what_is_not_known_is_named_and_makes_no_gaps():
    mechanism = worn()
    pose = np.eye(3)[None]
    assert unknown_for_gaps(mechanism) == ()
    assert wearer_gaps(mechanism, pose).shape == (1, 3)
    bare = mechanism.replace(limbs=[*mechanism.limbs[:2], ep.Limb("SPS"), ep.Limb("SPS")])
    (told,) = unknown_for_gaps(bare)
    assert "limbs 3 and 4" in told
    nobody = mechanism.replace(arm=None)
    (told,) = unknown_for_gaps(nobody)
    assert told.startswith("who wears it")
    assert len(unknown_for_gaps(bare.replace(arm=None))) == 2
    for one in (bare, nobody):
        assert np.isnan(wearer_gaps(one, pose)).all()
        assert clash(one, pose) == ""


def test_offsets_are_those_of_their_own_poses():
    """Of the first alone where one is given for all."""
    mechanism = worn()
    points, radii, body = mechanism.geometry, limb_radii(mechanism), ep.BodyShape.of(WEARER)
    poses = ep.shoulder_rotation([0.0, 60.0], [0.0, 30.0], 0.0, degrees=True).as_matrix()
    held, carried = 0.02 * np.random.default_rng(320).normal(size=(2, 2, 3))
    arguments = points.base_points, points.platform_points, radii, body
    both = wrist.clearances(poses, *arguments, (held, carried))
    for k in range(2):
        np.testing.assert_array_equal(wrist.clearances(poses[[k]], *arguments, (held[[k]], carried[[k]]))[0], both[k])
        np.testing.assert_array_equal(wrist.clearances(poses, *arguments, (held[[k]], carried[[k]]))[k], both[k])
    none = wrist.clearances(poses, *arguments)
    np.testing.assert_array_equal(none, wrist.clearances(poses, *arguments, (np.zeros((2, 3)), np.zeros((2, 3)))))
    assert none.shape == (2, 3)
    assert np.abs(both - none).min() > 1e-6
    each = limb_gaps(poses, mechanism, radii, body, (held, carried))
    np.testing.assert_allclose(each.min(axis=0), both.min(axis=0), atol=1e-12)


@pytest.mark.parametrize("size", [0.1, 0.5, 2.0])
def test_a_point_beside_a_segment_of_any_length(size):
    for along in (-0.5, 0.0, 0.3, 0.9, 1.0, 1.5):
        at, o, end = (along * size, 2.0, 0.0), (0.0, 0.0, 0.0), (size, 0.0, 0.0)
        away = np.hypot(2.0, size * max(0.0, -along, along - 1.0))
        assert segment_distance(at, at, o, end) == pytest.approx(away, rel=1e-14)
        assert segment_distance(o, end, at, at) == pytest.approx(away, rel=1e-14)
