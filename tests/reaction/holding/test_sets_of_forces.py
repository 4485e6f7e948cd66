"""Sets of forces within limits, and what disturbs a held pose: by membership, faces of moments and linear programs."""

from types import SimpleNamespace

import numpy as np
import pytest
import scipy
from programs import random_pose, room_left

import exo_pin as ep
from exo_pin.reaction import elastic_poses
from exo_pin.reaction.answer import QUERY_STATUS
from exo_pin.reaction.elastic_poses import ElasticPoses, _fixed_point
from exo_pin.reaction.holding.force_range import _force_sets, _of_pose, force_range
from exo_pin.reaction.holding.infeasible_poses import clearly_infeasible, disturbing_moment, infeasibility, is_held
from exo_pin.reaction.indeterminacy import component_assumptions
from exo_pin.reaction.indeterminacy.component_assumptions import ComponentSource, _end
from exo_pin.reaction.splits.limb_and_side_forces import choose, force_scale


def inside(pose, z):
    """Whether forces are within the limits, the socket and |g| <= |f|, written anew."""
    n = len(pose.f_low)
    held = (z >= pose.low).all() and (z <= pose.high).all()
    if pose.by_actuator:
        held = held and (np.abs(z[n:]) <= np.abs(z[:n][pose.upu])).all()
    if pose.socket is not None and pose.socket.penalty is None:
        held = held and (pose.socket.N @ (pose.state.shoulder + pose.shoulder_effect @ z) <= pose.socket.h).all()
    return bool(held)


@pytest.mark.parametrize("kind", ["range", "sides", "hard_cone", "soft_cone", "by_tension"])
def test_sets_of_forces_are_what_balances_within_the_limits(kind):
    rng, both = np.random.default_rng(len(kind)), set()
    for _ in range(12):
        pose = random_pose(rng, kind, n=5, faces=6, reachable=True)
        if not is_held(pose):
            continue
        sets, best = _force_sets(pose), choose(pose)
        assert sets.scale == force_scale(pose)
        np.testing.assert_allclose(np.linalg.norm(sets.rows, axis=1), 1.0)
        free = scipy.linalg.null_space(pose.moment_effect)
        near = np.append(best.f, best.g[pose.upu])
        for step in (0.0, 1e-3, 0.1, 1.0):
            z = near + free @ rng.normal(size=free.shape[1]) * step * sets.scale
            force = pose.state.shoulder + pose.shoulder_effect @ z
            # The y of these forces: the same F_s, and the same side of every limit that is not met by rounding.
            y = np.linalg.lstsq(sets.effect, force / sets.scale - sets.force, rcond=None)[0]
            if sets.effect.shape[1] <= 3:
                np.testing.assert_allclose(sets.force + sets.effect @ y, force / sets.scale, atol=1e-8)
            start = np.linalg.lstsq(pose.moment_effect, pose.state.moment / (pose.radius * sets.scale), rcond=None)[0]
            basis = np.linalg.svd(pose.moment_effect)[2][3:].T
            y = basis.T @ (z / sets.scale - start)
            np.testing.assert_allclose(sets.force + sets.effect @ y, force / sets.scale, atol=1e-8)
            gap = float((sets.rows @ y - sets.ends).max())
            if abs(gap) > 1e-6:
                assert inside(pose, z) == (gap < 0.0)
                both.add(gap < 0.0)
    assert both == {True, False}


def test_the_range_of_a_shoulder_that_carries_nothing_is_zero():
    assert _of_pose(random_pose(np.random.default_rng(1), "alone", n=6), 7.0) == (0.0, 0.0, 0.0)


def test_ranges_of_a_stack_are_of_its_held_rows():
    """A law that determines the forces has one size of F_s; rows without an answer, or not held, have none."""
    values, unmet = np.ones((2, 3, 9)), np.zeros(6, dtype=int)
    values[0, 1, 4], unmet[3] = np.nan, 7
    chosen = SimpleNamespace(unmet=unmet)
    law = SimpleNamespace(chooses_tensions=False)
    own = ComponentSource(law, None, (2, 3), values.reshape(6, 9), chosen)
    sizes = np.arange(6.0).reshape(2, 3)
    found = force_range(own, sizes)
    expected = np.array([[0.0, np.nan, 2.0], [np.nan, 4.0, 5.0]])
    for part in (found.least, found.greatest, found.found):
        np.testing.assert_array_equal(part, expected)
    assert infeasibility(own) is None
    pose = random_pose(np.random.default_rng(5), "range", n=4, reachable=True)
    asked = []
    law = SimpleNamespace(chooses_tensions=True, program=lambda poses, row: asked.append(row) or pose)
    whole = float(np.linalg.norm(pose.state.shoulder + pose.state.shoulder_of_f @ choose(pose).f))
    found = force_range(ComponentSource(law, None, (2, 3), values.reshape(6, 9), chosen), np.full((2, 3), whole))
    assert asked == [0, 2, 4, 5]
    assert np.isnan(found.least).tolist() == np.isnan(expected).tolist()
    assert found.least[0, 0] <= whole <= found.greatest[0, 0]


@pytest.mark.parametrize("n", [4, 6])
def test_what_disturbs_is_the_distance_to_the_nearest_face(n):
    rng, count = np.random.default_rng(n), 8
    arms, low, high = 0.2 * rng.normal(size=(count, 3, n)), np.zeros((count, n)), rng.uniform(20.0, 50.0, (count, n))
    moment = (arms @ rng.uniform(0.0, 30.0, (count, n, 1)))[..., 0] * rng.choice([1.0, 3.0], count)[:, None]
    edge = count - 1
    # One pose just on a face: the limits of two limbs do not matter, the others are at theirs.
    normal = np.cross(arms[edge, :, 0], arms[edge, :, 1])
    moment[edge] = arms[edge] @ np.where(normal @ arms[edge] > 0.0, high[edge], low[edge])
    state = SimpleNamespace(moment_of_f=arms, moment=moment, shoulder=10.0 * rng.normal(size=(count, 3)))
    tensions = SimpleNamespace(f=np.linalg.pinv(arms) @ moment[..., None])
    tensions.f = tensions.f[..., 0]
    poses = SimpleNamespace(
        state=state, limits=SimpleNamespace(lower=low, upper=high), status=np.zeros(count, dtype=np.int8),
        tensions=tensions, mechanism=SimpleNamespace(radius=0.2),
    )  # fmt: skip
    expected = np.array([room_left(*one) for one in zip(arms, moment, low, high, strict=True)])
    assert (expected < -1.0).any()
    assert (expected > 0.1).any()
    margin = disturbing_moment(poses)
    assert margin.shape == (count,)
    np.testing.assert_allclose(margin, expected, atol=1e-9)
    rows = np.array([edge, 2, 0, 5, 3])
    assert clearly_infeasible(poses, rows).tolist() == (expected[rows] < -1e-6).tolist()
    # A pose that misses a face by rounding is not clearly lost, one that misses by ten times the tolerance is.
    scale = max(np.abs(state.shoulder[edge]).max(), np.abs(tensions.f[edge]).max(), 0.0)
    outward = normal / np.linalg.norm(normal)
    for miss, lost in ((0.3, False), (3.0, True)):
        state.moment[edge] = arms[edge] @ np.where(normal @ arms[edge] > 0.0, high[edge], low[edge])
        state.moment[edge] += miss * 1e-9 * 0.2 * scale * outward
        assert clearly_infeasible(poses, np.array([edge])).tolist() == [lost]


def test_limits_that_are_away_from_zero_are_a_scale_of_what_rounding_decides():
    """Tensions of at least 1e6 N: a moment that is missed by 1e-4 N m is rounding beside them."""
    arms, low = np.eye(3)[None] * 0.5, np.full((1, 3), 1e6)
    for push in (False, True):
        ends = (low, 2.0 * low) if not push else (-2.0 * low, -low)
        near = ends[0] if not push else ends[1]
        state = SimpleNamespace(moment_of_f=arms, shoulder=np.zeros((1, 3)), moment=0.5 * near)
        poses = SimpleNamespace(
            state=state, limits=SimpleNamespace(lower=ends[0], upper=ends[1]), status=np.zeros(1, dtype=np.int8),
            tensions=SimpleNamespace(f=np.zeros((1, 3))), mechanism=SimpleNamespace(radius=0.5),
        )  # fmt: skip
        for miss, lost in ((1e-4, False), (1e-2, True)):
            state.moment = 0.5 * near - np.sign(near) * miss
            assert clearly_infeasible(poses, np.array([0])).tolist() == [lost]


@pytest.mark.parametrize("size", [1.0, 1e8, 1e12])
def test_ends_of_intervals_of_any_size(size):
    """The ends of x + y over a triangle, of forces up to 1e12 N, of empty sets and of open ones."""
    rows = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 2.0]])
    low, high, both = np.zeros(3), np.array([np.inf, np.inf, size]), np.ones(2)
    low[2] = -np.inf
    assert _end(both, rows, low, high, 1.0) == pytest.approx(0.0, abs=1e-7 * size)
    assert _end(both, rows, low, high, -1.0) == pytest.approx(size, rel=1e-7)
    assert _end(-both, rows, low, high, 1.0) == pytest.approx(-size, rel=1e-7)
    open_ = high.copy()
    open_[2] = np.inf
    low[2] = size
    assert _end(both, rows, low, open_, -1.0) == np.inf
    assert _end(-both, rows, low, open_, 1.0) == -np.inf
    assert _end(both, rows, low, open_, 1.0) == pytest.approx(0.5 * size, rel=1e-7)
    # x + 2 y at least size and at most half of it: nothing fits.
    open_[2] = 0.5 * size
    for sign in (1.0, -1.0):
        assert np.isnan(_end(both, rows, low, open_, sign))


def test_bounds_that_a_solver_does_not_take_are_scaled(monkeypatch):
    """The solver gives up on ends above 1000 N; 2 x - 3 y over a triangle of 8000 N has the same ends all the same."""
    solver = scipy.optimize.linprog

    def weak(target, **given):
        answer = solver(target, **given)
        if given["b_ub"].max() > 1e3:
            answer.status = 4
        return answer

    monkeypatch.setattr(component_assumptions.scipy.optimize, "linprog", weak)
    rows, low, high = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]), np.array([0.0, 0.0, -np.inf]), np.full(3, 8000.0)
    assert _end(np.array([2.0, -3.0]), rows, low, high, 1.0) == pytest.approx(-24000.0)
    assert _end(np.array([2.0, -3.0]), rows, low, high, -1.0) == pytest.approx(16000.0)


def test_a_zero_with_a_kink_is_found_from_where_small_steps_lead():
    """The way leads on by steps with a jump in them; where there is no zero, none is given."""
    scale = np.array([1e-3, 1.0])

    def apart(y):
        x = y * scale
        led = np.array([1e-3 if x[1] > -0.5 else 2e-3, 0.25 * np.tanh(4.0 * x[1])])
        return (led - x) / scale

    for start in (np.array([0.0, 0.3]), np.array([5.0, -3.0]), np.array([0.0, 0.0])):
        found = _fixed_point(apart, start, scale)
        assert np.abs(apart(found) * scale).max() <= 1e-9

    def lost(y):
        return np.where(y < 0.5, 1.0, -1.0) + 0.0 * y

    with pytest.raises(ep.SolverFailed, match="elastic device within its limits"):
        _fixed_point(lost, np.array([0.0, 0.0]), scale)


def test_small_steps_go_a_share_of_the_way(monkeypatch):
    """Each search begins where twenty halves of the way lead, and the first one from the start itself."""
    begun = []

    def root(apart, near, **_):
        begun.append(np.array(near))
        zero = np.array([2.0, 2.0]) if len(begun) == 4 else np.array([50.0, 50.0])
        return SimpleNamespace(x=zero)

    monkeypatch.setattr(elastic_poses.scipy.optimize, "root", root)
    found = _fixed_point(lambda y: 0.1 * (2.0 - y), np.array([0.0, 3.0]), np.ones(2))
    np.testing.assert_array_equal(found, [2.0, 2.0])
    away = np.array([-2.0, 1.0])
    for start, share, steps in zip(begun, (0.0, 0.5, 0.25, 0.1), (0, 20, 40, 100), strict=True):
        np.testing.assert_allclose(start, 2.0 + away * (1.0 - 0.1 * share) ** steps, rtol=1e-12)


def test_a_guide_is_loaded_by_the_larger_of_bending_and_torque():
    def guide(moment, torque):
        return SimpleNamespace(guide=SimpleNamespace(largest_bending_moment=moment, largest_torque=torque))

    limbs = (guide(2.0, 4.0), guide(None, 4.0), guide(2.0, None), guide(None, None), SimpleNamespace(guide=None))
    side = SimpleNamespace(
        stiffness=np.full((2, 5), 10.0), deflection=np.array([[0.5] * 5, [-0.1] * 5]), bending=np.full((2, 5), 0.2),
        torque=np.array([[-0.6] * 5, [0.6] * 5]),
    )  # fmt: skip
    own = SimpleNamespace(
        device=SimpleNamespace(displaced=SimpleNamespace(side=side)),
        mechanism=SimpleNamespace(limbs=limbs, limb_count=5),
        status=np.array([0, 1], dtype=np.int8),
    )
    # |g| = 5 and 1 N: bending 1 and 0.2 N m of 2, torque 3 and 0.6 N m of 4.
    expected = np.array([[0.75, 0.75, 0.5, np.nan, np.nan], [0.15, 0.15, 0.1, np.nan, np.nan]])
    np.testing.assert_allclose(ElasticPoses.guide_load.fget(own), expected)
    side.bending[:] = 0.5
    np.testing.assert_allclose(ElasticPoses.guide_load.fget(own)[0], [1.25, 0.75, 1.25, np.nan, np.nan])
    own.guide_load = ElasticPoses.guide_load.fget(own)
    ElasticPoses._mark_overloaded(own)
    assert [QUERY_STATUS[code] for code in own.status] == ["guide_overloaded", "near_singular"]
    # One without an equilibrium stays so.
    own.status[:] = QUERY_STATUS.index("no_equilibrium")
    ElasticPoses._mark_overloaded(own)
    assert (own.status == QUERY_STATUS.index("no_equilibrium")).all()


def test_which_poses_of_a_soft_device_need_a_choice():
    met = np.array([True, False, True, False, False])
    limits = SimpleNamespace(reachable=np.array([True, True, True, False, True]), met=lambda f, rows: met[rows])

    class Stack(SimpleNamespace):
        def _replace(self, **_):
            return self

    def rows(limb_count=4, locked=False, socket=None):
        displaced = SimpleNamespace(state=None, tensions=None, side=SimpleNamespace(stiffness=None))
        own = SimpleNamespace(
            status=np.array([0, 1, 0, 0, QUERY_STATUS.index("singular")], dtype=np.int8),
            split=SimpleNamespace(locked=locked, plain=lambda poses, rows: (None, None)),
            mechanism=SimpleNamespace(limb_count=limb_count),
            device=SimpleNamespace(displaced=displaced, misfit=None),
        )
        return ElasticPoses._to_limit(own, Stack(socket=socket, limits=limits)).tolist()

    # Of four limbs those whose tensions are beyond a limit, within their stroke and in equilibrium.
    assert rows() == [1]
    assert rows(3) == []
    assert rows(locked=True) == rows(locked=True, socket="cone") == []
    # A socket is looked at in all of them, with three limbs, too.
    assert rows(socket="cone") == rows(3, socket="cone") == [0, 1, 2]


@pytest.mark.parametrize("miss", [5e-10, 5e-6])
def test_a_geometry_that_its_forces_lead_to_is_not_searched_for(miss, monkeypatch):
    """Metres and radians count, whatever the scale of the unknowns."""
    searched = []

    def found(apart, start, scale):
        searched.append(start * scale)
        return (start * scale + miss) / scale

    monkeypatch.setattr(elastic_poses, "_fixed_point", found)
    monkeypatch.setattr(elastic_poses, "is_held", lambda program: program == "held")
    x = np.array([[0.0, 0.0], [0.01, -0.02]])
    for program, held in (("held", True), ("lost", False)):
        own = SimpleNamespace(
            x=x.copy(), equations=SimpleNamespace(scale=np.array([1e-3, 10.0])),
            _led_to=lambda poses, row, y: y + miss, _program=lambda poses, row, y, program=program: (program, None),
        )  # fmt: skip
        assert ElasticPoses._limit(own, None, 1) == held
        moves = held and miss > 1e-9
        np.testing.assert_allclose(own.x[1], x[1] + (miss if moves else 0.0), rtol=1e-12)
        np.testing.assert_array_equal(own.x[0], x[0])
    assert len(searched) == (2 if miss > 1e-9 else 0)
    for start in searched:
        np.testing.assert_allclose(start, x[1])
