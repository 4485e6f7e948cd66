"""Closed-loop kinematics: independent and dependent coordinates, reduced Jacobian, forward and inverse kinematics."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import qr

from ...core.errors import InvalidInput, UndeterminedMotion, UnknownName
from ...core.validation import FloatArray
from .closing import Closing
from .rank import rank_tolerance

__all__ = ["Kinematics", "Split"]


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
                raise InvalidInput(
                    f"expected {nv - rank} independent coordinates, got {len(chosen)}: give fewer joints"
                )
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
        columns = top.column[split.dependent]
        if not len(columns):
            return np.zeros((0, right.shape[1]))
        J = self.constraint_jacobian(q)[:, split.dependent] * top.row_scale[:, None] * columns
        return columns[:, None] * np.linalg.lstsq(J, top.row_scale[:, None] * right, rcond=None)[0]

    def _scaled_jacobian(self, q: FloatArray) -> tuple[FloatArray, float]:
        """Jacobian with metres divided by the characteristic length, and what counts as zero of its singular values."""
        work, top = self._workspace, self._topology
        work.linearise(q)
        scaled = work.jacobian * top.row_scale[:, None] * top.column
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
        J = pin.computeFrameJacobian(self._model, data, q, self._frames[frame], axes)
        # With a single coordinate the bindings give a vector.
        return np.array(np.reshape(J, (6, self._model.nv)))

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
        columns = top.column
        J = work.jacobian * top.row_scale[:, None] * columns
        if not J.size:
            return np.zeros(len(columns))
        largest = float(np.linalg.norm(J, 2))
        gap = float(np.abs(work.gap * top.row_scale).max(initial=0.0))
        cut = rank_tolerance(J.shape, 1.0, self._model.njoints, gap) if largest else 1.0
        return columns * np.linalg.lstsq(J, top.row_scale * right, rcond=cut)[0]


def _rank(matrix: FloatArray, tolerance: float) -> int:
    values = np.linalg.svd(matrix, compute_uv=False) if matrix.size else np.zeros(0)
    return int(np.count_nonzero(values > tolerance))
