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
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

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
from ..drives import DirectDrive, LimbDrive, MuscleDrive
from ..equations.drive_kernels import FLOWS, drive_rates, manifold_rates, slip
from ..equations.plant_kernels import Tables, stop_moment
from ..state import still_tables
from .arm_actions import ArmState, Payload, Torso, TorsoState, Wearer, acting, carried_along
from .direct_motors import DirectMotors, bristle_rates
from .padding import Padding, Pads

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
    padding : mapping of str to Padding, optional
        Of "cuff" and "harness", where they give way.
    """

    def __init__(
        self,
        device: ChainDevice,
        drives: Sequence[LimbDrive],
        tables: Tables,
        wearer: Sequence[Wearer] = (),
        payloads: Sequence[Payload] = (),
        torso: Torso | None = None,
        padding: Mapping[str, Padding] | None = None,
    ) -> None:
        # A model of its own: inertias of motors and payloads are added to it.
        self.device, self.drives, self.tables, self.padding = device, tuple(drives), tables, padding or {}
        self.pads = Pads(device, self.padding) if padding else None
        self.model = DeviceModel(device) if self.pads is None else self.pads.model
        self.wearer, self.payloads, self.torso = tuple(wearer), tuple(payloads), torso
        state = self.state = self.model.held
        self.count, self.nv, self.nq = len(drives), state.nv, state.nq
        self._bodies = carried_joints(state.model)
        #: Force of a tension of 1 N of each route on the arm where it was read last, base frame.
        self._pulls: dict[int, FloatArray] = {}
        self._owners = np.concatenate([np.full(state.model.nvs[k], k) for k in range(1, state.model.njoints)])
        self._places = [self._place(place) for _, place in self.model.drives]
        self.elastic = [(spring, self._place(place)) for spring, place in self.model.springs]
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
            if getattr(drives[i], "of_joint", False):
                self.signs[i] = 1.0
            self._constant[place, i] = self.signs[i]
        motors = [drive for drive in drives if isinstance(drive, DirectDrive)]
        self.motors = DirectMotors(motors, [self._places[i] for i in direct], state.model)
        # The tree with the free arm, which the forces on cuff and shoulder come from, turns the same rotors.
        self.model.free.model.armature[self.model.v_of] = state.model.armature[self.model.v_from]
        lower, upper = state.passive.dry_friction
        self.rubbing = np.flatnonzero(upper - lower > 0.0)
        self._rub = lower[self.rubbing], upper[self.rubbing]
        self._rub_over = np.where(state.topology.metres[self.rubbing], state.topology.length, 1.0) * _PRESLIDING
        self._arm = state.model.inertias[self.model.arm].copy()
        #: Payloads that the arm holds.
        self.carried: tuple[int, ...] = ()
        self._loaded = bool(self.wearer or tables.force.any() or tables.shoulder[[0, 1, 3]].any())
        self.size = self.nq + self.nv + len(self.rubbing) + 3

    def still(self) -> DeviceEquations:
        """The same without friction, with drives that stand still."""
        own = still_tables(self.tables, 0.0)
        return DeviceEquations(self.device, self.drives, own, self.wearer, self.payloads, self.torso, self.padding)

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
        own, found = self._reached(matrices)
        return np.array([self.coordinates(own(q)) for q in found]).reshape(*shape, self.count)

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
        own, found = self._reached(as_single_rotation("poses", poses).as_matrix()[None])
        return np.asarray(own(found[0]))

    def started(self, poses: Rotation, angular_velocity: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The configuration in a pose, and the least motion of all joints for an angular velocity, base frame."""
        R = as_single_rotation("poses", poses).as_matrix()
        own, found = self._reached(R[None])
        pads, turning = self.pads, R.T @ angular_velocity
        v = self.following(found[0], turning) if pads is None else pads.following(found[0], turning)
        return own(found[0]), v

    def _reached(self, matrices: FloatArray) -> tuple[Callable[[FloatArray], FloatArray], FloatArray]:
        """Configurations of the rigid device, and what makes them those of the tree.

        Raises
        ------
        InvalidInput
            If a pose is out of reach.
        """
        pads = self.pads
        found = postures(self.model if pads is None else pads.rigid, matrices)
        if not found.reached.all():
            raise InvalidInput("expected poses that the device reaches from rest: its loops do not close in one")
        return np.asarray if pads is None else pads.undisplaced, found.q

    def following(self, q: FloatArray, arm: FloatArray, opening: FloatArray | None = None) -> FloatArray:
        """Motion of all joints for one of the arm in its own axes; see :func:`exo_pin.device.postures.following`."""
        return following(self.model, q, arm, opening)

    def coordinates(self, q: FloatArray) -> FloatArray:
        """Of the drives, lengths of limbs and cables or angles, shape (n,), m or rad; fills the tree's poses."""
        self.state.buffers.linearise(q)
        return self._read(q)

    def _read(self, q: FloatArray) -> FloatArray:
        poses = self.state.buffers.poses
        return self._zero + np.array([self.coordinate(place, q, poses) for place in self._places])

    def coordinate(self, place: PlacedRoute | int, q: FloatArray, poses: FloatArray) -> float:
        """Length of a route, m, or coordinate of a joint, m or rad, with the tree's poses."""
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
        for spring, place in self.elastic:
            x = self.coordinate(place, q, poses)
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
        if not new:
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
            push, turn = acting(action(t, arm))
            force, moment = force + push, moment + turn
        if not (np.isfinite(moment).all() and np.isfinite(force).all()):
            raise SolverFailed("the motion", np.inf, "a force or moment of the wearer is not finite")
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
            T[direct], F[direct], out[6 + n + direct], loss = self.motors.efforts(
                x[direct], along, self.signs[direct], z, flows[direct]
            )
        joint, stop, taken, friction = tables.shoulder, np.zeros(3), 0.0, np.zeros(3)
        if joint[3] > 0.0:
            found, taken, _ = stop_moment(matrix(R), tuple(w.tolist()), *joint[4:9].tolist())
            stop = np.array(found)
        if joint[0] or joint[1]:
            z, turning = y[6 + 2 * n : 9 + 2 * n], math.sqrt(float(w @ w))
            slipping = slip.plain(float(w @ z), math.sqrt(float(z @ z))) * turning
            out[6 + 2 * n : 9 + 2 * n] = (w - slipping * z) / joint[2]
            friction = -joint[0] * w - joint[1] * z
            taken -= float(friction @ w)
        out[10 + 5 * n] = taken
        force, moment = self.wearer_action(t, R, w)
        tau, pull = P @ T, np.zeros(3)
        for i, place in enumerate(self._places):
            pull = pull + T[i] * self._pulls.get(id(place), 0.0)
        if self.elastic:
            springs, of_springs = self.springs(q)
            tau, pull = tau + springs, pull + of_springs
        damped = 0.0 if self.pads is None else self.pads.forces(q, v, tau)
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
        more[-2], more[-1] = float(moment @ w + push @ v), more[-1] + damped + self.state.passive.loss(v)
        a = acceleration(self.state, q, v, Applied(tau, None))
        if loss is not None:
            T[direct] -= self.motors.inertia * self.signs[direct] * a[self.motors.places]
            out[10 + 2 * n + direct], out[10 + 3 * n + direct] = T[direct] * along, F[direct] * along
            out[10 + 4 * n + direct] = loss
            out[13 + 6 * n + direct] = np.maximum(F[direct] * along + self.motors.copper * F[direct] ** 2, 0.0)
        return Forces(a, tau, pull, x, xd, T, F, friction, stop, force, moment, moving), out, more

    def rotation(self, q: FloatArray) -> FloatArray:
        """Of the arm, shape (3, 3)."""
        return np.array(pin.Quaternion(q[self.model.arm_q]).matrix())
