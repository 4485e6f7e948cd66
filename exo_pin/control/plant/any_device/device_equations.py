"""The plant of any device: its closed chain with the arm, and what drives, springs, shoulder and wearer do to it.

    M a + h = Σ T_i p_i + springs + dampers + moments on the arm + Jᵀλ,      J a = -J̇ v

in the coordinates of the chain's tree, whose arm turns about O (:mod:`exo_pin.chain.dynamics`). p_i is the generalised
force of a unit of the effort of drive i: of a motor in a joint along its coordinate, of a limb's slide against it, of a
cable minus the change of its length. Efforts of muscles, winches and linear actuators are those of
:mod:`exo_pin.control.plant.equations.drive_kernels`. A drive of which nothing but its limits is known
(:class:`.JointMotor`) acts without a spring between; its inertia J is added to that of its coordinate x, and its effort
on the joint is

    T = F - c x' - (F_c + μ |F| + F_brake) z - stops - J x''

Dry friction, also that of joints in the device's file, is elastoplastic, as the muscles'. Springs of the device follow
their laws. A payload is part of the arm while it is held; caught, it takes part in the motion by a plastic impact.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from ....chain.dynamics.equations.equations_of_motion import moving_loops, open_tree
from ....chain.dynamics.integration import Instant, energies_of
from ....chain.dynamics.nonsmooth.projected_motion import Applied, acceleration, response_at
from ....chain.structure.motion_axes import carried_joints, q_slice
from ....core.errors import InvalidInput, SolverFailed
from ....core.validation import FloatArray, as_single_rotation
from ....device import ChainDevice
from ....device.device_model import DeviceModel
from ....device.parts.laws import covered_force
from ....device.parts.routes import PlacedRoute
from ....device.postures import following, postures
from ....load_case.pose_stacks import pose_matrices
from ....numerics.vectors import matrix
from ..drives import DirectDrive, LimbDrive, MotorDrive, MuscleDrive
from ..equations.drive_kernels import FLOWS, drive_rates, limb_tension, manifold_rates, motor_energy, motor_force
from ..equations.plant_kernels import Tables, state_places, stop_moment
from ..state import still_tables
from .arm_actions import ArmState, Payload, Wearer
from .direct_motors import DirectMotors, bristle_rates, slips
from .moving_torso import Torso, TorsoState, carried_along

_INTACT, _EFFORT, _POWERED = (FLOWS.index(name) for name in ("intact", "effort", "powered"))
#: Displacement over which dry friction of a joint builds up, rad and characteristic lengths.
_PRESLIDING = 2e-3


class Forces(NamedTuple):
    """What acts at an instant, and what follows.

    Attributes
    ----------
    a, tau : ndarray
        Shape (nv,): acceleration, and generalised forces besides weight and what is in the chain's own joints.
    route_force : ndarray
        Shape (3,), N: of cables and springs along routes on the arm, base frame.
    coordinates, rates, efforts, sources : ndarray
        Shape (n,) each: of the drives, m or rad; efforts on the links, and those of motors.
    friction, stops, wearer_force, wearer_moment : ndarray
        Shape (3,): moments of the shoulder's friction and stops on the arm, force and moment about O of the wearer.
    torso : TorsoState or None
        How the base moves.
    """

    a: FloatArray
    tau: FloatArray
    route_force: FloatArray
    coordinates: FloatArray
    rates: FloatArray
    efforts: FloatArray
    sources: FloatArray
    friction: FloatArray
    stops: FloatArray
    wearer_force: FloatArray
    wearer_moment: FloatArray
    torso: TorsoState | None


class DeviceEquations:
    """The equations of a device; see the module.

    Parameters
    ----------
    device : ChainDevice
        With an arm.
    drives : sequence of LimbDrive
        Of its drives, then its brakes.
    tables : Tables
        Of drives, shoulder and load.
    wearer : sequence of callable
        Moments of the wearer.
    payloads : sequence of Payload
        What the arm carries besides.
    torso : Torso, optional
        How the base moves.
    """

    def __init__(
        self,
        device: ChainDevice,
        drives: Sequence[LimbDrive],
        tables: Tables,
        wearer: Sequence[Wearer] = (),
        payloads: Sequence[Payload] = (),
        torso: Torso | None = None,
    ) -> None:
        # A model of its own: inertias of motors and payloads are added to it.
        self.model, self.drives, self.tables = DeviceModel(device), tuple(drives), tables
        self.wearer, self.payloads, self.torso = tuple(wearer), tuple(payloads), torso
        state = self.state = self.model.held
        self.count, self.nv, self.nq = len(drives), state.nv, state.nq
        self._bodies = carried_joints(state.model)
        #: Force of a tension of 1 N of each route on the arm where it was read last, base frame.
        self._pulls: dict[int, FloatArray] = {}
        self._owners = np.concatenate([np.full(state.model.nvs[k], k) for k in range(1, state.model.njoints)])
        self._places = [self._place(place) for _, place in self.model.drives]
        self._springs = [(spring, self._place(place)) for spring, place in self.model.springs]
        self._zero = np.array([part.zero_length for part, _ in self.model.drives])
        direct = [i for i, drive in enumerate(drives) if drive.is_direct]
        self.limbs = [i for i in range(self.count) if i not in direct]
        self.direct = np.array(direct, dtype=int)
        self._constant = np.zeros((self.nv, self.count))
        #: Along its effort a drive's coordinate grows (1) or shrinks (-1).
        self.signs = np.full(self.count, -1.0)
        for i, place in enumerate(self._places):
            if isinstance(place, PlacedRoute):
                continue
            if drives[i].is_direct and drives[i].of_joint:  # type: ignore[attr-defined]
                self.signs[i] = 1.0
            self._constant[place, i] = self.signs[i]
        motors = [drive for drive in drives if isinstance(drive, DirectDrive)]
        self._motors = DirectMotors(motors, [self._places[i] for i in direct], state.model)
        lower, upper = state.passive.dry_friction
        self.rubbing = np.flatnonzero(upper - lower > 0.0)
        self._rub = lower[self.rubbing], upper[self.rubbing]
        self._rub_over = np.where(state.topology.metres[self.rubbing], state.topology.length, 1.0) * _PRESLIDING
        self._arm = state.model.inertias[self.model.arm].copy()
        #: Payloads that the arm holds.
        self.carried: tuple[int, ...] = ()
        self._loaded = bool(self.wearer or tables.force.any() or tables.shoulder[[0, 1, 3]].any())
        self.size = self.nq + self.nv + len(self.rubbing) + 3

    def still(self, damping: float) -> DeviceEquations:
        """The same without friction, with drives that stand still and a viscous moment in the shoulder, N m s/rad."""
        own = still_tables(self.tables, damping)
        return DeviceEquations(self.model.device, self.drives, own, self.wearer, self.payloads, self.torso)

    def moved(self, q: FloatArray, step: FloatArray) -> FloatArray:
        """A configuration after a step of all joints, shape (nv,)."""
        return np.asarray(pin.integrate(self.state.model, q, step))

    def lengths(self, poses: Rotation) -> FloatArray:
        """Coordinates of the drives in poses of shape (...), shape (..., n), m or rad.

        Raises
        ------
        InvalidInput
            If a pose is out of reach.
        """
        shape, matrices = pose_matrices(poses)
        found = postures(self.model, matrices)
        if not found.reached.all():
            raise InvalidInput("expected poses that the device reaches from rest: its loops do not close in one")
        return np.array([self.coordinates(q) for q in found.q]).reshape(*shape, self.count)

    def ratios(self, lengths: FloatArray) -> FloatArray:
        """Contraction ratios (5-4) of muscles; of other drives what their range lacks, as a share of it.

        Of a drive without ends it is the coordinate itself.

        Parameters
        ----------
        lengths : ndarray
            Coordinates of the drives, shape (..., n), m or rad.
        """
        high = np.array(
            [drive.taut_length if isinstance(drive, MuscleDrive) else drive.longest for drive in self.drives]
        )
        ends = np.isfinite(high) & np.isfinite(self.nominal)
        span = np.where(ends, self.nominal, 1.0)
        return np.where(ends, (np.where(ends, high, 0.0) - lengths) / span, lengths)

    @property
    def nominal(self) -> FloatArray:
        """Lengths by which contractions are divided, shape (n,): of a muscle, times its tackle's ratio; of a range."""
        own = [d.ratio * d.model.length if isinstance(d, MuscleDrive) else d.longest - d.shortest for d in self.drives]
        return np.array(own, dtype=float)

    def _place(self, place: PlacedRoute | int) -> PlacedRoute | int:
        """A route, or where a joint of the free tree stands in v of this one."""
        if isinstance(place, PlacedRoute):
            return place
        return int(self.model.v_from[int(np.flatnonzero(self.model.v_of == place)[0])])

    def configuration(self, poses: Rotation) -> FloatArray:
        """The closed configuration of the tree in a pose, shape (nq,), on the straight turn from rest.

        Raises
        ------
        InvalidInput
            If the pose is out of reach.
        """
        found = postures(self.model, as_single_rotation("poses", poses).as_matrix()[None])
        if not found.reached[0]:
            raise InvalidInput("expected a pose that the device reaches from rest: its loops do not close there")
        return np.asarray(found.q[0])

    def following(self, q: FloatArray, arm: FloatArray, opening: FloatArray | None = None) -> FloatArray:
        """Motion of all joints for one of the arm in its own axes; see :func:`exo_pin.device.postures.following`."""
        return following(self.model, q, arm, opening)

    def coordinates(self, q: FloatArray) -> FloatArray:
        """Of the drives, lengths of limbs and cables or angles, shape (n,), m or rad; fills the tree's poses."""
        self.state.buffers.linearise(q)
        return self._read(q)

    def _read(self, q: FloatArray) -> FloatArray:
        poses = self.state.buffers.poses
        return self._zero + np.array([self._coordinate(place, q, poses) for place in self._places])

    def _coordinate(self, place: PlacedRoute | int, q: FloatArray, poses: FloatArray) -> float:
        if isinstance(place, PlacedRoute):
            return float(place.length(poses))
        own = q[self._q_slices[place]]
        return float(own[0]) if len(own) == 1 else float(np.arctan2(own[1], own[0]))

    @cached_property
    def _q_slices(self) -> list[slice]:
        return [q_slice(self.state.model, int(owner)) for owner in self._owners]

    def columns(self) -> FloatArray:
        """p of every drive, shape (nv, n), where the tree was linearised last."""
        found = self._constant
        for i, place in enumerate(self._places):
            if isinstance(place, PlacedRoute):
                found = found.copy() if found is self._constant else found
                found[:, i] = self._generalised(place)
        return found

    def _generalised(self, place: PlacedRoute) -> FloatArray:
        """Generalised force of a tension of 1 N along a route."""
        work = self.state.buffers
        wrenches = self._bodies @ place.wrenches(work.poses)
        self._pulls[id(place)] = wrenches[self.model.arm, :3]
        return np.asarray(np.einsum("ci,ci->c", work.J, wrenches[self._owners]))

    def springs(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Generalised force of the device's springs, shape (nv,), and their force on the arm, where linearised last.

        Raises
        ------
        SolverFailed
            If the law of one does not cover where it is.
        """
        out, pull, poses = np.zeros(self.nv), np.zeros(3), self.state.buffers.poses
        for spring, place in self._springs:
            x = self._coordinate(place, q, poses)
            force = float(covered_force(spring.law, x))
            if not np.isfinite(force):
                raise SolverFailed("the motion", np.inf, f"spring {spring.name!r} has no data at {x:.4g}")
            if isinstance(place, PlacedRoute):
                out += force * self._generalised(place)
                pull = pull + force * self._pulls[id(place)]
            else:
                out[place] -= force
        return out, pull

    def held(self, time: float, before: bool = False) -> tuple[int, ...]:
        """Payloads that the arm holds just after a time in s, or before it."""
        return tuple(i for i, own in enumerate(self.payloads) if own.is_held(time, before))

    def carry(self, held: tuple[int, ...]) -> None:
        """Let the arm hold these payloads."""
        if held == self.carried:
            return
        whole = self._arm.copy()
        for i in held:
            whole += pin.Inertia(self.payloads[i].mass, np.array(self.payloads[i].at), np.zeros((3, 3)))
        for tree in (self.state.model, self.model.free.model):
            tree.inertias[self.model.arm] = whole
        self.carried = held

    def caught(self, held: tuple[int, ...], q: FloatArray, v: FloatArray) -> FloatArray:
        """Let the arm hold these payloads; the velocity after the impact with those that were at rest."""
        new = [self.payloads[i] for i in held if i not in self.carried]
        self.carry(held)
        if not new or not v.any():
            return v
        arm, push = self.model.arm_v, np.zeros(self.nv)
        for own in new:
            at = np.array(own.at)
            push[arm] -= np.cross(at, own.mass * np.cross(v[arm], at))
        motion = response_at(self.state, q)
        return np.asarray(v + motion.response @ (motion.response.T @ push))

    def wearer_action(self, t: float, R: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Force at O and moment about it of the wearer, N and N m, base frame."""
        force, moment, arm = np.zeros(3), np.zeros(3), ArmState(R, w)
        for action in self.wearer:
            found = action(t, arm)
            if isinstance(found, tuple):
                force, moment = force + found[0], moment + found[1]
            else:
                moment = moment + found
        if not np.isfinite(moment).all():
            raise SolverFailed("the motion", np.inf, "a moment of the wearer is not finite")
        return force, moment

    def rates(
        self, t: float, q: FloatArray, v: FloatArray, y: FloatArray, bristles: FloatArray, flows: FloatArray
    ) -> tuple[Forces, FloatArray, FloatArray]:
        """What acts at an instant; rates of the drives' state, and of bristles, wearer's work and loss in the joints.

        Parameters
        ----------
        t : float
            s.
        q, v : ndarray
            Of the tree.
        y : ndarray
            State of the equations of limbs (:data:`.plant_kernels.STATE`), whose first six numbers do not count.
        bristles : ndarray
            Of the joints with dry friction, -1 to 1.
        flows : ndarray
            What acts on the drives, shape (n, len(FLOWS)).
        """
        n, tables, work = self.count, self.tables, self.state.buffers
        work.jacobian_rates(q, v)
        self._pulls.clear()
        P, x = self.columns(), self._read(q)
        xd = self.signs * (P.T @ v)
        R = self.rotation(q)
        w = R @ v[self.model.arm_v]
        out, T, F, drawn, let_out = np.zeros(len(y)), np.zeros(n), np.zeros(n), 0.0, 0.0
        for i in self.limbs:
            T[i], filled, vented = drive_rates(tables, flows, i, y, float(xd[i]), float(x[i]), out)
            drawn, let_out = drawn + filled, let_out + vented
        if self.limbs:
            manifold_rates(tables, y, drawn, let_out, out)
        direct, loss = self.direct, None
        if len(direct):
            along, z = self.signs[direct] * xd[direct], y[6 + n + direct]
            T[direct], F[direct], out[6 + n + direct], loss = self._motors.efforts(
                x[direct], along, self.signs[direct], z, flows[direct]
            )
        joint, stop, taken, friction = tables.shoulder, np.zeros(3), 0.0, np.zeros(3)
        if joint[3] > 0.0:
            found, taken, _ = stop_moment(matrix(R), tuple(w.tolist()), *joint[4:9].tolist())
            stop = np.array(found)
        if joint[0] or joint[1]:
            z, turning = y[6 + 2 * n : 9 + 2 * n], math.sqrt(float(w @ w))
            slipping = slips(float(w @ z), math.sqrt(float(z @ z))) * turning
            out[6 + 2 * n : 9 + 2 * n] = (w - slipping * z) / joint[2]
            friction = -joint[0] * w - joint[1] * z
            taken -= float(friction @ w)
        out[10 + 5 * n] = taken
        force, moment = self.wearer_action(t, R, w)
        tau, pull = P @ T, np.zeros(3)
        for i, place in enumerate(self._places):
            pull = pull + T[i] * self._pulls.get(id(place), 0.0)
        if self._springs:
            springs, of_springs = self.springs(q)
            tau, pull = tau + springs, pull + of_springs
        if self._loaded:
            moment_of_load = np.cross(R @ tables.point, tables.force)
            tau[self.model.arm_v] += R.T @ (stop + friction + moment + moment_of_load)
        more = np.zeros(len(self.rubbing) + 2)
        if len(self.rubbing):
            low, high = self._rub
            own, bound = v[self.rubbing], np.where(bristles > 0.0, high, -low)
            tau[self.rubbing] -= bound * bristles
            more[:-2] = bristle_rates(own, bristles, self._rub_over)
            more[-1] = float(bound * bristles @ own)
        moving, push = None if self.torso is None else self.torso.at(t, tables.gravity), np.zeros(self.nv)
        if moving is not None:
            push = carried_along(self.state, self.model.centre, self._bodies, self._owners, moving)
        tau = tau + push
        more[-2], more[-1] = float(moment @ w + push @ v), more[-1] + self.state.passive.loss(v)
        a = acceleration(self.state, q, v, Applied(tau, None))
        if loss is not None:
            T[direct] -= self._motors.inertia * self.signs[direct] * a[self._motors.places]
            out[10 + 2 * n + direct], out[10 + 3 * n + direct] = T[direct] * along, F[direct] * along
            out[10 + 4 * n + direct] = loss
            out[13 + 6 * n + direct] = np.maximum(F[direct] * along + self._motors.copper * F[direct] ** 2, 0.0)
        return Forces(a, tau, pull, x, xd, T, F, friction, stop, force, moment, moving), out, more

    def shoulder_force(self, q: FloatArray, v: FloatArray, found: Forces) -> FloatArray:
        """F_s in a motion, shape (3,), N, base frame; NaN where equilibrium of the links does not determine it.

        The same tree with an arm that flies free needs it besides the forces of the loops, which its other rows give.
        """
        model, free, R = self.model, self.model.free, self.rotation(q)
        own, motion = model.free_configuration(q), model.free_motion(np.array([v, found.a]))
        free.buffers.jacobian_rates(own, motion[0])
        moving_loops(free, own, motion[0])
        left = open_tree(free, own, motion[0], motion[1], None)
        J = free.buffers.jacobian * free.topology.row_scale[:, None]
        tau = np.zeros(free.nv)
        tau[model.v_of], tau[model.angular] = found.tau[model.v_from], found.tau[model.arm_v]
        tau[model.linear] = R.T @ (found.route_force + found.wearer_force + self.tables.force)
        if found.torso is not None:
            along = carried_along(free, model.centre, model.carried, model.owners, found.torso)
            tau[model.linear] += along[model.linear]
        left -= tau
        scale = free.topology.column
        loops, _, rank, _ = np.linalg.lstsq((J * scale).T[model.rest], (left * scale)[model.rest], rcond=1e-9)
        if rank < free.row_count:
            return np.full(3, np.nan)
        return np.asarray(R @ (left - J.T @ loops)[model.linear])

    def energies(self, q: FloatArray, v: FloatArray, rates: FloatArray) -> tuple[float, float]:
        """Kinetic energy without that of motors, and potential of weight, springs, load and stops, J."""
        whole, kinetic = energies_of(self.state, Instant(q, v, 0.0, 0.0))
        self.state.buffers.linearise(q)
        poses = self.state.buffers.poses
        springs = sum(float(own.law.energy(self._coordinate(place, q, poses))) for own, place in self._springs)
        R, tables, joint = self.rotation(q), self.tables, self.tables.shoulder
        stop = stop_moment(matrix(R), (0.0, 0.0, 0.0), *joint[4:9].tolist())[2] if joint[3] > 0.0 else 0.0
        own = 0.5 * float(self._motors.inertia @ rates[self.direct] ** 2)
        return kinetic - own, whole - kinetic + springs + stop - float(tables.force @ (R @ tables.point))

    def rotation(self, q: FloatArray) -> FloatArray:
        """Of the arm, shape (3, 3)."""
        return np.array(pin.Quaternion(q[self.model.arm_q]).matrix())

    def limb_numbers(self, found: Forces, y: FloatArray, flows: FloatArray) -> FloatArray:
        """Length, rate, tension, contraction, force of the motor and energy stored in each drive, shape (n, 6)."""
        out, tables = np.zeros((self.count, 6)), self.tables
        out[:, 0], out[:, 1], out[:, 2], out[:, 4] = found.coordinates, found.rates, found.efforts, found.sources
        places = state_places(self.count)
        for i in self.limbs:
            length, rate = float(out[i, 0]), float(y[places["drive_speeds"]][i])
            out[i, 3] = limb_tension(tables, i, y, float(out[i, 1]), length)[1]
            if isinstance(self.drives[i], MotorDrive):
                row = tables.motors[i]
                out[i, 4] = flows[i, _POWERED] * motor_force(row, flows[i, _EFFORT], -rate)
                out[i, 5] = motor_energy(row, length, y[places["drives"]][i], rate, flows[i, _INTACT])
        if len(self.direct):
            own = self.direct
            out[own, 5] = (
                self._motors.stops(out[own, 0], out[own, 1])[2] + 0.5 * self._motors.inertia * out[own, 1] ** 2
            )
        return out
