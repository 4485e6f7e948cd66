"""A muscle in a limb: end fitting, force limits, pull only."""

import numpy as np
import pytest

from exo_pin import InvalidInput, MissingData
from exo_pin.muscle import Muscle, OutsideValidity, muscle_model


def muscle(length=0.25, **fields):
    return Muscle(model=muscle_model("tang-optimised", nominal_length=length), **{"end_fitting": 0.1, **fields})


def test_length_of_the_muscle_is_the_limb_less_its_fitting():
    limb = muscle()
    np.testing.assert_allclose(limb.contraction([0.35, 0.30, 0.36]), [0.0, 0.05, -0.01], atol=1e-15)
    short, long = limb.length_range()
    np.testing.assert_allclose([short, long], [0.35 - 0.25 * 0.0750980 / 0.3, 0.35 - 0.25 * 0.012317 / 0.3], rtol=1e-9)
    limb.force_limits([short, long])


def test_limits_of_a_vented_muscle():
    limb = muscle(supply_pressure=4e5)
    lengths = np.array([0.29, 0.30, 0.32, 0.3395])
    lower, upper = limb.force_limits(lengths)
    np.testing.assert_array_equal(lower, 0.0)
    # The law of the 300 mm muscle at equal strain and 4 bar.
    expected = muscle_model("tang-optimised").unchecked_force((0.35 - lengths) * 0.3 / 0.25, 4e5)
    line = 4e5 * limb.model.validity.capability[0] + limb.model.validity.capability[1]
    np.testing.assert_allclose(upper, np.minimum(expected, line), rtol=1e-12)
    assert upper[-1] == line < expected[-1]
    assert (np.diff(upper) > 0).all()


def test_limits_at_the_supply_come_back_as_pressures():
    limb = muscle(supply_pressure=3.5e5, least_pressure=2.5e5)
    lengths = np.linspace(0.29, 0.32, 7)
    lower, upper = limb.force_limits(lengths)
    np.testing.assert_allclose(limb.pressure_for(upper, lengths), 3.5e5, rtol=1e-9)
    np.testing.assert_allclose(limb.pressure_for(lower, lengths), 2.5e5, rtol=1e-9)
    assert (lower < upper).all()


def test_a_muscle_never_pushes():
    # At 1.6 bar the law is negative at 74 mm of contraction: the limit is zero, not a push.
    limb = muscle(length=0.3, supply_pressure=1.6e5, least_pressure=1.3e5)
    length = 0.4 - 0.074
    assert limb.model.unchecked_force(0.074, 1.6e5) < 0
    lower, upper = limb.force_limits(length)
    assert lower == upper == 0.0


def test_lengths_outside_raise_or_are_marked():
    limb = muscle()
    with pytest.raises(OutsideValidity, match="strain"):
        limb.force_limits(0.35)
    lower, upper = limb.force_limits([0.26, 0.30, 0.35], outside="mark")
    np.testing.assert_array_equal(upper.mask, [True, False, True])
    np.testing.assert_array_equal(lower.mask, [True, False, True])
    assert (upper.data >= 0).all()
    with pytest.raises(OutsideValidity, match="pressure"):
        muscle(supply_pressure=6e5).force_limits(0.30)


def test_missing_fitting_and_bad_values_are_named():
    bare = muscle(end_fitting=None)
    with pytest.raises(MissingData, match="end_fitting"):
        bare.force_limits(0.3)
    with pytest.raises(MissingData, match="end_fitting"):
        bare.length_range()
    with pytest.raises(InvalidInput, match="above the end fitting"):
        muscle().force_limits([0.3, 0.09])
    with pytest.raises(InvalidInput, match="finite"):
        muscle().force_limits(np.nan)
    with pytest.raises(InvalidInput, match="below the supply"):
        muscle(supply_pressure=2e5, least_pressure=3e5)
    with pytest.raises(InvalidInput, match="end_fitting"):
        muscle(end_fitting=-0.1)
    with pytest.raises(InvalidInput, match="StaticModel"):
        Muscle(model="best", end_fitting=0.1)
