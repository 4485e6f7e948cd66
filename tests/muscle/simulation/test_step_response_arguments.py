"""Numbers of a step response, and what it refuses."""

import math

import numpy as np
import pytest

from exo_pin import InvalidInput, UnknownName
from exo_pin.muscle import (
    ConstantFriction,
    Damping,
    DynamicModel,
    LoadDependentFriction,
    OutsideValidity,
    PolynomialModel,
    PressureStep,
    PressureTrace,
    StepResponse,
    Validity,
    dynamic_model,
    muscle_model,
    simulate,
)


def linear(stiffness=800.0, friction=2.5, damping=(0.0, 0.0)):
    """A muscle that is a straight spring, 60 N at 0 mm, whatever the pressure."""
    static = PolynomialModel(
        coefficients={(0, 0): 60.0, (1, 0): -stiffness},
        name="spring",
        reference_length=0.3,
        validity=Validity(strain=(0.0, 0.25), pressure=(0.0, 5e5)),
    )
    return DynamicModel(
        name="spring", static=static, friction=ConstantFriction(friction), damping=Damping.from_bar(*damping)
    )


def test_settling_overshoot_and_steady_state():
    t = np.linspace(0.0, 4.0, 4001)
    wave = 0.05 * (1 - np.exp(-2 * t) * np.cos(10 * t))
    wave[-500:] = wave[-1] = 0.05
    n = len(t)
    zeros = np.zeros(n)
    made = StepResponse(
        time=t, contraction=wave, velocity=zeros, pressure=zeros, mode=np.zeros(n, int), inside=np.ones(n, bool),
        switches=(), mass=1.0, muscle_work=0.0, friction_loss=0.0, damping_loss=0.0, impact_loss=0.0,
        energy_residual=0.0,
    )  # fmt: skip
    assert made.steady_state == 0.05
    peak = (1 - np.exp(-2 * t) * np.cos(10 * t)).max() - 1
    assert abs(made.overshoot - peak) < 1e-12
    outside = np.exp(-2 * t) * np.abs(np.cos(10 * t)) > 0.02
    last = t[np.nonzero(outside)[0][-1]]
    assert last <= made.settling_time() <= last + 1e-3
    assert made.settling_time(0.5) < made.settling_time(0.1) < made.settling_time(0.02)
    with pytest.raises(InvalidInput, match="band"):
        made.settling_time(-1)
    model = linear()
    short = simulate(model, 2.0, PressureStep(1e5, 1e5), np.linspace(0, 0.3, 301), contraction=0.072)
    assert not short.at_rest
    assert short.settling_time() == math.inf
    still = simulate(model, 2.0, PressureStep(1e5, 1e5), np.linspace(0, 0.3, 4))
    with pytest.raises(InvalidInput, match="ends elsewhere"):
        _ = still.overshoot


def test_bad_input_is_named():
    model = dynamic_model("tang-3-31")
    step, times = PressureStep(2.6e5, 3.6e5), np.linspace(0, 1, 11)
    for bad, message in (
        ({"mass": -1.0}, "mass"),
        ({"mass": np.nan}, "mass"),
        ({"times": [0.0]}, "at least two"),
        ({"times": [0.0, 1.0, 0.5]}, "rise"),
        ({"contraction": -0.01}, "stop"),
        ({"rtol": 0.0}, "rtol"),
        ({"model": 3}, "model to be a DynamicModel"),
        ({"pressure": 3.6e5}, "pressure to be a PressureInput"),
    ):
        with pytest.raises(InvalidInput, match=message):
            simulate(**{"model": model, "mass": 2.0, "pressure": step, "times": times} | bad)
    with pytest.raises(OutsideValidity, match="lifts it beyond"):
        simulate(model, 0.1, step, times)
    with pytest.raises(InvalidInput, match="no scaling"):
        DynamicModel(name="", static=muscle_model("best", 0.15), friction=ConstantFriction(), damping=Damping(0.0, 0.0))
    with pytest.raises(InvalidInput, match="FrictionLaw"):
        DynamicModel(name="", static=muscle_model("best"), friction=2.5, damping=Damping(0.0, 0.0))
    with pytest.raises(InvalidInput, match="rise"):
        PressureTrace([0.0, 0.0], [1e5, 1e5])
    with pytest.raises(InvalidInput, match="zero or more"):
        PressureTrace([0.0, 1.0], [1e5, -1e5])
    with pytest.raises(InvalidInput, match="final"):
        PressureStep(0.0, -1.0)
    with pytest.raises(InvalidInput, match="N_1"):
        LoadDependentFriction(1.0, np.nan, 1.0, 1.0)
    with pytest.raises(UnknownName, match="tang-constant-friction"):
        dynamic_model("tang")
