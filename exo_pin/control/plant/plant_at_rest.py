"""What a plant is made of, and its states at rest."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.records import Record
from ...core.validation import FloatArray, as_finite, as_single_rotation, require_type
from ...device import as_device
from ...load_case import Load
from ...load_case.pose_stacks import require_massless
from ...muscle.valve.flow import ATMOSPHERE, ValveUnit
from .assumptions import Assumption, assumptions_of
from .contraction import Contractions
from .drives import MotorDrive, drives_of
from .equations.muscle_kernels import pressures_for, static_tensions
from .options import PlantOptions
from .plant_tables import plant_tables, supply_of
from .simulation.drive_schedule import DriveSchedule
from .simulation.settling import settled
from .state import FIRST_STEP, PlantState, equations_state

if TYPE_CHECKING:
    from ...design import Mechanism
    from ...exo.shoulder_exo import ShoulderExo


class DriveStates(NamedTuple):
    """States of n drives at rest.

    Attributes
    ----------
    pressures : ndarray
        Shape (n,), gauge, Pa; zero for motors.
    positions : ndarray
        Shape (n,), length that a motor drive lets out, m; zero for muscles.
    """

    pressures: FloatArray
    positions: FloatArray


class PlantAtRest(Record):
    """Parts and states of :class:`Plant`, which moves them."""

    def __init__(
        self, exo: ShoulderExo | Mechanism, options: PlantOptions | None = None, load: Load | None = None
    ) -> None:
        mechanism = as_device(exo).accelerate("plant")
        if mechanism is None:
            raise InvalidInput(f"expected a wrist of limbs, whose drives a plant moves, got the device {exo.name!r}")
        require_massless(mechanism)
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

    def force_limits(self, lengths: ArrayLike, slack: bool = False) -> tuple[FloatArray, FloatArray]:
        """Least and greatest tension at rest at limb lengths in m, shape (n,) each, N; strokes do not count.

        Of muscles those without air and at the supply's pressure; of motors those of the design. Cables are kept taut
        by the least tension of their drives if they can be, unless ``slack`` allows them to be without.

        Parameters
        ----------
        lengths : array_like
            Shape (n,), m.
        slack : bool
            Whether cables may be without tension.

        Returns
        -------
        tuple of ndarray
            Least and greatest, shape (n,), N.

        Raises
        ------
        InvalidInput
            If lengths are not finite, or not one a limb.

        Examples
        --------
        >>> exo = ep.load("three-linear-actuators")
        >>> least, greatest = ep.Plant(exo).force_limits(exo.inverse_kinematics(exo.pose(flexion=45)).lengths)
        >>> least, greatest  # N: these push as well
        (array([-400., -400., -400.]), array([400., 400., 400.]))
        """
        least, greatest, given = np.zeros(self.count), np.zeros(self.count), self._each("lengths", lengths)
        if self.supply is not None:
            static_tensions(self.tables.law, self.tables.muscles, given, 0.0, least)
            static_tensions(self.tables.law, self.tables.muscles, given, self.supply.pressure, greatest)
        for i, drive in enumerate(self.drives):
            if isinstance(drive, MotorDrive):
                least[i], greatest[i] = -drive.push_limit, drive.pull_limit
            greatest[i] = max(greatest[i], least[i])
            if drive.least_tension > 0.0 and not slack:
                least[i] = max(least[i], min(drive.least_tension, greatest[i]))
        return least, greatest

    def drive_states(self, lengths: ArrayLike, tensions: ArrayLike) -> DriveStates:
        """Pressures and positions of the drives that hold tensions in N at limb lengths in m, shape (n,) each.

        Drives that cannot pull as much pull no more than they can.

        Parameters
        ----------
        lengths : array_like
            Shape (n,), m.
        tensions : array_like
            Shape (n,), N.

        Returns
        -------
        DriveStates

        Raises
        ------
        InvalidInput
            If lengths or tensions are not finite, or not one a limb.

        Examples
        --------
        >>> exo = ep.load("four-cables")
        >>> plant = ep.Plant(exo)
        >>> lengths = exo.inverse_kinematics(exo.pose(abduction=30)).lengths
        >>> stretch = lengths - plant.drive_states(lengths, np.full(4, 20.0)).positions
        >>> (1e3 * stretch).round(2)  # mm, by 20 N in each cable
        array([0.37, 0.31, 0.34, 0.35])
        """
        pressures, positions = np.zeros(self.count), np.zeros(self.count)
        given, held = self._each("lengths", lengths), self._each("tensions", tensions)
        if self.supply is not None:
            pressures_for(self.tables.law, self.tables.muscles, given, held, self.supply.pressure, pressures)
        for i, drive in enumerate(self.drives):
            if isinstance(drive, MotorDrive):
                pressures[i], positions[i] = 0.0, given[i] - held[i] / drive.stiffness
        return DriveStates(pressures, positions)

    def _each(self, name: str, values: ArrayLike) -> FloatArray:
        """One finite number a limb, as the kernels take them."""
        return np.array(as_finite(name, values, (self.count,)))

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
        return PlantState(
            time=0.0, quaternion=pose.as_quat(), angular_velocity=as_finite("angular_velocity", angular_velocity, (3,)),
            pressures=np.where(self.motors, 0.0, given), drive_positions=out, drive_speeds=np.zeros(n),
            drive_friction=np.zeros(n), shoulder_friction=np.zeros(3), supply_pressure=self.tables.air[1] - ATMOSPHERE,
            commands=drives.commands, pulses=drives.pulses, integrals=np.zeros(4 * n + 3), step=FIRST_STEP,
        )  # fmt: skip

    def rest(
        self, pressures: ArrayLike = 0.0, near: Rotation | None = None, drive_positions: ArrayLike | None = None
    ) -> PlantState:
        """The state of rest at constant pressures and with motors that stand still.

        It is the stable equilibrium that a damped motion from ``near`` leads to. Friction is left out, so with friction
        the plant may rest elsewhere, too.

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
        start = self.state(near, pressures=pressures, drive_positions=drive_positions)
        pose = settled(self.tables, equations_state(start, self.motors), start.orientation)
        return self.state(pose, pressures=start.pressures, drive_positions=start.drive_positions)

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
