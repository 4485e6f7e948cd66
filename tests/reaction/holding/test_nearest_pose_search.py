"""The search for the nearest pose that can be held, against sets of poses whose nearest one is known."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.reaction.holding.hold_check import HoldCheck
from exo_pin.reaction.holding.remedy import (
    _count,
    _shorter,
    _shortest,
    _spread,
    nearest_held_pose,
    remedy,
    spread_directions,
)


def checks(start, is_held, unknown=False):
    """A check of poses that are held as a function of their turn from the first says."""

    def check(poses):
        turns = (poses * start.inv()).as_rotvec()
        held = np.asarray(is_held(turns))
        none = np.zeros((*held.shape, 3))
        can = np.zeros_like(held) if unknown else held
        return HoldCheck(can, ~held, held & unknown, none, none, none, none, (), ())

    return check


@pytest.mark.parametrize("unknown", [False, True])
@pytest.mark.parametrize("degrees", [1.0, 3.3, 14.0, 40.0, 59.0])
def test_the_way_to_a_half_space_of_turns_is_its_distance(degrees, unknown):
    rng = np.random.default_rng(round(10 * degrees))
    start, axis = Rotation.random(rng=rng), rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    least = np.radians(degrees)
    found = nearest_held_pose(checks(start, lambda turns: turns @ axis >= least, unknown), start)
    turn = (found.pose * start.inv()).as_rotvec()
    assert found.distance == pytest.approx(np.linalg.norm(turn), abs=1e-12)
    assert turn @ axis >= least - 1e-12
    assert least - 1e-12 <= found.distance <= least + np.radians(0.1)
    assert not found.check.violated


def test_what_is_held_itself_and_what_is_out_of_reach():
    start, axis = Rotation.random(rng=np.random.default_rng(5)), np.array([0.6, 0.0, 0.8])
    own = nearest_held_pose(checks(start, lambda turns: turns @ axis <= 1.0), start)
    assert own.distance == 0.0
    assert own.pose is start
    far = checks(start, lambda turns: turns @ axis >= np.radians(60.5))
    assert nearest_held_pose(far, start) is None
    assert nearest_held_pose(far, start, reach=np.radians(70.0)) is not None
    near = checks(start, lambda turns: turns @ axis >= np.radians(9.0))
    assert nearest_held_pose(near, start, reach=np.radians(8.0)) is None

    # A pose of which nothing is known, and that breaks no limit, is not one that can be held.
    def nothing_known(poses):
        shape = np.shape(poses.as_quat())[:-1]
        no, none = np.zeros(shape, dtype=bool), np.zeros((*shape, 3))
        return HoldCheck(no, no, no, none, none, none, none, (), ())

    assert nearest_held_pose(nothing_known, start, reach=np.radians(4.0)) is None


def test_directions_are_spread_evenly_and_shorter_turns_are_shorter():
    for count in (32, 96):
        units = spread_directions(count)
        np.testing.assert_allclose(np.linalg.norm(units, axis=1), 1.0, atol=1e-12)
        np.testing.assert_allclose(units.mean(axis=0), 0.0, atol=0.01)
        # As many as would be in equal patches of the sphere: the second moments of an even spread are a third.
        np.testing.assert_allclose(units.T @ units / count, np.eye(3) / 3.0, atol=0.01)
        apart = np.arccos(np.clip(units @ units.T, -1.0, 1.0)) + 10.0 * np.eye(count)
        assert apart.min() > 0.8 * np.sqrt(4.0 * np.pi / count)
    assert [_count(np.radians(angle)) for angle in (2.0, 30.0, 45.0, 60.0)] == [32, 32, 56, 96]
    turn = np.array([0.2, -0.3, 0.1])
    size, step = np.linalg.norm(turn), 0.03
    tries = _shorter(turn, step)
    lengths = np.linalg.norm(tries, axis=1)
    np.testing.assert_allclose(lengths, size - step * np.array([1.0, *[0.5] * 6, *[0.1] * 6]), atol=1e-12)
    angles = np.arctan(np.array([0.0, *[step / size] * 6, *[2.0 * step / size] * 6]))
    np.testing.assert_allclose(np.arccos(np.clip(tries @ turn / lengths / size, -1.0, 1.0)), angles, atol=1e-7)
    # Six sides, 60° apart about the turn.
    for ring in (tries[1:7], tries[7:]):
        np.testing.assert_allclose(ring.sum(axis=0) / 6.0, ring @ turn @ np.ones(6) / 6.0 / size**2 * turn, atol=1e-12)
        assert len({tuple(row.round(9)) for row in ring}) == 6
    # Near the start no turn is more than halved, and none leans by more than 45°.
    close = _shorter(0.01 * turn / size, step)
    np.testing.assert_allclose(np.linalg.norm(close, axis=1), [0.005] * 7 + [0.007] * 6, atol=1e-12)
    assert np.linalg.norm(close, axis=1).min() == pytest.approx(0.005)
    np.testing.assert_allclose(close[1:] @ turn / np.linalg.norm(close[1:], axis=1) / size, np.sqrt(0.5), atol=1e-12)


def test_turns_that_are_refined_are_short_and_apart():
    up, side = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    near = np.array([0.1, 0.0, 1.0]) / np.sqrt(1.01)
    turns = np.array([0.40 * near, 0.39 * up, 0.41 * side, 0.9 * -side])
    np.testing.assert_array_equal(_spread(turns), turns[[1, 2]])
    # One that is much longer does not make up for its direction, and one alone is all there is.
    np.testing.assert_array_equal(_spread(turns[[0, 1, 3]]), turns[[1, 0]])
    np.testing.assert_array_equal(_spread(turns[:1]), turns[:1])


@pytest.mark.parametrize("axis", [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.6, -0.8, 0.0], [0.1, 0.2, -0.97]])
def test_the_shortest_turn_to_a_half_space_is_along_its_normal(axis):
    axis = np.array(axis) / np.linalg.norm(axis)
    edge = np.radians(20.0)

    def held(turns):
        return turns @ axis >= edge

    side = np.cross(axis, [0.3, 0.5, 0.2])
    starts = np.array([1.1 * edge * axis + 0.3 * side / np.linalg.norm(side), 1.4 * edge * axis - 0.2 * side])
    found = _shortest(held, starts)
    assert held(found)
    assert np.linalg.norm(found) <= edge + np.radians(0.3)
    assert np.linalg.norm(_shortest(held, starts[:1])) <= edge + np.radians(0.5)


def test_motions_are_refused():
    exo = ep.load("prototype")
    moving = ep.Case(exo.pose(60), ep.Motion([0.0, 0.0, 1.0], [0.0, 0.0, 0.0]))
    with pytest.raises(ep.InvalidInput, match="no motion"):
        remedy(exo, moving, ep.Assumptions())
