"""Worst cases over offset and stiffness, against dense sampling and closed forms."""

import numpy as np
import pytest
from guided_limbs import guided
from scipy.spatial.transform import Rotation
from wrists import random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.load_case.centre_path import elevation_angle

DEGREES = {"degrees": True}
LIFTED = ep.shoulder_rotation(60, 30, 0, **DEGREES)


@pytest.fixture(scope="module")
def exo():
    return guided(ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male")), stiffness=2e4 * np.eye(3))


def again(pose, count):
    return Rotation.from_quat(np.tile(pose.as_quat(), (count, 1)))


def in_ball(rng, count, radius):
    u = rng.normal(size=(count, 3))
    return u / np.linalg.norm(u, axis=1, keepdims=True) * radius * np.cbrt(rng.random((count, 1)))


@pytest.mark.parametrize("split", ["spherical", "elastic_linear"])
@pytest.mark.parametrize("pose", [LIFTED, ep.shoulder_rotation(40, 50, 20, **DEGREES)], ids=["a", "b"])
def test_no_sampled_offset_exceeds_the_worst(split, pose, exo):
    worst = exo.worst_offset(pose, 0.015, split)
    assert worst.status == "ok"
    assert np.linalg.norm(worst.at) <= 0.015 * (1 + 1e-9)
    sampled = exo.reaction(
        again(pose, 2000), split=split, centre_offset=in_ball(np.random.default_rng(50), 2000, 0.015)
    )
    assert sampled.magnitude.max() <= worst.magnitude * (1 + 1e-6)
    assert sampled.magnitude.max() >= 0.95 * worst.magnitude
    evidence = exo.reaction(pose, split=split, centre_offset=worst.at)
    np.testing.assert_allclose(evidence.shoulder_force, worst.shoulder_force, rtol=1e-9)
    assert worst.nominal == pytest.approx(exo.reaction(pose, split=split).magnitude)


@pytest.mark.parametrize("split", ["spherical", "elastic_linear"])
def test_a_ball_with_a_singular_configuration_has_no_worst_force(split, exo):
    rest = Rotation.identity()
    worst = exo.worst_offset(rest, 0.015, split)
    assert worst.status == "singular_within"
    assert worst.magnitude == np.inf
    assert "no bound" in str(worst)
    # The evidence: on a line through it the forces grow as the inverse of the distance.
    along = worst.at / np.linalg.norm(worst.at)
    sizes = [exo.reaction(rest, split=split, centre_offset=worst.at - d * along).magnitude for d in (1e-6, 1e-7)]
    assert 8.0 < sizes[1] / sizes[0] < 12.0
    # A ball that ends short of it has a finite answer, as the nearest of its kind must.
    short = exo.worst_offset(rest, 0.98 * np.linalg.norm(worst.at), split)
    assert short.status in ("ok", "near_singular")
    assert np.isfinite(short.magnitude)
    assert short.magnitude > 5 * short.nominal


def test_worst_offset_of_a_stack_marks_only_the_bad_row(exo):
    single = exo.worst_offset(LIFTED, 0.01)
    both = exo.worst_offset(Rotation.concatenate([Rotation.identity(), LIFTED]), 0.01)
    assert both.status.tolist() == ["singular_within", "ok"]
    np.testing.assert_allclose(both.magnitude, [np.inf, single.magnitude])
    assert "1 with a singular" in str(both)


def test_worst_offset_of_four_limbs():
    mechanism = random_mechanism(np.random.default_rng(51), 4)
    exo = ep.ShoulderExo.from_mechanism(mechanism)
    pose = regular_poses(mechanism, np.random.default_rng(52), 1, margin=0.1)[0]
    worst = exo.worst_offset(pose, 0.005)
    sampled = exo.reaction(again(pose, 1000), centre_offset=in_ball(np.random.default_rng(53), 1000, 0.005))
    assert 0.95 * worst.magnitude <= sampled.magnitude.max() <= worst.magnitude * (1 + 1e-6)


@pytest.mark.full
@pytest.mark.parametrize("offset", [pytest.param([0, 0, 0], marks=pytest.mark.full), [0.005, 0.003, -0.01]])
def test_worst_stiffness(offset, exo):
    poses = regular_poses(exo.mechanism, np.random.default_rng(57), 5, margin=0.05)
    stiffened = (exo.replace(shoulder=ep.Shoulder(stiffness=k)) for k in np.geomspace(1e3, 1e6, 200))
    all_sizes = [one.reaction(poses, split="elastic_linear", centre_offset=offset).magnitude for one in stiffened]
    for pose, sizes in zip(poses, np.transpose(all_sizes), strict=True):
        worst = exo.worst_stiffness(pose, 1e3, 1e6, centre_offset=offset)
        assert np.max(sizes) <= worst.magnitude * (1 + 1e-6)
        assert worst.exact == (offset == [0, 0, 0])
        if np.isfinite(worst.magnitude):
            assert np.max(sizes) >= 0.99 * worst.magnitude
            at = exo.replace(shoulder=ep.Shoulder(stiffness=float(worst.at)))
            evidence = at.reaction(pose, split="elastic_linear", centre_offset=offset)
            np.testing.assert_allclose(evidence.shoulder_force, worst.shoulder_force, rtol=1e-6)
        else:
            assert worst.status == "singular_within"


def test_stiffness_at_which_the_shoulder_loses_hold(exo):
    """Off the centre, limbs and a soft enough shoulder together can become unstable; the force grows without bound."""
    rng, found = np.random.default_rng(58), 0
    poses = regular_poses(exo.mechanism, rng, 200, margin=0.02)
    worst = exo.worst_stiffness(poses, 1e2, 1e6, centre_offset=[0.01, 0.0, -0.02])
    for row in np.flatnonzero(worst.status == "singular_within")[:5]:
        near = exo.replace(shoulder=ep.Shoulder(stiffness=float(worst.at[row]) * (1 + 1e-7)))
        answer = near.reaction(poses[row], split="elastic_linear", centre_offset=[0.01, 0.0, -0.02])
        assert not answer.magnitude < 1e5
        found += 1
    assert found == 5


def test_poses_without_a_nominal_answer(exo):
    loose = exo.replace(limbs=(ep.Limb(),) * 3, shoulder=ep.Shoulder(stiffness=0.0))
    worst = loose.worst_offset(LIFTED, 0.01, "elastic_linear")
    assert worst.status == "not_solved"
    assert np.isnan(worst.magnitude)
    assert "not_solved" in str(worst)
    singular = exo.worst_offset(ep.shoulder_rotation(0, 90, 0, **DEGREES), 0.01)
    assert singular.magnitude == np.inf
    np.testing.assert_array_equal(singular.at, 0.0)
    assert "no nominal force" in str(singular)


def test_bad_sets(exo):
    with pytest.raises(ep.InvalidInput, match="radius"):
        exo.worst_offset(LIFTED, 0.0)
    with pytest.raises(ep.InvalidInput, match="millimetres"):
        exo.worst_offset(LIFTED, 15.0)
    with pytest.raises(ep.InvalidInput, match="minimal"):
        exo.worst_offset(LIFTED, 0.01, "minimal")
    with pytest.raises(ep.MissingData, match="stiffness"):
        ep.load("prototype").worst_offset(LIFTED, 0.01, "elastic_linear")
    with pytest.raises(ep.InvalidInput, match="least"):
        exo.worst_stiffness(LIFTED, 1e5, 1e4)
    heavy = exo.replace(limbs=(ep.Limb("UPU", ep.LimbBody.rod(0.1, 0.1, 0.01)),) * 3)
    with pytest.raises(ep.InvalidInput, match="massless"):
        heavy.worst_offset(LIFTED, 0.01)


def test_centre_path(exo):
    angles = np.radians([0.0, 30.0, 90.0, 150.0])
    moved = np.array([[0, 0, 0], [0, 0.001, 0.002], [0, -0.002, 0.012], [0.001, -0.01, 0.02]])
    path = ep.CentrePath(angles, moved)
    np.testing.assert_allclose(path.at(angles), moved, atol=1e-15)
    between = path.at(np.linspace(angles[0], angles[-1], 400))
    assert between[:, 2].min() >= 0
    assert (np.diff(between[:, 2]) >= 0).all()
    poses = ep.shoulder_rotation([0, 30, 90], [0, 0, 0], [0, 40, 0], **DEGREES)
    np.testing.assert_allclose(np.degrees(elevation_angle(poses)), [0, 30, 90], atol=1e-9)
    poses = ep.shoulder_rotation([30, 60, 90], [20, 30, 40], 0, **DEGREES)
    answer = exo.reaction(poses, split="elastic_linear", centre_offset=path)
    by_hand = exo.reaction(
        poses, split="elastic_linear", centre_offset=ep.CentreOffset.of_moving_shoulder(path.at(elevation_angle(poses)))
    )
    np.testing.assert_array_equal(answer.shoulder_force, by_hand.shoulder_force)
    assert not np.allclose(answer.shoulder_force, exo.reaction(poses, split="elastic_linear").shoulder_force, rtol=1e-3)
    other = exo.mirrored().reaction(
        ep.shoulder_rotation([30, 60, 90], [20, 30, 40], 0, side="right", **DEGREES),
        split="elastic_linear",
        centre_offset=path.mirrored(),
    )
    np.testing.assert_allclose(other.magnitude, answer.magnitude, rtol=1e-9)
    with pytest.raises(ep.InvalidInput, match="known"):
        path.at(np.radians(170.0))
    with pytest.raises(ep.InvalidInput, match="degrees"):
        ep.CentrePath([0.0, 30.0], moved[:2])
    with pytest.raises(ep.InvalidInput, match="millimetres"):
        ep.CentrePath(angles, 1e3 * moved)
