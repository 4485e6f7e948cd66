"""Derivatives of the equations of motion along the closed loops; see :mod:`.dynamics_derivatives`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from ...core.validation import FloatArray
from ..dynamics.equations.equations_of_motion import EquationsOfMotion
from ..structure.chain_state import ChainState
from ..structure.constant_axes import symmetric


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


def tree_derivatives(
    state: ChainState, q: FloatArray, v: FloatArray, a: FloatArray, external: Mapping[str, FloatArray]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Derivatives of the open tree's generalised forces with respect to q, v and a, of the last the lower half.

    Windows of the buffers, shapes (nv, nv). The poses, Jacobians and ``tree`` of the buffers are filled, too, unless
    joints have axes that move.
    """
    constant, work = state.axes, state.buffers
    data, (by_q, by_v, _) = work.rate_data, work.trees
    pushed = _pushed(state, q, external) if external else None
    constant.rnea_derivatives(data, q, v, a)
    if state.passive.act:
        unit, none = np.eye(state.nv), np.zeros((state.nv, state.nv))
        by_q -= state.passive.change(q, unit, none)
        by_v -= state.passive.change(q, none, unit)
    if pushed is not None:
        by_q -= pushed
    return work.trees


def _pushed(state: ChainState, q: FloatArray, external: Mapping[str, FloatArray]) -> FloatArray:
    """Derivatives of the generalised forces of wrenches on frames with respect to q, shape (nv, nv)."""
    constant, data, axes = state.axes, state.buffers.rate_data, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    found = np.zeros((state.nv, state.nv))
    for name, wrench in external.items():
        for k, direction in enumerate(np.eye(state.nv)):
            constant.jacobian_rate(data, q, direction)
            pin.updateFramePlacements(constant.model, data)
            rate = pin.getFrameJacobianTimeVariation(constant.model, data, state.frames[name], axes)
            found[:, k] += np.reshape(rate, (6, state.nv)).T @ wrench
    return found


def open_change(point: OperatingPoint, change: Change) -> FloatArray:
    """Change of the open tree's generalised forces, shape (nv, columns)."""
    by_q, by_v, lower = tree_derivatives(point.state, point.q, point.v, point.a, point.external)
    return np.asarray(by_q @ change.q + by_v @ change.v + symmetric(lower) @ change.a)
