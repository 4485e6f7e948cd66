"""Step response of a hung mass to a pressure input, integrated phase by phase, and its settling.

Stick and slip phases of a hung mass, separated by located events.

Each phase is a smooth equation for SciPy's ``solve_ivp``. Sliding ends where the velocity passes zero; then the
mass sticks if friction can hold it, else it slides back. Sticking ends where the net force passes the friction
bound. The sign function is never smoothed. At the start of its stroke the muscle is held by its braid, which does
not stretch: a mass that comes down there is stopped without rebound.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import inf, pi, sqrt
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from ...core.errors import InvalidInput, OutsideValidity, SolverFailed
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_finite, as_positive, as_rising, frozen, require_type
from ..laws.dynamic import DynamicModel, G
from ..laws.validity import as_outside
from .response import Mode, PressureInput, PressureStep, StepResponse

#: State: contraction, velocity, work of the static force, loss to friction, loss to damping.
STATE_SIZE = 5
_MAX_PHASES = 10_000
#: A rest ends where the net force is beyond the friction bound by this, N: far below any force that matters, far above
#: rounding. So a mass that slides has a force that moves it, and one that rests has not. As the pressure settles, rests
#: and slides follow each other ever closer to the bound, and with no such margin they end in slides of no length.
_FORCE_TOLERANCE = 1e-9

#: Least number of steps in a period of the mass on the muscle's stiffness.
_STEPS_PER_PERIOD = 50
#: First step of a sliding phase, s.
_FIRST_STEP = 1e-6

#: Replaces a margin of zero, which counts as inside.
_INSIDE = 1e-300

Event = Callable[[float, FloatArray], float]


def _at_rest(t: float, y: FloatArray) -> list[float]:
    return [0.0] * STATE_SIZE


def _ending(event: Event, direction: float) -> Event:
    """Mark a function whose zero, passed in a direction, ends a phase, as SciPy asks for it."""
    event.terminal, event.direction = True, direction  # type: ignore[attr-defined]
    return event


@dataclass
class Phases:
    """One integration: the model, the load, and what has been collected so far."""

    model: DynamicModel
    mass: float
    pressure: PressureInput
    stop: float
    enforce: bool
    options: dict[str, Any]
    times: FloatArray
    states: FloatArray = field(init=False)
    modes: NDArray[np.int_] = field(init=False)
    switches: list[tuple[float, Mode]] = field(default_factory=list)
    impact_loss: float = 0.0
    edges: list[bool] = field(default_factory=list)
    #: Where the present phase ends at the latest: at a jump of the pressure it still has the value before it.
    until: float = inf

    def __post_init__(self) -> None:
        self.states = np.full((len(self.times), STATE_SIZE), np.nan)
        self.modes = np.zeros(len(self.times), dtype=int)

    def at(self, t: float) -> float:
        """Return the pressure in Pa that the present phase has at ``t``."""
        return self.pressure.before(t) if t >= self.until else self.pressure(t)

    def net(self, x: float, t: float) -> float:
        """Net force on the resting mass without friction, N, positive shortens."""
        return self.pull(x, self.at(t)) - self.mass * G

    def pull(self, x: float, pressure: float) -> float:
        """Return the static force in N, zero where the law would push: a slack muscle does not."""
        return max(0.0, float(self.model.static.unchecked_force(x, pressure)))

    def bound(self, x: float, t: float) -> float:
        """Friction bound in N."""
        return self.model.friction.bound(x, self.at(t), self.mass)

    def mode_at_rest(self, t: float, x: float) -> Mode:
        """Decide what a mass does that has no velocity at this moment."""
        net, at_stop = self.net(x, t), x <= self.stop
        if abs(net) <= self.bound(x, t) + _FORCE_TOLERANCE:
            return Mode.AT_STOP if at_stop else Mode.STICKING
        if net > 0:
            return Mode.SHORTENING
        return Mode.AT_STOP if at_stop else Mode.LENGTHENING

    def derivative(self, direction: float) -> Callable[[float, FloatArray], list[float]]:
        """Return the equation of motion while sliding in a direction, shortening positive.

        Source: thesis (3-26), (3-27).
        """
        friction, damping = self.model.friction, self.model.damping

        def rhs(t: float, y: FloatArray) -> list[float]:
            x, v = float(y[0]), float(y[1])
            p = self.at(t)
            pull = self.pull(x, p)
            drag = p * max(0.0, damping.rate(v)) * v
            rub = direction * friction.bound(x, p, self.mass)
            return [v, (pull - drag - rub) / self.mass - G, pull * v, rub * v, drag * v]

        return rhs

    def sliding_events(self, mode: Mode) -> list[Event]:
        """Return what ends a sliding phase: standing still, the stop, an edge of the friction or damping range."""

        def at_rest(t: float, y: FloatArray) -> float:
            return float(y[1])

        def touches(t: float, y: FloatArray) -> float:
            return float(y[0]) - self.stop

        events = [_ending(at_rest, -float(mode))]
        if mode is Mode.LENGTHENING:
            events.append(_ending(touches, -1.0))
        # Where friction or damping leave their range the equation has a kink: the integration restarts there.
        return events + [self._edge(i, inside) for i, inside in enumerate(self.edges)]

    def margins(self, t: float, y: FloatArray) -> tuple[float, ...]:
        """Return what must be zero or more for friction and damping to oppose the motion, and for a pull."""
        x, p = float(y[0]), self.at(t)
        force = float(self.model.static.unchecked_force(x, p))
        return *self.model.margins(x, float(y[1]), p, self.mass), force

    def _edge(self, index: int, inside: bool) -> Event:
        def edge(t: float, y: FloatArray) -> float:
            value = float(self.margins(t, y)[index])
            # On the edge is inside; a margin that is zero throughout (no friction, no damping) is no crossing.
            return value if value != 0.0 or not inside else _INSIDE

        # Only the crossing to the other side counts, so that a restart on the edge does not meet it again.
        return _ending(edge, -1.0 if inside else 1.0)

    def resting_events(self, x: float, at_stop: bool) -> list[Event]:
        """Return what ends a rest: the net force passes the friction bound."""

        def lifts(t: float, y: FloatArray) -> float:
            return self.net(x, t) - self.bound(x, t) - _FORCE_TOLERANCE

        def sinks(t: float, y: FloatArray) -> float:
            return -self.net(x, t) - self.bound(x, t) - _FORCE_TOLERANCE

        return [_ending(event, 1.0) for event in ([lifts] if at_stop else [lifts, sinks])]

    def check(self, t: FloatArray, states: FloatArray) -> None:
        """Raise if a step of a sliding phase left the model's range and ``outside`` is "raise"."""
        if not self.enforce:
            return
        p = self.pressure.sample(t)
        inside = self.model.contains(states[0], states[1], p, self.mass)
        if not inside.all():
            i = int(np.argmin(inside))
            reason = self.model.explain(float(states[0, i]), float(states[1, i]), float(p[i]), self.mass)
            raise OutsideValidity(self.model.name, f"at {t[i]:.4g} s {reason}", int((~inside).sum()))

    def phase(self, t: float, end: float, y: FloatArray, mode: Mode) -> tuple[float, FloatArray, int | None]:
        """Integrate one phase; return when and where it ends, and the event that ended it."""
        self.until = end
        resting = mode in (Mode.STICKING, Mode.AT_STOP)
        options = dict(self.options)
        if resting:
            events = self.resting_events(float(y[0]), mode is Mode.AT_STOP)
            options["max_step"] = min(options["max_step"], 0.25 * self.pressure.time_scale)
            rhs: Callable[[float, FloatArray], list[float]] = _at_rest
        else:
            self.edges = self.edges or [value >= 0 for value in self.margins(t, y)]
            # Events are found by a change of sign from step to step. The first step must be too short for the
            # velocity to leave zero and come back, the others for two reversals.
            stiffness = abs(float(self.model.static._stiffness(y[0], self.pressure(t))))
            period = 2 * pi * sqrt(self.mass / stiffness) if stiffness > 0 else inf
            options["max_step"] = min(options["max_step"], _STEPS_PER_PERIOD**-1 * period)
            options["first_step"] = min(_FIRST_STEP, options["max_step"], end - t)
            events = self.sliding_events(mode)
            rhs = self.derivative(float(mode))
        solution = scipy.integrate.solve_ivp(rhs, (t, end), y, events=events, dense_output=True, **options)
        if solution.status < 0:
            raise SolverFailed("solve_ivp", inf, solution.message)
        self.check(solution.t, solution.y)
        self.until = inf
        reached = float(solution.t[-1])
        within = (self.times >= t) & (self.times <= reached)
        if within.any():
            self.states[within] = solution.sol(self.times[within]).T
            self.modes[within] = int(mode)
        hit = None
        if solution.status == 1:
            hit = next(i for i, times in enumerate(solution.t_events) if len(times))
        return reached, solution.y[:, -1].copy(), hit

    def run(self, y: FloatArray) -> FloatArray:
        """Integrate from a state at the first time to the last, across all phases; return the last state."""
        t, end = float(self.times[0]), float(self.times[-1])
        marks = [b for b in self.pressure.breaks if t < b < end] + [end]
        mode = Mode(int(np.sign(y[1]))) if y[1] != 0.0 else self.mode_at_rest(t, float(y[0]))
        self.switches.append((t, mode))
        for _ in range(_MAX_PHASES):
            target = next(mark for mark in marks if mark > t)
            t, y, hit = self.phase(t, target, y, mode)
            fresh = self.next_mode(t, y, mode, hit)
            if fresh is not mode:
                self.switches.append((t, fresh))
            mode = fresh
            if t >= end:
                if not np.isfinite(self.states).all():
                    raise SolverFailed("stick-slip integration", inf, "the motion is not finite")
                return y
        raise SolverFailed("stick-slip integration", end - t, f"more than {_MAX_PHASES} phases by {t:.6g} s")

    def next_mode(self, t: float, y: FloatArray, mode: Mode, hit: int | None) -> Mode:
        """Decide what follows a phase; set the velocity to exactly zero where it is."""
        if mode in (Mode.STICKING, Mode.AT_STOP):
            # While it rests the pressure may pass an edge unseen: look anew when it slides.
            self.edges = []
            if hit is None:
                return self.mode_at_rest(t, float(y[0]))
            return Mode.SHORTENING if hit == 0 else Mode.LENGTHENING
        if hit == 0:
            y[1] = 0.0
            return self.mode_at_rest(t, float(y[0]))
        if hit == 1 and mode is Mode.LENGTHENING:
            self.impact_loss += 0.5 * self.mass * float(y[1]) ** 2
            y[0], y[1] = self.stop, 0.0
            return self.mode_at_rest(t, float(y[0]))
        if hit is None:
            # A break of the pressure: it may have jumped.
            self.edges = []
        else:
            edge = hit - (2 if mode is Mode.LENGTHENING else 1)
            self.edges[edge] = not self.edges[edge]
        return mode


#: Settings for many responses that are compared with each other: fewer digits, no error.
QUICK: dict[str, Any] = {"outside": "mark", "rtol": 1e-8, "atol": 1e-10}
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
    options = {**INTEGRATION, "rtol": as_positive("rtol", rtol), "atol": as_positive("atol", atol)}
    run = Phases(model, load, pressure, end_stop, enforce, options, t)
    last = run.run(np.array([x, speed, 0.0, 0.0, 0.0]))
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
