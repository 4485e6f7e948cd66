"""Tensions of least |F_s| and the moment that limbs hold besides, by enumeration of faces and active sets."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from programs import room_left
from scipy.spatial.transform import Rotation
from wrists import exo_of, heavy_limbs, random_mechanism, regular_poses

import exo_pin as ep
from exo_pin import thesis_rotation
from exo_pin.design import preset
from exo_pin.reaction.holding.least_held_forces import (
    least_held_forces,
    missing_moments,
    nearest_tensions,
    tension_limits,
)

NONE = (np.zeros((1, 3)), np.zeros((1, 3)))


def free_body(mechanism, R, base, cuff, force, moment):
    """b × s and s as columns, and the force and moment about O that limbs and shoulder have to hold."""
    on_arm = (mechanism.geometry.platform_points + cuff) @ R.T
    lines = on_arm - mechanism.geometry.base_points - base
    s = lines / np.linalg.norm(lines, axis=1)[:, None]
    weight = mechanism.arm.mass * np.array(mechanism.gravity)
    return np.cross(on_arm, s).T, s.T, force + weight, moment + np.cross(R @ mechanism.arm.centre_of_mass, weight)


def shortest(arms, moment, pulls, force, low, high):
    """Tensions of least |pulls f - force| of those with a moment within limits, by enumeration of active sets."""
    n, best, found = arms.shape[1], np.inf, None
    for state in itertools.product((0, -1, 1), repeat=n):
        state = np.array(state)
        free = state == 0
        f = np.where(state < 0, low, high)
        f[free] = 0.0
        if not np.isfinite(f).all() or (free.sum() < 3):
            continue
        own = np.linalg.lstsq(arms[:, free], moment - arms @ f, rcond=None)[0]
        along = np.linalg.svd(arms[:, free])[2][3:].T
        f[free] = own
        if along.shape[1]:
            effect = pulls[:, free] @ along
            f[free] = own + along @ np.linalg.lstsq(effect, force - pulls @ f, rcond=None)[0]
        inside = (f >= low - 1e-9).all() and (f <= high + 1e-9).all()
        size = np.linalg.norm(pulls @ f - force)
        if inside and np.abs(arms @ f - moment).max() < 1e-9 and size < best - 1e-12:
            best, found = size, f
    return found


def with_actuators(mechanism, rng, **more):
    """Cables and linear actuators in turn, of different strengths."""
    kinds = []
    for i, limb in enumerate(mechanism.limbs):
        pull, push = rng.uniform(30.0, 250.0, 2)
        own = ep.Actuator("cable", pull) if i % 2 else ep.Actuator("linear", pull, push)
        kinds.append(replace(limb, actuator=own))
    return mechanism.replace(limbs=tuple(kinds))


@pytest.mark.parametrize("n", [3, 4, 5])
@pytest.mark.parametrize("shifted", [False, True])
def test_tensions_and_room_equal_the_enumeration(n, shifted):
    rng = np.random.default_rng(10 * n + shifted)
    mechanism = with_actuators(random_mechanism(rng, n, ["SPS"] * n), rng)
    poses = regular_poses(mechanism, rng, 25, margin=0.1)
    count, R = len(poses), poses.as_matrix()
    offset = (0.02 * rng.normal(size=(count, 3)), 0.02 * rng.normal(size=(count, 3))) if shifted else NONE
    force, couple, at = (rng.normal(size=(count, 3)) * size for size in (8.0, 1.0, 0.2))
    load = ep.Load(force, couple, at) if shifted else None
    least = 3.0 if shifted else 0.0
    low, high = (part[0] for part in tension_limits(mechanism, np.ones((1, n)), least))
    for limb, bottom, top in zip(mechanism.limbs, low, high, strict=True):
        assert bottom == (least if limb.actuator.pulls_only else -limb.actuator.push_limit)
        assert top == limb.actuator.pull_limit
    margin, tensions, shoulder = least_held_forces(mechanism, R, offset, np.ones((count, n)), least, load)
    held = 0
    for k in range(count):
        base, cuff = (part[min(k, len(part) - 1)] for part in offset)
        own = (force[k], couple[k] + np.cross(R[k] @ at[k], force[k])) if shifted else (0.0, 0.0)
        arms, pulls, push, moment = free_body(mechanism, R[k], base, cuff, *own)
        assert margin[k] == pytest.approx(room_left(arms, moment, low, high), abs=1e-9)
        if margin[k] < 0.0:
            assert np.isnan(tensions[k]).all()
            assert np.isnan(shoulder[k]).all()
            continue
        f = shortest(arms, moment, pulls, push, low, high)
        held += 1
        assert np.linalg.norm(shoulder[k]) == pytest.approx(np.linalg.norm(pulls @ f - push), abs=1e-8)
        np.testing.assert_allclose(shoulder[k], pulls @ f - push, atol=1e-5)
        np.testing.assert_allclose(arms @ tensions[k], moment, atol=1e-9)
        np.testing.assert_allclose(pulls @ tensions[k] - push, shoulder[k], atol=1e-9)
        assert (tensions[k] >= low - 1e-9).all()
        assert (tensions[k] <= high + 1e-9).all()
    assert 3 <= held < count


@pytest.mark.parametrize("n", [3, 4])
def test_a_limb_that_is_lost_one_without_limit_and_poses_without_forces(n):
    rng = np.random.default_rng(n)
    mechanism = with_actuators(random_mechanism(rng, n, ["SPS"] * n), rng)
    poses = regular_poses(mechanism, rng, 60, margin=0.05)
    count, R = len(poses), poses.as_matrix()
    lengths = np.ones((count, n))
    margin, _, _ = least_held_forces(mechanism, R, NONE, lengths)
    lame, own, _ = least_held_forces(mechanism, R, NONE, lengths, lost=1)
    limits = [np.array(part[0]) for part in tension_limits(mechanism, lengths[:1], 0.0)]
    for part in limits:
        part[1] = 0.0
    for k in range(count):
        arms, _, _, moment = free_body(mechanism, R[k], 0.0, 0.0, 0.0, 0.0)
        assert lame[k] == pytest.approx(room_left(arms, moment, *limits), abs=1e-9)
    assert (lame <= margin + 1e-9).all()
    np.testing.assert_allclose(own[lame >= 0.0, 1], 0.0, atol=1e-12)
    # Of unknown strength: held only if it were strong enough, so nothing is known there; not held is not held.
    limbs = list(mechanism.limbs)
    limbs[1] = replace(limbs[1], actuator=ep.Actuator("cable"))
    unknown, none, _ = least_held_forces(mechanism.replace(limbs=tuple(limbs)), R, NONE, lengths)
    ceiling = tension_limits(mechanism.replace(limbs=tuple(limbs)), lengths[:1], 0.0)[1][0, 1]
    assert ceiling > 1e3
    assert 0 < np.isnan(unknown).sum() < count
    assert (unknown[np.isfinite(unknown)] < 0.0).all()
    assert np.isnan(none).all()
    known, own, _ = least_held_forces(mechanism.replace(limbs=tuple(limbs)), R, NONE, lengths, lost=1)
    np.testing.assert_allclose(known, lame, atol=1e-12)


def test_a_singular_pose_of_three_limbs_has_no_margin():
    exo = ep.load("three-linear-actuators").replace(arm=ep.Arm(3.0, [0.0, 0.0, -0.25]))
    wrist = exo.replace(geometry=preset("prototype").geometry).mechanism
    poses = thesis_rotation([40, 90, 40], [-20, 0, -20], [-30, 0, -30], degrees=True)
    # Nor has one in which a limb goes through O.
    folded, _ = Rotation.align_vectors(wrist.geometry.base_points[:1].copy(), wrist.geometry.platform_points[:1].copy())
    R = np.concatenate([poses.as_matrix(), folded.as_matrix()[None]])
    margin, tensions, shoulder = least_held_forces(wrist, R, NONE, np.ones((4, 3)))
    assert np.isnan(margin).tolist() == [False, True, False, True]
    assert np.isnan(tensions[[1, 3]]).all()
    assert np.isnan(shoulder[[1, 3]]).all()
    assert margin[0] == margin[2]


@pytest.mark.parametrize("n", [3, 4])
def test_limbs_with_mass_give_the_answer_of_a_query(n):
    rng = np.random.default_rng(7 + n)
    mechanism = heavy_limbs(random_mechanism(rng, n, ["SPS"] * n), rng)
    mechanism = mechanism.replace(
        limbs=tuple(replace(limb, actuator=ep.Actuator("linear", 3000.0, 3000.0)) for limb in mechanism.limbs)
    )
    poses = regular_poses(mechanism, rng, 12, margin=0.03)
    R, base, cuff = poses.as_matrix(), np.array([0.01, -0.02, 0.015]), np.array([-0.01, 0.0, 0.02])
    load = ep.Load(np.array([4.0, -2.0, -9.0]), at=np.array([0.0, 0.05, -0.3]), frame="arm")
    _, tensions, shoulder = least_held_forces(mechanism, R, (base[None], cuff[None]), np.ones((len(R), n)), load=load)
    answer = exo_of(mechanism).reaction(
        poses, split="minimal", load=load, centre_offset=ep.CentreOffset(base=base, cuff=cuff)
    )
    held = np.isfinite(tensions).all(axis=1) & answer.held
    assert held.sum() >= 8
    np.testing.assert_allclose(tensions[held], answer.actuator_forces[held], atol=1e-6)
    np.testing.assert_allclose(shoulder[held], answer.shoulder_force[held], atol=1e-6)


@pytest.mark.parametrize("n", [3, 4, 5, 6, 8])
def test_nearest_tensions_miss_least_of_a_moment_and_load_the_shoulder_least(n):
    rng = np.random.default_rng(n)
    both = set()
    for _ in range(20):
        arms, pulls = 0.1 * rng.normal(size=(3, n)), rng.normal(size=(3, n))
        low, high = np.zeros(n), rng.uniform(10.0, 60.0, n)
        moment, force = rng.normal(size=3) * rng.choice([1.0, 12.0]), 20.0 * rng.normal(size=3)
        f = nearest_tensions(arms, moment, pulls, force, low, high)
        missed = arms @ f - moment
        assert (f >= low).all()
        assert (f <= high).all()
        np.testing.assert_allclose(
            missing_moments(moment[None], arms[None], low[None], high[None]), np.linalg.norm(missed), atol=1e-10
        )
        # No tension comes nearer (Farkas): what is missed separates the moment from all that limbs give.
        gains = missed @ arms
        assert missed @ missed == pytest.approx(np.where(gains > 0, low, high) @ gains - missed @ moment, abs=1e-8)
        lacks = np.linalg.norm(missed) > 1e-9
        both.add(bool(lacks))
        if 3 < n < 6 and not lacks:
            best = shortest(arms, moment, pulls, force, low, high)
            np.testing.assert_allclose(pulls @ f, pulls @ best, atol=1e-7)
    assert both == {True, False}
