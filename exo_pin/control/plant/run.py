"""What a simulation of the plant yields."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.results import Result
from ...core.validation import FloatArray, ReadOnly, as_finite
from ...device import as_device
from ...load_case import Case, CentreOffset, CentrePath, Load, Motion
from ...reaction import Assumptions, ConstraintBounds, GlenoidCone, Limits, Reaction, Split, Weights, solve
from ...reaction.assumptions import Question
from ...reaction.constraints.given_limits import given_forces
from .any_device.arm_actions import ArmBody
from .any_device.padding import displacements
from .arm_wrench import acceleration, carried, cuff_wrench, external_load, needed_moment, posture_of
from .drives import MuscleDrive
from .equations.drive_kernels import MOTOR_COLUMNS
from .run_summary import muscle_cautions, summary
from .state import PlantState, Snapshot

if TYPE_CHECKING:
    from .plant import Plant


#: Two times nearer than this, s, are one.
_SAME = 1e-9
#: Most limbs whose forces a motion determines.
_DETERMINED = 3


@dataclass(frozen=True, eq=False)
class Run(Result, ReadOnly):
    """A motion of the plant, at N instants, with n limbs.

    Work, losses, energy and air count from where the motion began, also in a run that goes on from another's state.
    Lengths, speeds and forces of a drive in a joint are along its coordinate, rad and N m where it turns.

    Attributes
    ----------
    plant : Plant
    times : ndarray
        Shape (N,), s.
    rotations : Rotation
        Stack of shape (N,), {O_B} to {O_A}.
    angular_velocity, angular_acceleration : ndarray
        Shape (N, 3), base frame, rad/s and rad/s².
    pressures : ndarray
        Shape (N, n), gauge, Pa; zero for motors.
    drive_positions, drive_speeds : ndarray
        Shape (N, n), length that each motor drive lets out, m, and its rate, m/s; zero for muscles.
    motor_forces : ndarray
        Shape (N, n), force of each motor along its limb, positive if it pulls in, N; zero for muscles.
    supply_pressure : ndarray
        Shape (N,), of the manifold, gauge, Pa.
    commands : ndarray
        Shape (N, n), last command of the controller to each drive, -1 to 1.
    lengths, length_rates : ndarray
        Shape (N, n), of the limbs between joint centres, m and m/s.
    tensions : ndarray
        Shape (N, n), N; below zero where a linear actuator pushes.
    bladder_contractions : ndarray
        Shape (N, n), m: how much shorter than nominal each muscle is; that of a slack muscle, which hangs in a bow,
        is less than its limb's. Zero for motors.
    friction_moment, stop_moment : ndarray
        Shape (N, 3), N m, of the shoulder's friction and of the ends of its range on the arm, base frame.
    kinetic_energy, potential_energy : ndarray
        Shape (N,), J; the potential is that of weight, load and stops, zero at O.
    tension_work : ndarray
        Shape (N, n), work of the tensions on the arm since the start, J.
    source_work : ndarray
        Shape (N, n), work of the source on the drive since the start, J: of the air (above the atmosphere) on the
        bladders, of the motor on its transmission. Of the air's work the tensions do not get what goes into bladder and
        braid, the difference between the law of forces and that of volumes.
    drive_loss : ndarray
        Shape (N, n), energy that damping and friction within the drives took, J; no part of ``tension_work``.
    stored_energy : ndarray
        Shape (N, n), energy of moving motor drives, stretched limbs and ends of strokes, J; zero for muscles.
    electric_energy : ndarray
        Shape (N, n), J, that each motor took; what one that brakes gives back goes into a resistor and does not count.
    shoulder_loss : ndarray
        Shape (N,), energy that friction and stops of the shoulder took since the start, J.
    wearer_force, wearer_moment : ndarray
        Shape (N, 3), force at O and moment about it of the wearer on the arm, N and N m, base frame.
    link_force : ndarray
        Shape (N, 3), F_s by the equations of the device's links, N, base frame; NaN where they do not determine it.
        Zero for a wrist in closed form.
    chain : ndarray
        Shape (N, size), of a device that moves as a chain; see :attr:`.PlantState.chain`.
    air_used, air_vented : ndarray
        Shape (N,), air from the supply and air to the atmosphere since the start, kg.
    status : str
        "completed", or when and why the motion stopped.
    steps : int
        Of the integrator.
    snapshots : tuple of Snapshot
        N of them, what :meth:`state` is made of.

    Examples
    --------
    >>> plant = ep.Plant(ep.load("prototype"))
    >>> start = plant.state(ep.load("prototype").pose(flexion=40))
    >>> run = plant.simulate(lambda t, seen: [-1.0, -1.0, -1.0], 0.1, start)
    >>> energy = run.kinetic_energy + run.potential_energy + run.shoulder_loss - run.tension_work.sum(axis=1)
    >>> bool(np.ptp(energy) < 1e-5)  # J: none is lost
    True
    """

    plant: Plant
    times: FloatArray
    rotations: Rotation
    angular_velocity: FloatArray
    angular_acceleration: FloatArray
    pressures: FloatArray
    drive_positions: FloatArray
    drive_speeds: FloatArray
    motor_forces: FloatArray
    supply_pressure: FloatArray
    commands: FloatArray
    lengths: FloatArray
    length_rates: FloatArray
    tensions: FloatArray
    bladder_contractions: FloatArray
    friction_moment: FloatArray
    stop_moment: FloatArray
    kinetic_energy: FloatArray
    potential_energy: FloatArray
    tension_work: FloatArray
    source_work: FloatArray
    drive_loss: FloatArray
    stored_energy: FloatArray
    electric_energy: FloatArray
    shoulder_loss: FloatArray
    air_used: FloatArray
    air_vented: FloatArray
    wearer_force: FloatArray
    wearer_moment: FloatArray
    link_force: FloatArray
    chain: FloatArray
    status: str
    steps: int
    snapshots: tuple[Snapshot, ...]

    def state(self, t: float) -> PlantState:
        """The complete state at one of :attr:`times`, before the controller was called there.

        ``plant.simulate(..., state0=run.state(t))`` goes on from there with the same numbers, bit for bit.

        Parameters
        ----------
        t : float
            One of :attr:`times`, s.

        Returns
        -------
        PlantState
            Orientation {O_B} to {O_A}, angular velocity in the base frame, rad/s, gauge pressures, Pa, and drives, m.

        Raises
        ------
        InvalidInput
            If the run was not recorded at ``t``.

        Examples
        --------
        >>> plant = ep.Plant(ep.load("prototype"))
        >>> run = plant.simulate(lambda t, seen: [0.3, 0.0, 0.0], 0.1)
        >>> again = plant.simulate(lambda t, seen: [0.3, 0.0, 0.0], 0.05, run.state(0.05))
        >>> bool((again.tensions[-1] == run.tensions[-1]).all())  # the same motion, bit for bit
        True
        """
        at = float(as_finite("t", t, ()))
        place = int(np.abs(self.times - at).argmin())
        if abs(self.times[place] - at) > _SAME:
            raise InvalidInput(
                f"expected t as one of the times of the run, whose nearest is {self.times[place]:.9g} s, got {at:.9g}; "
                "give simulate a sample_rate that has it"
            )
        return self.snapshots[place].state(self.plant.motors)

    @property
    def contraction_ratios(self) -> FloatArray:
        """From the limbs' lengths, (5-4), shape (N, n); see :class:`Measurement`."""
        return self.plant.contractions.ratios(self.lengths)

    @property
    def in_range(self) -> np.ndarray:
        """Whether each muscle's law was identified in its state, shape (N, n), bool; elsewhere it is extrapolated."""
        inside = np.ones(self.pressures.shape, dtype=bool)
        for i, drive in enumerate(self.plant.drives):
            if isinstance(drive, MuscleDrive):
                strain, pressure = self.bladder_contractions[:, i] / drive.model.length, self.pressures[:, i]
                inside[:, i] = drive.model.validity.contains(strain, pressure, None)
        return inside

    @property
    def cautions(self) -> tuple[str, ...]:
        """Doubts about the muscles: states in which their laws were not identified, pressures above the safe one."""
        return tuple(muscle_cautions(self))

    @property
    def electric_power(self) -> FloatArray:
        """What each motor takes, shape (N, n), W; below zero where it brakes and gives back. Zero for muscles.

        Source: mechanical power, and the loss in the copper, F² v_0/F_0 (:mod:`.equations.drive_kernels`).
        """
        copper, along = (self.plant.tables.motors[:, MOTOR_COLUMNS.index(name)] for name in ("copper", "along"))
        return np.asarray(copper * self.motor_forces**2 + along * self.motor_forces * self.drive_speeds)

    @property
    def slack(self) -> np.ndarray:
        """Whether a limb that only pulls carries nothing, shape (N, n), bool."""
        pulls = np.array([not drive.pushes for drive in self.plant.drives], dtype=bool)
        return np.asarray((self.tensions <= 0.0) & pulls)

    @property
    def configurations(self) -> FloatArray:
        """Of a device that moves as a chain, shape (N, nq), its arm on a ball joint; shape (N, 0) else."""
        return self.chain[:, : 0 if self.plant.equations is None else self.plant.equations.nq]

    @property
    def cuff_displacement(self) -> FloatArray:
        """Of a cuff that gives way, against the arm at the point of its spring, shape (N, 6), m and rad, arm frame."""
        return displacements(self, "cuff")

    @property
    def harness_displacement(self) -> FloatArray:
        """Of a harness that gives way, against the torso, shape (N, 6), m and rad, base frame."""
        return displacements(self, "harness")

    @property
    def wearer_work(self) -> FloatArray:
        """Work of the wearer and of a torso that moves, and energy of payloads caught and dropped, shape (N,), J."""
        return self.chain[:, -3] if self.chain.shape[1] else np.zeros(len(self.times))

    @property
    def joint_loss(self) -> FloatArray:
        """Energy that damping and friction of the device's joints took since the start, shape (N,), J."""
        return self.chain[:, -2] if self.chain.shape[1] else np.zeros(len(self.times))

    @property
    def energy_residual(self) -> FloatArray:
        """Gain of energy less work and loss since the start, shape (N,), J: the integration's own error."""
        energy = self.kinetic_energy + self.potential_energy
        change = energy - self.tension_work.sum(axis=1) - self.wearer_work + self.shoulder_loss + self.joint_loss
        return np.asarray(change - change[0])

    @property
    def drive_energy_residual(self) -> FloatArray:
        """Gain of energy of each motor drive less work and loss since the start, shape (N, n), J; zero for muscles.

        It is the integration's own error; when a limb breaks, the energy of its stretch is lost besides.
        """
        gain = self.stored_energy + self.tension_work + self.drive_loss - self.source_work
        return np.asarray(np.where(self.plant.motors, gain - gain[0], 0.0))

    @property
    def motion(self) -> Motion:
        """Angular velocity and acceleration, for a query at the same orientations."""
        return Motion(self.angular_velocity, self.angular_acceleration)

    def load(self) -> Load:
        """Load on the arm besides weight and drives: given force, payloads, wearer, torso, friction and stops.

        Returns
        -------
        Load
            Base frame; forces are moved to O.

        Examples
        --------
        >>> plant = ep.Plant(ep.load("prototype"))
        >>> run = plant.simulate(lambda t, seen: [-1.0, -1.0, -1.0], 0.1)
        >>> bool(np.allclose(run.load().moment, run.friction_moment + run.stop_moment))  # N m, about O
        True
        """
        tables = self.plant.tables
        force, moment = carried(self, ArmBody(tables.mass, tables.centre, tables.inertia))
        return Load(force + self.wearer_force, moment + self.wearer_moment + self.friction_moment + self.stop_moment)

    needed_moment = property(needed_moment)
    cuff_wrench = property(cuff_wrench)
    external_load = external_load
    summary = summary

    def question(self, rows: Any = slice(None)) -> Question:
        """What this motion asks of :meth:`exo_pin.ShoulderExo.reaction`, at all samples or some of them.

        Parameters
        ----------
        rows : index
            Which samples.

        Returns
        -------
        dict
            Motion and load; the tensions as ``limits``, with more limbs than a motion determines; the configurations as
            ``posture``, of a device with joints that move while the arm rests.

        Examples
        --------
        >>> run = ep.Plant(ep.load("prototype")).simulate(lambda t, seen: [0.3, 0.0, 0.0], 0.1)
        >>> sorted(run.question([0, 1]))
        ['load', 'motion']
        """
        load = self.load()
        query: Question = {
            "motion": Motion(self.angular_velocity[rows], self.angular_acceleration[rows]),
            "load": Load(np.asarray(load.force)[rows], np.asarray(load.moment)[rows]),
        }
        device = self.plant.mechanism
        if self.plant.padding:
            raise InvalidInput("expected a rigid cuff and harness: take shoulder_force and cuff_wrench of the run")
        if self.plant.torso is not None and not device.limbs_are_massless:
            raise InvalidInput(
                "expected a torso at rest, or massless limbs: the query does not know the links' inertia on it"
            )
        if self.plant.count > _DETERMINED or not as_device(device).holds_alone:
            # What an answer lists besides drives and brakes are moments of the wearer, which are part of the load.
            more = device.limb_count - self.plant.count
            query["limits"] = given_forces(self.tensions[rows], more)
        if (posture := posture_of(self, rows)) is not None:
            query["posture"] = posture
        return query

    def reaction(
        self,
        split: str | Split = "spherical",
        constraint_bounds: ConstraintBounds = None,
        centre_offset: CentreOffset | CentrePath | ArrayLike | None = None,
        *,
        limits: Limits | None = None,
        cone: GlenoidCone | None = None,
        weights: Weights | None = None,
    ) -> Reaction:
        """The reaction query along the run: what limbs and shoulder carry in this motion, at every instant.

        Parameters
        ----------
        split, constraint_bounds, centre_offset, limits, cone, weights
            As for :meth:`exo_pin.ShoulderExo.reaction`; motion and load are those of the run.

        Returns
        -------
        Reaction
            Of shape (N,). Its actuator forces are the run's tensions: with three limbs the motion determines them, with
            more they are given as ``limits``, unless others are given or the split takes none.

        Examples
        --------
        >>> plant = ep.Plant(ep.load("prototype"))
        >>> run = plant.simulate(lambda t, seen: [0.3, 0.0, 0.0], 0.1)
        >>> bool(np.allclose(run.reaction().actuator_forces, run.tensions, atol=1e-6))  # N
        True
        """
        law, own = Assumptions(split).law, self.question()
        if limits is None:
            limits = own.get("limits", "design") if law.chooses_tensions else "design"
        case = Case(self.rotations, own["motion"], own["load"], centre_offset, posture=own.get("posture"))
        return solve(self.plant.mechanism, case, Assumptions(law, limits, constraint_bounds, cone, weights))

    @property
    def shoulder_force(self) -> FloatArray:
        """F_s of the run's own tensions and bare muscles, shape (N, 3), N, base frame, of the shoulder on the arm.

        The arm's momentum: F_s = m (a_C - g) - F + Σ T_i s_i. Limbs carry no side force (the split "spherical"). Of a
        device whose links have mass it is that of its links, or of :meth:`reaction` where these do not determine it.
        """
        tables, mechanism = self.plant.tables, self.plant.mechanism
        if self.plant.padding:
            return self.link_force
        if not mechanism.limbs_are_massless:
            return self.link_force if np.isfinite(self.link_force).all() else np.asarray(self.reaction().shoulder_force)
        span = self.rotations.as_matrix() @ tables.platform.T
        directions = (span.transpose(0, 2, 1) - tables.base) / self.lengths[..., None]
        pull = np.einsum("ki,kij->kj", self.tensions, directions)
        return np.asarray(tables.mass * (acceleration(self, tables.centre) - tables.gravity) - self.load().force + pull)
