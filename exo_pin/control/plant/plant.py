"""The plant: the built machine, ready to be driven by a controller."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.errors.base import echo
from ...core.records import Record
from ...core.validation import FloatArray, as_choice, as_finite, as_single_rotation, require_type
from ...design import Mechanism
from ...load_case import Load
from ...muscle.valve.supply import ValveUnit
from ..arguments import require_callable
from .assumptions import Assumption, assumptions_of
from .contraction import Contractions
from .drives.drives import drives_of
from .drives.motor_drive import MotorDrive
from .drives.statics import DriveStates, drive_states, force_limits
from .faults import Fault, as_faults
from .options import PlantOptions
from .plant_tables import plant_tables, supply_of
from .run import Run
from .simulation.chain_simulation import simulate_chain
from .simulation.minimal_simulation import simulate_minimal
from .simulation.scenario import Clock, Scenario, as_tolerance, first_state
from .simulation.settling import settled
from .state import Controller, PlantState, Sensor

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo

__all__ = ["METHODS", "Plant"]

#: How a plant is integrated.
METHODS = ("minimal", "chain")


class Plant(Record):
    """Arm, shoulder unit, and the drives of the limbs: muscles with air and valves, winches, linear actuators.

    Assumptions: the arm is one rigid body that turns about O; limbs are massless in minimal coordinates, and have the
    masses of the design in the method "chain"; drives are those of the design's actuators, muscles through their end
    fittings; muscles and cables never push; the rest are :class:`PlantOptions`.

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
        require_type("options", self.options, PlantOptions, "PlantOptions")
        if not isinstance(self.options.valves, ValveUnit) and len(self.options.valves) != self.count:
            raise InvalidInput(f"expected {self.count} valve units, one a limb, got {len(self.options.valves)}")
        self.load = load
        self.drives = drives_of(mechanism, self.options)
        self.supply = supply_of(self.drives, self.options)
        self.tables = plant_tables(mechanism, self.drives, self.options, load, self.supply)
        self.contractions = Contractions(mechanism)

    @property
    def count(self) -> int:
        """Number of limbs n."""
        return self.mechanism.limb_count

    @property
    def motors(self) -> np.ndarray:
        """Whether a limb has a motor, shape (n,), bool; the others have pneumatic muscles."""
        return np.array([drive.is_motor for drive in self.drives])

    @property
    def units(self) -> tuple[ValveUnit | MotorDrive, ...]:
        """What a command goes to, one a limb: valves of muscles, motors."""
        given = self.options.valves
        valves = (given,) * self.count if isinstance(given, ValveUnit) else tuple(given)
        return tuple(
            drive if isinstance(drive, MotorDrive) else unit for drive, unit in zip(self.drives, valves, strict=True)
        )

    def contraction_ratios(self, lengths: ArrayLike) -> FloatArray:
        """Contraction ratios (5-4), shape (..., n), of limb lengths in m, as :class:`Measurement` has them.

        Raises
        ------
        InvalidInput
            If lengths are not finite, or not one a limb.
        """
        return self.contractions.ratios(lengths)

    def force_limits(self, lengths: ArrayLike, slack: bool = False) -> tuple[FloatArray, FloatArray]:
        """Least and greatest tension at rest at limb lengths in m, shape (n,) each, N; strokes do not count.

        Cables are kept taut by the least tension of their drives, unless ``slack`` allows them to be without.

        Raises
        ------
        InvalidInput
            If lengths are not finite, or not one a limb.
        """
        return force_limits(self, lengths, slack)

    def drive_states(self, lengths: ArrayLike, tensions: ArrayLike) -> DriveStates:
        """Pressures and positions of the drives that hold tensions in N at limb lengths in m, shape (n,) each.

        Raises
        ------
        InvalidInput
            If lengths or tensions are not finite, or not one a limb.
        """
        return drive_states(self, lengths, tensions)

    @property
    def assumptions(self) -> tuple[Assumption, ...]:
        """Every parameter that the source does not print, with its value and basis."""
        return assumptions_of(self.mechanism, self.drives, self.options)

    def state(
        self,
        orientation: Rotation | None = None,
        angular_velocity: ArrayLike = (0.0, 0.0, 0.0),
        pressures: ArrayLike | None = None,
        drive_positions: ArrayLike | None = None,
    ) -> PlantState:
        """A state to start from, with motors at rest.

        Parameters
        ----------
        orientation : Rotation, optional
            {O_B} to {O_A}; the identity if left out, an arm that hangs.
        angular_velocity : array_like
            Shape (3,), rad/s, base frame.
        pressures : array_like, optional
            Gauge pressures, shape (n,), Pa; a number is for all muscles. Zero if left out.
        drive_positions : array_like, optional
            Lengths that the motor drives let out, shape (n,), m; those of the limbs without tension if left out.

        Raises
        ------
        InvalidInput
            If something is not usable.
        """
        given = as_finite("pressures", 0.0 if pressures is None else pressures, (), stack=True)
        if given.shape not in ((), (self.count,)):
            raise InvalidInput(f"expected {self.count} pressures, one a limb, got shape {given.shape}")
        pose = as_single_rotation("orientation", Rotation.identity() if orientation is None else orientation)
        out = self.contractions.lengths(pose) if drive_positions is None else drive_positions
        out = np.where(self.motors, as_finite("drive_positions", out, (self.count,)), 0.0)
        return PlantState(pose, angular_velocity, np.where(self.motors, 0.0, given), out)  # type: ignore[arg-type]

    def rest(
        self, pressures: ArrayLike = 0.0, near: Rotation | None = None, drive_positions: ArrayLike | None = None
    ) -> PlantState:
        """The state of rest at constant pressures and with motors that stand still.

        It is the stable equilibrium that a damped motion from ``near`` leads to. Friction is left out, so with friction
        the plant may rest elsewhere, too. The weight of limbs counts.

        Parameters
        ----------
        pressures : array_like
            Gauge pressures, shape (n,), Pa; a number is for all muscles.
        drive_positions : array_like, optional
            As for :meth:`state`.
        near : Rotation, optional
            Where the motion starts; the arm hanging if left out.

        Raises
        ------
        InvalidInput
            If something is not usable.
        SolverFailed
            If the motion does not end.
        """
        start = self.state(near, pressures=pressures, drive_positions=drive_positions)
        pose = settled(self.tables, first_state(self, start), start.orientation, self.mechanism.limbs)
        return self.state(pose, pressures=start.pressures, drive_positions=start.drive_positions)

    def held(self, orientation: Rotation, tensions: ArrayLike) -> PlantState:
        """The state of rest in a pose, with the drives where they hold tensions.

        Parameters
        ----------
        orientation : Rotation
            Single, {O_B} to {O_A}.
        tensions : array_like
            Shape (n,), N. Whether they balance the arm is not checked.

        Raises
        ------
        InvalidInput
            If something is not usable.
        """
        pose = self.state(orientation).orientation
        found = self.drive_states(self.contractions.lengths(pose), tensions)
        return self.state(pose, pressures=found.pressures, drive_positions=found.positions)

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
            From time in s and :class:`Measurement` to a command a limb, -1 to 1. For a muscle its meaning is that of
            the :class:`ValveUnit`; for a motor it is the force over the motor's limit, 1 pulls in. Called at the
            control rate; the command is held until the next call, and pulses of valves take it over at the start of
            each of their periods. Commands beyond ±1 are cut.
        duration : float
            s.
        state0 : PlantState, optional
            The start; :meth:`rest` if left out: the arm at rest, muscles empty, motors as long as an arm that hangs.
        control_rate : float
            Hz.
        faults : Fault or sequence of Fault
            Of muscles, valves and motors, each of which begins within the run.
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
            raise InvalidInput(f"expected state0 to be a PlantState of {self.count} limbs, got {echo(start)}")
        require_callable(controller, "a controller, a function (t, measurement) -> commands")
        if sensor is not None:
            require_callable(sensor, "a sensor, a function (t, measurement) -> measurement")
        clock = Clock(duration, control_rate, control_rate if sample_rate is None else sample_rate)
        simulation = simulate_chain if as_choice("method", method, METHODS) == "chain" else simulate_minimal
        every = as_faults(faults, self.motors.tolist(), clock.duration)
        return simulation(Scenario(self, controller, clock, start, every, sensor, as_tolerance(rtol), progress))

    def __repr__(self) -> str:
        return f"<Plant {self.mechanism.name!r}: {self.count} limbs>"
