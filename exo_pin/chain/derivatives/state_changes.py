"""Derivatives of the equations of motion along the closed loops; see :mod:`.dynamics_derivatives`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from ...core.validation import FloatArray
from ..dynamics.equations.equations_of_motion import EquationsOfMotion
from ..kinematics.rank import rank_tolerance
from ..kinematics.reduced_kinematics import CoordinateSplit, solve_dependent
from ..structure.chain_state import ChainState

#: Step of the differences of J̇ v, rad and characteristic lengths. Truncation errors are of the order of step⁴,
#: rounding errors of 1e-16/step.
_STEP = 1e-3


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
    gravity : pinocchio.Motion
        At that time, m/s².
    """

    state: ChainState
    q: FloatArray
    v: FloatArray
    a: FloatArray
    multipliers: FloatArray
    equations: EquationsOfMotion
    external: Mapping[str, FloatArray]
    gravity: pin.Motion


def rates_along(state: ChainState, q: FloatArray, directions: FloatArray) -> FloatArray:
    """∂J along each direction, shape (columns, rows, nv)."""
    work = state.buffers
    found = np.zeros((directions.shape[1], state.row_count, state.model.nv))
    for k, direction in enumerate(directions.T):
        if direction.any():
            work.drift_of(q, np.ascontiguousarray(direction))
            found[k] = work.jacobian_rate
    return found


def change_of(state: ChainState, point: OperatingPoint, parts: CoordinateSplit) -> tuple[Change, FloatArray]:
    """Changes of the point with its independent coordinates, and ∂J along each column."""
    nv, d = state.model.nv, len(parts.independent)
    zero = np.zeros((nv, d))

    def following(right: FloatArray) -> FloatArray:
        """Dependent coordinates of the solution of J x = right, zero in the others."""
        out = np.zeros((nv, d))
        order, rank, x, *_ = solve_dependent(state, point.q, right, parts.dependent)
        out[order[:rank]] = x[:, nv - rank :]
        return out

    unit = zero.copy()
    unit[parts.independent, np.arange(d)] = 1.0
    state.buffers.linearise(point.q)
    G = unit + following(-state.buffers.jacobian @ unit)

    along = rates_along(state, point.q, G)
    here = rates_along(state, point.q, point.v[:, None])[0]
    v_q = following(-np.einsum("kij,j->ik", along, point.v))
    turning = np.einsum("kij,j->ik", rates_along(state, point.q, v_q), point.v) + here @ v_q
    a_q = following(-np.einsum("kij,j->ik", along, point.a) - _drift_change(point, G) - turning)
    a_v = following(-np.einsum("kij,j->ik", along, point.v) - here @ G)
    change = Change(np.hstack([G, zero, zero]), np.hstack([v_q, G, zero]), np.hstack([a_q, a_v, G]))
    return change, np.concatenate([along, np.zeros_like(along), np.zeros_like(along)])


def _drift_change(point: OperatingPoint, directions: FloatArray) -> FloatArray:
    """∂(J̇ v)/∂q along each direction at constant v, shape (rows, d), by differences of fourth order."""
    state, model = point.state, point.state.model
    out = np.zeros((state.row_count, directions.shape[1]))
    if not point.v.any():
        return out
    column = state.topology.column
    for k, direction in enumerate(directions.T):
        size = float(np.abs(direction / column).max(initial=0.0))
        if size == 0.0:
            continue
        step = _STEP / size
        for far, weight in ((1.0, 8.0), (2.0, -1.0)):
            for sign in (1.0, -1.0):
                there = pin.integrate(model, point.q, sign * far * step * direction)
                out[:, k] += sign * weight / (12.0 * step) * state.buffers.drift_of(there, point.v)
    return out


def open_change(point: OperatingPoint, change: Change) -> FloatArray:
    """Change of the open tree's generalised forces, shape (nv, columns)."""
    state = point.state
    constant, data = state.axes, state.buffers.rate_data
    model = constant.model
    constant.follow()
    by_q, by_v, M = constant.rnea_derivatives(data, point.q, point.v, point.a)
    found = by_q @ change.q + by_v @ change.v + M @ change.a
    found -= state.passive.change(point.q, change.q, change.v)
    axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    for name, wrench in point.external.items():
        for k, direction in enumerate(change.q.T):
            if direction.any():
                constant.jacobian_rate(data, point.q, np.ascontiguousarray(direction))
                pin.updateFramePlacements(model, data)
                rate = pin.getFrameJacobianTimeVariation(model, data, state.frames[name], axes)
                found[:, k] -= np.reshape(rate, (6, model.nv)).T @ wrench
    return found


def force_change(
    point: OperatingPoint, change: Change, rates: FloatArray, passive: np.ndarray
) -> tuple[FloatArray, FloatArray]:
    """Changes of efforts and multipliers, shapes (nv, columns) and (rows, columns).

    They solve the equations of motion with the least sum of squares of what is missing in the coordinates without
    actuator, forces multiplied by the characteristic length; there the changes are those of what is missing. At the
    point itself nothing is.
    """
    state, top = point.state, point.state.topology
    left = open_change(point, change) - np.einsum("kij,i->jk", rates, point.multipliers)
    column = top.column[passive]
    matrix = (point.equations.jacobian[:, passive] * top.row_scale[:, None] * column).T
    found, rank = np.zeros((state.row_count, change.q.shape[1])), 0
    if matrix.size:
        # The pseudo-inverse of a matrix of constant rank changes by itself and by how its null space turns.
        U, values, Vt = np.linalg.svd(matrix, full_matrices=False)
        rank = int((values > rank_tolerance(matrix.shape, values[0], state.model.njoints, point.equations.gap)).sum())
        inverse = (Vt[:rank].T / values[:rank]) @ U[:, :rank].T
        scaled = point.multipliers / top.row_scale
        found = inverse @ (column[:, None] * left[passive])
        tall = inverse.T @ scaled
        for k, rate in enumerate(rates):
            turned = (rate[:, passive] * top.row_scale[:, None] * column) @ tall
            found[:, k] += turned - inverse @ (matrix @ turned)
    multipliers = top.row_scale[:, None] * found
    tau = left - point.equations.jacobian.T @ multipliers
    if rank == len(passive):
        # The loops carry whatever is needed in these coordinates, so that what is left is rounding.
        tau[passive] = 0.0
    return tau, multipliers
