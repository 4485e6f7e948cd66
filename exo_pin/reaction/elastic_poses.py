"""Poses of an elastic device at their equilibrium, and at that within limits of f and the glenoid cone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy
from numpy.typing import NDArray

from ..core.errors import SolverFailed
from ..core.progress import track
from ..core.records import Record
from ..core.validation import FloatArray
from ..design import Mechanism
from ..load_case.pose_stacks import Query
from ..wrist.forces.affine_state import EquilibriumParts
from ..wrist.forces.displaced import Displaced, MovedDevice
from ..wrist.forces.elastic_equilibrium import ArmLoads, ElasticEquations, settle
from .answer import QUERY_STATUS, answered
from .holding.infeasible_poses import is_held, shortfall
from .splits.elastic import Elastic
from .splits.limb_and_side_forces import Pose, choose
from .splits.pose_stack import Moved, PoseStack

#: Largest displacement of the centre that counts as near, m: no shoulder joint opens that far.
_NEAR = 0.1
#: Largest difference between the geometry of a program and the geometry that its forces lead to, m and rad.
_SAME = 1e-9
#: Shares of the way to the geometry that the forces lead to, and how many such steps come before another search.
_RELAXED = ((0.5, 20), (0.25, 40), (0.1, 100))


class ElasticPoses(Record):
    """N poses of an elastic device.

    Parameters
    ----------
    split : Elastic
        With held or locked actuators.
    mechanism : Mechanism
        The design.
    query : Query
        N poses.
    offset : tuple of ndarray or None
        Centre offsets of base and cuff, shape (N, 3), m.
    loads : callable
        Of the arm; see :data:`exo_pin.wrist.forces.elastic_equilibrium.ArmLoads`.

    Attributes
    ----------
    status : ndarray of int8
        Shape (N,), index into :data:`exo_pin.reaction.answer.QUERY_STATUS`.
    device : MovedDevice
        At the equilibrium; in rows without one, in the given pose.
    """

    def __init__(
        self,
        split: Elastic,
        mechanism: Mechanism,
        query: Query,
        offset: tuple[FloatArray, FloatArray] | None,
        loads: ArmLoads,
    ) -> None:
        self.split, self.mechanism = split, mechanism
        self.stiffness = mechanism.shoulder.stiffness
        base, cuff = offset or (np.zeros((len(query.matrices), 3)),) * 2
        every = np.arange(len(base))
        self.equations = ElasticEquations(mechanism, query, base, cuff, loads, self.stiffness, split.locked)
        self.unmoved = Displaced(mechanism, query, base, cuff, *loads(every, query.matrices)[:2])
        self.status: NDArray[np.int8] = self.unmoved.status.copy()
        self.x, self.reached = settle(self.equations, answered(self.status))
        self._move()
        near = np.linalg.norm(self.equations.centre(self.x), axis=1) <= _NEAR
        lost = answered(self.status)[~((self.reached >= 1.0) & near)[answered(self.status)]]
        self.status[lost] = QUERY_STATUS.index("no_equilibrium")

    def _move(self) -> None:
        """Move the device to the unknowns x."""
        self.device = MovedDevice(self.equations, np.arange(len(self.x)), self.x)
        rows = answered(self.status)
        unstable = np.isnan(self.device.movement.bending[rows]).any(axis=1)
        self.status[rows[unstable]] = QUERY_STATUS.index("no_equilibrium")
        rows = rows[~unstable]
        # Moved, a pose may come nearer to the singular surface, but not onto it: no path of finite forces leads there.
        self.status[rows] = np.maximum(self.status[rows], np.minimum(self.device.displaced.status[rows], 1))

    @property
    def parts(self) -> EquilibriumParts:
        """Parts of the equilibrium as of :class:`Displaced`; without one the margin is NaN."""
        own, none = self.device.displaced, self.status == QUERY_STATUS.index("no_equilibrium")
        classified = (self.status, np.where(none, np.nan, own.margin), own.determinant)
        return own.state, own.tensions, own.side.stiffness, self.device.misfit, *classified

    @property
    def loads(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Loads of the displaced arm."""
        return self.device.loads

    def lengths(self) -> FloatArray:
        """Lengths of the limbs, shape (N, n), m."""
        return self.device.movement.lengths

    def within_limits(self, poses: PoseStack, progress: bool = False) -> PoseStack:
        """The poses at their equilibrium within limits and cone, and how the device moved to it."""
        infeasible = np.zeros(len(self.status), dtype=bool)
        rows = self._to_limit(poses)
        for row in track(rows.tolist(), "elastic limits", progress):
            try:
                infeasible[row] = not self._limit(poses, row)
            except (SolverFailed, np.linalg.LinAlgError):
                # Not found is not infeasible.
                self.status[row] = QUERY_STATUS.index("not_solved")
        if rows.size:
            self._move()
        self._mark_overloaded()
        own = (self.device.movement, self.unmoved.tensions.shoulder, self.reached, self.guide_load, infeasible)
        return _moved(poses, self.device)._replace(moved=Moved(*own))

    def _to_limit(self, poses: PoseStack) -> NDArray[np.intp]:
        """Rows whose tensions can be chosen and have to be, because those without limits do not meet them."""
        rows = answered(self.status)
        if self.split.locked or (poses.socket is None and self.mechanism.limb_count == 3):
            return rows[:0]
        rows = rows[poses.limits.reachable[rows]]
        if poses.socket is not None:
            return rows
        f, _ = self.split.plain(_moved(poses, self.device), rows)
        return rows[~poses.limits.met(f, rows)]

    def _limit(self, poses: PoseStack, row: int) -> bool:
        """Move one pose to the geometry to which the forces within its limits lead; return whether they hold it.

        Raises
        ------
        SolverFailed, LinAlgError
            If that geometry was not found.
        """
        start, scale = self.x[row].copy(), self.equations.scale

        def apart(y: FloatArray) -> FloatArray:
            return np.asarray((self._led_to(poses, row, y * scale) - y * scale) / scale)

        if np.abs(apart(start / scale) * scale).max() <= _SAME:
            return is_held(self._program(poses, row, start)[0])
        x = _fixed_point(apart, start / scale, scale) * scale
        held = is_held(self._program(poses, row, x)[0])
        if held:
            self.x[row] = x
        return held

    def _program(self, poses: PoseStack, row: int, x: FloatArray) -> tuple[Pose, MovedDevice]:
        """The program of one pose at the unknowns x, and the device there."""
        device = MovedDevice(self.equations, np.array([row]), x[None])
        socket = None if poses.socket is None else poses.socket._replace(N=poses.socket.N[[row]])
        moved = _moved(poses, device)._replace(limits=poses.limits.rows(np.array([row])), socket=socket)
        return self.split.program(moved, 0), device

    def _led_to(self, poses: PoseStack, row: int, x: FloatArray) -> FloatArray:
        """Unknowns that follow from the forces that the program chooses at the unknowns x, or from the closest ones."""
        program, device = self._program(poses, row, x)
        own, missing = device.displaced, shortfall(program)
        f = choose(program).f if missing is None else missing.f
        assert program.follower is not None
        g = program.follower.g + program.follower.g_of_f @ f
        state = own.state.row(0)
        S, k = state.shoulder_of_g, own.side.stiffness[0]
        force = state.shoulder + state.shoulder_of_f @ f + S @ (k * device.misfit[0])
        delta = np.zeros(3) if self.stiffness is None else -np.linalg.solve(self.stiffness + (S * k) @ S.T, force)
        closure = state.closures(f, g)
        on_arm = (closure - state.limb_share).sum(axis=0)
        return self.equations.led_to(x, row, delta, -closure.sum(axis=0), on_arm + device.loads[2][0])

    def _mark_overloaded(self) -> None:
        """Mark poses in which a guide is loaded beyond its strength."""
        with np.errstate(invalid="ignore"):
            over = (self.guide_load > 1.0).any(axis=1)
        rows = answered(self.status)
        self.status[rows[np.asarray(over)[rows]]] = QUERY_STATUS.index("guide_overloaded")

    @property
    def guide_load(self) -> FloatArray:
        """The larger of bending moment and torque of each guide over its limit, shape (N, n); NaN if none is known."""
        side = self.device.displaced.side
        g = np.abs(side.stiffness * side.deflection)
        limits = np.full((2, self.mechanism.limb_count), np.nan)
        for i, limb in enumerate(self.mechanism.limbs):
            if limb.guide is not None:
                own = (limb.guide.largest_bending_moment, limb.guide.largest_torque)
                limits[:, i] = [np.nan if value is None else value for value in own]
        return np.asarray(np.fmax(g * side.bending / limits[0], g * np.abs(side.torque) / limits[1]))


def _fixed_point(apart: Callable[[FloatArray], FloatArray], start: FloatArray, scale: FloatArray) -> FloatArray:
    """Zero of ``apart``, which has kinks where a tension meets its limit: a search may stop at one.

    It then starts anew from a point that small steps along ``apart`` lead to.

    Raises
    ------
    SolverFailed
        If none was found.
    """
    miss = np.inf
    for share, steps in ((0.0, 0), *_RELAXED):
        near = start
        for _ in range(steps):
            near = near + share * apart(near)
        found = scipy.optimize.root(apart, near, method="hybr", options={"xtol": 1e-13}).x
        miss = float(np.abs(apart(found) * scale).max())
        if miss <= _SAME:
            return np.asarray(found)
    raise SolverFailed("hybr", miss, "elastic device within its limits")


def _moved(poses: PoseStack, device: MovedDevice) -> PoseStack:
    """Poses in the equilibrium of a moved device."""
    own = device.displaced
    return poses._replace(state=own.state, tensions=own.tensions, stiffness=own.side.stiffness, misfit=device.misfit)
