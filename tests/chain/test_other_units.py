"""A chain says the same of itself in any units of length and of mass: no answer has a metre or a kilogram in it."""

from typing import NamedTuple

import numpy as np
import pytest
from mechanisms import five_bar, four_bar, parallelogram, random_loop, sliders
from other_units import Units

from exo_pin.chain import ClosedChain

#: Powers of two, so that the digits of all numbers stay: large and small characteristic lengths.
UNITS = [Units(2.0**6, 2.0**-4), Units(2.0**-6, 2.0**5)]
LOOPS = {f"loop-{kind}": random_loop(kind) for kind in ("prismatic", "revolute", "universal", "distance", "rigid")}
PLANAR = {"four_bar": four_bar(), "four_bar_link": four_bar("link"), "five_bar": five_bar()}
FRAMES = dict.fromkeys(LOOPS, "left_3") | {"four_bar": "rocker", "four_bar_link": "lower", "five_bar": "tip"}
NAMED = LOOPS | PLANAR | {"sliders": sliders(0.3), "parallelogram": parallelogram()}


class Both(NamedTuple):
    """One chain in two units."""

    name: str
    units: Units
    chain: ClosedChain
    other: ClosedChain
    q: np.ndarray
    motion: np.ndarray  # what coordinates are multiplied by
    force: np.ndarray  # what efforts are multiplied by

    def motions(self, seed=3):
        """A velocity and an acceleration that keep the loops closed, in the first units."""
        rng = np.random.default_rng(seed)
        v = self.chain.project_velocity(self.q, rng.normal(size=len(self.q)))
        return v, self.chain.project_acceleration(self.q, v, rng.normal(size=len(self.q)))


def written(name, units, change=lambda chain: chain):
    named = NAMED[name]
    chain = change(named.chain())
    return Both(name, units, chain, units.chain(chain), named.q, units.motion(chain), units.force(chain))


@pytest.fixture(params=[(name, units) for name in NAMED for units in UNITS], ids=lambda case: f"{case[0]}-{case[1][0]}")
def both(request):
    return written(*request.param)


def assert_equal(found, expected, rtol=1e-8):
    """Equal but for rounding of the largest."""
    expected = np.asarray(expected, dtype=float)
    size = float(np.abs(expected).max(initial=0.0))
    np.testing.assert_allclose(found, expected, rtol=rtol, atol=rtol * size)


def assert_same_rank(one, other):
    for key in ("rows", "coordinates", "rank", "regular_rank", "redundant_closures", "kinds", "idle", "geometry"):
        assert getattr(other, key) == getattr(one, key), key
    assert_equal(other.singular_values, one.singular_values)
    assert other.tolerance == pytest.approx(one.tolerance, rel=1e-3)


def test_mobility(both):
    # Hardly open, so that the tolerance is that of the opening.
    q = both.q + 2e-11 * np.random.default_rng(1).normal(size=len(both.q))
    frame = FRAMES.get(both.name)
    actuated = both.chain.model.names[1:3]
    one = both.chain.mobility(q, frame=frame, actuated=actuated)
    other = both.other.mobility(q * both.motion, frame=frame, actuated=actuated)
    assert_same_rank(one, other)
    assert_same_rank(one.locked, other.locked)
    assert other.characteristic_length == both.units.metre * one.characteristic_length
    if one.margins is None:
        return
    for key in ("effort", "travel"):
        expected = {name: both.units.named(name) * value for name, value in getattr(one.margins, key).items()}
        assert getattr(other.margins, key) == pytest.approx(expected, rel=1e-6, abs=1e-9)


def test_motions(both):
    v, _ = both.motions()
    x = np.random.default_rng(3).normal(size=len(both.q))
    q = both.q * both.motion
    assert_equal(both.other.project_velocity(q, x * both.motion) / both.motion, v)
    # Accelerations nearest to zero.
    at_rest = both.chain.project_acceleration(both.q, v, 0.0 * v)
    assert_equal(both.other.project_acceleration(q, v * both.motion, 0.0 * v) / both.motion, at_rest)


def test_inverse_dynamics(both):
    v, a = both.motions()
    q, actuated, wrench = both.q * both.motion, list(both.chain.model.names)[1:], both.units.wrench()
    if both.name != "sliders":
        actuated = both.chain.roles.actuated
    given = (q, v * both.motion, a * both.motion)
    for metric in ("reactions", "closures"):
        one = both.chain.inverse_dynamics(both.q, v, a, metric=metric, actuated=actuated)
        other = both.other.inverse_dynamics(*given, metric=metric, actuated=actuated)
        assert_equal(other.tau / both.force, one.tau)
        assert_equal(other.multipliers / both.units.multipliers(both.chain), one.multipliers)
        assert other.undetermined == one.undetermined
        np.testing.assert_array_equal(other.effort_is_unique, one.effort_is_unique)
        assert len(other.cautions) == len(one.cautions)
        for name in [*list(both.chain.model.names)[1:], *(closure.name for closure in both.chain.closures)]:
            here, there = one.joint_reaction(name), other.joint_reaction(name)
            assert_equal(there.wrench / wrench, here.wrench)
            np.testing.assert_array_equal(there.unique, here.unique)
            found, expected = there.directions / (wrench / both.units.newton)[:, None], here.directions
            assert_equal(found @ found.T, expected @ expected.T)


def test_closing(both):
    rng = np.random.default_rng(4)
    start = both.q + rng.uniform(-0.1, 0.1, len(both.q)) * np.where(both.motion == 1.0, 1.0, 0.3)
    for hold in ((), list(both.chain.model.names)[1:2]):
        one = both.chain.close(start, hold=hold)
        assert np.abs(one - start).max() > 1e-3
        assert_equal(both.other.close(start * both.motion, hold=hold) / both.motion, one)
