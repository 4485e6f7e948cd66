"""One muscle under its PI controller, Figure 5-10."""

from dataclasses import replace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.control import MuscleLoop, PIGains, muscle_loop
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


def test_air_that_cannot_lift_leaves_the_mass_on_the_braid():
    run = muscle_loop(muscle_model("best", 0.25), 30.0, 0.15, duration=0.5)
    assert (run.contraction == 0.0).all()
    assert run.duty[0] == pytest.approx(15 * 3.3e-2)
    weak = ep.PlantOptions(supply=ep.Supply(2e4))
    assert muscle_loop(muscle_model("best", 0.25), 1.3, 0.15, duration=0.5, options=weak).pressure.max() <= 2e4


def test_pulses_of_a_quick_valve_fill_as_their_average_does():
    law, friction = muscle_model("best"), ConstantFriction()
    unit = ep.PlantOptions().valves
    runs = []
    for own in (replace(unit, frequency=500.0), replace(unit, frequency=500.0, modulation="averaged")):
        options = ep.PlantOptions(valves=own, muscle_friction=friction)
        runs.append(muscle_loop(law, 1.3, 0.15, options=options, duration=0.4))
    assert runs[1].pressure[-1] > 0.9e5
    np.testing.assert_allclose(runs[1].pressure, runs[0].pressure, atol=0.02 * runs[0].pressure.max())
    assert (runs[1].pressure != runs[0].pressure).any()


def test_numbers_of_a_response():
    time = np.linspace(0.0, 10.0, 101)
    gone = 0.01 + 0.04 * (1.0 - np.exp(-time)) + 0.003 * ((time > 2.95) & (time < 4.05))
    gone[time >= 7.95] = 0.049
    run = MuscleLoop(time, gone, 0 * time, 0 * time, 0 * time, 0.05, time > 0.95)
    assert run.step == pytest.approx(0.04)
    assert run.steady_error == pytest.approx(0.001 / 0.04)
    assert run.overshoot == pytest.approx((0.04 * (1.0 - np.exp(-4.0)) + 0.003 - 0.04) / 0.04)
    # Within 2 mm from e^-t = 0.05 on, but for the excursion, which at 4 s is of 2.3 mm.
    assert run.settling_time == pytest.approx(4.1)
    assert run.cautions == ("The motion is inside the range of the force law for 90 % of it.",)
    still = replace(run, contraction=np.full(101, 0.01), inside=np.full(101, True))
    assert (still.settling_time, still.overshoot, still.cautions) == (np.inf, 0.0, ())
    assert replace(run, contraction=np.append(0.01, np.full(100, 0.0495)), wanted=0.05).settling_time == time[1]


def test_bad_arguments_are_named():
    law = muscle_model("best", 0.25)
    for words, match in (
        ({"wanted": 15.0}, "share of the length"),
        ({"mass": -1.0}, "mass"),
        ({"duration": 1e9}, "duration"),
        ({"gains": 3}, "PIGains"),
        ({"options": 3}, "PlantOptions"),
    ):
        given = {"mass": 1.3, "wanted": 0.15} | words
        with pytest.raises(InvalidInput, match=match):
            muscle_loop(law, **given)
