"""Tensions of least |F_s| of a workspace and the moment that limbs hold besides, by enumeration of active sets."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from programs import room_left
from wrists import random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.workspace import Criteria, workspace


def asked(mechanism, poses, offset=None, least=0.0, load=None, names=("forces",), **limits):
    """Margin, tensions and F_s of a workspace."""
    moved = None if offset is None else ep.CentreOffset(*offset)
    found = workspace(mechanism, poses, Criteria(names=names, least_tension=least, **limits), load, moved)
    return found.margins[names[0]], found.tensions, found.shoulder_force


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


def limits_of(mechanism, least=0.0):
    """Least and greatest tension of each limb, shape (n,) each, N."""
    kinds = [limb.actuator for limb in mechanism.limbs]
    low = [least if own.pulls_only else -own.push_limit for own in kinds]
    return np.array(low), np.array([own.pull_limit for own in kinds])


@pytest.mark.parametrize("n", [3, 4, 5])
@pytest.mark.parametrize("shifted", [False, True])
def test_tensions_and_room_equal_the_enumeration(n, shifted):
    rng = np.random.default_rng(10 * n + shifted)
    mechanism = with_actuators(random_mechanism(rng, n, ["SPS"] * n), rng)
    poses = regular_poses(mechanism, rng, 25, margin=0.1)
    count, R = len(poses), poses.as_matrix()
    offset = (0.02 * rng.normal(size=(count, 3)), 0.02 * rng.normal(size=(count, 3))) if shifted else None
    force, couple, at = (rng.normal(size=(count, 3)) * size for size in (8.0, 1.0, 0.2))
    load = ep.Load(force, couple, at) if shifted else None
    least = 3.0 if shifted else 0.0
    low, high = limits_of(mechanism, least)
    margin, tensions, shoulder = asked(mechanism, poses, offset, least, load)
    held = 0
    for k in range(count):
        base, cuff = (0.0, 0.0) if offset is None else (part[k] for part in offset)
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
def test_a_limb_that_is_lost_and_one_without_limit(n):
    rng = np.random.default_rng(n)
    mechanism = with_actuators(random_mechanism(rng, n, ["SPS"] * n), rng)
    poses = regular_poses(mechanism, rng, 60, margin=0.05)
    lame, _, _ = asked(mechanism, poses, names=("limb_loss",), least_moment_without_limb=0.0)
    limits = np.array(limits_of(mechanism))
    for k, R in enumerate(poses.as_matrix()):
        arms, _, _, moment = free_body(mechanism, R, 0.0, 0.0, 0.0, 0.0)
        rooms = [room_left(arms, moment, *np.where(np.arange(n) == i, 0.0, limits)) for i in range(n)]
        assert lame[k] == pytest.approx(min(rooms), abs=1e-9)
    limbs = list(mechanism.limbs)
    limbs[1] = replace(limbs[1], actuator=ep.Actuator("cable"))
    with pytest.raises(ep.MissingData, match="greatest pull of limb 2"):
        asked(mechanism.replace(limbs=tuple(limbs)), poses)
