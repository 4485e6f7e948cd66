"""Derivatives of the equations of motion along the closed loops; see :mod:`.dynamics_derivatives`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ...core.validation import FloatArray
from ..dynamics.equations.equations_of_motion import EquationsOfMotion
from ..structure.chain_state import ChainState
from .force_change_kernels import changes


class Change(NamedTuple):
    """Changes of an operating point, column by column: with q_i, then v_i, then a_i of the d independent coordinates.

    Attributes
    ----------
    q, v, a : ndarray
        Shape (nv, 3 d): per rad or m, rad/s or m/s, rad/s² or m/s² of the column's coordinate.
    """

    q: FloatArray
    v: FloatArray
    a: FloatArray


class OperatingPoint(NamedTuple):
    """State of motion of a chain with its forces, at which derivatives are taken.

    Attributes
    ----------
    state : ChainState
        The chain.
    q, v, a : ndarray
        Shapes (nq,), (nv,), (nv,), a motion that does not open the loops.
    multipliers : ndarray
        λ, shape (rows,), N and N m, the least in the metric "closures".
    equations : EquationsOfMotion
        Equations of motion there.
    external : mapping of str to ndarray
        Frame name to wrench, shape (6,), about the frame's origin, world axes, N and N m.
    gravity : ndarray
        Shape (6,), at that time, linear part first, m/s².
    """

    state: ChainState
    q: FloatArray
    v: FloatArray
    a: FloatArray
    multipliers: FloatArray
    equations: EquationsOfMotion
    external: Mapping[str, FloatArray]
    gravity: FloatArray


def rates_along(state: ChainState, q: FloatArray, directions: FloatArray) -> FloatArray:
    """∂J along each direction, shape (columns, rows, nv)."""
    work = state.buffers
    found = np.zeros((directions.shape[1], state.row_count, state.model.nv))
    for k, direction in enumerate(directions.T):
        if direction.any():
            work.drift_of(q, np.ascontiguousarray(direction))
            found[k] = work.jacobian_rate
    return found


def change_of(
    point: OperatingPoint, dependent: NDArray[np.int64], G: FloatArray, passive: NDArray[np.int64]
) -> tuple[Change, FloatArray, FloatArray]:
    """Changes of the point with its independent coordinates, and of its efforts and multipliers.

    Shapes (nv, 3 d) and (rows, 3 d), see :func:`.force_change_kernels.force_changes`. The buffers must be linearised at
    the point.
    """
    state, equations = point.state, point.equations
    work, top, trees = state.buffers, state.topology, tree_derivatives(point)
    moved, multipliers = changes.run(
        work.poses, work.J, point.v, point.a, work.q, state.axes.tree, top.loops, top.scales, equations.jacobian,
        dependent, G, *trees, point.multipliers, passive, state.model.njoints, equations.gap,
    )  # fmt: skip
    return Change(*moved[:3]), moved[3], multipliers


def tree_derivatives(point: OperatingPoint) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Derivatives of the open tree's generalised forces with respect to q, v and a, shapes (nv, nv)."""
    state = point.state
    constant, data = state.axes, state.buffers.rate_data
    model = constant.model
    constant.follow()
    by_q, by_v, M = constant.rnea_derivatives(data, point.q, point.v, point.a)
    if state.passive.act:
        unit, none = np.eye(state.nv), np.zeros((state.nv, state.nv))
        by_q -= state.passive.change(point.q, unit, none)
        by_v -= state.passive.change(point.q, none, unit)
    axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    for name, wrench in point.external.items():
        for k, direction in enumerate(np.eye(state.nv)):
            constant.jacobian_rate(data, point.q, direction)
            pin.updateFramePlacements(model, data)
            rate = pin.getFrameJacobianTimeVariation(model, data, state.frames[name], axes)
            by_q[:, k] -= np.reshape(rate, (6, model.nv)).T @ wrench
    return by_q, by_v, M


def open_change(point: OperatingPoint, change: Change) -> FloatArray:
    """Change of the open tree's generalised forces, shape (nv, columns)."""
    by_q, by_v, M = tree_derivatives(point)
    return np.asarray(by_q @ change.q + by_v @ change.v + M @ change.a)
