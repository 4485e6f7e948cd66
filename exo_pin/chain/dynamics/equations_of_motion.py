"""Equations of motion of a closed chain at one state: the open tree's forces, and what multipliers add to them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ...core.errors import (
    InvalidInput,
    LoopNotClosed,
    NearSingularConfiguration,
    SingularConfiguration,
    UnknownName,
)
from ...core.validation import FloatArray, as_finite, as_mapping
from ..kinematics.rank import RESOLVED, configuration_error, rank_tolerance
from ..structure.chain_state import CLOSED, Structure
from .equation_kernels import equations, wrenches_of

__all__ = [
    "Balance",
    "Wrench",
    "axes_and_point",
    "balance_of",
    "put_on",
    "refuse_missing",
    "refuse_near_singular",
    "refuse_opening",
]

#: A motion may open the loops by so much of its own size: what dependent_motion and projections leave, and typing.
_OPENING = 1e-6
#: Motions slower than this, characteristic lengths and rad a second (and squared), count as this fast there: what
#: rounding leaves of a chain at rest is no motion that could open anything.
_REST = 1e-3


@dataclass(frozen=True, eq=False, slots=True)
class Wrench:
    """A wrench as an affine function of the multipliers.

    Attributes
    ----------
    constant : ndarray
        Shape (6,), force and moment at λ = 0, world axes.
    effect : ndarray
        Shape (6, rows), its change per unit of λ.
    """

    constant: FloatArray
    effect: FloatArray

    def told(self, point: FloatArray, axes: FloatArray) -> Wrench:
        """The wrench about a point, shape (3,), in given axes, shape (3, 3) with the axes as rows.

        Only of a wrench that is told about the world's origin in the world's axes.
        """
        both = np.column_stack([self.constant, self.effect])
        x, y, z = point
        moment = both[3:] - np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) @ both[:3]
        turned = np.vstack([axes @ both[:3], axes @ moment])
        return Wrench(turned[:, 0], turned[:, 1:])

    def reversed(self) -> Wrench:
        """The opposite wrench."""
        return Wrench(-self.constant, -self.effect)


@dataclass(frozen=True, eq=False, slots=True)
class Balance:
    """M a + h - passive - external = τ + Jᵀλ at one state; passive are the forces of springs and damping.

    Attributes
    ----------
    chain : Structure
        The chain.
    q : ndarray
        Shape (nq,).
    tau : ndarray
        Shape (nv,), the left side: generalised forces of the open tree less those of its springs and dampers, N and
        N m.
    jacobian : ndarray
        J, shape (rows, nv).
    gap : float
        Largest scaled residual of the loops.
    poses : ndarray
        Shape (njoints, 4, 3), as in :class:`exo_pin.chain.structure.workspace.Workspace`.
    tree : ndarray
        Shape (njoints, 6), what every joint transmits to its child's side at λ = 0, about the world's origin.
    unit : ndarray
        Shape (rows, 6), what the body of frame a receives for a multiplier of one, about the world's origin.
    """

    chain: Structure
    q: FloatArray
    tau: FloatArray
    jacobian: FloatArray
    gap: float
    poses: FloatArray
    tree: FloatArray
    unit: FloatArray

    def joint(self, index: int) -> Wrench:
        """What a tree joint transmits to its child's side, about the world's origin."""
        carried = np.repeat(self.chain._topology.carried[index], np.diff(self.chain._topology.rows))
        return Wrench(self.tree[index], -carried * self.unit.T)

    def closure(self, index: int) -> Wrench:
        """What a closure transmits to the body of frame a, about the world's origin."""
        rows = self.chain._topology.rows
        effect = np.zeros((6, len(self.unit)))
        own = slice(rows[index], rows[index + 1])
        effect[:, own] = self.unit[own].T
        return Wrench(np.zeros(6), effect)

    def closure_frame(self, index: int) -> tuple[FloatArray, FloatArray]:
        """A closure's point p_b and the axes of frame a, as rows."""
        top = self.chain._topology
        (joint_a, joint_b), (local_a, local_b) = top.joints[index], top.local[index]
        point = local_b[3] @ self.poses[joint_b, :3] + self.poses[joint_b, 3]
        return point, local_a[:3] @ self.poses[joint_a, :3]

    def wrenches(self, multipliers: FloatArray) -> FloatArray:
        """All joints' and closures' wrenches, each about its own point, world axes, for sets of multipliers.

        Parameters
        ----------
        multipliers : ndarray
            Shape (rows, sets). To the first set belong the forces of the open tree, the others are told without.

        Returns
        -------
        ndarray
            Shape (6 (njoints - 1 + m), sets), joints but the world's first, then closures.
        """
        top = self.chain._topology
        out = np.empty((6 * (len(self.tree) - 1 + len(top.kinds)), multipliers.shape[1]))
        wrenches_of(self.poses, self.tree, self.unit, top.carried, top.joints, top.local, top.rows, multipliers, out)
        return out

    def metric(self, start: FloatArray, stresses: FloatArray, metric: str) -> FloatArray:
        """What a metric makes least, all in N, for λ = start + stresses z.

        Returns
        -------
        ndarray
            Shape (p, 1 + k): at z = 0 in the first column, its change per unit of z in the others.
        """
        top = self.chain._topology
        columns = np.column_stack([start, stresses])
        if metric == "closures":
            return np.where(top.row_metres, 1.0, 1.0 / top.length)[:, None] * columns
        wrenches = self.wrenches(columns).reshape(-1, 6, columns.shape[1])
        wrenches[:, 3:] /= top.length
        return wrenches.reshape(-1, columns.shape[1])


def balance_of(
    chain: Structure,
    q: FloatArray,
    v: FloatArray | None,
    a: FloatArray | None,
    external: Mapping[str, ArrayLike] | None = None,
    keeps_closed: bool = True,
) -> Balance:
    """Equations of motion at a state.

    Parameters
    ----------
    chain : Structure
        The chain.
    q, v, a : ndarray
        Shapes (nq,), (nv,), (nv,), checked; None counts as zero.
    external : mapping, optional
        As for :meth:`exo_pin.chain.ClosedChain.rnea`.
    keeps_closed : bool
        Whether to refuse open loops and a motion that opens them.

    Raises
    ------
    LoopNotClosed
        If the loops stand open by more than 1e-8.
    InvalidInput
        If the motion opens the loops.
    UnknownName
        If a frame is not known.
    UnsupportedDynamics
        If a joint has dry friction.
    """
    work, top, model = chain._workspace, chain._topology, chain.model
    moves = (v is not None and bool(v.any())) or (a is not None and bool(a.any()))
    v, a = work.still if v is None else v, work.still if a is None else a
    if moves and keeps_closed:
        work.jacobian_rates(q, v)
    else:
        pin.computeJointJacobians(model, work.data, q)
    work.external[:] = 0.0
    if external is not None:
        put_on(chain, external)
    chain._passive.refuse_friction()
    tau = np.array(pin.rnea(model, work.data, q, v, a, work.external_vector))
    if chain._passive.act:
        tau -= chain._passive.force(q, v)
    jacobian, unit, tree, poses, worst, gap, speed, size, opening_v, opening_a = equations(
        work.poses,
        work.J,
        work.dJ,
        work.forces,
        v,
        a,
        moves and keeps_closed,
        top.joints,
        top.local,
        top.kinds,
        top.distances,
        top.rows,
        top.signs,
        top.supports,
        top.row_scale,
        top.column,
    )
    if keeps_closed:
        if not worst <= CLOSED:
            raise LoopNotClosed(q.copy(), worst, 0)
        _refuse("velocity", opening_v, speed)
        _refuse("acceleration", opening_a, size)
    return Balance(chain, q, tau, jacobian, gap, poses, tree, unit)


def refuse_opening(chain: Structure, v: FloatArray) -> None:
    """Raise if a velocity opens the loops; the chain must be linearised."""
    work, top = chain._workspace, chain._topology
    opening = float(np.abs(top.row_scale * (work.jacobian @ v)).max(initial=0.0))
    _refuse("velocity", opening, float(np.abs(v / top.column).max(initial=0.0)))


def _refuse(what: str, opening: float, size: float) -> None:
    if not opening <= _OPENING * max(size, _REST):
        unit, advice = {
            "velocity": ("a second", "project_velocity"),
            "acceleration": ("a second squared", "project_acceleration"),
        }[what]
        raise InvalidInput(
            f"the {what} opens the loops by {opening:.3g} (lengths and rad {unit}): use {advice} or dependent_motion"
        )


def refuse_missing(chain: Structure, q: FloatArray, v: FloatArray, a: FloatArray, missed: FloatArray) -> None:
    """Raise if an acceleration misses the closures' rows by ``missed``, shape (rows,)."""
    top = chain._topology
    opening = float(np.abs(top.row_scale * missed).max(initial=0.0))
    speed = float(np.abs(v / top.column).max(initial=0.0))
    if not opening <= _OPENING * max(float(np.abs(a / top.column).max(initial=0.0)) + speed**2, _REST):
        raise SingularConfiguration(q, v, opening)


def refuse_near_singular(balance: Balance, weakest: float | None = None) -> None:
    """Raise if forces or accelerations would depend on how well the loops happen to be closed.

    Parameters
    ----------
    balance : Balance
        Equations of motion at a closed configuration.
    weakest : float, optional
        The smallest singular value that is not zero of the equations that were solved, metres divided by the
        characteristic length; that of the constraint Jacobian if left out.

    Raises
    ------
    NearSingularConfiguration
        If it is known to no better than a thousandth of itself.
    """
    top, joints = balance.chain._topology, balance.chain.model.njoints
    # The constraints' singular values are no smaller than those of the equations, which are some of their columns.
    if not balance.jacobian.size or (weakest is not None and weakest**2 > CLOSED / RESOLVED):
        return
    scaled = balance.jacobian * top.row_scale[:, None] * top.column
    values = np.asarray(np.linalg.svd(scaled, compute_uv=False), dtype=np.float64)
    tolerance = rank_tolerance(scaled.shape, float(values[0]), joints, balance.gap)
    error = configuration_error(values, tolerance, joints, balance.gap) * float(values[0])
    least = float(values[np.count_nonzero(values > tolerance) - 1]) if weakest is None else weakest
    if error > RESOLVED * least:
        raise NearSingularConfiguration(balance.q, least, error)


def put_on(chain: Structure, external: Mapping[str, ArrayLike] | None) -> None:
    """Add wrenches on frames to the workspace's external forces; the poses must be there."""
    work, frames = chain._workspace, chain.model.frames
    for name, value in as_mapping("external", external, "frames to wrenches").items():
        if name not in chain._frames:
            raise UnknownName("frame", name, chain._frames)
        given = as_finite(f"external[{name!r}]", value, (6,))
        frame = frames[chain._frames[name]]
        to_local = work.poses[frame.parentJoint, :3]
        force = to_local @ given[:3]
        work.external[frame.parentJoint, :3] += force
        work.external[frame.parentJoint, 3:] += to_local @ given[3:] + np.cross(frame.placement.translation, force)


def axes_and_point(
    balance: Balance, own: tuple[FloatArray, FloatArray], at: str | ArrayLike, in_frame: str
) -> tuple[FloatArray, FloatArray]:
    """Point and axes that a question names, given its joint's own.

    Parameters
    ----------
    own : tuple of ndarray
        Point (3,) and axes (3, 3), as rows.
    at : str or array_like
        "origin" for the own point, a frame's name for its origin, or a point (3,), m, world frame.
    in_frame : str
        "world", "local" for the own axes, or a frame's name.

    Raises
    ------
    UnknownName
        If a frame is not known.
    """
    names: tuple[Literal["origin", "world", "local"], ...] = ("origin", "world", "local")
    point, axes = own
    if isinstance(at, str):
        if at != "origin":
            point = _frame_pose(balance, at, "point or frame", names[:1])[0]
    else:
        point = as_finite("at", at, (3,))
    if in_frame == "world":
        return point, np.eye(3)
    return point, axes if in_frame == "local" else _frame_pose(balance, in_frame, "frame", names[1:])[1]


def _frame_pose(balance: Balance, name: str, what: str, others: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
    frames = balance.chain._frames
    if not isinstance(name, str) or name not in frames:
        raise UnknownName(what, name, (*others, *frames))
    frame = balance.chain.model.frames[frames[name]]
    pose = balance.poses[frame.parentJoint]
    return frame.placement.translation @ pose[:3] + pose[3], frame.placement.rotation.T @ pose[:3]
