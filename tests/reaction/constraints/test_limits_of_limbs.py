"""Limits of lengths, forces, speed and power, number by number, and the verdict that follows from them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from programs import distance_to_cone, random_pose, shoulder_force

import exo_pin as ep
from exo_pin.reaction.assumptions import as_split
from exo_pin.reaction.constraints.actuator_limits import LimbLimits, design_limits, length_limits, stroke_limits
from exo_pin.reaction.holding.hold_check import hold_check
from exo_pin.reaction.splits.limb_and_side_forces import choose, force_scale

INF, NAN = np.inf, np.nan


def limits(lower, upper, below=False, above=False, error=0.0, **more):
    """Limits of one pose a row, of three limbs."""
    count = np.size(lower) // 3

    def full(value, kind):
        return np.broadcast_to(np.array(value, dtype=kind), (count, 3)).copy()

    return LimbLimits(
        full(lower, float), full(upper, float), full(below, bool), full(above, bool), full(error, float), **more
    )


def test_how_far_tensions_are_beyond_their_limits():
    own = limits([[-10.0, 0.0, 5.0]], [[20.0, 30.0, INF]])
    for tensions, expected in (
        ([-10.0, 0.0, 5.0], [0.0, 0.0, 0.0]),
        ([20.0, 30.0, 1e9], [0.0, 0.0, 0.0]),
        ([-12.0, -3.0, 4.0], [-2.0, -3.0, -1.0]),
        ([25.0, 31.0, 6.0], [5.0, 1.0, 0.0]),
    ):
        np.testing.assert_allclose(own.force_error(np.array([tensions])), [expected], atol=1e-4)
        assert own.met(np.array([tensions]), np.array([0]))[0] == (expected == [0.0] * 3)
    # Rounding relative to the largest tension breaks no limit.
    for share, met in ((1e-10, True), (1e-5, False)):
        beyond = np.array([[-10.0 - 1e4 * share, 1.0, 1e4]])
        assert own.met(beyond, np.array([0]))[0] == met
        assert (own.force_error(beyond)[0, 0] == 0.0) == met
        beyond = np.array([[20.0 + 1e4 * share, 1.0, 1e4]])
        assert own.met(beyond, np.array([0]))[0] == met
        assert (own.force_error(beyond)[0, 0] == 0.0) == met
    # Where a limit is not known the outcome is not, unless another one is broken or it plays no part.
    open_ = limits([[-INF, -INF, 0.0]], [[50.0, 50.0, INF]], [[True, False, False]], [[False, False, True]])
    np.testing.assert_allclose(
        open_.force_error(np.array([[-4.0, -4.0, 4.0], [4.0, 60.0, -4.0]])),
        [[NAN, 0.0, NAN], [0.0, 10.0, -4.0]],
        atol=1e-4,
    )


def test_what_limits_say_of_poses():
    own = limits(
        [[-INF] * 3, [0.0] * 3], [[INF] * 3, [5.0] * 3], error=[[0.0, NAN, 0.0], [0.0, 0.01, NAN]],
        excess_speed=np.array([[0.0, 0.0, 0.0], [0.0, 0.1, 0.0]]),
    )  # fmt: skip
    assert own.reachable.tolist() == [True, False]
    assert own.slow_enough.tolist() == [True, False]
    assert own.bound_forces
    assert not own.rows(np.array([0])).bound_forces
    assert not own.one_signed
    assert own.rows(np.array([1])).one_signed
    assert limits([[-INF] * 3], [[0.0] * 3]).one_signed
    assert limits([[-INF, 2.0, -INF]], [[INF] * 3]).bound_forces
    assert limits([[-INF] * 3], [[INF, INF, 2.0]]).bound_forces
    assert limits([[0.0] * 3, [0.0] * 3], [[1.0] * 3] * 2).slow_enough.tolist() == [True, True]
    stopped = own.with_passive_error(np.array([0.2, 0.0]))
    assert stopped.reachable.tolist() == [False, False]
    assert own.with_passive_error(np.zeros(2)).reachable.tolist() == [True, False]
    second = stopped.rows(np.array([1]))
    np.testing.assert_array_equal(second.passive_error, [0.0])
    np.testing.assert_array_equal(second.excess_speed, [[0.0, 0.1, 0.0]])
    none = LimbLimits.none((2, 3))
    assert not none.asked
    assert not none.bound_forces
    assert none.open_below.all()
    assert none.open_above.all()
    assert none.reachable.all()


def test_narrower_limits_are_known_where_they_are_finite():
    wide = limits([[-10.0, -INF, 0.0]], [[20.0, INF, 30.0]], [[False, True, True]], [[False, True, False]])
    found = wide.narrowed(np.array([[-5.0, -INF, 40.0]]), np.array([[INF, 8.0, 50.0]]))
    np.testing.assert_array_equal(found.lower, [[-5.0, -INF, 30.0]])
    np.testing.assert_array_equal(found.upper, [[20.0, 8.0, 30.0]])
    np.testing.assert_array_equal(found.length_error, [[0.0, 0.0, INF]])
    np.testing.assert_array_equal(found.open_below, [[False, True, False]])
    np.testing.assert_array_equal(found.open_above, [[False, False, False]])


def test_speed_and_power_limit_what_a_moving_limb_can_pull_and_push():
    given = [(0.5, 10.0), (None, 4.0), (0.2, None)]
    mechanism = SimpleNamespace(limbs=[SimpleNamespace(speed_limit=s, power_limit=p) for s, p in given])
    wide = limits([[-100.0] * 3] * 3, [[90.0] * 3] * 3, above=True)
    rates = np.array([[0.25, -0.5, 0.3], [-0.6, 0.0, -0.2], [NAN, 0.01, 0.2 * (1.0 + 1e-12)]])
    found = wide.in_motion(mechanism, rates)
    np.testing.assert_allclose(found.upper, [[40.0, 90.0, 90.0], [90.0, 90.0, 90.0], [90.0, 90.0, 90.0]])
    np.testing.assert_allclose(found.lower, [[-100.0, -8.0, -100.0], [-10.0 / 0.6, -100.0, -100.0], [-100.0] * 3])
    np.testing.assert_allclose(found.excess_speed, [[0.0, 0.0, 0.1], [0.1, 0.0, 0.0], [0.0, 0.0, 0.0]], atol=1e-15)
    np.testing.assert_array_equal(found.open_above, wide.open_above)
    np.testing.assert_array_equal(found.open_below, wide.open_below)


def test_the_verdict_of_a_check_by_limit():
    """Each row another way in which limits are met, broken or not known; the third limb's limits are estimates."""
    mechanism = ep.load("three-linear-actuators").mechanism
    keys = ("limbs[2].stroke.end_fitting", "limbs[1].mass")
    mechanism = mechanism.replace(limbs=mechanism.limbs, estimated=keys)
    rows = {
        "met": ([0, 0, 0], [1, 1, 1], False),
        "strong": ([0, 0, 0], [9, 1, 1], False),
        "short": ([-0.1, 0, 0], [1, 1, 1], False),
        "estimated": ([0, 0, 0.1], [1, 1, 1], False),
        "estimated and short": ([-0.1, 0, 0.1], [1, 1, 1], False),
        "estimated and strong": ([0, 0, 0.1], [9, 1, 1], False),
        "open": ([0, 0, 0], [1, 1, 1], True),
        "unknown length": ([0, NAN, 0], [1, 1, 1], False),
    }
    error = np.array([row[0] for row in rows.values()], dtype=float)
    f = np.array([row[1] for row in rows.values()], dtype=float)
    above = np.array([[row[2]] * 3 for row in rows.values()])
    upper = np.where(above, INF, 5.0)

    def asked(estimated=True, answered=True, **more):
        own = mechanism if estimated else mechanism.replace(estimated=())
        limit = LimbLimits(np.full_like(f, -5.0), upper, np.zeros_like(above), above, error, **more)
        every = np.full(len(f), answered)
        found = hold_check(own, limit, f, every)
        return [{name: bool(getattr(found, name)[k]) for name in ("can_hold", "violated", "unknown")}
                for k in range(len(f))], found  # fmt: skip

    def names(told, name):
        return {key for key, row in zip(rows, told, strict=True) if row[name]}

    broken = {"strong", "short", "estimated", "estimated and short", "estimated and strong"}
    told, found = asked(estimated=False)
    assert names(told, "violated") == broken
    assert names(told, "unknown") == {"open", "unknown length"}
    assert names(told, "can_hold") == {"met"}
    assert found.estimated == ()
    told, found = asked()
    assert names(told, "violated") == broken
    assert names(told, "unknown") == {"met", "estimated", "open", "unknown length"}
    assert names(told, "can_hold") == set()
    assert found.estimated == keys[:1]
    np.testing.assert_allclose(found.force_error[1], [4.0, 0.0, 0.0], atol=1e-6)
    # Without an answer nothing is held, and nothing of it is told; the strength of motion counts as force.
    told, found = asked(estimated=False, answered=False)
    assert names(told, "violated") == names(told, "can_hold") == names(told, "unknown") == set()
    for part in (found.length_error, found.force_error, found.tensions, found.excess_speed):
        assert np.isnan(part).all()
    fast = np.zeros_like(f)
    fast[0, 1] = 0.5
    told, found = asked(estimated=False, excess_speed=fast)
    assert names(told, "violated") == broken | {"met"}
    np.testing.assert_array_equal(found.excess_speed, fast)
    told, _ = asked(estimated=False, passive_error=np.array([0.1, *[0.0] * 7]))
    assert names(told, "violated") == broken | {"met"}
    # Without a question for limits, nothing is known and nothing is missing.
    told, found = asked(asked=False)
    assert names(told, "can_hold") == set()
    assert found.missing == found.estimated == ()
    assert names(told, "unknown") == {"met", "open", "unknown length"} | {"estimated"} - broken
    assert not found.asked


def test_limits_of_a_design_by_length():
    law = ep.Actuator("pneumatic muscle", force_law="best", supply_pressure=4e5)
    exo = ep.load("four-cables")
    limbs = [
        ep.Limb("SPS", stroke=ep.Stroke(0.2, 0.75, 1.0, 0.1), actuator=law),
        ep.Limb("SPS", stroke=ep.Stroke(0.2, 0.75, 1.0, 0.1), actuator=replace(law, pull_limit=50.0)),
        ep.Limb("SPS", stroke=ep.Stroke(0.2, 0.75, 1.0), actuator=ep.Actuator("linear", 70.0)),
        ep.Limb("SPS"),
    ]
    mechanism = exo.replace(limbs=limbs).mechanism
    lengths = np.array([[0.28, 0.28, 0.28, 0.28], [0.05, 0.05, 9.0, 9.0]])
    pull = float(ep.muscle.muscle_model("best", 0.2).force(0.02, 4e5))
    own = design_limits(mechanism, lengths)
    np.testing.assert_allclose(own.upper[0], [pull, min(50.0, pull), 70.0, NAN], rtol=1e-9)
    np.testing.assert_array_equal(np.isnan(own.upper[1]), [True, True, False, True])
    np.testing.assert_array_equal(own.lower[0][:2], [0.0, 0.0])
    assert np.isnan(own.lower[0][2:]).all()
    low, high = length_limits(mechanism)
    np.testing.assert_allclose(low[:2], 0.25)
    np.testing.assert_allclose(high[:2], 0.30)
    assert np.isnan([low[3], high[3]]).all()
    least, greatest = stroke_limits(mechanism)
    at = np.linspace(0.25, 0.30, 400)
    best = max(float(design_limits(mechanism, np.full((1, 4), length)).upper[0, 0]) for length in at)
    assert greatest[0] == pytest.approx(best, rel=0.05)
    assert greatest[1] <= 50.0
    assert greatest[2] == 70.0
    np.testing.assert_array_equal(least, [0.0, 0.0, -INF, -INF])
    found = LimbLimits.of_design(mechanism, lengths)
    np.testing.assert_allclose(found.length_error[:, 0], [0.0, -0.2], atol=1e-12)
    assert np.isnan(found.length_error[:, 3]).all()
    np.testing.assert_array_equal(found.open_above[0], [False, False, False, True])
    np.testing.assert_array_equal(found.open_below[0], [False, False, True, True])


def test_scale_of_the_forces_of_a_pose():
    rng = np.random.default_rng(2)
    pose = random_pose(rng, "pull", n=4)
    least = np.linalg.lstsq(pose.moment_effect, pose.state.moment / pose.radius, rcond=None)[0]
    sizes = [np.abs(least).max(), np.abs(pose.state.shoulder).max()]
    assert force_scale(pose) == pytest.approx(max(sizes))
    for size in (1e4, 1.0):
        own = pose._replace(state=pose.state._replace(shoulder=np.array([0.0, -size, 0.5 * size])))
        assert force_scale(own) == pytest.approx(max(size, sizes[0]))
    count = len(pose.low)
    few = pose._replace(upu=pose.upu[:0], g_low=np.zeros(0), g_high=np.zeros(0))
    low, high = np.full(4, -INF), np.full(4, INF)
    # Limits count by the end nearest to zero.
    for own_low, own_high, size in (
        ([1e5, 0, 0, 0], high, 1e5),
        (low, [-2e5, 9, 9, 9], 2e5),
        ([-1e6] * 4, [1e6] * 4, 0),
    ):
        found = force_scale(few._replace(f_low=np.array(own_low, float), f_high=np.array(own_high, float)))
        assert found == pytest.approx(max(size, *sizes))
    assert count >= 4
    nothing = few._replace(
        state=few.state._replace(shoulder=np.zeros(3), moment=np.zeros(3)), f_low=np.zeros(4), f_high=high
    )
    assert force_scale(nothing) == 1.0
    alone = nothing._replace(alone=True, state=nothing.state._replace(moment=np.zeros(3), shoulder=np.ones(3)))
    both = np.vstack([alone.moment_effect, -alone.shoulder_effect])
    needed = np.linalg.lstsq(both, np.append(np.zeros(3), np.ones(3)), rcond=None)[0]
    assert force_scale(alone) == pytest.approx(max(1.0, np.abs(needed).max()))


def test_a_soft_cone_costs_its_distance():
    """No random step along what balances is cheaper in |F_s|² and penalty times squared distance from the cone."""
    rng, tried = np.random.default_rng(8), 0
    while tried < 3:
        pose = random_pose(rng, "soft_cone", n=5, faces=5, reachable=True)._replace(tension=0.0)
        best = choose(pose)

        def cost(z, pose=pose):
            n = len(pose.f_low)
            g = np.zeros(n)
            g[pose.upu] = z[n:]
            force = shoulder_force(pose, z[:n], g)
            return float(((pose.goal @ force) ** 2).sum() + pose.socket.penalty * distance_to_cone(pose, force))

        z = np.append(best.f, best.g[pose.upu])
        here, scale = cost(z), force_scale(pose)
        free = np.linalg.svd(pose.moment_effect)[2][3:].T
        for size in (1e-3, 0.1):
            other = z + free @ rng.normal(size=free.shape[1]) * scale * size
            if (other >= pose.low).all() and (other <= pose.high).all():
                tried += 1
                assert cost(other) >= here - 1e-6 * (1.0 + pose.socket.penalty) * scale**2 * size


def test_angles_of_a_scapula_and_splits_by_name():
    ep.glenoid_orientation(0.0, 0.0, 0.0, retroversion=np.pi / 2.0, inclination=-np.pi / 2.0)
    with pytest.raises(ep.InvalidInput, match="retroversion within ±90 degrees, got 91"):
        ep.glenoid_orientation(0, 0, 0, retroversion=91, inclination=0, degrees=True)
    for angles, axis in (((90, 0, 0), [1, 0, 0]), ((0, 90, 0), [0, 0, 1])):
        turn = ep.glenoid_orientation(*angles, retroversion=0, inclination=0, degrees=True)
        np.testing.assert_allclose(turn.apply([0.0, 1.0, 0.0]), axis, atol=1e-12)
    with pytest.raises(ep.InvalidInput, match="got the class"):
        as_split(type(as_split("minimal")))
    own = type("Own", (type(as_split("minimal")),), {"name": "minimal"})
    with pytest.raises(ep.InvalidInput, match="another one than Own"):
        as_split(own())
    with pytest.raises(ep.InvalidInput, match="to be words"):
        as_split(type("Own", (type(as_split("minimal")),), {"name": ""})())
    moves = type("Own", (type(as_split("minimal")),), {"name": "moves", "moves": True})
    with pytest.raises(ep.InvalidInput, match="child of Elastic"):
        as_split(moves())
    elastic = type("Own", (type(as_split("elastic")),), {"name": "own"})()
    elastic.name = "own"
    assert as_split(elastic) is elastic
