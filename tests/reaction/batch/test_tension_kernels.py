"""Tensions of one pose within limits in the kernels, by enumeration, and the codes of poses without any."""

import itertools

import numpy as np
import pytest
from wrists import random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.numerics.bounded.box_descent import scratch
from exo_pin.reaction.batch.limit_kernels import MET, NOT_HELD, UNDECIDED, many_tensions_within, tensions_within
from exo_pin.wrist.forces.force_kernels import spherical_forces

RADIUS = 0.2


def shortest(arms, moment, low, high):
    """Tensions of least norm with a moment, by enumeration of the limits that hold them; None if there are none."""
    best, found = np.inf, None
    for state in itertools.product((0, -1, 1), repeat=len(low)):
        state = np.array(state)
        f, free = np.where(state < 0, low, high), state == 0
        if not np.isfinite(f[~free]).all() or free.sum() < 3:
            continue
        f[free] = 0.0
        f[free] = np.linalg.lstsq(arms[:, free], moment - arms @ f, rcond=None)[0]
        inside = (f >= low - 1e-9).all() and (f <= high + 1e-9).all() and np.abs(arms @ f - moment).max() < 1e-9
        if inside and np.linalg.norm(f) < best:
            best, found = np.linalg.norm(f), f
    return found


def limbs(rng, n):
    """Directions, normals and lever arms of n limbs, and b x s as columns."""
    b, s = RADIUS * rng.normal(size=(n, 3)), rng.normal(size=(n, 3))
    b *= RADIUS / np.linalg.norm(b, axis=1, keepdims=True)
    s /= np.linalg.norm(s, axis=1, keepdims=True)
    across = np.cross(s, b)
    reach = np.linalg.norm(across, axis=1)
    return s, across / reach[:, None], reach, -across.T


def asked(n, s, X, reach, arms, moment, force, low, high):
    """Code, f and F_s of the kernel for so many limbs."""
    f, shoulder, Q, U = np.empty(n), np.empty(3), np.empty((n, 3)), np.empty((3, 3))
    spherical_forces.plain(s, X, reach, tuple(force), tuple(moment), f, shoulder, Q, U)
    np.testing.assert_allclose(arms @ f, moment, atol=1e-12)
    np.testing.assert_allclose(shoulder, s.T @ f - force, atol=1e-12)
    M, c, arm_room, moments, relief = tuple(moment), np.empty(3), np.empty((n, 3)), np.empty((2, 3)), np.empty((2, n))
    if n <= 6:
        m = n - 3
        room = (np.empty((n, m)), np.empty((3, m)), c, np.empty(m), arm_room, moments, relief)
        code = tensions_within.plain(s, X, reach, M, RADIUS, Q, low, high, *room, f, shoulder)
    else:
        some = (c, arm_room, moments, relief, scratch(n))
        code = many_tensions_within.plain(s, X, reach, M, RADIUS, low, high, *some, f, shoulder)
    return code, f, shoulder


@pytest.mark.parametrize("n", [4, 5, 6, 7])
def test_tensions_within_limits_are_the_shortest_of_all(n):
    rng, seen = np.random.default_rng(n), {MET: 0, NOT_HELD: 0}
    for k in range(24 if n < 7 else 5):
        s, X, reach, arms = limbs(rng, n)
        low, high = rng.uniform(-5.0, 5.0, n), np.full(n, np.inf)
        if k % 2:
            high = low + rng.uniform(5.0, 60.0, n)
        # What the limbs pull, and more moment than they can give.
        pull = low + rng.uniform(0.0, 1.0, n) * np.minimum(high - low, 40.0)
        moment, force = arms @ pull * (1.0, 9.0, 1.3)[k % 7 % 3], 20.0 * rng.normal(size=3)
        if k % 3 == 0:
            moment = arms @ pull
        code, f, shoulder = asked(n, s, X, reach, arms, moment, force, low, high)
        best = shortest(arms, moment, low, high)
        assert code == (NOT_HELD if best is None else MET)
        seen[code] += 1
        if best is not None:
            np.testing.assert_allclose(f, best, atol=1e-8)
            np.testing.assert_allclose(shoulder, s.T @ f - force, atol=1e-9)
            assert (f >= low - 1e-9).all()
            assert (f <= high + 1e-9).all()
    assert min(seen.values()) >= 1


@pytest.mark.parametrize("n", [4, 7])
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_rounding_decides_only_next_to_the_limits(n, size):
    """All limbs at their limits hold a moment; a little more of it along what they give most of is not held."""
    rng = np.random.default_rng(n)
    s, X, reach, arms = limbs(rng, n)
    y = rng.normal(size=3)
    low, high = np.zeros(n), size * rng.uniform(5.0, 9.0, n)
    corner = np.where(y @ arms > 0.0, high, low)
    moment, along = arms @ corner, y / np.linalg.norm(y) * size * RADIUS
    codes = [asked(n, s, X, reach, arms, moment + share * along, np.zeros(3), low, high)[0] for share in
             (-1e-3, 0.0, 1e-11, 1e-6, 1e-2, 10.0)]  # fmt: skip
    assert codes[0] == MET
    assert NOT_HELD not in codes[1:3]
    assert codes[3:] == [NOT_HELD] * 3
    # F_s counts among the sizes of rounding.
    short, heavy = moment + 1e-6 * along, size * np.array([0.0, 1e6, 1e6])
    assert asked(n, s, X, reach, arms, short, heavy, low, high)[0] == UNDECIDED
    # Limits of another sign, the load much less than they are.
    pushing = asked(n, s, X, reach, arms, 1e-3 * moment, np.zeros(3), -2.0 * high, -high)[0]
    assert pushing == (NOT_HELD if shortest(arms, 1e-3 * moment, -2.0 * high, -high) is None else MET)


def test_what_the_kernel_cannot_decide_the_program_does(plain, monkeypatch):
    """Each pose that needs a choice is left to the program, and has the answer of a query."""
    rng = np.random.default_rng(71)
    mechanism = random_mechanism(rng, 4, ["SPS"] * 4)
    poses = regular_poses(mechanism, rng, 6, margin=0.08)
    exo = ep.ShoulderExo.from_mechanism(mechanism)
    exo = exo.replace(limbs=[ep.Limb("SPS", actuator=ep.Actuator("linear", 300.0, 5.0))] * 4)
    answer = exo.reaction(poses)
    free = exo.reaction(poses, limits="none")
    chosen = answer.held & ~np.isclose(answer.actuator_forces, free.actuator_forces, atol=1e-6).all(axis=1)
    assert chosen.any()
    inner = tensions_within.plain.__globals__
    monkeypatch.setitem(inner, "least_sum_force", lambda *_: False)
    found = exo.reaction_map(poses)
    np.testing.assert_array_equal(found.status, answer.status)
    np.testing.assert_array_equal(found.unknown, answer.unknown)
    np.testing.assert_allclose(found.actuator_forces[chosen], answer.actuator_forces[chosen], atol=1e-6)
    np.testing.assert_allclose(found.shoulder_force, answer.shoulder_force, atol=1e-6)
