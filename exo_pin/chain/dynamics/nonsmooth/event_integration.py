"""Time integration from event to event: friction that sticks and slips, and stops.

Every step is SciPy's DOP853 in one mode. The events are examined at eight instants of the step, from its dense output,
and the first is located by bisection; the step ends there. Two events of the same kind within an eighth of a step that
cancel each other are not noticed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import scipy

from ....core.errors import MotionBlocked, SimulationStopped, SolverFailed
from ....core.progress import track
from ....core.validation import FloatArray
from ..crossing import Crossings, SmoothStep
from ..integration import Instant, Rates, instant_of, refuse_jump, taken
from .contact_forces import room_to_stops
from .settling import Impacts, MotionEvent, StopRules, settled

#: Sliding has ended at this speed backwards, a stop is reached at this depth, characteristic lengths and rad.
_BACK, _DEPTH = 1e-10, 1e-13
#: Instants of a step at which events are examined, and halvings to locate one.
_INSTANTS, _HALVINGS = 8, 60
#: Most changes of mode within a time, s.
_CROWD, _MOMENT = 60, 1e-6


@dataclass
class EventIntegration:
    """One integration.

    Attributes
    ----------
    rates : Rates
        The differential equations.
    stops : StopRules
        Limits that are stops.
    """

    rates: Rates
    stops: StopRules

    def run(
        self, instant: Instant, when: FloatArray, tolerances: tuple[float, float], progress: bool
    ) -> tuple[list[Instant], int, list[MotionEvent]]:
        """States at the times ``when``, steps, and events.

        Raises
        ------
        LoopNotClosed, MasslessMotion, SimulationStopped
            As :meth:`ClosedChain.simulate`.
        """
        from ..implicit import Stiffness  # it derives from SciPy's solvers, which take time to import

        rates, steps, step, short = self.rates, 0, None, 0
        stiffness, accuracy = Stiffness(rates.derivative), dict(zip(("rtol", "atol"), tolerances, strict=True))
        crowd: list[float] = []
        time, end = float(when[0]), float(when[-1])
        self._impacts: dict[int, Impacts] = {}
        instant, found = self._settled(time, instant)
        states = [instant]
        crossings, passage = Crossings(rates), None
        for target in track(when[1:].tolist(), "simulating", progress, len(when) - 1):
            while time < target and len(states) < len(when):
                rates.base = instant.q
                # The impulses of held coordinates follow.
                held = np.zeros(0 if rates.mode is None else len(rates.mode.index))
                y = np.concatenate([0.0 * instant.v, instant.v, [instant.work, instant.dissipated], held])
                bound = end if passage is None else passage.end
                if passage is None:
                    bound, passage = crossings.ahead(time, instant, end)
                step = None if step is None else min(step, bound - time)
                solver = stiffness.solver(rates, time, y, bound, first_step=step, **accuracy)
                short = taken(solver, instant, short)
                inside = solver.dense_output()
                crossings.smooth_steps.append(SmoothStep(time, float(solver.t), rates.base, inside))
                change = self._change(inside, time, float(solver.t))
                last = float(solver.t) if change is None else change
                while len(states) < len(when) and when[len(states)] <= last:
                    states.append(instant_of(rates, inside(float(when[len(states)]))))
                y = solver.y if change is None else inside(last)
                before, instant = instant, instant_of(rates, y)
                refuse_jump(rates.state, before, instant, time, y[: len(instant.v)], tolerances)
                time, steps, step = last, steps + 1, min(solver.h_abs, end - last) or None
                if passage is not None and time >= passage.end:
                    instant, passage, crossed = crossings.arrived(time, instant, passage)
                    found += crossed
                if change is not None:
                    instant, changes = self._settled(time, instant)
                    found, step, passage, rates.carried = found + changes, None, None, None
                    crossings.smooth_steps.clear()
                    crowd = [t for t in crowd if t > time - _MOMENT] + [time]
                    self._refuse_crowd(crowd, time, instant)
        return states, steps, found

    def _settled(self, time: float, instant: Instant) -> tuple[Instant, list[MotionEvent]]:
        """The state in which the motion continues, and what happened; sets the mode of a motion with contacts."""
        if self.stops.limits is None and not self.rates.state.passive.rubs:
            return instant, []
        try:
            settled_instant, self.rates.mode, found = settled(self.rates, time, instant, self.stops, self._impacts)
        except (MotionBlocked, SolverFailed) as error:
            raise SimulationStopped(time, instant.q.copy(), instant.v.copy(), str(error)) from error
        self._floor = np.minimum(room_to_stops(self.rates.state, self.stops.limits, settled_instant.q)[0], 0.0) - _DEPTH
        return settled_instant, found

    def _refuse_crowd(self, crowd: list[float], time: float, instant: Instant) -> None:
        if len(crowd) > _CROWD:
            raise SimulationStopped(
                time,
                instant.q.copy(),
                instant.v.copy(),
                f"more than {_CROWD} changes between sticking, slipping and stops within {_MOMENT:g} s. Efforts that "
                "depend on the sign of v switch without end: make them continuous",
            )

    def _change(self, inside: scipy.integrate.DenseOutput, start: float, end: float) -> float | None:
        """The time of the first change of mode in a step, by bisection; None for none."""
        earlier = start
        for later in np.linspace(start, end, _INSTANTS + 1)[1:].tolist():
            if self._ends(inside, later):
                for _ in range(_HALVINGS):
                    middle = 0.5 * (earlier + later)
                    if not earlier < middle < later:
                        break
                    earlier, later = (earlier, middle) if self._ends(inside, middle) else (middle, later)
                return float(later)
            earlier = later
        return None

    def _ends(self, inside: scipy.integrate.DenseOutput, time: float) -> bool:
        """Whether the mode has ended before a time of a step."""
        rates, mode = self.rates, self.rates.mode
        if mode is None:
            return False
        state, nv, y = rates.state, rates.state.nv, inside(time)
        q, v = np.asarray(pin.integrate(state.model, rates.base, y[:nv])), y[nv : 2 * nv].copy()
        if (mode.sign * v < -_BACK * state.topology.column).any():
            return True
        gaps, index, _ = room_to_stops(state, self.stops.limits, q)
        if len(gaps) and (gaps < self._floor)[~np.isin(index, mode.index)].any():
            return True
        return not mode.holds(q, v, rates.applied(time, q, v))
