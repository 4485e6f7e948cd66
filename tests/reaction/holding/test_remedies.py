"""The nearest pose that can be held, against sets of poses whose nearest one is known."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.reaction.holding.hold_check import HoldCheck
from exo_pin.reaction.holding.remedy import _count, _shorter, nearest_held_pose, remedy, spread_directions


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


def test_the_remedy_of_a_device_is_checked_and_says_what_is_missing():
    exo = ep.load("four-cables")
    load = ep.Load([0.0, 0.0, -60.0], at=[0.0, 0.0, -0.3])
    pose = next(
        own for own in (exo.pose(angle, 60) for angle in (60, 80, 100, 120)) if not exo.reaction(own, load=load).held
    )
    found = exo.remedy(pose, load)
    assert found.side == "left"
    if found.nearest is not None:
        assert exo.reaction(found.nearest.pose, load=load).held
        assert found.nearest.distance > 0.0
    assert str(found).endswith(found.infeasibility.explain())
    held = exo.remedy(exo.pose(45))
    assert str(held) == "The pose itself can be held."
    weak = exo.remedy(exo.pose(45), ep.Load([0.0, 0.0, 0.0], [4000.0, 0.0, 0.0]))
    assert weak.nearest is None
    assert str(weak).startswith("No pose within 60° can be held. With the best forces")
    with pytest.raises(ep.InvalidInput, match="no motion"):
        remedy(exo, ep.Case(pose, ep.Motion(np.ones(3), np.zeros(3))), ep.Assumptions())
    with pytest.raises(ep.InvalidInput):
        exo.remedy(exo.pose([10, 20]))


def test_a_pose_that_can_be_held_is_its_own_nearest():
    design = ep.load("four-linear-actuators")
    pose = design.pose(40.0, 30.0)
    found = design.remedy(pose)
    assert found.nearest.distance == 0.0
    assert (found.nearest.pose * pose.inv()).magnitude() == 0.0
    assert found.nearest.check.can_hold
    assert str(found) == "The pose itself can be held."


def test_stacks_and_motions_are_refused():
    exo = ep.load("prototype")
    moving = ep.Case(exo.pose(60), ep.Motion([0.0, 0.0, 1.0], [0.0, 0.0, 0.0]))
    with pytest.raises(InvalidInput, match="no motion"):
        remedy(exo, moving, ep.Assumptions())
    with pytest.raises(InvalidInput, match="single rotation"):
        exo.remedy(exo.pose([0, 10]))
    with pytest.raises(InvalidInput, match="Rotation"):
        exo.remedy("rest")
