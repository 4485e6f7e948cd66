"""The plant: the built machine, ready to be driven by a controller."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.errors.base import echo
from ...core.errors.checked import checked
from ...core.validation import as_finite, as_positive, require_type
from .faults import Fault, as_faults
from .plant_at_rest import PlantAtRest
from .run import Run
from .simulation.drive_schedule import SAME
from .simulation.simulation import Clock, PlantSimulation, RunInstant, as_tolerance, end_time
from .state import Controller, PlantState, Sensor

if TYPE_CHECKING:
    pass


@checked
class Plant(PlantAtRest):
    """Arm, shoulder unit, and the drives of the limbs: muscles with air and valves, winches, linear actuators.

    Assumptions: the arm is one rigid body that turns about O; limbs are massless; drives are those of the design's
    actuators, muscles through their end fittings; muscles and cables never push; the rest are :class:`PlantOptions`.

    Parameters
    ----------
    exo : ShoulderExo or Mechanism
        The design, with an arm, and with actuators: muscles whose force law and end fitting are known, or cables and
        linear actuators whose strokes and force limits are.
    options : PlantOptions, optional
        Air, motors, friction, shoulder unit.
    load : Load, optional
        One constant force on the arm, base frame.

    Raises
    ------
    MissingData
        If something of the design is not known.
    InvalidInput
        If something is not usable.

    Examples
    --------
    >>> plant = ep.Plant(ep.load("prototype"))
    >>> rest = plant.rest()  # hanging, muscles vented
    >>> plant.simulate(lambda t, measured: np.zeros(plant.count), 0.2, rest).status
    'completed'
    """

    def simulate(
        self,
        controller: Controller,
        duration: float,
        state0: PlantState | None = None,
        control_rate: float = 100.0,
        faults: Fault | Sequence[Fault] = (),
        *,
        sensor: Sensor | None = None,
        sample_rate: float | None = None,
        rtol: float = 1e-8,
        progress: bool = False,
    ) -> Run:
        """Move in time under a controller.

        A motion that is cut at one of :attr:`Run.times` and goes on from :meth:`Run.state` there, with the same
        controller, sensor and faults, gives the numbers of the uncut one, bit for bit: on one machine,
        with the same rates and tolerance, each part in one piece of its own times.

        Parameters
        ----------
        controller : callable
            From time in s and :class:`Measurement` to a command a limb, -1 to 1. For a muscle its meaning is that of
            the :class:`ValveUnit`; for a motor it is the force over the motor's limit, 1 pulls in. Called at the
            multiples of the period; the command is held until the next call, and pulses of valves take it over at the
            start of each of their periods. Commands beyond ±1 are cut. What it remembers is its own affair.
        duration : float
            s, from the time of ``state0`` on.
        state0 : PlantState, optional
            The start; :meth:`rest` if left out: the arm at rest, muscles empty, motors as long as an arm that hangs.
        control_rate : float
            Hz.
        faults : Fault or sequence of Fault
            Of muscles, valves and motors, each of which begins before the end of the run.
        sensor : callable, optional
            From time and exact measurement to the one that the controller gets.
        sample_rate : float, optional
            Hz, at which the run is recorded; the control rate if left out.
        rtol : float
            Relative tolerance of a step, at most 1e-3.
        progress : bool
            Whether to show a bar.

        Returns
        -------
        Run
            A motion that cannot go on ends early, and ``Run.status`` says when and why: so does one whose controller or
            sensor raises, or returns something else than n finite commands, after its first call.

        Raises
        ------
        InvalidInput
            If an argument is not usable, or the controller or sensor fails at its first call.

        Examples
        --------
        >>> plant = ep.Plant(ep.load("prototype"))
        >>> run = plant.simulate(lambda t, seen: [1.0, -1.0, -1.0], 0.2)  # fills the first muscle, vents the others
        >>> (1e-5 * run.pressures[-1]).round(1), run.status  # bar
        (array([1.1, 0. , 0. ]), 'completed')
        """
        start = self._of_this_plant("state0", self.rest() if state0 is None else state0)
        require_type("controller", controller, Callable, "a function (t, measurement) -> commands")
        if sensor is not None:
            require_type("sensor", sensor, Callable, "a function (t, measurement) -> measurement")
        clock = Clock(duration, control_rate, control_rate if sample_rate is None else sample_rate, start.time)
        every = as_faults(faults, self.motors.tolist(), clock.end)
        instants = clock.instants(every)
        return PlantSimulation(self, controller, instants, start, every, sensor, as_tolerance(rtol)).run(progress)

    def step(
        self,
        state: PlantState,
        commands: ArrayLike,
        dt: float,
        faults: Fault | Sequence[Fault] = (),
        *,
        rtol: float = 1e-8,
    ) -> PlantState:
        """The state after a time in which commands are held: :meth:`simulate` for a loop of one's own.

        Steps of one control period give the states of :meth:`simulate`, bit for bit.

        Parameters
        ----------
        state : PlantState
        commands : array_like
            Shape (n,), -1 to 1, as of a controller that is called at the start.
        dt : float
            s.
        faults, rtol
            As for :meth:`simulate`; faults that have not begun yet are left out.

        Returns
        -------
        PlantState

        Raises
        ------
        InvalidInput
            If something is not usable.
        SolverFailed
            If the motion cannot go on.

        Examples
        --------
        >>> plant = ep.Plant(ep.load("prototype"))
        >>> state = plant.rest()
        >>> filled = plant.step(state, [1.0, -1.0, -1.0], 0.05)
        >>> (filled.pressures > state.pressures).tolist(), filled.time  # only the first valve lets air in; s
        ([True, False, False], 0.05)
        """
        start = self._of_this_plant("state", state).time
        end = end_time(start, as_positive("dt", dt), 1.0 / dt)
        if end - start <= SAME:
            raise InvalidInput(f"expected dt of more than {SAME:g} s, got {dt:g}")
        every = as_faults(faults, self.motors.tolist())
        held = as_finite("commands", commands, (self.count,))
        events = {t for fault in every for t in (fault.start, fault.end) if start + SAME < t < end - SAME}
        instants = [RunInstant(start, control=True), *map(RunInstant, sorted(events)), RunInstant(end, sample=True)]
        motion = PlantSimulation(self, lambda t, seen: held, instants, state, every, None, as_tolerance(rtol))
        # A sensor takes no part in a step.
        return replace(motion.stepped(), sensor=state.sensor)

    def _of_this_plant(self, name: str, state: PlantState) -> PlantState:
        if not isinstance(state, PlantState) or len(state.pressures) != self.count:
            raise InvalidInput(f"expected {name} to be a PlantState of {self.count} limbs, got {echo(state)}")
        return state

    def __repr__(self) -> str:
        return f"<Plant {self.mechanism.name!r}: {self.count} limbs>"
