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
from .any_device.arm_actions import ArmState, arm_loads
from .any_device.padding import displacements
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
        force, moment = self._carried
        return Load(force + self.wearer_force, moment + self.wearer_moment + self.friction_moment + self.stop_moment)

    @property
    def _carried(self) -> tuple[FloatArray, FloatArray]:
        """Force and moment about O of the given force, payloads with inertia, and the torso, shape (N, 3) each."""
        motion = self.rotations.as_matrix(), self.angular_velocity, self.angular_acceleration
        return arm_loads(self.plant, self.times, *motion)

    @property
    def needed_moment(self) -> FloatArray:
        """What device and wearer together put on the arm about O, shape (N, 3), N m, base frame.

        It moves the arm, with the torso, and bears its weight, payloads, the given force, and friction and stops.
        """
        tables, R = self.plant.tables, self.rotations.as_matrix()
        own, along = (np.einsum("kji,kj->ki", R, part) for part in (self.angular_velocity, self.angular_acceleration))
        rate = along @ tables.inertia.T + np.cross(own, own @ tables.inertia.T)
        inertial, weight = np.einsum("kij,kj->ki", R, rate), np.cross(R @ tables.centre, tables.mass * tables.gravity)
        return np.asarray(inertial - weight - self._carried[1] - self.friction_moment - self.stop_moment)

    @property
    def cuff_wrench(self) -> FloatArray:
        """Force of the device on the arm, N, and its moment about O, N m, shape (N, 6), base frame.

        The moment is what the arm needs less what the wearer makes; it depends on no split. The force is that of
        :attr:`shoulder_force`.
        """
        tables, load = self.plant.tables, self.load()
        force = tables.mass * (self._centre_acceleration - tables.gravity) - load.force - self.shoulder_force
        return np.concatenate([force, self.needed_moment - self.wearer_moment], axis=1)

    summary = summary

    @property
    def _centre_acceleration(self) -> FloatArray:
        """Of the arm's centre of mass, shape (N, 3), m/s²."""
        C, w = self.rotations.apply(self.plant.tables.centre), self.angular_velocity
        return np.cross(self.angular_acceleration, C) + np.cross(w, np.cross(w, C))

    def external_load(self, rows: Any = slice(None)) -> Load:
        """What acts on the arm from outside, beside weight, device and wearer: given force, payloads, torso, pushes.

        Parameters
        ----------
        rows : index
            Which samples.

        Returns
        -------
        Load
            Of shape (k,), base frame; forces are moved to O.

        Examples
        --------
        >>> from exo_pin import control
        >>> exo, shove = ep.load("four-cables"), control.Push(ep.Load([20.0, 0.0, 0.0], at=(0.0, 0.0, -0.3)))
        >>> plant = ep.Plant(exo, wearer=shove)
        >>> run = plant.simulate(lambda t, seen: np.full(4, 0.1), 0.02, plant.held(exo.pose(), np.full(4, 40.0)))
        >>> run.external_load().force[0]  # N
        array([20.,  0.,  0.])
        """
        force, moment = (part[rows].copy() for part in self._carried)
        pushes = [action for action in self.plant.wearer if getattr(action, "external", False)]
        states = zip(self.times[rows], self.rotations[rows].as_matrix(), self.angular_velocity[rows], strict=True)
        for k, (t, R, w) in enumerate(states):
            for push in pushes:
                found = push(float(t), ArmState(R, w))
                force[k], moment[k] = force[k] + found[0], moment[k] + found[1]
        return Load(force, moment)

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
        if self.plant.contractions is self.plant.equations and device.structure.idle:
            # Joints that no drive moves are where the run has them, and not at rest there.
            query["posture"] = self.configurations[rows]
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
        return np.asarray(tables.mass * (self._centre_acceleration - tables.gravity) - self.load().force + pull)
