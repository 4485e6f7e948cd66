"""Equations of a device that gives way, in one pose that its drives hold.

With q(x) the closed configuration of the displacements x, T the motions of all joints for a turn of the arm about each
axis, N the motions that leave the arm where it is and load a spring, and b the weight, load and inertia of all,

    T'(λ b - springs - B f) = 0        N'(λ b - springs - B f) = r(x, λ) = 0

The first gives f, with a row besides for every motion that loads no spring and that drives or brakes hold; of several
f those nearest to efforts that are given, by default of least norm. The second is solved by
:func:`exo_pin.numerics.continuation.follow`, as for a wrist: from the unloaded, aligned device, loads and offset
growing together with λ. x counts N as it is at the start; where a path ends, it is counted anew from there, because far
from its start N is no more what the device can do. Other offsets of the pose begin at the equilibrium of the first, and
the offset alone grows with λ; where that path ends, the one from the unloaded device counts. Derivatives are
differences, kept while x changes little.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.linalg import null_space

from ...chain.kinematics.closing import nearest_closed
from ...core.errors import LoopNotClosed, SolverFailed
from ...core.validation import FloatArray
from ...load_case.pose_stacks import Query
from ...numerics.continuation import follow
from ..balance.device_loads import DeviceLoads, device_loads
from ..balance.device_state import least_efforts
from ..parts.lacking_data import LackingData
from ..postures import following
from ..turns.idle_joints import idle_motions
from .soft_tree import SoftModel
from .springs import CUFF, SHOULDER

_CLOSED = 1e-12
#: A large change of x, in characteristic lengths and rad; step of differences, and changes after which they are new.
_SCALE, _STEP, _KEPT = 0.5, 1e-7, 3e-3
#: Part of load and offset by which loops are tried beyond the end of a path.
_BEYOND = 1e-3
#: Corrections after the path, against rounding.
_POLISH = 3
#: More and less of the efforts for what they change, of the largest of them, and of 1 N or N m.
_MORE = 1e-4


class OutOfReach(SolverFailed):
    """The loops of the device open before it has its offset."""


class NotEvaluated(SolverFailed):
    """The way to the whole load ends where the data of a part end; ``lacking`` are these parts."""

    def __init__(self, reached: float, lacking: tuple[LackingData, ...]) -> None:
        self.lacking = lacking
        super().__init__("equilibrium on springs", reached, ", ".join(map(str, lacking)))


class SoftPose(NamedTuple):
    """The device at displacements x of one pose.

    Attributes
    ----------
    loads : DeviceLoads
        Its equations, a stack of one, with the springs among the loads.
    q : ndarray
        Configuration of the held tree.
    moment_of_f, moment : ndarray
        M and m, shapes (3 + d, p) and (3 + d,): of turns of the arm, and of idle motions that load no spring and that
        drives or brakes hold.
    f : ndarray
        Efforts, shape (p,).
    stress : ndarray
        Efforts that balance themselves, shape (p, k), orthonormal.
    residual : ndarray
        r, shape (k,), N m and, over the characteristic length, N.
    drive_effect : ndarray
        Effect of the efforts on r, shape (k, p).
    loose : float
        Load of motions that no drive, brake or spring holds, N m.
    """

    loads: DeviceLoads
    q: FloatArray
    moment_of_f: FloatArray
    moment: FloatArray
    f: FloatArray
    stress: FloatArray
    residual: FloatArray
    drive_effect: FloatArray
    loose: float


class _Start(NamedTuple):
    """Where a path begins: x, shape (k,) or (1,), at equilibrium with a part of the load and offsets, shape (3,), m.

    x counts motions from a configuration without offsets.
    """

    x: FloatArray
    load: float
    base: FloatArray
    cuff: FloatArray
    configuration: FloatArray
    motions: FloatArray


class SoftEquations:
    """r of one pose, for :func:`exo_pin.numerics.continuation.follow`.

    Parameters
    ----------
    soft : SoftModel
        The device.
    q : ndarray
        Configuration of the rigid device in the pose.
    query : Query
        Poses, motion and load.
    k : int
        The pose.
    base, cuff : ndarray
        Offsets, shape (3,), m.
    preferred : ndarray
        Shape (p,): efforts that those of the answer are nearest to.
    on_cuff : ndarray
        Weight and inertia of the device's links that are fixed to the arm, shape (6,), about O, base frame. It acts
        where it would with a rigid cuff.
    """

    #: Whether x is counted anew where a path ends.
    _counts_anew = True

    def __init__(
        self,
        soft: SoftModel,
        q: FloatArray,
        query: Query,
        k: int,
        base: FloatArray,
        cuff: FloatArray,
        preferred: FloatArray,
        on_cuff: FloatArray,
    ) -> None:
        self.soft, self.model, self.query = soft, soft.model, query.rows(np.array([k]))
        self.base, self.cuff, self.preferred, self.on_cuff = base.copy(), cuff.copy(), preferred, on_cuff
        self.start = soft.start(q, query.quaternions[k])
        self.matrix = query.matrices[k]
        #: Parts whose data ended where the equations were asked last.
        self.lacking: tuple[LackingData, ...] = ()
        self._kept: tuple[FloatArray, float, FloatArray, FloatArray] | None = None
        #: ∂r/∂x where paths begin, which no offset changes.
        self._first: FloatArray | None = None
        self.columns = self._soft_motions(self.start)
        self.size = self.columns.shape[1]
        self._unloaded = self._begin = _Start(np.zeros(1), 0.0, np.zeros(3), np.zeros(3), self.start, self.columns)
        #: The equilibrium of the first offset that was solved.
        self._settled: _Start | None = None

    def _held_rows(self, idle: FloatArray, efforts: FloatArray, turns: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Motions of the free tree that load no spring and leave the arm where it is: held ones, and others, (nv, k).

        Parameters
        ----------
        idle : ndarray
            Motions of all joints of the held tree while the arm rests, scaled, orthonormal columns.
        efforts : ndarray
            Generalised force of a unit of each effort, shape (nv, p).
        turns : ndarray
            Motions that turn the arm, shape (nv, 3).
        """
        _, s, Vt = np.linalg.svd(idle[self.model.soft])
        of_free = self._of_free(idle @ Vt[int((s > self.model.none).sum()) :].T)
        U, s, _ = np.linalg.svd(of_free.T @ efforts)
        scale = np.hypot(np.linalg.norm(turns.T @ efforts), np.linalg.norm(s))
        count = int((s > self.model.none * scale).sum())
        return of_free @ U[:, :count], of_free @ U[:, count:]

    def _of_free(self, motions: FloatArray) -> FloatArray:
        """Motions of the free tree, shape (nv, k), from scaled ones of the held tree that leave the arm at rest."""
        return self.model.free_motion((motions * self.model.held.topology.column[:, None]).T).T

    def _soft_motions(self, q: FloatArray) -> FloatArray:
        """N at a closed configuration, scaled, shape (nv of the held tree, k): orthonormal."""
        idle = idle_motions(self.model, q, self.model.none)
        _, s, Vt = np.linalg.svd(idle[self.model.soft], full_matrices=False)
        return np.asarray(idle @ Vt[: int((s > self.model.none).sum())].T)

    def _offsets(self, share: float) -> tuple[FloatArray, FloatArray]:
        """Offsets of base and cuff at a share of the path."""
        base, cuff = self._begin.base, self._begin.cuff
        return base + share * (self.base - base), cuff + share * (self.cuff - cuff)

    def configuration(self, x: FloatArray, share: float) -> FloatArray:
        """The closed configuration of displacements x at a share of the path, shape (nq,)."""
        model, soft = self.model, self.soft
        change = (self.columns @ x) * model.held.topology.column
        q = pin.integrate(model.held.model, self.start, change)
        for part, shift in zip((soft.base, soft.cuff), self._offsets(share), strict=True):
            q[part.start : part.start + 3] += shift
        return nearest_closed(model.held, q, model.fixed, _CLOSED, 30)[0]

    def at(self, x: FloatArray, share: float) -> SoftPose:
        """The device at displacements x.

        Raises
        ------
        LoopNotClosed
            If its loops do not close.
        NotEvaluated
            If the data of a part do not cover it.
        """
        model, soft, R = self.model, self.soft, self.matrix
        q = self.configuration(x, share)
        loads = device_loads(model, q[None], self.query)
        if not loads.equations.closed[0]:
            raise LoopNotClosed(q, np.inf, 0)
        if loads.lacking:
            raise NotEvaluated(share, loads.lacking[0])
        part, (base, cuff) = self._begin.load + share * (1.0 - self._begin.load), self._offsets(share)
        tau = part * loads.tau[0]
        for spring in soft.springs:
            if spring.name == CUFF:
                tau[spring.own] -= part * self._on_cuff(loads)
            if spring.name == SHOULDER:
                # Not the torso moves but the arm and all that it carries, the other way: what loads them loads it.
                tau[spring.own] = -R @ tau[model.linear]
            tau[spring.own] -= spring.load(q, base, cuff)
        turns = model.free_motion(following(model, q, R.T).T).T
        B, own, idle = loads.driven.B[0], len(model.drives), idle_motions(model, q, model.none)
        held, free = self._held_rows(idle, B, turns)
        loose = float(np.linalg.norm(free.T @ tau))
        motions = np.column_stack([turns, held])
        moment_of_f, moment = motions.T @ B, motions.T @ tau
        wanted, alone = part * self.preferred[:own], soft.device.holds_alone
        # The efforts nearest to those wanted, after the wearer's least moment.
        found = least_efforts(moment_of_f, moment - moment_of_f @ wanted, soft.device.structure.rank, not alone)
        f, more = found.f, np.zeros((len(moment_of_f), len(found.f) - own))
        f[:own] += wanted
        more[:3] = np.eye(3)[:, : more.shape[1]]
        moment_of_f = np.concatenate([moment_of_f, more], axis=1)
        # N here: what of it is idle.
        motions = self._of_free(idle @ (idle.T @ self.columns))
        effect = motions.T @ B
        residual = motions.T @ tau - effect @ f[: B.shape[1]]
        effect = np.concatenate([effect, np.zeros((len(effect), len(f) - B.shape[1]))], axis=1)
        return SoftPose(loads._replace(tau=tau[None]), q, moment_of_f, moment, f, found.stress, residual, effect, loose)

    def _on_cuff(self, loads: DeviceLoads) -> FloatArray:
        """Generalised force on the cuff's joint of the device's links that are fixed to the arm."""
        place = loads.equations.poses[0, self.model.free.joint_index(CUFF)]
        axes, force = place[:3], self.on_cuff[:3]
        about = self.on_cuff[3:] - pin.skew(place[3] - self.model.centre) @ force
        return np.concatenate([axes @ force, axes @ about])

    def residual(self, x: FloatArray, share: float) -> FloatArray:
        """r, shape (k,); NaN where the loops do not close, or data of a part end."""
        try:
            return self.at(x, share).residual
        except LoopNotClosed:
            pass
        except NotEvaluated as error:
            self.lacking = error.lacking
        return np.full(self.size, np.nan)

    def __call__(
        self, rows: NDArray[np.intp], x: FloatArray, parameter: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """r, ∂r/∂x and ∂r/∂λ of the one pose; see :func:`exo_pin.numerics.continuation.follow`."""
        here, share, self.lacking = x[0], float(parameter[0]), ()
        r = self.residual(here, share)
        kept = self._kept
        if kept is None or kept[1] != share or np.abs(kept[0] - here).max(initial=0.0) > _KEPT:
            slopes = self._first if share == 0.0 else None
            if slopes is None:
                own = [(self.residual(here + step, share) - r) / _STEP for step in _STEP * np.eye(self.size)]
                slopes = np.array(own).T.reshape(self.size, self.size)
            if share == 0.0:
                self._first = slopes
            rate = (self.residual(here, share + _STEP) - r) / _STEP
            self._kept = kept = here.copy(), share, slopes, rate
        return r[None], kept[2][None], kept[3][None]

    def opens(self, x: FloatArray, share: float) -> bool:
        """Whether the loops do not close with a little more of the offset, which rigid parts do not follow."""
        try:
            self.configuration(x, share + _BEYOND)
        except LoopNotClosed:
            return True
        return False

    def move(self, base: FloatArray, cuff: FloatArray) -> None:
        """Ask for other offsets of the same pose, shape (3,), m."""
        self.base, self.cuff = base.copy(), cuff.copy()
        self._begin_at(self._settled or self._unloaded)

    def _begin_at(self, begin: _Start) -> None:
        counted = self.columns is begin.motions and begin is self._begin
        self._first, self._kept = self._first if counted else None, None
        self._begin, self.start, self.columns = begin, begin.configuration, begin.motions

    def solved(self) -> tuple[SoftPose, FloatArray]:
        """The pose in equilibrium, and its x.

        Raises
        ------
        OutOfReach
            If the path ends where the loops open.
        NotEvaluated
            If it ends where the data of a part do.
        SolverFailed
            If it ends otherwise before the whole load; ``residual`` of both is the share that was reached.
        """
        if not self.size:
            # What gives way cannot move: the rest of the device holds it.
            return self.at(np.zeros(0), 1.0), np.zeros(0)
        x, reached = self._path(0.0)
        if reached < 1.0 and self._begin is not self._unloaded:
            self._begin_at(self._unloaded)
            x, reached = self._path(0.0)
        while reached < 1.0 and self._counts_anew:
            last, ended = reached, self.lacking
            self._start_from(x, reached)
            x, reached = self._path(last)
            if not reached > last:
                self.lacking = self.lacking or ended
                break
        if reached < 1.0:
            if self.lacking:
                raise NotEvaluated(reached, self.lacking)
            kind = OutOfReach if self.opens(x, reached) else SolverFailed
            raise kind("equilibrium on springs", reached, "displacements of the parts that give way")
        for _ in range(_POLISH):
            r, J, _ = self(np.zeros(1, dtype=np.intp), x[None], np.ones(1))
            x = x - np.linalg.solve(J[0], r[0])
        self._settled = self._settled or _Start(x, 1.0, self.base, self.cuff, self.start, self.columns)
        return self.at(x, 1.0), x

    def _path(self, start: float) -> tuple[FloatArray, float]:
        """x and the share that is reached from the start of x at another share."""
        begin, scale = self._begin.x, np.full(self.size, _SCALE)
        path = follow(lambda rows, x, share: self(rows, begin + x, share), np.zeros(1, dtype=np.intp), scale, start)
        return begin + path.x[0], float(path.reached[0])

    def _start_from(self, x: FloatArray, share: float) -> None:
        """Count x anew from where it is."""
        q = self.configuration(x, share)
        self.columns, self._kept = self._soft_motions(q), None
        for part, shift in ((self.soft.base, self.base), (self.soft.cuff, self.cuff)):
            q[part.start : part.start + 3] -= share * shift
        self.start = q

    def response(self, pose: SoftPose, x: FloatArray, stress: FloatArray) -> list[tuple[SoftPose, SoftPose, float]]:
        """The device with a little more and less of each set of efforts that balance the arm, columns of (p, m)."""
        slope, kept, out = self(np.zeros(1, dtype=np.intp), x[None], np.ones(1))[1][0], self.preferred, []
        more = _MORE * max(1.0, float(np.abs(pose.f).max()))
        for column in stress.T:
            move = np.linalg.solve(slope, pose.drive_effect @ column)
            ends = []
            for sign in (1.0, -1.0):
                self.preferred = pose.f + sign * more * column
                ends.append(self.at(x + sign * more * move, 1.0))
            out.append((ends[0], ends[1], 2.0 * more))
        self.preferred = kept
        return out

    def undetermined(self, pose: SoftPose) -> FloatArray:
        """Efforts and F_s of forces that balance themselves while every spring gives what it gives, (p + 3, k).

        The springs' joints are held, so that what they pass on counts as not known: of the rest, multipliers and
        efforts with J'λ = B f. The wearer's moment is the least one that will do. k columns are independent.
        """
        model, top, loads = self.model, self.model.free.topology, pose.loads
        sprung = [np.arange(spring.own.start, spring.own.stop) for spring in self.soft.springs]
        unit = np.eye(model.free.nv)
        motions = [unit[:, np.setdiff1d(model.rest, np.concatenate(sprung))]]
        motions += [unit[:, spring.own] @ spring.along_motion(pose.q) for spring in self.soft.springs]
        of_rows, B = loads.equations.jacobian[0].T * top.row_scale, loads.driven.B[0]
        size = np.linalg.norm(B * top.column[:, None], axis=0)
        of_all = np.column_stack([of_rows, -B / np.where(size > 0.0, size, 1.0)])
        open_ = null_space(np.column_stack(motions).T @ (top.column[:, None] * of_all), rcond=model.none)
        out = np.zeros((len(pose.f) + 3, open_.shape[1]))
        out[: len(size)], out[len(pose.f) :] = open_[of_rows.shape[1] :], of_all[model.linear] @ open_
        U, s, _ = np.linalg.svd(out, full_matrices=False)
        return np.asarray(U[:, s > model.none])

    def displaced(self, q: FloatArray) -> dict[str, FloatArray]:
        """Displacement of every spring, by the name of its joint."""
        return {spring.name: spring.displacement(q, self.base, self.cuff) for spring in self.soft.springs}
