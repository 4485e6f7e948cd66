"""Derivatives of the equations of motion along the closed loops; see :mod:`.dynamics_derivatives`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from ...core.validation import FloatArray
from ..dynamics.equations_of_motion import Balance
from ..kinematics.rank import rank_tolerance
from ..kinematics.reduced_kinematics import Kinematics, Split
from ..structure.chain_state import Structure

__all__ = ["Change", "State", "change_of", "force_change", "open_change", "rates_along"]

#: Step of the differences of J̇ v, rad and characteristic lengths; step⁴ errs the formula, 1e-16/step the rounding.
_STEP = 1e-3


class Change(NamedTuple):
    """How a state changes, column by column: with q_i, then v_i, then a_i of the d independent coordinates.

    Attributes
    ----------
    q, v, a : ndarray
        Shape (nv, 3 d): per rad or m, rad/s or m/s, rad/s² or m/s² of the column's coordinate.
    """

    q: FloatArray
    v: FloatArray
    a: FloatArray


class State(NamedTuple):
    """A state of a chain with its forces.

    Attributes
    ----------
    chain : Structure
        The chain.
    q, v, a : ndarray
        Shapes (nq,), (nv,), (nv,), a motion that keeps the loops closed.
    multipliers : ndarray
        λ, shape (rows,), N and N m, the least in the metric "closures".
    balance : Balance
        Equations of motion there.
    external : mapping of str to ndarray
        Frame name to wrench, shape (6,), about the frame's origin, world axes, N and N m.
    gravity : pinocchio.Motion
        As it was, m/s².
    """

    chain: Structure
    q: FloatArray
    v: FloatArray
    a: FloatArray
    multipliers: FloatArray
    balance: Balance
    external: Mapping[str, FloatArray]
    gravity: pin.Motion


def rates_along(chain: Structure, q: FloatArray, directions: FloatArray) -> FloatArray:
    """∂J along each direction, shape (columns, rows, nv)."""
    work = chain._workspace
    found = np.zeros((directions.shape[1], chain.row_count, chain.model.nv))
    for k, direction in enumerate(directions.T):
        if direction.any():
            work.drift_of(q, np.ascontiguousarray(direction))
            found[k] = work.jacobian_rate
    return found


def change_of(chain: Kinematics, state: State, split: Split) -> tuple[Change, FloatArray]:
    """How the state follows its independent coordinates, and ∂J along each column."""
    G = chain._reduced(state.q, split)
    nv, d = G.shape
    zero = np.zeros((nv, d))

    def following(right: FloatArray) -> FloatArray:
        """What J x = right makes of the dependent coordinates."""
        out = np.zeros((nv, d))
        out[split.dependent] = chain._dependent(state.q, split, right)
        return out

    along = rates_along(chain, state.q, G)
    here = rates_along(chain, state.q, state.v[:, None])[0]
    v_q = following(-np.einsum("kij,j->ik", along, state.v))
    turning = np.einsum("kij,j->ik", rates_along(chain, state.q, v_q), state.v) + here @ v_q
    a_q = following(-np.einsum("kij,j->ik", along, state.a) - _drift_change(state, G) - turning)
    a_v = following(-np.einsum("kij,j->ik", along, state.v) - here @ G)
    change = Change(np.hstack([G, zero, zero]), np.hstack([v_q, G, zero]), np.hstack([a_q, a_v, G]))
    return change, np.concatenate([along, np.zeros_like(along), np.zeros_like(along)])


def _drift_change(state: State, directions: FloatArray) -> FloatArray:
    """∂(J̇ v)/∂q along each direction with v kept, shape (rows, d), by differences of fourth order."""
    chain, model = state.chain, state.chain.model
    out = np.zeros((chain.row_count, directions.shape[1]))
    if not state.v.any():
        return out
    column = chain._topology.column
    for k, direction in enumerate(directions.T):
        size = float(np.abs(direction / column).max(initial=0.0))
        if size == 0.0:
            continue
        step = _STEP / size
        for far, weight in ((1.0, 8.0), (2.0, -1.0)):
            for sign in (1.0, -1.0):
                there = pin.integrate(model, state.q, sign * far * step * direction)
                out[:, k] += sign * weight / (12.0 * step) * chain._workspace.drift_of(there, state.v)
    return out


def open_change(state: State, change: Change) -> FloatArray:
    """Change of the open tree's generalised forces, shape (nv, columns)."""
    chain = state.chain
    constant, data = chain._axes, chain._workspace.rate_data
    model = constant.model
    constant.follow()
    by_q, by_v, M = constant.rnea_derivatives(data, state.q, state.v, state.a)
    found = by_q @ change.q + by_v @ change.v + M @ change.a
    found -= chain._passive.change(state.q, change.q, change.v)
    axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    for name, wrench in state.external.items():
        for k, direction in enumerate(change.q.T):
            if direction.any():
                constant.jacobian_rate(data, state.q, np.ascontiguousarray(direction))
                pin.updateFramePlacements(model, data)
                rate = pin.getFrameJacobianTimeVariation(model, data, chain._frames[name], axes)
                found[:, k] -= np.reshape(rate, (6, model.nv)).T @ wrench
    return found


def force_change(state: State, change: Change, rates: FloatArray, passive: np.ndarray) -> tuple[FloatArray, FloatArray]:
    """Changes of efforts and multipliers, shapes (nv, columns) and (rows, columns)."""
    chain, top = state.chain, state.chain._topology
    left = open_change(state, change) - np.einsum("kij,i->jk", rates, state.multipliers)
    column = top.column[passive]
    matrix = (state.balance.jacobian[:, passive] * top.row_scale[:, None] * column).T
    found = np.zeros((chain.row_count, change.q.shape[1]))
    if matrix.size:
        # The pseudo-inverse of a matrix of constant rank changes by itself and by how its null space turns.
        inverse = _pseudo_inverse(chain, matrix, state.balance.gap)
        scaled = state.multipliers / top.row_scale
        found = inverse @ (column[:, None] * left[passive])
        tall = inverse.T @ scaled
        for k, rate in enumerate(rates):
            turned = (rate[:, passive] * top.row_scale[:, None] * column) @ tall
            found[:, k] += turned - inverse @ (matrix @ turned)
    multipliers = top.row_scale[:, None] * found
    tau = left - state.balance.jacobian.T @ multipliers
    tau[passive] = 0.0
    return tau, multipliers


def _pseudo_inverse(chain: Structure, matrix: FloatArray, gap: float) -> FloatArray:
    U, values, Vt = np.linalg.svd(matrix, full_matrices=False)
    rank = int(np.count_nonzero(values > rank_tolerance(matrix.shape, float(values[0]), chain.model.njoints, gap)))
    return np.asarray((Vt[:rank].T / values[:rank]) @ U[:, :rank].T, dtype=np.float64)
