"""Programs of single poses at their edges: side forces with moments, sockets, weights, signs."""

from types import SimpleNamespace

import numpy as np
import pytest
import scipy
from programs import random_pose

from exo_pin.reaction.holding import force_range as ranges
from exo_pin.reaction.holding.infeasible_poses import is_held, shortfall
from exo_pin.reaction.splits.limb_and_side_forces import Pose, Socket, choose, force_scale

INF = np.inf


def with_side_moments(rng, lever, reachable):
    """A pose whose side forces have moments about O, as off the centre."""
    while True:
        pose = random_pose(rng, "sides", n=4, reachable=True)
        if pose.upu.size >= 2:
            break
    of_g = np.zeros((3, 4))
    of_g[:, pose.upu] = lever * rng.normal(size=(3, pose.upu.size))
    moment = pose.state.moment_of_f @ rng.uniform(0.0, 40.0, 4)
    if reachable:
        moment = pose.state.moment_of_f @ (pose.f_low + 1.0) + of_g[:, pose.upu] @ (
            0.5 * pose.g_low + 0.5 * pose.g_high
        )
    return pose._replace(state=pose.state._replace(moment_of_g=of_g, moment=moment))


def reliefs_hold(pose, missing):
    """Just one limit wider by its relief holds the pose, a little less does not; return how many there are."""
    count = 0
    for i in range(len(pose.f_low)):
        assert np.isinf(missing.relief[i]) or missing.blocking[i] != 0
        if not np.isfinite(missing.relief[i]):
            continue
        count += 1
        for share, held in ((1.0 + 1e-6, True), (1.0 - 1e-4, False)):
            low, high = pose.f_low.copy(), pose.f_high.copy()
            end = low if missing.blocking[i] < 0 else high
            end[i] += missing.blocking[i] * missing.relief[i] * share
            assert is_held(pose._replace(f_low=low, f_high=high)) == held
    return count


def test_reliefs_of_limits_that_block_from_below_and_from_above():
    rng, found = np.random.default_rng(19), {-1: 0, 1: 0}
    for _ in range(40):
        pose = random_pose(rng, "spherical", n=5, reachable=True)
        low, high = np.full(5, 5.0), np.full(5, 30.0)
        inside = np.where(rng.random(5) < 0.4, rng.choice([-20.0, 60.0], 5), 15.0)
        pose = pose._replace(f_low=low, f_high=high, state=pose.state._replace(moment=pose.state.moment_of_f @ inside))
        missing = shortfall(pose)
        if missing is not None and reliefs_hold(pose, missing):
            for sign in found:
                found[sign] += int((np.isfinite(missing.relief) & (missing.blocking == sign)).sum())
    assert min(found.values()) >= 3


@pytest.mark.parametrize("reachable", [True, False])
def test_side_forces_with_moments_help_to_hold_a_pose(reachable):
    rng, seen = np.random.default_rng(17 + reachable), []
    for _ in range(12):
        pose = with_side_moments(rng, 0.2, reachable)
        effect, target, scale = pose.moment_effect, pose.state.moment / pose.radius, force_scale(pose)
        best = scipy.optimize.lsq_linear(
            effect, target, (pose.low - 1e-12, pose.high + 1e-12), tol=1e-14, method="bvls"
        )
        least = np.sqrt(2.0 * best.cost)
        if 1e-12 * scale < least < 1e-6 * scale:
            continue
        missing = shortfall(pose)
        assert (missing is None) == is_held(pose) == (least <= 1e-9 * scale)
        seen.append(missing is None)
        if missing is None:
            # Without side forces it would be another question.
            continue
        np.testing.assert_allclose(np.linalg.norm(missing.missing[3:]) / pose.radius, least, rtol=1e-6)
        np.testing.assert_array_equal(missing.missing[:3], 0.0)
        np.testing.assert_array_equal(missing.direction[:3], 0.0)
        reliefs_hold(pose, missing)
    assert len(seen) >= 8
    assert any(seen) if reachable else not all(seen)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_a_socket_and_an_imbalance_are_in_newtons(size):
    """One vertical force of 5 N is missing of a socket that takes at most 2 N: so many are missing of any size."""
    n = 3
    arms = 0.2 * np.eye(3)
    state = random_pose(np.random.default_rng(3), "pull", n=n).state._replace(
        moment_of_f=arms, moment_of_g=np.zeros((3, n)), moment=arms @ [1.0, 2.0, 3.0] * size,
        shoulder=np.array([0.0, 0.0, 5.0]) * size, shoulder_of_f=np.zeros((3, n)), shoulder_of_g=np.zeros((3, n)),
        closure_of_f=np.zeros((n, 6)), closure_of_g=np.zeros((n, 6)),
    )  # fmt: skip
    socket = Socket(np.array([[0.0, 0.0, 1.0]]), np.array([2.0 * size]), None)
    ends = np.zeros(n), np.full(n, 10.0 * size)
    pose = Pose(state, 0.2, *ends, socket)
    missing = shortfall(pose)
    # F_s = 5 N would balance, and 2 N is the most along z: 3 N of force are missing, and no moment.
    np.testing.assert_allclose(missing.missing[3:], 0.0, atol=1e-9 * size)
    np.testing.assert_allclose(np.abs(missing.missing[:3]), [0.0, 0.0, 3.0 * size], atol=1e-6 * size)
    np.testing.assert_allclose(missing.shoulder, [0.0, 0.0, 2.0 * size], atol=1e-6 * size)
    assert missing.required - missing.available == pytest.approx(3.0 * size, rel=1e-5)
    assert shortfall(pose._replace(socket=socket._replace(h=np.array([5.0 * size])))) is None
    assert not is_held(pose)


def test_limbs_that_may_not_push_and_one_that_gives_nothing():
    """The sign of |g| <= |f| is that of all limbs, not of one whose limits are zero."""
    low, high = np.array([-50.0, 0.0, -20.0]), np.zeros(3)
    rows = Pose.side_rows(SimpleNamespace(f_low=low, f_high=high, upu=np.array([0, 1]), by_actuator=True))
    for g, allowed in (([5.0, 0.0], True), ([-10.0, 0.0], True), ([11.0, 0.0], False), ([0.0, 0.1], False)):
        assert (rows @ [-10.0, 0.0, -3.0, *g] <= 0.0).all() == allowed
    rows = Pose.side_rows(SimpleNamespace(f_low=-low, f_high=-2 * low, upu=np.array([0, 1]), by_actuator=False))
    assert rows.shape == (0, 5)


@pytest.mark.parametrize("tension", [0.0, 0.01, 1.0, 9.0])
def test_the_best_of_weights_without_limits_is_a_least_squares_answer(tension):
    rng = np.random.default_rng(23)
    pose = random_pose(rng, "weights", n=5, reachable=True)
    free = np.full(5, INF)
    goal = rng.normal(size=(3, 3)) + 2.0 * np.eye(3)
    pose = pose._replace(
        f_low=-free, f_high=free, goal=goal, tension=tension, upu=np.array([], dtype=int), g_low=np.empty(0),
        g_high=np.empty(0),
    )  # fmt: skip
    best = choose(pose)
    f0 = np.linalg.lstsq(pose.state.moment_of_f, pose.state.moment, rcond=None)[0]
    along = scipy.linalg.null_space(pose.state.moment_of_f)
    cost = np.vstack([goal @ pose.state.shoulder_of_f, np.sqrt(tension) * np.eye(5)])
    start = np.concatenate([goal @ pose.state.shoulder, np.zeros(5)])
    y = np.linalg.lstsq(cost @ along, -start - cost @ f0, rcond=None)[0]
    np.testing.assert_allclose(best.f, f0 + along @ y, atol=1e-6 * force_scale(pose))
    np.testing.assert_array_equal(best.g, 0.0)


def test_a_range_beyond_vertices_that_are_counted(monkeypatch):
    """Where vertices are too many a bound from both sides takes their place; it contains what they say."""
    pose = random_pose(np.random.default_rng(41), "range", n=5, reachable=True)
    pose = pose._replace(f_low=np.zeros(5), f_high=np.full(5, 60.0))
    if not is_held(pose):
        f = np.full(5, 20.0)
        pose = pose._replace(state=pose.state._replace(moment=pose.state.moment_of_f @ f))
    size = float(np.linalg.norm(pose.state.shoulder + pose.state.shoulder_of_f @ choose(pose).f))
    least, greatest, found = ranges._of_pose(pose, size)
    assert greatest == found
    monkeypatch.setattr(ranges, "MOST", 0)
    same, bound, near = ranges._of_pose(pose, size)
    assert same == pytest.approx(least, rel=1e-6, abs=1e-6)
    assert near <= greatest + 1e-6 <= bound + 2e-6
    assert near >= 0.8 * greatest
    assert bound > near


def test_the_words_of_a_bound_count_relative_to_it():
    def told(greatest, found):
        return str(ranges.ForceRange(np.array(1.0), np.array(greatest), np.array(found)))

    assert told(30.0, 30.0 - 1e-5) == "1.0 to 30.0 N"
    assert told(30.0, 30.0 - 1e-4) == "1.0 to at most 30.0 N (at least 30.0 N)"
    assert told(30.0, 20.0) == "1.0 to at most 30.0 N (at least 20.0 N)"
