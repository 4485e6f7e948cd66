"""The plant: the built machine, ready to be driven by a controller."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.errors.base import echo
from ...core.errors.checked import checked
from ...core.records import Record
from ...core.validation import as_finite, as_positive, as_single_rotation, require_type
from ...device import Device, as_device
from ...load_case import Load
from ...muscle.valve.flow import ATMOSPHERE, ValveUnit
from .any_device.arm_actions import Payload, Torso, Wearer
from .any_device.device_equations import DeviceEquations
from .any_device.device_motion import started
from .any_device.padding import Padding
from .any_device.rest import rest_of
from .contractions import Contractions, drive_states, force_limits
from .drives import DirectDrive, MotorDrive, drives_of
from .faults import Fault, as_faults
from .options import PlantOptions
from .plant_tables import Assumption, assumptions_of, plant_tables, supply_of
from .run import Run
from .run_summary import warn_of_stiff_drives
from .simulation import SAME, DriveSchedule, PlantSimulation, RunInstant, end_time, events_of, run_instants
from .state import FIRST_STEP, Controller, PlantState, Sensor

if TYPE_CHECKING:
    from ...design import Mechanism
    from ...exo.shoulder_exo import ShoulderExo


@checked
class Plant(Record):
    """A device on an arm with its drives: muscles with air and valves, winches, linear actuators, motors in joints.

    Assumptions: the arm is one rigid body that turns about O; drives are those of the design's
    actuators, muscles through their end fittings; muscles and cables never push; the rest are :class:`PlantOptions`.
    A wrist with massless limbs moves by compiled closed forms; any other device, and one with a wearer's moments, a
    payload or a torso that moves, as its closed chain. Both give the same motion.

    Parameters
    ----------
    exo : ShoulderExo, Mechanism or Device
        The device, with an arm, and with drives: muscles whose force law and end fitting are known, cables and linear
        actuators whose strokes and force limits are, or drives with limits of their effort.
    options : PlantOptions, optional
        Air, motors, friction, shoulder unit.
    load : Load, optional
        One constant force on the arm, base frame.
    wearer : callable or sequence of callable
        What the person does: from time in s and :class:`ArmState` to the moment on the arm about O, shape (3,), N m,
        base frame, or to a force at O and that moment (:mod:`exo_pin.control.wearer`). Several add up.
    payloads : Payload or sequence of Payload
        What the arm carries for a time.
    torso : Torso, optional
        How the torso moves, with shoulder and device on it; it stands still if left out.
    cuff, harness : Padding, optional
        How cuff and harness move on the springs of the device's interfaces; rigid if left out.

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

    def __init__(
        self,
        exo: ShoulderExo | Mechanism | Device,
        options: PlantOptions | None = None,
        load: Load | None = None,
        wearer: Wearer | Sequence[Wearer] = (),
        payloads: Payload | Sequence[Payload] = (),
        torso: Torso | None = None,
        cuff: Padding | None = None,
        harness: Padding | None = None,
    ) -> None:
        device = as_device(exo)
        record = device.accelerate("plant")
        self.mechanism = device if record is None else record
        self.options = PlantOptions() if options is None else options
        require_type("options", self.options, PlantOptions, "PlantOptions")
        self.load = load
        chain = None if record is not None else device.as_chain()
        parts = self.mechanism.limbs if chain is None else (*chain.drives, *chain.brakes)
        self.drives = drives_of(parts, self.mechanism.name, self.options)
        self.supply, geometry = supply_of(self.drives, self.options), None if record is None else record.geometry
        self.tables = plant_tables(
            self.mechanism, geometry, self.drives, self.options, load, self.supply, cuff is not None
        )
        self.wearer = (wearer,) if callable(wearer) else tuple(wearer)
        for each in self.wearer:
            require_type("wearer", each, Callable, "functions (t, arm) -> moment")
        self.payloads = (payloads,) if isinstance(payloads, Payload) else tuple(payloads)
        for held in self.payloads:
            require_type("payloads", held, Payload, "Payload records")
        require_type("torso", torso, Torso | None, "a Torso")
        self.torso = torso
        for name, pad in (("cuff", cuff), ("harness", harness)):
            require_type(name, pad, Padding | None, "a Padding")
        #: Of "cuff" and "harness", where they give way.
        self.padding = {name: pad for name, pad in (("cuff", cuff), ("harness", harness)) if pad is not None}
        #: Equations of the closed chain; None where closed forms move the arm.
        self.equations: DeviceEquations | None = None
        more = (self.wearer, self.payloads, torso, self.padding)
        if chain is not None or any(more) or not self.mechanism.limbs_are_massless:
            self.equations = DeviceEquations(device.as_chain(), self.drives, self.tables, *more)
        self.contractions: Contractions | DeviceEquations
        if record is not None:
            self.contractions = Contractions(record)
        else:
            assert self.equations is not None
            self.contractions = self.equations

    @property
    def count(self) -> int:
        """Number of limbs n."""
        return len(self.drives)

    @property
    def motors(self) -> np.ndarray:
        """Whether a limb has a motor, shape (n,), bool; the others have pneumatic muscles."""
        return np.array([drive.is_motor for drive in self.drives], dtype=bool)

    @property
    def units(self) -> tuple[ValveUnit | MotorDrive | DirectDrive, ...]:
        """What a command goes to, one a limb: valves of muscles, motors."""
        motors = MotorDrive | DirectDrive
        return tuple(drive if isinstance(drive, motors) else self.options.valves for drive in self.drives)

    force_limits = force_limits
    drive_states = drive_states

    @property
    def assumptions(self) -> tuple[Assumption, ...]:
        """Every parameter that the source does not print, with its value and basis."""
        return assumptions_of(self.mechanism, self.drives, self.options)

    def state(
        self,
        poses: Rotation | None = None,
        angular_velocity: ArrayLike = (0.0, 0.0, 0.0),
        pressures: ArrayLike | None = None,
        drive_positions: ArrayLike | None = None,
    ) -> PlantState:
        """A state to start from at time zero, with motors at rest and friction without load.

        Parameters
        ----------
        poses : Rotation, optional
            {O_B} to {O_A}; the identity if left out, an arm that hangs.
        angular_velocity : array_like
            Shape (3,), rad/s, base frame.
        pressures : array_like, optional
            Gauge pressures, shape (n,), Pa; a number is for all muscles. Zero if left out.
        drive_positions : array_like, optional
            Lengths that the motor drives let out, shape (n,), m; those of the limbs without tension if left out.

        Returns
        -------
        PlantState

        Raises
        ------
        InvalidInput
            If something is not usable.

        Examples
        --------
        >>> exo = ep.load("prototype")
        >>> start = ep.Plant(exo).state(exo.pose(flexion=20), pressures=1e5)
        >>> start.pressures.tolist(), start.time  # Pa in each muscle; s
        ([100000.0, 100000.0, 100000.0], 0.0)
        """
        given = as_finite("pressures", 0.0 if pressures is None else pressures, (), stack=True)
        if given.shape not in ((), (self.count,)):
            raise InvalidInput(f"expected {self.count} pressures, one a limb, got shape {given.shape}")
        if (given < 0.0).any():
            raise InvalidInput(f"expected gauge pressures of zero or more, in Pa, got {given}")
        pose = as_single_rotation("poses", Rotation.identity() if poses is None else poses)
        out = self.contractions.lengths(pose) if drive_positions is None else drive_positions
        out = np.where(self.motors, as_finite("drive_positions", out, (self.count,)), 0.0)
        n, drives = self.count, DriveSchedule(self.units)
        state = PlantState(
            time=0.0, quaternion=pose.as_quat(), angular_velocity=as_finite("angular_velocity", angular_velocity, (3,)),
            pressures=np.where(self.motors, 0.0, given), drive_positions=out, drive_speeds=np.zeros(n),
            drive_friction=np.zeros(n), shoulder_friction=np.zeros(3), supply_pressure=self.tables.air[1] - ATMOSPHERE,
            commands=drives.commands, pulses=drives.pulses, integrals=np.zeros(4 * n + 3), step=FIRST_STEP,
        )  # fmt: skip
        return state if self.equations is None else replace(state, chain=started(self.equations, state))

    def rest(
        self, pressures: ArrayLike = 0.0, near: Rotation | None = None, drive_positions: ArrayLike | None = None
    ) -> PlantState:
        """The state of rest at constant pressures and with motors that stand still.

        It is a stable equilibrium: that of a wrist in closed form where a damped motion from ``near`` leads, that of
        another device where short steps along the forces do. Friction is left out, so with friction the plant may rest
        elsewhere, too.

        Parameters
        ----------
        pressures : array_like
            Gauge pressures, shape (n,), Pa; a number is for all muscles.
        drive_positions : array_like, optional
            As for :meth:`state`.
        near : Rotation, optional
            Where the motion starts; the arm hanging if left out.

        Returns
        -------
        PlantState

        Raises
        ------
        InvalidInput
            If something is not usable.
        SolverFailed
            If the motion does not end.

        Examples
        --------
        >>> plant = ep.Plant(ep.load("prototype"))
        >>> ep.shoulder_angles(plant.rest().orientation, degrees=True).round(1)
        array([13. , -5.4,  0.6])
        """
        return rest_of(self, self.state(near, pressures=pressures, drive_positions=drive_positions))

    def held(self, poses: Rotation, tensions: ArrayLike) -> PlantState:
        """The state of rest in a pose, with the drives where they hold tensions.

        Parameters
        ----------
        poses : Rotation
            Single, {O_B} to {O_A}.
        tensions : array_like
            Shape (n,), N. Whether they balance the arm is not checked.

        Returns
        -------
        PlantState

        Raises
        ------
        InvalidInput
            If something is not usable.

        Examples
        --------
        >>> exo = ep.load("four-cables")
        >>> state = ep.Plant(exo).held(exo.pose(abduction=40), [30.0, 20.0, 20.0, 30.0])
        >>> ep.shoulder_angles(state.orientation, degrees=True).round(6) + 0.0
        array([ 0., 40.,  0.])
        """
        pose = self.state(poses).orientation
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
            Of a device that moves as a chain :meth:`state`: the arm hanging.
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
        usual = self.rest if self.equations is None else self.state
        warn_of_stiff_drives(self)
        start = self._of_this_plant("state0", usual() if state0 is None else state0)
        require_type("controller", controller, Callable, "a function (t, measurement) -> commands")
        if sensor is not None:
            require_type("sensor", sensor, Callable, "a function (t, measurement) -> measurement")
        given = {"control_rate": control_rate, "sample_rate": control_rate if sample_rate is None else sample_rate}
        control, sample = (as_positive(name, rate) for name, rate in given.items())
        end = end_time(start.time, as_positive("duration", duration), control, sample)
        every = as_faults(faults, self.motors.tolist(), end)
        instants = run_instants(start.time, end, control, sample, [*every, *self._sudden])
        return PlantSimulation(self, controller, instants, start, every, sensor, rtol).run(progress)

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
        events = {t for t in events_of([*every, *self._sudden]) if start + SAME < t < end - SAME}
        instants = [RunInstant(start, control=True), *map(RunInstant, sorted(events)), RunInstant(end, sample=True)]
        motion = PlantSimulation(self, lambda t, seen: held, instants, state, every, None, rtol)
        # A sensor takes no part in a step.
        return replace(motion.stepped(), sensor=state.sensor)

    @property
    def _sudden(self) -> list[Any]:
        """What begins and ends besides faults."""
        return [*self.payloads, *self.wearer, self.torso and self.torso.acceleration]

    def _of_this_plant(self, name: str, state: PlantState) -> PlantState:
        if not isinstance(state, PlantState) or len(state.pressures) != self.count:
            raise InvalidInput(f"expected {name} to be a PlantState of {self.count} limbs, got {echo(state)}")
        if len(state.chain) != (0 if self.equations is None else self.equations.size):
            raise InvalidInput(f"expected {name} of this plant, got that of one with other joints, wearer or payloads")
        return state

    def __repr__(self) -> str:
        return f"<Plant {self.mechanism.name!r}: {self.count} limbs>"
