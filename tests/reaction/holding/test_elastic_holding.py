"""Verdict, limits and remedy where the device gives way: lengths are those of the displaced device."""

from dataclasses import replace

import numpy as np
import pytest
from guided_limbs import guided
from wrists import PERSON, random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.reaction import elastic as elastic_poses

LIFTED = ep.shoulder_rotation(60, 30, 0, degrees=True)
OFFSET = [0.0, 0.006, 0.008]
GUIDE = ep.LimbGuide(60.0, 50.0)


@pytest.fixture(scope="module")
def worn():
    return guided(ep.load("prototype").worn_by(PERSON), GUIDE, 2e4)


@pytest.mark.parametrize("split", ["elastic", "elastic_locked"])
def test_strokes_are_compared_with_the_lengths_of_the_displaced_device(worn, split):
    pose_lengths = worn.inverse_kinematics(LIFTED).lengths
    free = worn.reaction(LIFTED, split=split, centre_offset=OFFSET)
    own = free.source.poses.lengths[0]
    np.testing.assert_array_equal(own, free.limb_lengths)
    # Locked actuators have the lengths of the aligned device; held ones have followed the pose.
    moved = np.abs(own - pose_lengths)
    assert moved.max() < 1e-9 if split == "elastic_locked" else moved.max() > 1e-4
    longest = own - 1e-3
    strokes = [ep.Stroke(1.0, 0.1, float(end), end_fitting=0.0) for end in longest]
    limbs = [replace(limb, stroke=stroke) for limb, stroke in zip(worn.limbs, strokes, strict=True)]
    answer = worn.replace(limbs=limbs).reaction(LIFTED, split=split, centre_offset=OFFSET)
    np.testing.assert_allclose(answer.limits.length_error, 1e-3, atol=1e-9)
    assert answer.equilibrium_status == "ok"
    assert answer.status == "out_of_stroke"
    assert "too long" in answer.verdict


def test_locked_actuators_take_no_other_tensions():
    mechanism = random_mechanism(np.random.default_rng(21), 4)
    exo = guided(ep.ShoulderExo.from_mechanism(mechanism), GUIDE, 2e4)
    pose = regular_poses(exo.mechanism, np.random.default_rng(22), 1, margin=0.1)[0]
    tensions = {split: exo.reaction(pose, split=split).actuator_forces for split in ("elastic", "elastic_locked")}
    for split, f in tensions.items():
        # The most loaded limb can take a little less than it bears: others can take that over, if they can adapt.
        i = int(np.abs(f).argmax())
        most = np.full(4, 1e4)
        most[i] = 0.99 * abs(f[i])
        limbs = [
            replace(limb, actuator=ep.Actuator("linear", float(end), float(end)))
            for limb, end in zip(exo.limbs, most, strict=True)
        ]
        answer = exo.replace(limbs=limbs).reaction(pose, split=split)
        adapts = split == "elastic"
        assert answer.held == adapts
        assert (answer.status == "beyond_limits") != adapts
        # What cannot adapt keeps the forces of its lock, which would be needed.
        assert np.allclose(answer.actuator_forces, f, rtol=1e-12) != adapts


def soft_cables(shoulder, harness, turning):
    interface = ep.Interface(np.diag([harness] * 3 + [turning] * 3), np.zeros(3))
    exo = ep.load("four-cables").worn_by(PERSON)
    return exo.replace(shoulder=ep.Shoulder(stiffness=shoulder * np.eye(3)), interfaces=ep.Interfaces(interface, None))


@pytest.mark.full
def test_an_equilibrium_behind_a_kink_is_found():
    exo = soft_cables(16074.0, 8200.6, 11.17)
    load = ep.Load([0.0, 0.0, -49.5], at=[0.0, 0.0, -0.3])
    pose = ep.shoulder_rotation(106.649, 30.787, 0, degrees=True)
    answer = exo.reaction(pose, None, load, "elastic")
    assert answer.status == "ok"
    assert answer.can_hold or answer.unknown
    assert (answer.actuator_forces >= -1e-9 * answer.actuator_forces.max()).all()
    assert (answer.residual[answer.has_answer] <= 1e-9).all()
    # Turned together with gravity and load, the same device gives the same force.
    turn = ep.shoulder_rotation(20, 35, 50, degrees=True)
    points, R = exo.mechanism.geometry, turn.as_matrix()
    turned = exo.replace(
        geometry=ep.WristGeometry(points.base_points @ R.T, points.platform_points), gravity=R @ exo.mechanism.gravity
    )
    same = turned.reaction(turn * pose, None, ep.Load(R @ load.force, at=load.at), "elastic")
    assert same.magnitude == pytest.approx(answer.magnitude, rel=1e-7)


@pytest.mark.full
def test_not_found_is_not_known(monkeypatch):
    # The longer searches end in the same way.
    monkeypatch.setattr(elastic_poses, "_RELAXED", ())
    exo = soft_cables(12130.562542526299, 1021.8877346838975, 34.68654989180011)
    load = ep.Load([0.0, 0.0, -35.5], at=[0.0, 0.0, -0.3])
    pose = ep.shoulder_rotation(69.46138506606732, 9.49611787188846, 0, degrees=True)
    answer = exo.reaction(pose, None, load, "elastic")
    assert answer.status == "not_solved"
    assert (
        answer.verdict == "It is not known whether the device can hold this pose: its equilibrium could not be solved."
    )
    assert answer.unknown
    assert not answer.can_hold
    assert not answer.limits.violated
    stack = ep.shoulder_rotation([69.46138506606732, 69.46138506606732], 9.49611787188846, 0, degrees=True)
    verdict = exo.reaction(stack, None, load, "elastic").verdict
    assert verdict == "2 of 2 poses: not known, because its equilibrium could not be solved."
