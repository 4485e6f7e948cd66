"""Closed-loop kinematics: independent and dependent coordinates, reduced Jacobian, forward and inverse kinematics."""

from __future__ import annotations

import dataclasses

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import qr

from ..errors import InvalidInput, LoopNotClosed, UndeterminedMotion, UnknownName
from ..validation import FloatArray, as_finite, frozen
from .closing import Closing
from .closures import Closure, Closures
from .rank import rank_tolerance

__all__ = ["Kinematics", "Split"]

#: Largest step along a path, rad and characteristic lengths. A branch is lost only where two come nearer than that.
_PATH_STEP = 0.1
#: Steps are halved where the loops do not follow, so many times.
_HALVINGS = 12
#: A corrected step that moves more than this many times its prediction has left its branch.
_JUMP = 0.5
_CLOSED = 1e-12
_STEPS = 30


@dataclass(frozen=True, eq=False)
class Split:
    """Coordinates of v that may be chosen, and those that follow from them.

    Attributes
    ----------
    independent : ndarray of int
        Shape (dof,), indices in v.
    dependent : ndarray of int
        Shape (nv - dof,), indices in v.
    condition : float
        Ratio of the largest to the smallest singular value of the Jacobian's dependent columns, metres divided by
        the characteristic length. It has no unit; large means close to a singularity of this split.
    """

    independent: NDArray[np.int64]
    dependent: NDArray[np.int64]
    condition: float


class Kinematics(Closing):
    """Kinematics of a closed chain in terms of some of its joints."""

    def split(self, q: ArrayLike, independent: Iterable[str] | None = None) -> Split:
        """Split the coordinates into independent and dependent ones.

        Parameters
        ----------
        q : array_like
            Shape (nq,), closed.
        independent : iterable of str, optional
            Joints whose coordinates are independent. By default the dependent ones are chosen for their conditioning,
            by pivoted QR of the scaled Jacobian: each is the column that adds most to those chosen before.

        Raises
        ------
        UndeterminedMotion
            If the given joints leave others free.
        InvalidInput
            If they are not independent of each other.
        """
        J, tolerance = self._scaled_jacobian(self._closed(q))
        nv = J.shape[1]
        if independent is not None:
            chosen = self.velocity_indices(independent)
            dependent = np.setdiff1d(np.arange(nv), chosen)
            rank = _rank(J, tolerance)
            if _rank(J[:, dependent], tolerance) < len(dependent):
                raise UndeterminedMotion(np.array(q), len(dependent) - _rank(J[:, dependent], tolerance))
            if len(dependent) > rank or len(chosen) > nv - rank:
                raise InvalidInput(f"expected {nv - rank} independent coordinates, got {len(chosen)}: give fewer joints")
        else:
            rank = _rank(J, tolerance)
            pivots = np.asarray(qr(J, mode="r", pivoting=True)[1]) if J.size else np.arange(nv)
            dependent, chosen = np.sort(pivots[:rank]), np.sort(pivots[rank:])
        values = np.linalg.svd(J[:, dependent], compute_uv=False) if len(dependent) else np.ones(1)
        return Split(
            np.asarray(chosen, dtype=np.int64), np.asarray(dependent, dtype=np.int64), float(values[0] / values[-1])
        )

    def reduced_jacobian(self, q: ArrayLike, independent: Iterable[str] | None = None) -> FloatArray:
        """All velocities from the independent ones: v = G v_i, shape (nv, dof), with J G = 0.

        Parameters
        ----------
        q, independent
            As for :meth:`split`; the columns are in the order of ``independent``.
        """
        return self._reduced(q, self.split(q, independent))

    def reduced_jacobian_rate(
        self, q: ArrayLike, v: ArrayLike, independent: Iterable[str] | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """The reduced Jacobian and its time derivative: a = G a_i + Ġ v_i.

        Parameters
        ----------
        q, independent
            As for :meth:`split`.
        v : array_like
            Shape (nv,), a velocity that keeps the loops closed.

        Returns
        -------
        G, G_rate : ndarray
            Shape (nv, dof).
        """
        split = self.split(q, independent)
        G = self._reduced(q, split)
        work = self._workspace
        work.drift_of(self._configuration(q), self._tangent("v", v))
        rate = np.zeros_like(G)
        # J G = 0 at all times, so J Ġ = -J̇ G, and the independent rows of G are constant.
        rate[split.dependent] = self._dependent(q, split, -work.jacobian_rate @ G)
        return G, rate

    def _reduced(self, q: ArrayLike, split: Split) -> FloatArray:
        J = self.constraint_jacobian(q)
        G = np.zeros((self._model.nv, len(split.independent)))
        G[split.independent, np.arange(len(split.independent))] = 1.0
        G[split.dependent] = self._dependent(q, split, -J[:, split.independent])
        return G

    def _dependent(self, q: ArrayLike, split: Split, right: FloatArray) -> FloatArray:
        """Solve J_d x = right, metres weighed against radians by the characteristic length."""
        top = self._topology
        columns = np.where(top.metres, top.length, 1.0)[split.dependent]
        if not len(columns):
            return np.zeros((0, right.shape[1]))
        J = self.constraint_jacobian(q)[:, split.dependent] * top.row_scale[:, None] * columns
        return columns[:, None] * np.linalg.lstsq(J, top.row_scale[:, None] * right, rcond=None)[0]

    def _scaled_jacobian(self, q: FloatArray) -> tuple[FloatArray, float]:
        """Jacobian with metres divided by the characteristic length, and what counts as zero of its singular values."""
        work, top = self._workspace, self._topology
        work.linearise(q)
        scaled = work.jacobian * top.row_scale[:, None] * np.where(top.metres, top.length, 1.0)
        largest = float(np.linalg.norm(scaled, 2)) if scaled.size else 0.0
        gap = float(np.abs(work.gap * top.row_scale).max(initial=0.0))
        return scaled, rank_tolerance(scaled.shape, largest, self._model.njoints, gap) if scaled.size else 0.0

    def frame_jacobian(self, q: ArrayLike, frame: str, independent: Iterable[str] | None = None) -> FloatArray:
        """Twist of a frame from the independent velocities, shape (6, dof).

        Parameters
        ----------
        q, independent
            As for :meth:`split`.
        frame : str
            A frame of the model.

        Returns
        -------
        ndarray
            Velocity of the frame's origin (m/s) above its angular velocity (rad/s), world axes.
        """
        return self._tree_frame_jacobian(self._configuration(q), frame) @ self.reduced_jacobian(q, independent)

    def _tree_frame_jacobian(self, q: FloatArray, frame: str) -> FloatArray:
        if frame not in self._frames:
            raise UnknownName("frame", frame, self._frames)
        data = self._workspace.data
        axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        return np.array(pin.computeFrameJacobian(self._model, data, q, self._frames[frame], axes))

    def project_velocity(self, q: ArrayLike, v: ArrayLike) -> FloatArray:
        """The velocity nearest to v that keeps the loops closed, shape (nv,).

        Nearest in the sum of squares with metres divided by the characteristic length.
        """
        q, v = self._closed(q), self._tangent("v", v)
        self._workspace.linearise(q)
        return v - self._least(self._workspace.jacobian @ v)

    def project_acceleration(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> FloatArray:
        """The acceleration nearest to a that keeps the loops closed while they move with v, shape (nv,).

        Nearest as for :meth:`project_velocity`; v has to keep them closed, too.
        """
        q, v, a = self._closed(q), self._tangent("v", v), self._tangent("a", a)
        drift = self._workspace.drift_of(q, v).copy()
        self._workspace.linearise(q)
        return a - self._least(self._workspace.jacobian @ a + drift)

    def _least(self, right: FloatArray) -> FloatArray:
        """The least x with J x = right, J as last linearised."""
        work, top = self._workspace, self._topology
        columns = np.where(top.metres, top.length, 1.0)
        J = work.jacobian * top.row_scale[:, None] * columns
        if not J.size:
            return np.zeros(len(columns))
        largest = float(np.linalg.norm(J, 2))
        gap = float(np.abs(work.gap * top.row_scale).max(initial=0.0))
        cut = rank_tolerance(J.shape, 1.0, self._model.njoints, gap) if largest else 1.0
        return columns * np.linalg.lstsq(J, top.row_scale * right, rcond=cut)[0]

    def forward_kinematics(
        self, positions: ArrayLike, near: ArrayLike, joints: Iterable[str] | None = None
    ) -> FloatArray:
        """The configuration at given positions of some joints, on the branch of a known one.

        The joints go there along a straight line, in steps that the loops follow, so the answer is on the same
        assembly branch as ``near``. What they leave free moves least. :meth:`placement` then tells where any frame is.

        Parameters
        ----------
        positions : array_like
            Coordinates in q of ``joints``, in their order.
        near : array_like
            Shape (nq,), a closed configuration.
        joints : iterable of str, optional
            The actuated joints of the roles if left out.

        Returns
        -------
        ndarray
            Shape (nq,), closed.

        Raises
        ------
        LoopNotClosed
            If the branch ends before: a limb is stretched or folded, or the path meets a singularity.
        InvalidInput
            If no joints are given and the roles name none.
        """
        names = self._actuated(joints)
        index = np.concatenate([np.arange(self._model.nq)[self.configuration_slice(name)] for name in names])
        held = self.velocity_indices(names)
        start = self._closed(near)
        goal = start.copy()
        goal[index] = as_finite("positions", positions, (len(index),))
        goal = self._configuration(goal)
        whole = pin.difference(self._model, start, goal)
        scale = np.where(self._topology.metres, 1.0 / self._topology.length, 1.0)
        reach = float(np.abs(whole[held] * scale[held]).max(initial=0.0))

        def at(fraction: float, q: FloatArray) -> FloatArray:
            """q with its given joints moved on to a fraction of their way."""
            here = pin.integrate(self._model, start, fraction * whole)
            moved = q.copy()
            moved[index] = goal[index] if fraction == 1.0 else here[index]
            return moved

        def correct(fraction: float, q: FloatArray) -> FloatArray:
            return self._close(at(fraction, q), held, _CLOSED, _STEPS)[0]

        return self._follow(start, reach, correct)

    def inverse_kinematics(
        self,
        frame: str,
        target: pin.SE3,
        near: ArrayLike,
        kind: str = "rigid",
        hold: Iterable[str] = (),
    ) -> FloatArray:
        """The configuration that brings a frame to a place, on the branch of a known one.

        The frame goes there along a screw, in steps that the loops follow.

        Parameters
        ----------
        frame : str
            A frame of the model.
        target : pinocchio.SE3
            Where its origin and axes shall be, world frame.
        near : array_like
            Shape (nq,), a closed configuration.
        kind : str
            What of the target counts, as a closure type: "rigid" for the whole pose, "spherical" for the origin
            alone, "revolute" for origin and z axis, and so on.
        hold : iterable of str
            Joints that must not move.

        Returns
        -------
        ndarray
            Shape (nq,), closed and at the target to 1e-12.

        Raises
        ------
        LoopNotClosed
            If the frame cannot get there on this branch.
        """
        start = self._closed(near)
        held = self.velocity_indices(hold)
        origin = self.placement(start, frame)
        if kind == "spherical":
            # Only the point counts: a straight line, without turning.
            target = pin.SE3(origin.rotation, as_finite("target", target.translation, (3,)))
        way = pin.log6(origin.actInv(target))
        reach = max(
            float(np.linalg.norm(way.linear)) / self._topology.length, float(np.linalg.norm(way.angular))
        )

        # One more closure holds the frame to its place in the world.
        given = self._data_of_file
        task = Closure(" task", kind, frame, "universe")
        extended = Kinematics(self._model, Closures(given.name, given.root, (*given.closures, task)))
        local = extended._topology.local.copy()
        task_frame, seen = local[-1, 1], frozen(local.view())
        extended._topology = dataclasses.replace(extended._topology, local=seen)

        def correct(fraction: float, q: FloatArray) -> FloatArray:
            place = target if fraction == 1.0 else origin * pin.exp6(fraction * way)
            task_frame[:3], task_frame[3] = place.rotation.T, place.translation
            return extended._close(q, held, _CLOSED, _STEPS)[0]

        return self._follow(start, reach, correct)

    def _follow(
        self, start: FloatArray, reach: float, correct: Callable[[float, FloatArray], FloatArray]
    ) -> FloatArray:
        """Go from start to the end of a path in steps, halving those that the loops do not follow.

        The first guess of each step goes on as the last one went; a step that ends far from its guess may have
        changed its branch and is halved, too.
        """
        step = 1.0 / max(1, int(np.ceil(reach / _PATH_STEP)))
        smallest = step / 2**_HALVINGS
        scale = np.where(self._topology.metres, 1.0 / self._topology.length, 1.0)
        fraction, q = 0.0, start
        rate = np.zeros(self._model.nv)
        while fraction < 1.0:
            target = fraction + step if fraction + step < 1.0 - 1e-9 else 1.0
            guess = pin.integrate(self._model, q, (target - fraction) * rate)
            try:
                found = correct(target, guess)
                moved = pin.difference(self._model, q, found)
                jumped = bool(np.abs(scale * pin.difference(self._model, guess, found)).max(initial=0.0) > _JUMP)
                if jumped:
                    raise LoopNotClosed(guess, self._workspace.residual(guess), _STEPS)
            except LoopNotClosed:
                if step <= smallest:
                    raise
                step /= 2
                continue
            rate = moved / (target - fraction)
            q, fraction = found, target
        return q

    def _actuated(self, joints: Iterable[str] | None) -> tuple[str, ...]:
        names = self.roles.actuated if joints is None else (joints,) if isinstance(joints, str) else tuple(joints)
        if not names:
            raise InvalidInput("expected joints, because the closures file's roles name no actuated ones")
        return names


def _rank(matrix: FloatArray, tolerance: float) -> int:
    values = np.linalg.svd(matrix, compute_uv=False) if matrix.size else np.zeros(0)
    return int(np.count_nonzero(values > tolerance))

