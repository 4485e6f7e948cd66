"""Step response of a hung mass to a pressure input, integrated phase by phase (:mod:`.phases`), and its settling."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Any

import numpy as np

from ...core.errors import InvalidInput, OutsideValidity
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_finite, as_positive, as_rising, frozen, require_type
from ..laws.dynamic import DynamicModel, G
from ..laws.validity import as_outside
from .phases import Phases
from .response import PressureInput, PressureStep, StepResponse

#: Settings for many responses that are compared with each other: fewer digits, no second integration, no error.
QUICK: dict[str, Any] = {"outside": "mark", "rtol": 1e-8, "atol": 1e-10, "estimate_error": False}
#: Method and longest step, s, of SciPy's ``solve_ivp``.
INTEGRATION: dict[str, Any] = {"method": "DOP853", "max_step": inf}
#: The thesis records each response for so long, s (Section 3.2).
RECORD = 8.0


@checked
def simulate(
    model: DynamicModel,
    mass: float,
    pressure: PressureInput,
    times: Sequence[float] | FloatArray,
    contraction: float | None = None,
    velocity: float = 0.0,
    outside: str = "raise",
    stop: float = 0.0,
    rtol: float = 1e-10,
    atol: float = 1e-12,
    estimate_error: bool = True,
) -> StepResponse:
    """Motion of a mass that hangs on a muscle while its pressure changes.

    Parameters
    ----------
    model : DynamicModel
        The muscle.
    mass : float
        Hung mass, kg.
    pressure : PressureInput
        Pressure over time.
    times : array_like
        Shape (n,), s, rising: the motion is integrated from the first to the last and given at each.
    contraction : float or None
        At the start, m. None for rest at the first pressure: where the static force carries the mass, or at the
        stop if it cannot lift it.
    velocity : float
        At the start, m/s, shortening positive.
    outside : {"raise", "mark"}
        What to do when the motion leaves the range of the model, which is looked at in every step. "mark" goes on
        with pull, friction and damping cut at zero, and ``inside`` marks where. Held by its braid the muscle is
        outside the force law's range, so a response from an empty muscle needs "mark".
    stop : float
        Contraction in m at which the braid holds. Table 3-2 shows -0.1 to 1.1 mm for every weight at 0.4 bar.
    rtol, atol : float
        Tolerances of the integration, on contraction in m, velocity in m/s and energies in J.
    estimate_error : bool
        Whether to integrate again a hundred times finer and report the difference.

    Returns
    -------
    StepResponse

    Raises
    ------
    InvalidInput
        If an argument is not usable, or the start lies beyond the stop.
    OutsideValidity
        With "raise", when the motion leaves the range; the message has the time.
    SolverFailed
        If the integration does not end.

    Examples
    --------
    >>> from exo_pin.muscle import PressureStep, dynamic_model, simulate
    >>> step = PressureStep(2e5, 3e5, at=0.1, time_constant=0.3)  # Pa, s
    >>> run = simulate(dynamic_model("tang-3-31"), 1.5, step, np.linspace(0.0, 4.0, 201), outside="mark")
    >>> round(1e3 * float(run.contraction[-1] - run.contraction[0]), 1)  # mm that 1 bar lifts 1.5 kg
    17.2
    """
    require_type("model", model, DynamicModel)
    require_type("pressure", pressure, PressureInput)
    load = as_positive("mass", mass)
    t = as_rising("times", times)
    end_stop = float(as_finite("stop", stop, ()))
    speed = float(as_finite("velocity", velocity, ()))
    enforce = as_outside(outside) == "raise"
    if contraction is None:
        x = _rest(model, load, pressure.before(float(t[0])), end_stop)
    else:
        x = float(as_finite("contraction", contraction, ()))
    if x < end_stop or (x == end_stop and speed < 0):
        raise InvalidInput(f"expected a start at or above the stop of {end_stop:g} m, moving away, got {x:g} m")
    start = np.array([x, speed, 0.0, 0.0, 0.0])
    tolerances = (as_positive("rtol", rtol), as_positive("atol", atol))

    def integrated(rtol: float, atol: float) -> tuple[Phases, FloatArray]:
        options = {**INTEGRATION, "rtol": rtol, "atol": atol}
        run = Phases(model, load, pressure, end_stop, enforce, options, t)
        return run, run.run(start.copy())

    run, last = integrated(*tolerances)
    error = None
    if estimate_error:
        # SciPy does not go below about 2e-14 relative.
        again, _ = integrated(max(0.01 * tolerances[0], 3e-14), 0.01 * tolerances[1])
        error = float(np.abs(again.states[:, 0] - run.states[:, 0]).max())
    p = pressure.sample(t)
    kinetic = 0.5 * load * (float(last[1]) ** 2 - speed**2)
    gained = kinetic + load * G * (float(last[0]) - x)
    balance = float(last[2] - last[3] - last[4]) - run.impact_loss
    return StepResponse(
        time=t,
        contraction=frozen(run.states[:, 0].copy()),
        velocity=frozen(run.states[:, 1].copy()),
        pressure=frozen(np.array(p)),
        mode=run.modes,
        inside=model.contains(run.states[:, 0], run.states[:, 1], p, load),
        switches=tuple(run.switches),
        mass=load,
        muscle_work=float(last[2]),
        friction_loss=float(last[3]),
        damping_loss=float(last[4]),
        impact_loss=run.impact_loss,
        energy_residual=gained - balance,
        error_estimate=error,
    )


def _rest(model: DynamicModel, mass: float, pressure: float, stop: float) -> float:
    """Contraction at which the static force carries the mass, or the stop if it cannot lift it."""
    static = model.static
    if float(static.unchecked_force(stop, pressure)) <= mass * G:
        return stop
    found = static.contraction_for(mass * G, pressure, outside="mark")
    x = float(np.ma.getdata(found))
    if not np.isfinite(x):
        raise OutsideValidity(
            model.name, f"expected a rest within the stroke, got {mass:g} kg at {pressure:g} Pa: it lifts it beyond"
        )
    return max(x, stop)


def settling_against_lag(
    model: DynamicModel, mass: float, pressure: float, lags: Sequence[float] | FloatArray, record: float = RECORD
) -> FloatArray:
    """Settling time of a mass lifted by an empty muscle, for supplies of different lag.

    Parameters
    ----------
    model : DynamicModel
        The muscle.
    mass : float
        Hung mass, kg.
    pressure : float
        Final pressure, Pa.
    lags : array_like
        Time constants of the pressure, s; 0 for a jump.
    record : float
        How long the response is recorded, s. With a long lag the last value is still short of the steady state.

    Returns
    -------
    ndarray
        Shape (n,), s, from the step to the moment after which the contraction stays within 2 % of the step of its last
        value; infinite where it has not settled by the end of the record. NaN for a motion that leaves the model's
        range once it has entered it, which is no result of the model; the start of the stroke of an empty muscle is
        outside.

    Raises
    ------
    InvalidInput
        If an argument is not usable.

    Examples
    --------
    >>> from exo_pin.muscle import dynamic_model, settling_against_lag
    >>> settling_against_lag(dynamic_model("tang-3-31"), 1.5, 3e5, [0.5, 0.7], record=5.0).round(2)  # s: slower air
    array([1.9 , 2.63])
    """
    taus = as_finite("lags", lags, (None,))
    if (taus < 0).any():
        raise InvalidInput(f"expected lags in s, zero or more, got {taus.min():g}")
    length = as_positive("record", record)
    times = np.linspace(0.0, length, 2001)
    supplies = [PressureStep(0.0, pressure, time_constant=float(tau)) for tau in taus]
    runs = [simulate(model, mass, supply, times, **QUICK) for supply in supplies]
    return frozen(np.array([run.settling_time() if _stays_inside(run) else np.nan for run in runs]))


def _stays_inside(run: StepResponse) -> bool:
    """Whether a response stays within the model's range once it has entered it."""
    return bool(run.inside.any() and run.inside[int(run.inside.argmax()) :].all())
