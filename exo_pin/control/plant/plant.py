"""The plant: the built machine, ready to be driven by a controller."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.records import Record
from ...core.validation import as_choice, as_finite, as_positive
from ...design import Mechanism
from ...load_case import Load
from ...muscle.valve.supply import ValveUnit
from .assumptions import Assumption, assumptions_of
from .equations.plant_tables import plant_tables
from .faults import Fault, as_faults
from .options import PlantOptions
from .run import Run
from .simulation.chain_simulation import simulate_chain
from .simulation.minimal_simulation import Clock, simulate_minimal
from .simulation.settling import settled
from .state import Controller, PlantState, Sensor

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo

__all__ = ["METHODS", "Plant"]

#: How a plant is integrated.
METHODS = ("minimal", "chain")
#: Beyond this tolerance a run would end with a motion that is off by degrees, and not say so.
_LOOSEST = 1e-3


class Plant(Record):
    """Arm, shoulder unit, muscles, air and valves.

    Assumptions: the arm is one rigid body that turns about O; limbs are massless in minimal coordinates, and have the
    masses of the design in the method "chain"; muscles are those of the design's
    actuators, through their end fittings, and never push; the rest are :class:`PlantOptions`.

    Parameters
    ----------
    exo : ShoulderExo or Mechanism
        The design, with an arm, and with muscles whose force law and end fitting are known.
    options : PlantOptions, optional
        Air, friction, shoulder unit.
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
    >>> import exo_pin as ep
    >>> from exo_pin.control.plant.plant import Plant
    >>> plant = Plant(ep.load("prototype"))
    >>> plant.count
    3
    """

    def __init__(
        self, exo: ShoulderExo | Mechanism, options: PlantOptions | None = None, load: Load | None = None
    ) -> None:
        mechanism = exo if isinstance(exo, Mechanism) else getattr(exo, "mechanism", None)
        if not isinstance(mechanism, Mechanism):
            raise InvalidInput(f"expected a ShoulderExo or a Mechanism, got {type(exo).__name__}")
        self.mechanism = mechanism
        self.options = PlantOptions() if options is None else options
        if not isinstance(self.options, PlantOptions):
            raise InvalidInput(f"expected options to be PlantOptions, got {type(options).__name__}")
        if not isinstance(self.options.valves, ValveUnit) and len(self.options.valves) != self.count:
            raise InvalidInput(f"expected {self.count} valve units, one a muscle, got {len(self.options.valves)}")
        self.load = load
        self.tables = plant_tables(mechanism, self.options, load)

    @property
    def count(self) -> int:
        """Number of muscles n."""
        return self.mechanism.limb_count

    @property
    def units(self) -> tuple[ValveUnit, ...]:
        """Valves, one unit a muscle."""
        given = self.options.valves
        return (given,) * self.count if isinstance(given, ValveUnit) else tuple(given)

    @property
    def assumptions(self) -> tuple[Assumption, ...]:
        """Every parameter that the source does not print, with its value and basis."""
        return assumptions_of(self.mechanism, self.options)

    def state(
        self,
        orientation: Rotation | None = None,
        angular_velocity: ArrayLike = (0.0, 0.0, 0.0),
        pressures: ArrayLike | None = None,
    ) -> PlantState:
        """A state to start from.

        Parameters
        ----------
        orientation : Rotation, optional
            {O_B} to {O_A}; the identity if left out, an arm that hangs.
        angular_velocity : array_like
            Shape (3,), rad/s, base frame.
        pressures : array_like, optional
            Gauge pressures, shape (n,), Pa; a number is for all muscles. Zero if left out.

        Raises
        ------
        InvalidInput
            If something is not usable.
        """
        given = as_finite("pressures", 0.0 if pressures is None else pressures, (), stack=True)
        if given.shape not in ((), (self.count,)):
            raise InvalidInput(f"expected {self.count} pressures, one a muscle, got shape {given.shape}")
        pose = Rotation.identity() if orientation is None else orientation
        return PlantState(pose, angular_velocity, np.broadcast_to(given, self.count))  # type: ignore[arg-type]

    def rest(self, pressures: ArrayLike = 0.0, near: Rotation | None = None) -> PlantState:
        """The state of rest at constant pressures: the stable equilibrium that a damped motion from ``near`` leads to.

        Friction is left out, so with friction the plant may rest elsewhere, too. The weight of limbs counts.

        Parameters
        ----------
        pressures : array_like
            Gauge pressures, shape (n,), Pa; a number is for all muscles.
        near : Rotation, optional
            Where the motion starts; the arm hanging if left out.

        Raises
        ------
        InvalidInput
            If something is not usable.
        SolverFailed
            If the motion does not end.
        """
        start = self.state(near, pressures=pressures)
        pose = settled(self.tables, np.array(start.pressures), start.orientation, self.mechanism.limbs)
        return self.state(pose, pressures=start.pressures)

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
        method: str = "minimal",
        rtol: float = 1e-8,
        progress: bool = False,
    ) -> Run:
        """Move in time under a controller.

        Parameters
        ----------
        controller : callable
            From time in s and :class:`Measurement` to a command a muscle, -1 to 1, whose meaning is that of the
            :class:`ValveUnit`. Called at the control rate; the command is held until the next call, and the pulses
            take it over at the start of each of their periods. Commands beyond ±1 are cut.
        duration : float
            s.
        state0 : PlantState, optional
            The start; :meth:`rest` if left out: the arm at rest, muscles empty.
        control_rate : float
            Hz.
        faults : Fault or sequence of Fault
            Of muscles and valves.
        sensor : callable, optional
            From time and exact measurement to the one that the controller gets.
        sample_rate : float, optional
            Hz, at which the run is recorded; the control rate if left out.
        method : {"minimal", "chain"}
            "minimal" integrates in minimal coordinates on the rotation group, compiled, for massless limbs; "chain" the
            closed chain of Pinocchio, some hundred times slower. They agree, but for dry friction in the shoulder,
            which the chain has in each axis of the arm by itself.
        rtol : float
            Relative tolerance of a step, at most 1e-3.
        progress : bool
            Whether to show a bar.

        Returns
        -------
        Run
            A motion that cannot go on ends early, and ``Run.status`` says why.

        Raises
        ------
        InvalidInput
            If an argument, or what the controller returns, is not usable.
        """
        start = self.rest() if state0 is None else state0
        if not isinstance(start, PlantState) or len(start.pressures) != self.count:
            raise InvalidInput(f"expected state0 to be a PlantState of {self.count} muscles, got {start!r:.60}")
        if not callable(controller):
            raise InvalidInput(
                f"expected a controller, a function (t, measurement) -> commands, got {controller!r:.60}"
            )
        if sensor is not None and not callable(sensor):
            raise InvalidInput(f"expected a sensor, a function (t, measurement) -> measurement, got {sensor!r:.60}")
        if as_positive("rtol", rtol) > _LOOSEST:
            raise InvalidInput(f"expected rtol as a relative tolerance of at most {_LOOSEST:g}, got {rtol:g}")
        clock = Clock(duration, control_rate, control_rate if sample_rate is None else sample_rate)
        simulation = simulate_chain if as_choice("method", method, METHODS) == "chain" else simulate_minimal
        return simulation(self, controller, clock, start, as_faults(faults, self.count), sensor, rtol, progress)

    def __repr__(self) -> str:
        return f"<Plant {self.mechanism.name!r}: {self.count} muscles>"
