"""Bounds on side forces in the forms a caller may give them, one pose and one limb at a time."""

import numpy as np
import pytest

from exo_pin import InfeasibleBounds, InvalidInput, NonConvexBound, UnknownName
from exo_pin.reaction.constraints.side_force_bounds import UNBOUNDED, SideForceBounds, two_ends

INF = np.inf
F = np.array([3.0, -5.0, 0.0])


def ends(bounds, row=0, shape=(4,), f=F, **how):
    return np.array(SideForceBounds(bounds, shape, len(f), **how).at(row, f))


def test_without_bounds_every_side_force_is_allowed():
    np.testing.assert_array_equal(ends(None), [[-INF] * 3, [INF] * 3])
    np.testing.assert_array_equal(UNBOUNDED.at(0, F), [[-INF] * 3, [INF] * 3])
    free = SideForceBounds((-INF, INF), (4,), 3)
    assert free.is_free
    assert SideForceBounds(None, (4,), 3).is_free
    np.testing.assert_array_equal(SideForceBounds(None, (4,), 3).block(1, 3), [[[-INF] * 3], [[INF] * 3]])
    for half in ((-INF, 2.0), (-2.0, INF), (0.0, 0.0), 2.0):
        assert not SideForceBounds(half, (4,), 3).is_free


def test_a_number_bounds_either_side_and_a_pair_each_of_them():
    np.testing.assert_array_equal(ends(7.0), [[-7.0] * 3, [7.0] * 3])
    np.testing.assert_array_equal(ends((-1.0, [2.0, INF, 4.0])), [[-1.0] * 3, [2.0, INF, 4.0]])
    # A row a pose: of each its own, and of some of them in their order.
    lower, upper = -np.arange(12.0).reshape(4, 3), 10.0 + np.arange(12.0).reshape(4, 3)
    for row in range(4):
        np.testing.assert_array_equal(ends((lower, upper), row), [lower[row], upper[row]])
    bounds = SideForceBounds((lower, upper), (4,), 3)
    np.testing.assert_array_equal(bounds.block(1, 3), [lower[1:3], upper[1:3]])
    some = bounds.of_rows(np.array([3, 0]))
    np.testing.assert_array_equal(some.block(0, 2), [lower[[3, 0]], upper[[3, 0]]])
    np.testing.assert_array_equal(bounds.block(0, 4), [lower, upper])
    same = SideForceBounds(None, (4,), 3).of_rows(np.array([1]))
    np.testing.assert_array_equal(same.at(0, F), [[-INF] * 3, [INF] * 3])


def test_the_actuators_bounds_are_their_own_forces_or_go_with_chosen_tensions():
    """Equilibrium determines three tensions, unless side forces of a displaced device change them."""
    np.testing.assert_array_equal(ends("actuator"), [-np.abs(F), np.abs(F)])
    four = np.array([1.0, -2.0, 3.0, 4.0])
    for limbs, signed, displaced, by_tension in (
        (3, False, False, False),
        (3, True, False, False),
        (3, False, True, False),
        (3, True, True, True),
        (4, True, False, True),
        (4, True, True, True),
    ):
        bounds = SideForceBounds("actuator", (), limbs, signed, displaced)
        assert (bounds.by_tension, bounds.by_actuator) == (by_tension, not by_tension)
        assert not bounds.is_free
        expected = INF if by_tension else np.abs(four[:limbs])
        np.testing.assert_array_equal(bounds.at(0, four[:limbs])[1], np.broadcast_to(expected, limbs))
    for displaced in (False, True):
        with pytest.raises(NonConvexBound, match="4 limbs"):
            SideForceBounds("actuator", (), 4, False, displaced)
    plain = SideForceBounds((-1.0, 1.0), (), 3)
    assert (plain.by_actuator, plain.by_tension) == (False, False)


@pytest.mark.parametrize(
    ("bounds", "error", "said"),
    [
        ("actuators", UnknownName, "actuator"),
        ((1.0, -1.0), InfeasibleBounds, None),
        ((np.nan, 1.0), InvalidInput, "without NaN"),
        ((-1.0, np.nan), InvalidInput, "without NaN"),
        ((INF, INF), InvalidInput, "below"),
        ((-INF, -INF), InvalidInput, "below"),
        ((-1e300, 1.0), InvalidInput, "at most"),
        ((-1.0, 1e300), InvalidInput, "at most"),
        ((-1.0, 1.0, 2.0), InvalidInput, "lower, upper"),
        ({-1.0, 1.0}, InvalidInput, "lower, upper"),
        ({"low": -1.0, "high": 1.0}, InvalidInput, "lower, upper"),
        ((np.zeros(2), 1.0), InvalidInput, "broadcast"),
    ],
)
def test_bounds_that_cannot_be_meant(bounds, error, said):
    with pytest.raises(error, match=said):
        SideForceBounds(bounds, (4,), 3)


def test_crossed_bounds_name_their_limbs():
    with pytest.raises(InfeasibleBounds) as caught:
        SideForceBounds(([0.0, 3.0, 3.0], [[1.0, 1.0, 4.0], [1.0, 5.0, 2.0], [1.0, 5.0, 5.0]]), (3,), 3)
    assert np.array(caught.value.limbs).tolist() == [1, 2]
    # What is equal is not crossed.
    SideForceBounds((2.0, 2.0), (3,), 3)
    assert two_ends([1, 2], "a pair") == (1, 2)
