"""The motion of any device in time: what :class:`.MinimalMotion` is for a wrist in closed form.

Steps are those of :mod:`exo_pin.chain.dynamics`: DOP853 on the configuration manifold until stability and not accuracy
bounds them, then collocation at Radau's points, so that stiff drives cost few steps. After each of them the loops are
closed. Every piece of time begins with what :attr:`DeviceMotion.chain` holds and nothing else, so that a motion that is
cut goes on bit for bit. :func:`observed` is what a run reports of it: forces of shoulder and limbs, and energies.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pinocchio as pin

from ....chain.dynamics.equations.equations_of_motion import moving_loops, open_tree
from ....chain.dynamics.implicit import Stiffness
from ....chain.dynamics.integration import Instant, energies_of
from ....chain.kinematics.closing import close
from ....chain.kinematics.loops import project_velocity, refined
from ....core.errors import ExoPinError
from ....core.validation import FloatArray
from ....numerics.vectors import matrix
from ..equations.drive_kernels import FLOWS, limb_numbers
from ..equations.plant_kernels import state_places, stop_moment, tolerances
from ..state import equations_state, first_chain
from .arm_actions import carried_along
from .device_equations import DeviceEquations

if TYPE_CHECKING:
    from ..plant import Plant
    from ..state import PlantState, Snapshot
    from .device_equations import Forces

#: Share of the largest singular value that is none.
_RANK = 1e-9


def shoulder_force(of: DeviceEquations, q: FloatArray, v: FloatArray, found: Forces) -> FloatArray:
    """F_s in a motion, shape (3,), N, base frame; NaN where equilibrium of the links does not determine it.

    The same tree with an arm that flies free needs it besides the forces of the loops, which its other rows give.
    """
    model, free, R = of.model, of.model.free, of.rotation(q)
    own, motion = model.free_configuration(q), model.free_motion(np.array([v, found.a]))
    free.buffers.jacobian_rates(own, motion[0])
    moving_loops(free, own, motion[0])
    left = open_tree(free, own, motion[0], motion[1], None)
    J = free.buffers.jacobian * free.topology.row_scale[:, None]
    tau = np.zeros(free.nv)
    tau[model.v_of], tau[model.angular] = found.tau[model.v_from], found.tau[model.arm_v]
    tau[model.linear] = R.T @ (found.route_force + found.wearer_force + of.tables.force)
    if found.torso is not None:
        along = carried_along(free, model.centre, model.carried, model.owners, found.torso)
        tau[model.linear] += along[model.linear]
    left -= tau
    scale = free.topology.column
    U, sizes, Vt = np.linalg.svd((J * scale).T[model.rest])
    rank = int((sizes > _RANK * sizes.max(initial=0.0)).sum())
    # Loops may stress each other as long as the shoulder does not feel it.
    if np.abs(Vt[rank:] @ J[:, model.linear]).max(initial=0.0) > _RANK * np.abs(J).max(initial=0.0):
        return np.full(3, np.nan)
    loops = Vt[:rank].T @ (U[:, :rank].T @ (left * scale)[model.rest] / sizes[:rank])
    return np.asarray(R @ (left - J.T @ loops)[model.linear])


def energies(of: DeviceEquations, q: FloatArray, v: FloatArray, rates: FloatArray) -> tuple[float, float]:
    """Kinetic energy without that of motors, and potential of weight, springs, padding, load and stops, J."""
    whole, kinetic = energies_of(of.state, Instant(q, v, 0.0, 0.0))
    of.state.buffers.linearise(q)
    poses = of.state.buffers.poses
    springs = sum(float(spring.law.energy(of.coordinate(place, q, poses))) for spring, place in of.elastic)
    R, tables, joint = of.rotation(q), of.tables, of.tables.shoulder
    stop = stop_moment(matrix(R), (0.0, 0.0, 0.0), *joint[4:9].tolist())[2] if joint[3] > 0.0 else 0.0
    own = 0.5 * float(of.motors.inertia @ rates[of.direct] ** 2)
    springs += stop + (0.0 if of.pads is None else of.pads.energy(q))
    return kinetic - own, whole - kinetic + springs - float(tables.force @ (R @ tables.point))


def _limb_numbers(of: DeviceEquations, found: Forces, y: FloatArray, flows: FloatArray) -> FloatArray:
    """Length, rate, tension, contraction, force of the motor and energy stored in each drive, shape (n, 6)."""
    out, tables = np.zeros((of.count, 6)), of.tables
    out[:, 0], out[:, 1], out[:, 2], out[:, 4] = found.coordinates, found.rates, found.efforts, found.sources
    for i in of.limbs:
        _, *out[i, 3:] = limb_numbers(tables, flows, i, y, float(out[i, 1]), float(out[i, 0]))
    if len(of.direct):
        own = of.direct
        ends = flows[own, FLOWS.index("intact")] * of.motors.stops(out[own, 0], out[own, 1])[2]
        out[own, 5] = ends + 0.5 * of.motors.inertia * out[own, 1] ** 2
    return out


def observed(
    of: DeviceEquations,
    snapshots: Sequence[Snapshot],
    flows: FloatArray,
    arrays: tuple[FloatArray, FloatArray, FloatArray],
) -> FloatArray:
    """Fill what :func:`.plant_kernels.observe` fills; force and moment of the wearer, and F_s, shape (N, 9)."""
    (motion, limbs, energy), more = arrays, np.zeros((len(snapshots), 9))
    places: Any = np.cumsum([of.nq, of.nv, len(of.rubbing)])
    for k, now in enumerate(snapshots):
        q, v, bristles, _ = np.split(now.chain, places)
        of.carry(of.held(now.time, before=True))
        found, _, _ = of.rates(now.time, q, v, now.y, bristles, flows[k])
        R = of.rotation(q)
        motion[k] = np.concatenate([R @ found.a[of.model.arm_v], found.friction, found.stops])
        limbs[k] = _limb_numbers(of, found, now.y, flows[k])
        energy[k] = energies(of, q, v, found.rates)
        more[k] = np.concatenate([found.wearer_force, found.wearer_moment, shoulder_force(of, q, v, found)])
    return more


class Piece(NamedTuple):
    """A time in which no valve switches: its ends, s, and the flows, as the equations read them."""

    start: float
    end: float
    flows: FloatArray


#: Step of the derivative of the rates, the shortest step, s, and how far before its end a piece ends for the wearer, s.
_DIFFERENCE, _SHORTEST, _INSIDE = 1e-7, 1e-12, 1e-12


class DeviceMotion:
    """A plant of any device at one instant, which can be moved on.

    Attributes
    ----------
    step, steps : float, int
        The step tried next, s, and the steps taken.
    """

    def __init__(self, plant: Plant, start: PlantState, rtol: float, equations: DeviceEquations | None = None) -> None:
        own = plant.equations if equations is None else equations
        assert own is not None
        self._of: DeviceEquations = own
        self._rtol, self.step, self.steps = rtol, start.step, 0
        self._rate: Any = None
        self._y = equations_state(start, plant.motors)
        places = np.cumsum([own.nq, own.nv, len(own.rubbing), 2])
        q, v, bristles, sums, self._implicit = np.split(start.chain, places)
        self._q, self._v, self._more = q.copy(), v.copy(), np.concatenate([bristles, sums])
        own.carry(own.held(start.time, before=True))
        self._atol = np.concatenate(
            [np.full(2 * own.nv, rtol), tolerances(plant.tables, rtol)[6:], np.full(len(self._more), rtol)]
        )
        self._tell()

    @property
    def chain(self) -> FloatArray:
        """:attr:`.PlantState.chain`."""
        return np.concatenate([self._q, self._v, self._more, self._implicit])

    def _tell(self) -> None:
        """Tell the state of limbs where the arm and the direct drives are."""
        own, places = self._of, state_places(self._of.count)
        self._y[3:6] = own.rotation(self._q) @ self._v[own.model.arm_v]
        if len(own.direct):
            x = own.coordinates(self._q)
            self._y[places["drives"]][own.direct] = x[own.direct]
            self._y[places["drive_speeds"]][own.direct] = (own.signs * (own.columns().T @ self._v))[own.direct]

    def lengths(self) -> FloatArray:
        """Coordinates of the drives, shape (n,), m or rad."""
        return self._of.coordinates(self._q)

    def kinematics(self) -> tuple[FloatArray, FloatArray]:
        """Quaternion of the arm and state of the equations of limbs, with ξ = 0."""
        return self._q[self._of.model.arm_q], self._y

    def advance(self, pieces: Sequence[Piece]) -> str:
        """Move on through some pieces of time; return when and why that did not succeed, or nothing."""
        for piece in pieces:
            try:
                stopped = self._through(piece)
            except (ExoPinError, np.linalg.LinAlgError) as error:
                stopped = f"stopped after {piece.start:.6g} s: {error}"
            # Of this piece alone; a function within another cannot be copied to other processes.
            self._rate = None
            if stopped:
                return stopped
        return ""

    def _through(self, piece: Piece) -> str:
        own, nv = self._of, self._of.nv
        self._take(piece)
        stiffness = Stiffness(self._derivative, bool(self._implicit[0]))
        state, time, n = own.state, piece.start, len(self._y) - 6
        while time < piece.end:
            base = self._q

            def rate(t: float, Y: FloatArray, base: FloatArray = base) -> FloatArray:
                if not np.abs(Y[:nv]).max(initial=0.0) < np.pi:
                    # A step that has blown up is taken again, shorter: a full turn has no derivative.
                    return np.full(len(Y), np.nan)
                q, v = pin.integrate(state.model, base, Y[:nv]), Y[nv : 2 * nv]
                y = np.concatenate([np.zeros(6), Y[2 * nv : 2 * nv + n]])
                # What ends with this piece acts up to its end.
                found, out, more = own.rates(min(t, piece.end - _INSIDE), q, v, y, Y[2 * nv + n : -2], piece.flows)
                turn: FloatArray = v
                if state.nq != nv:
                    right = np.reshape(pin.dIntegrate(state.model, base, Y[:nv])[1], (nv, nv))
                    turn = np.asarray(np.linalg.solve(right, v))
                return np.concatenate([turn, found.a, out[6:], more])

            self._rate = rate
            Y = np.concatenate([np.zeros(nv), self._v, self._y[6:], self._more])
            step = min(self.step, piece.end - time)
            solver = stiffness.solver(
                rate, time, Y, piece.end, first_step=step, rtol=self._rtol, atol=self._atol
            )  # fmt: skip
            message = solver.step()
            if solver.status == "failed" or (solver.step_size or 1.0) < _SHORTEST:
                return f"stopped at {time:.6g} s: {message or 'steps would have to be too small'}"
            last, grown = solver.t >= piece.end, float(solver.h_abs)
            # A step cut short at the end says nothing about the next one.
            self.step = max(self.step, grown) if last else grown
            time, self.steps = float(solver.t), self.steps + 1
            self._place(solver.y)
        self._implicit = np.array([float(stiffness.implicit)])
        self._tell()
        return ""

    def _take(self, piece: Piece) -> None:
        """Catch and drop payloads at the start of a piece; the wearer gains or loses their energy."""
        own, held = self._of, self._of.held(piece.start)
        if held == own.carried:
            return
        before = sum(energies(own, self._q, self._v, np.zeros(own.count)))
        self._v = own.caught(held, self._q, self._v)
        self._more[-2] += sum(energies(own, self._q, self._v, np.zeros(own.count))) - before
        self._tell()

    def _place(self, Y: FloatArray) -> None:
        """Take over the end of a step, with closed loops."""
        own, nv, n = self._of, self._of.nv, len(self._y) - 6
        state = own.state
        self._q, self._v = pin.integrate(state.model, self._q, Y[:nv]), Y[nv : 2 * nv].copy()
        if state.row_count:
            self._q = refined(state, close(state, self._q, restarts=0))
            self._v = project_velocity(state, self._q, self._v)
        self._y[6:], self._more = Y[2 * nv : 2 * nv + n], Y[2 * nv + n :].copy()

    def _derivative(self, t: float, Y: FloatArray, rate: FloatArray) -> FloatArray:
        """Of the rates by the state, by differences: it serves Newton's method alone."""
        found = np.zeros((len(Y), len(Y)))
        for k in range(len(Y) - 2):
            moved = Y.copy()
            moved[k] += _DIFFERENCE * max(1.0, abs(Y[k]))
            found[:, k] = (self._rate(t, moved) - rate) / (moved[k] - Y[k])
        return found


def started(own: DeviceEquations, state: PlantState) -> FloatArray:
    """:attr:`.PlantState.chain` of a motion that begins with the arm's pose and angular velocity of a state.

    Joints are where the straight turn of the arm from rest leads them, and follow it with the least motion.
    """
    return first_chain(*own.started(state.orientation, state.angular_velocity), len(own.rubbing))
