"""Tensions that are chosen, their optimality and scale, and limits that are refused."""

import numpy as np
import pytest
from programs import random_pose

import exo_pin as ep
from exo_pin.reaction.answer import QUERY_STATUS
from exo_pin.reaction.constraints.actuator_limits import stroke_limits
from exo_pin.reaction.constraints.limb_limits import as_limb_limits
from exo_pin.reaction.holding.infeasible_poses import is_held, shortfall
from exo_pin.reaction.splits.limb_and_side_forces import choose, force_scale

NAN, INF = np.nan, np.inf
CODE = {name: QUERY_STATUS.index(name) for name in QUERY_STATUS}


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e5])
def test_the_scale_of_forces_scales_with_them(size):
    rng = np.random.default_rng(8)
    for kind in ("pull", "range", "hard_cone", "alone", "weights"):
        pose = random_pose(rng, kind, n=5, faces=6, reachable=True)
        state = pose.state._replace(moment=size * pose.state.moment, shoulder=size * pose.state.shoulder)
        socket = None if pose.socket is None else pose.socket._replace(h=size * pose.socket.h)
        ends = {name: size * getattr(pose, name) for name in ("f_low", "f_high", "g_low", "g_high")}
        other = pose._replace(state=state, socket=socket, **ends)
        assert force_scale(other) == pytest.approx(size * force_scale(pose), rel=1e-9)
        if not is_held(pose) or not is_held(other):
            continue
        one, two = choose(pose), choose(other)
        np.testing.assert_allclose(two.f, size * one.f, atol=1e-6 * size * force_scale(pose))
        assert two.gap <= 1e-6 * force_scale(other)


def test_side_forces_of_a_lost_pose_stay_below_its_tensions():
    rng, found = np.random.default_rng(11), 0
    while found < 4:
        pose = random_pose(rng, "by_tension", n=4, reachable=False)
        missing = shortfall(pose._replace(f_high=np.full(4, 0.3 * force_scale(pose))))
        if missing is None:
            continue
        found += 1
        assert (np.abs(missing.g) <= np.abs(missing.f) + 1e-9 * force_scale(pose)).all()


def test_the_optimality_of_tensions_is_in_newtons():
    exo = ep.load("four-cables")
    answer = exo.reaction(exo.pose(60.0), limits=(20.0, 400.0))
    assert answer.source.chosen.unjudged.all()
    split, poses, f = answer.source.split, answer.source.poses, answer.actuator_forces
    best = split.judged(poses, 0, f, np.zeros(4))
    assert best.kkt < 1e-8
    assert abs(best.gap) < 1e-6
    # A step along the tensions that balance themselves costs; the gap bounds by how much, N.
    stress = poses.tensions.self_stress[0, :, 0]
    way = stress if ((f + stress) >= 20.0 - 1e-9).all() else -stress
    for step in (1.0, 5.0):
        other = f + step * way
        assert (other >= 20.0 - 1e-9).all()
        worse = split.judged(poses, 0, other, np.zeros(4))
        excess = np.linalg.norm(other) - np.linalg.norm(f)
        assert excess > 0.0
        assert worse.gap >= excess - 1e-9
        assert worse.gap <= np.linalg.norm(other)


class Given:
    """An actuator whose limits are written down, one row a pose."""

    def __init__(self, lower, upper):
        self.ends = np.array(lower, dtype=float), np.array(upper, dtype=float)

    def force_limits(self, length):
        return self.ends


@pytest.mark.parametrize(
    ("lower", "upper", "message"),
    [
        ([0.0, INF], [1.0, INF], "no force can meet"),
        ([0.0, -INF], [1.0, -INF], "no force can meet"),
        ([0.0, 2.0], [1.0, 1.0], "above its upper"),
        ([0.0, -1e30], [1.0, 1.0], "more than"),
        ([0.0, 0.0], [1.0, 1e30], "more than"),
    ],
)
def test_limits_of_one_pose_that_cannot_be_meant_are_refused(lower, upper, message):
    mechanism = ep.load("four-cables").mechanism
    lengths = np.ones((2, 4))
    with pytest.raises(ep.InvalidInput, match=message):
        as_limb_limits([Given([0.0, 0.0], [1.0, 1.0])] * 3 + [Given(lower, upper)], mechanism, (2,), lambda: lengths)
    found = as_limb_limits([Given([0.0, NAN], [1.0, 2.0])] * 4, mechanism, (2,), lambda: lengths)
    np.testing.assert_array_equal(found.lower, [[0.0] * 4, [-INF] * 4])
    np.testing.assert_array_equal(found.upper, [[1.0] * 4, [INF] * 4])
    np.testing.assert_array_equal(found.length_error, [[0.0] * 4, [INF] * 4])
    assert found.reachable.tolist() == [True, False]


def test_limits_of_strokes_of_actuators_of_which_little_is_known():
    exo = ep.load("four-cables")
    kinds = (ep.Actuator("linear", 50.0, 20.0), ep.Actuator("linear"), ep.Actuator("cable", 30.0), ep.Actuator("cable"))
    low, high = stroke_limits(exo.replace(limbs=[ep.Limb("SPS", actuator=kind) for kind in kinds]).mechanism)
    np.testing.assert_array_equal(low, [-20.0, -INF, 0.0, 0.0])
    np.testing.assert_array_equal(high[[0, 2]], [50.0, 30.0])
    assert (high[[1, 3]] > 1e3).all()
