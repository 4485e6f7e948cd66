"""Pressures over time: steps, traces and jumps as the simulation meets them."""

import numpy as np
from scipy.optimize import brentq

from exo_pin.muscle import (
    PressureStep,
    PressureTrace,
    dynamic_model,
    simulate,
)

G = 9.81


def test_a_short_pulse_in_a_trace_is_not_missed():
    """What exceeds friction lasts less than half of a sample."""
    model, grid = dynamic_model("tang-constant-friction"), np.linspace(0.0, 0.2, 5)
    rest = simulate(model, 2.0, PressureStep(3e5, 3e5), grid).contraction[0]
    lack = 2.0 * G + model.friction.bound(rest, 3e5, 2.0)
    enough = brentq(lambda p: float(model.static.unchecked_force(rest, p)) - lack, 3e5, 4e5) - 3e5
    for share, lifted in ((0.98, False), (1.03, True)):
        trace = PressureTrace(grid, np.array([3e5, 3e5, 3e5 + share * enough, 3e5, 3e5]))
        run = simulate(model, 2.0, trace, np.linspace(0.0, 0.2, 201))
        assert (run.contraction[-1] > rest) == lifted
