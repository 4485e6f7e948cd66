"""Settling against the lag of the supply: it grows with the lag; motions outside the model's range are not quoted."""

import numpy as np
import pytest

from exo_pin.muscle import PressureStep, dynamic_model, settling_against_lag, simulate


@pytest.mark.full
def test_settling_follows_the_lag():
    model, mass = dynamic_model("tang-3-31"), 22.74 / 9.81
    lags = [0.0, 1.0, 2.0]
    settling = settling_against_lag(model, mass, 4e5, lags)
    # A jump drives the mass faster than the damping holds.
    assert np.isnan(settling[0])
    assert settling[1] == pytest.approx(3.63, abs=0.05)
    assert settling[1] < 6.0 < settling[2]
    steps = [PressureStep(0.0, 4e5, time_constant=lag) for lag in lags]
    times = np.linspace(0, 8, 801)
    alone = [simulate(model, mass, step, times, outside="mark") for step in steps]
    assert alone[0].overshoot > 0.5
    assert max(run.overshoot for run in alone[1:]) < 0.001
    assert settling[1] == pytest.approx(alone[1].settling_time(), abs=0.02)
