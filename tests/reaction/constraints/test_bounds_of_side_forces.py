"""Bounds on side forces in the forms a caller may give them."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InfeasibleBounds, InvalidInput, NonConvexBound, UnknownName

INF = np.inf


@pytest.fixture(scope="module")
def exo():
    return ep.load("prototype").worn_by(ep.Person(1.75, 75, "male")).replace(limbs=None)


def asked(exo, bounds, **question):
    return exo.reaction(exo.pose([60.0, 20.0, 40.0], 30.0), split="minimal", constraint_bounds=bounds, **question)


def test_bounds_are_the_intervals_of_side_forces(exo):
    lower, upper = -np.arange(9.0).reshape(3, 3), 10.0 + np.arange(9.0).reshape(3, 3)
    f = np.abs(exo.reaction(exo.pose([60.0, 20.0, 40.0], 30.0)).actuator_forces)
    full = np.full((3, 3), INF)
    for bounds, low, high in (
        (None, -full, full),
        ((-INF, INF), -full, full),
        (7.0, np.full((3, 3), -7.0), np.full((3, 3), 7.0)),
        ((-1.0, [2.0, INF, 4.0]), np.full((3, 3), -1.0), np.tile([2.0, INF, 4.0], (3, 1))),
        ([-1.0, 2.0], np.full((3, 3), -1.0), np.full((3, 3), 2.0)),
        # A row a pose: of each its own.
        ((lower, upper), lower, upper),
        # Equilibrium determines three tensions, which bound their own side forces.
        ("actuator", -f, f),
    ):
        answer = asked(exo, bounds, limits="none")
        g = answer.constraint_forces
        assert ((g >= low * (1.0 + 1e-12)) & (g <= high * (1.0 + 1e-12))).all()
        # Bounds that bound nothing leave a least force that is zero by construction.
        assert answer.trivial == bool(np.isinf(low).all() and np.isinf(high).all())


@pytest.mark.parametrize("half", [(-INF, 2.0), (-2.0, INF), (0.0, 0.0), 2.0, "actuator"])
def test_a_bound_to_one_side_is_one(exo, half):
    assert not asked(exo, half, limits="none").trivial


def test_tensions_bound_side_forces_where_their_sign_is_known():
    """Of more than three limbs, or off the centre, |g| <= |f| binds tensions that are chosen together with g."""
    four = ep.load("four-cables").replace(limbs=[ep.Limb("UPU")] * 4)
    for offset in (None, [0.005, 0.0, 0.002]):
        with pytest.raises(NonConvexBound, match="4 limbs"):
            asked(four, "actuator", limits="none", centre_offset=offset)
        answer = asked(four, "actuator", limits="pull", centre_offset=offset)
        assert answer.held.any()
        f, g = answer.actuator_forces[answer.held], answer.constraint_forces[answer.held]
        assert (np.abs(g) <= f + 1e-8 * np.abs(f).max()).all()
        assert (np.abs(g) > 0.1 * f).any()


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
def test_bounds_that_cannot_be_meant(exo, bounds, error, said):
    with pytest.raises(error, match=said):
        asked(exo, bounds)


def test_crossed_bounds_name_their_limbs(exo):
    with pytest.raises(InfeasibleBounds) as caught:
        asked(exo, ([0.0, 3.0, 3.0], [[1.0, 1.0, 4.0], [1.0, 5.0, 2.0], [1.0, 5.0, 5.0]]))
    assert np.array(caught.value.limbs).tolist() == [1, 2]
    # What is equal is not crossed.
    np.testing.assert_array_equal(asked(exo, (2.0, 2.0), limits="none").constraint_forces, 2.0)
