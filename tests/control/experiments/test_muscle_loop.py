"""One muscle under its PI controller, Figure 5-10."""

import numpy as np

from exo_pin.control import PIGains, muscle_loop
from exo_pin.muscle import ConstantFriction, Damping, DynamicModel, PressureTrace, muscle_model, simulate


def test_the_motion_is_that_of_the_event_located_integration():
    """The pressure that came, given to the integration with located stick and slip, makes the same contraction."""
    law = muscle_model("best")
    run = muscle_loop(law, 1.3, 0.15, duration=0.7)
    model = DynamicModel(name="check", static=law, friction=ConstantFriction(), damping=Damping.from_bar(-1.0, 0.802))
    seen = simulate(model, 1.3, PressureTrace(run.time, run.pressure), run.time, outside="mark")
    np.testing.assert_allclose(run.contraction, seen.contraction, atol=5e-4)
    assert run.contraction.max() > 0.015


def test_it_comes_to_rest_where_friction_holds_the_weight_near_the_wanted_contraction():
    law = muscle_model("best", 0.25)
    run = muscle_loop(law, 1.3, 0.15, duration=4.0)
    assert abs(run.steady_error) < 0.05
    assert run.overshoot < 0.06
    assert run.settling_time < 2.0
    held = float(law.force(run.contraction[-1], run.pressure[-1])) - 1.3 * 9.81
    assert abs(held) < 2.5 + 0.05
    # The integral of the controller: a softer one takes longer.
    slow = muscle_loop(law, 1.3, 0.15, gains=PIGains(3.3e-2, 3.0), duration=4.0)
    assert slow.settling_time > run.settling_time
    assert run.cautions[0].startswith("The motion is inside")
