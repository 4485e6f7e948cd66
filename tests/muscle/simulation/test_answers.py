"""Answers of simulated steps of pressure, as they are stored."""

import numpy as np
from answers import answer, changes, each_of
from asked_in_turn import in_turn
from some_muscles import CONSTANT, RUBBING

from exo_pin.muscle import (
    ConstantFriction,
    Damping,
    DynamicModel,
    LoadDependentFriction,
    PolynomialModel,
    PressureStep,
    PressureTrace,
    Validity,
    dynamic_model,
    settling_against_lag,
    simulate,
)


def asked_of_pressures():
    step, jump = PressureStep(1e5, 3e5, 0.2, 0.15), PressureStep(1e5, 3e5, 0.2)
    trace = PressureTrace([0.1, 0.2, 0.25, 0.5], [1e5, 3e5, 2.2e5, 2.5e5])
    times = [0.0, 0.1, 0.2, 0.21, 0.4, 0.7]
    return in_turn(
        {
            name: lambda one=one: (
                [(one(t), one.before(t)) for t in times],
                one.sample(times),
                one.breaks,
                str(one.time_scale),
            )
            for name, one in {"step": step, "jump": jump, "trace": trace, "default": PressureStep(0.0, 1e5)}.items()
        },
        negative=lambda: PressureTrace([0.0, 1.0], [1e5, -2e5]),
        zero=lambda: PressureTrace([0.0, 1.0], [1e5, 0.0]).sample([0.5]),
        turned=lambda: PressureTrace([1.0, 0.0], [1e5, 2e5]),
        late=lambda: PressureStep(1e5, 2e5, -1.0),
        lag=lambda: PressureStep(1e5, 2e5, 0.0, -1.0),
        initial=lambda: PressureStep(-1.0, 2e5),
        final=lambda: PressureStep(1.0, -2e5),
    )


def spring(friction=2.5, damping=(0.0, 0.0), stiffness=800.0, pull=60.0):
    """A muscle that is a straight spring, whatever the pressure."""
    static = PolynomialModel(
        coefficients={(0, 0): pull, (1, 0): -stiffness},
        name="spring",
        reference_length=0.3,
        validity=Validity(strain=(0.0, 0.25), pressure=(0.0, 5e5)),
    )
    law = friction if isinstance(friction, LoadDependentFriction) else ConstantFriction(friction)
    return DynamicModel(name="spring", static=static, friction=law, damping=Damping.from_bar(*damping))


def response(model, mass, step, seconds, **options):
    run = simulate(model, mass, step, np.linspace(0.0, seconds, 21), **{"outside": "mark"} | options)
    return run, in_turn(settled=lambda: [str(round(run.settling_time(band), 8)) for band in (0.02, 0.2)])


def asked_of_motion():
    tang, even, constant = dynamic_model("tang-3-31"), PressureStep(3e5, 3e5), dynamic_model("tang-constant-friction")
    return in_turn(
        lifted=lambda: response(tang, 1.3, PressureStep(2.2e5, 3.4e5, 0.05, 0.04), 0.6, outside="raise"),
        jump=lambda: response(tang, 1.3, PressureStep(2.2e5, 3.4e5, 0.05), 0.2)[0].contraction,
        dropped=lambda: response(constant, 1.0, PressureStep(3e5, 0.0, 0.1), 0.5, contraction=0.05),
        held=lambda: response(constant, 4.9, PressureStep(2.5e5, 0.5e5, 0.05, 0.1), 0.4, contraction=0.0),
        fast=lambda: response(spring(1.0, (-1.0, 0.802)), 2.0, even, 0.15, contraction=0.02, velocity=0.6),
        sinks=lambda: response(tang, 1.3, PressureStep(3.4e5, 2.2e5, 0.05, 0.04), 0.3, stop=0.02),
        lengthens=lambda: response(
            spring(0.4, (-0.5, 0.3)), 2.0, even, 0.5, contraction=0.05, velocity=-0.4, stop=0.035
        ),
        trace=lambda: response(tang, 1.3, PressureTrace([0.05, 0.1, 0.2], [2e5, 3.1e5, 2.6e5]), 0.4),
        rubs=lambda: response(
            spring(RUBBING, (0.2, 0.1)), 2.0, PressureStep(1.4e5, 2.5e5, 0.1, 0.2), 0.5, contraction=0.03
        ),
        stays=lambda: simulate(spring(), 3.0, even, [0.0, 0.1], contraction=0.038).step,
        leaves=lambda: response(tang, 2.3, PressureStep(0.0, 3.6e5, 0.0, 0.2), 0.3, outside="raise"),
    )


def asked_of_starts():
    tang, even = dynamic_model("tang-3-31"), PressureStep(3e5, 3e5)

    def start(mass, step=even, law=tang, times=(0.0, 0.001), **options):
        run = simulate(law, mass, step, times, outside="mark", **options)
        return 1e3 * run.contraction, run.mode, run.at_rest, run.inside

    return in_turn(
        rest=lambda: [start(mass) for mass in (1.1, 3.3, 9.0)],
        jump=lambda: start(1.3, PressureStep(2.5e5, 3e5)),
        light=lambda: start(0.01, law=CONSTANT),
        above=lambda: start(3.0, stop=0.09),
        lower=lambda: start(30.0, stop=-0.001),
        held=lambda: [start(3.0, law=spring(), contraction=x) for x in (0.0, 0.034, 0.0351, 0.0413, 0.042)],
        stopped=lambda: [start(mass, law=spring(), contraction=0.0) for mass in (5.8, 5.9, 6.3, 6.5)],
        slowly=lambda: start(3.0, law=spring(0.2), contraction=0.0376),
        below=lambda: start(1.0, contraction=-0.001),
        falls=lambda: start(1.0, contraction=0.0, velocity=-0.1),
        lifts=lambda: start(1.0, contraction=0.0, velocity=0.1),
        leaves=lambda: answer(lambda: simulate(tang, 1.0, PressureStep(3e5, 0.0, 0.1), [0.0, 0.3], 0.05))["answer"][
            "raises"
        ],
        no_model=lambda: start(1.0, law="tang-3-31"),
        no_pressure=lambda: start(1.0, 3e5),
        no_mass=lambda: start(0.0),
        no_speed=lambda: start(1.0, contraction=0.01, velocity=np.inf),
        turned=lambda: start(1.0, times=(0.0, -1.0)),
        digits=lambda: start(1.0, rtol=0.0),
        absolute=lambda: start(1.0, atol=-1.0),
        choice=lambda: simulate(tang, 1.0, even, [0.0, 1.0], outside="leave"),
        no_lags=lambda: settling_against_lag(tang, 1.5, 3e5, [-0.5, 0.1]),
        no_record=lambda: settling_against_lag(tang, 1.5, 3e5, [0.1], 0.0),
    )


ASKED = {
    "pressures": asked_of_pressures,
    "motion": asked_of_motion,
    "starts": asked_of_starts,
    "settling": lambda: settling_against_lag(dynamic_model("tang-3-31"), 1.5, 3e5, [0.0, 0.15, 0.4], record=1.5),
}
#: Those that take longer than 0.15 s.
LONGER = {"motion"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
