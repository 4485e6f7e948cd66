"""Settling against the lag of the supply: it grows with the lag; motions outside the model's range are not quoted."""

import numpy as np
import pytest

from exo_pin.core.errors import InvalidInput
from exo_pin.muscle import PressureStep, dynamic_model, settling_against_lag, simulate


def test_settling_follows_the_lag():
    model, mass = dynamic_model("tang-3-31"), 22.74 / 9.81
    curve = settling_against_lag(model, mass, 4e5, [0.0, 1.0, 2.0])
    # A jump drives the mass faster than the damping holds.
    assert curve.in_range.tolist() == [False, True, True]
    assert np.isnan(curve.quoted[0])
    assert curve.quoted[1] == pytest.approx(3.63, abs=0.05)
    assert curve.quoted[1] < 6.0 < curve.quoted[2]
    assert curve.overshoot[0] > 0.5
    assert curve.overshoot[1:].max() < 0.001
    step = PressureStep(0.0, 4e5, time_constant=1.0)
    alone = simulate(model, mass, step, np.linspace(0, 8, 801), outside="mark", estimate_error=False)
    assert curve.settling[1] == pytest.approx(alone.settling_time(), abs=0.02)


def test_bad_lags_are_named():
    model = dynamic_model("tang-3-31")
    with pytest.raises(InvalidInput, match="zero or more"):
        settling_against_lag(model, 2.0, 4e5, [-1.0])
    with pytest.raises(InvalidInput, match="record"):
        settling_against_lag(model, 2.0, 4e5, [1.0], record=0.0)
