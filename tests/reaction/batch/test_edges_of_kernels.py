"""Tensions that the kernels take, leave or cannot decide."""

import numpy as np
import pytest
import scipy
from wrists import random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.reaction.batch import limit_kernels as tension_kernels
from exo_pin.reaction.batch.limit_kernels import MET, NOT_HELD, UNDECIDED, _taken, _without, tensions_within

INF = np.inf


def limbs(rng, n=4):
    b, s = rng.normal(size=(n, 3)), rng.normal(size=(n, 3))
    b *= 0.2 / np.linalg.norm(b, axis=1, keepdims=True)
    s /= np.linalg.norm(s, axis=1, keepdims=True)
    across = np.cross(s, b)
    reach = np.linalg.norm(across, axis=1)
    return s, across / reach[:, None], reach


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_tensions_are_taken_if_they_have_the_same_moment(axis, plain):
    """Off by a moment about one axis of 1e-9 of tension and radius is off, by 1e-11 is rounding."""
    s, X, reach = limbs(np.random.default_rng(51 + axis))
    arms = -(reach[:, None] * X).T
    f = np.array([10.0, 20.0, 30.0, 40.0])
    low, high = np.zeros(4), np.full(4, 100.0)
    for share, taken in ((1e-9, False), (1e-11, True), (-1e-9, False)):
        change = np.linalg.pinv(arms) @ (share * 0.2 * 40.0 * np.eye(3)[axis])
        within, own, shoulder = np.vstack([f + change, np.full(4, np.nan)]), f.copy(), np.array([1.0, 2.0, 3.0])
        assert _taken(s, X, reach, 0.2, low, high, within, own, shoulder) == taken
        if taken:
            np.testing.assert_allclose(own, f + change, rtol=1e-15)
            np.testing.assert_allclose(shoulder, [1.0, 2.0, 3.0] + s.T @ change, atol=1e-14)
        else:
            np.testing.assert_array_equal(own, f)
            np.testing.assert_array_equal(shoulder, [1.0, 2.0, 3.0])
    # Beyond a limit by rounding they are brought onto it.
    high[3], stress = 40.0, scipy.linalg.null_space(arms)[:, 0]
    stress *= np.sign(stress[3])
    within, own = np.vstack([f + 1e-12 * stress, f]), f.copy()
    assert _taken(s, X, reach, 0.2, low, high, within, own, np.zeros(3))
    assert own[3] == 40.0


@pytest.mark.parametrize("by", ["tension", "shoulder x", "shoulder y", "shoulder z", "low", "high"])
def test_what_rounding_decides_is_measured_by_the_largest_force(by, plain):
    """A moment that is missed by 1e-9 of scale and radius; the scale is 1000 N of one force or another."""
    X, reach = -np.eye(3), np.full(3, 0.5)
    low, high, shoulder, largest = np.zeros(3), np.full(3, 1.0), np.zeros(3), 1.0
    moment = np.zeros(3)
    if by == "tension":
        largest = 1000.0
    elif by.startswith("shoulder"):
        shoulder["xyz".index(by[-1])] = -1000.0
    elif by == "low":
        low[1], high[1] = 1000.0, 1001.0
        moment[1] = 500.0
    else:
        low[1], high[1] = -1001.0, -1000.0
        moment[1] = -500.0
    for share, code in ((3.0, NOT_HELD), (0.3, UNDECIDED), (-0.3, UNDECIDED)):
        off = moment.copy()
        off[0] -= share * 1e-9 * 1000.0 * 0.5
        room = np.empty((3, 3)), np.empty((2, 3)), np.empty((2, 3))
        assert _without(X, reach, tuple(off), 0.5, low, high, *room, largest, shoulder) == code


def test_tensions_beyond_a_limit_by_rounding_are_left_as_they_are(plain):
    s, X, reach = limbs(np.random.default_rng(61))
    f = np.array([100.0, 20.0, 30.0, 40.0])
    for beyond, same in ((5e-8, True), (5e-7, False)):
        low, high = np.zeros(4), np.array([200.0, 20.0 - beyond, 200.0, 200.0])
        own, shoulder, Q = f.copy(), np.zeros(3), np.linalg.qr(-(reach[:, None] * X))[0]
        room = (np.empty((4, 1)), np.empty((3, 1)), np.empty(3), np.empty(1), np.empty((4, 3)), np.empty((2, 3)))
        moment = tuple(-(reach[:, None] * X).T @ f)
        code = tensions_within(s, X, reach, moment, 0.2, Q, low, high, *room, np.empty((2, 4)), own, shoulder)
        assert (own == f).all() == same
        assert code == MET or not same


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
    inner = tension_kernels.tensions_within.plain.__globals__
    monkeypatch.setitem(inner, "least_sum_force", lambda *_: False)
    found = exo.reaction_map(poses)
    np.testing.assert_array_equal(found.status, answer.status)
    np.testing.assert_array_equal(found.unknown, answer.unknown)
    np.testing.assert_allclose(found.actuator_forces[chosen], answer.actuator_forces[chosen], atol=1e-6)
    np.testing.assert_allclose(found.shoulder_force, answer.shoulder_force, atol=1e-6)
