"""Efforts and friction at rest that share a joint's force, against all pairs on a grid."""

import itertools

import numpy as np
import pytest

from exo_pin.chain.dynamics.nonsmooth.joint_friction import RestingFriction, Rubbing, bearing_drive, resting_friction
from exo_pin.chain.structure.chain_state import ActuatedCoordinates

#: Efforts and friction, N m; all other numbers here lie on it.
GRID = np.arange(-12, 13) * 0.5
INF = np.inf


def shared(total, friction, effort, actuated=True, alone=False):
    """One coordinate with ranges of friction and effort."""
    one = [np.array([x]) for x in (*friction, *effort, total)]
    return RestingFriction(np.array([actuated]), np.array([alone]), *one, np.array([True]))


def pairs(low, high, friction, effort):
    """All (effort, friction) whose sum is a total of the range."""
    return np.array([
        (e, f) for e, f in itertools.product(GRID, GRID)
        if friction[0] <= f <= friction[1] and effort[0] <= e <= effort[1] and low <= e + f <= high
    ])  # fmt: skip


@pytest.mark.parametrize("total", [-3.0, -1.0, 0.0, 0.5, 2.0])
@pytest.mark.parametrize("friction", [(-1.0, 1.0), (-2.0, 0.5), (0.0, 1.5)])
@pytest.mark.parametrize("effort", [(-INF, INF), (-2.0, 1.0), (0.0, 3.0)])
def test_shares_are_those_of_all_pairs(total, friction, effort):
    possible = pairs(total, total, friction, effort)
    if not len(possible):
        return
    rest = shared(total, friction, effort)
    tau, rubbed = rest.split()
    # The least friction, and what is left for the actuator.
    least = possible[np.abs(possible[:, 1]).argmin()]
    assert (tau[0], rubbed[0]) == tuple(least)
    for low, high in ((total, total), (total - 1.0, total + 0.5)):
        some = pairs(low, high, friction, effort)
        totals = np.array([[low, high]])
        np.testing.assert_array_equal(rest.efforts(slice(0, 1), totals)[0], [some[:, 0].min(), some[:, 0].max()])
        found = rest.frictions(slice(0, 1), np.array([7.0]), totals)[0]
        np.testing.assert_array_equal(found, [some[:, 1].min(), some[:, 1].max()])


def test_friction_alone_bears_all_and_other_joints_keep_what_is_known():
    alone = shared(2.0, (-3.0, 3.0), (-INF, INF), False, True)
    assert [part[0] for part in alone.split()] == [0.0, 2.0]
    totals = np.array([[1.0, 2.5]])
    np.testing.assert_array_equal(alone.efforts(slice(0, 1), totals), [[0.0, 0.0]])
    np.testing.assert_array_equal(alone.frictions(slice(0, 1), np.array([7.0]), totals), totals)
    moving = shared(2.0, (-3.0, 3.0), (-INF, INF), False, False)
    assert [part[0] for part in moving.split()] == [2.0, 0.0]
    np.testing.assert_array_equal(moving.efforts(slice(0, 1), totals), totals)
    np.testing.assert_array_equal(moving.frictions(slice(0, 1), np.array([7.0]), totals), [[7.0, 7.0]])


def test_two_coordinates_of_a_joint_have_a_row_each():
    ones = np.ones(3)
    rest = RestingFriction(
        np.zeros(3, dtype=bool), np.zeros(3, dtype=bool), -ones, ones, -ones * INF, ones * INF, ones, ones > 0
    )
    friction, totals = np.array([7.0, 8.0, 9.0]), np.array([[1.0, 2.0], [3.0, 4.0]])
    np.testing.assert_array_equal(rest.frictions(slice(1, 3), friction, totals), [[8.0, 8.0], [9.0, 9.0]])


def test_who_bears_what():
    drive = ActuatedCoordinates(np.array([0, 2]), np.array([1, 3, 4]))
    low, high = -np.arange(5.0), np.arange(5.0)
    rubbing = Rubbing(np.zeros(5), np.array([2, 3]), low, high)
    bearing = bearing_drive(drive, rubbing)
    assert bearing.driven.tolist() == [0, 2, 3]
    assert bearing.passive.tolist() == [1, 4]
    found = resting_friction(drive, rubbing, (low - 1, high + 1), np.ones(5), np.ones(5, dtype=bool))
    assert found.actuated.tolist() == [False, False, True, False, False]
    assert found.alone.tolist() == [False, False, False, True, False]
    np.testing.assert_array_equal([found.low, found.high, found.least, found.largest], [low, high, low - 1, high + 1])
