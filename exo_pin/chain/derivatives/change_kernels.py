"""Changes of motion along the closed loops, compiled; see :mod:`.dynamics_derivatives`.

A coordinate moves with its joint: along u the world Jacobian's column of coordinate k changes by U × J_k, with U the
twist of k's joint along u. So all changes of twists and of J̇ v with q are sums over the tree.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.compiled import kernel
from ...numerics.small_linear import solve_factored
from ..kinematics.kernels.closure_kernels import add_cross, fill_rate, moves_within, twist_at
from ..structure.couplings import couple_rate_change
from ..structure.projection import (
    COUPLED_ANGLE,
    project,
    project_rate,
    project_rate_change,
    projection_turns,
    relative_pose,
)


@kernel(inline=True)
def _add_turning(twists: Any, j: int, motions: Any, k: int, out: Any, row: int) -> None:
    """Add to a row the change V × m of motion k, which turns with twist j; all are rows of arrays, shape (..., 6)."""
    u, v, w, x, y, z = twists[j, 0], twists[j, 1], twists[j, 2], twists[j, 3], twists[j, 4], twists[j, 5]
    a, b, c, d, e, f = motions[k, 0], motions[k, 1], motions[k, 2], motions[k, 3], motions[k, 4], motions[k, 5]
    out[row, 0] += y * c - z * b + v * f - w * e
    out[row, 1] += z * a - x * c + w * d - u * f
    out[row, 2] += x * b - y * a + u * e - v * d
    out[row, 3] += y * f - z * e
    out[row, 4] += z * d - x * f
    out[row, 5] += x * e - y * d


@kernel
def _own_motions(J: Any, owners: Any, u: Any, out: Any) -> None:
    """Fill what each joint adds to its parent's twist along u, shape (joints, 6)."""
    out[:] = 0.0
    for k in range(len(u)):
        for i in range(6):
            out[owners[k], i] += J[k, i] * u[k]


@kernel
def _twists_along(J: Any, axes: Any, u: Any, own: Any, out: Any) -> None:
    """Fill the twists of all joints along u, shape (joints, 6), and what each joint adds to its parent's."""
    parents, owners = axes
    _own_motions(J, owners, u, own)
    out[0] = 0.0
    for j in range(1, len(parents)):
        for i in range(6):
            out[j, i] = out[parents[j], i] + own[j, i]


@kernel
def _rate_along(
    poses: Any, J: Any, u: Any, axes: Any, loops: Any, q: Any, memory: Any, twists: Any, out: Any, drift: Any
) -> None:
    """Fill ∂J along u, shape (rows, nv), its product with u, and the twists along u."""
    owners = axes[1]
    own, _, _, _, _, dJ, scratch = memory
    _twists_along(J, axes, u, own, twists)
    dJ[:] = 0.0
    for k in range(len(u)):
        _add_turning(twists, owners[k], J, k, dJ, k)
    fill_rate(poses, J, dJ, u, loops, q, scratch, out, drift)


@kernel
def new_change_memory(joints: int, nv: int, height: int) -> Any:
    """Arrays for :func:`motion_changes`, which makes none."""
    return np.empty((7, joints, 6)), np.empty((nv, 6)), np.empty((5, max(nv, height)))


@kernel
def drift_change(
    poses: Any, J: Any, v: Any, u: Any, w: Any, axes: Any, loops: Any, q: Any, memory: Any, V: Any, U: Any, out: Any
) -> None:
    """Fill the change of J̇ v along u while v changes by w, shape (rows,).

    Parameters
    ----------
    poses, J, loops, q
        As for :func:`exo_pin.chain.kinematics.kernels.closure_kernels.jacobian_rate`.
    v, u, w : ndarray
        Shape (nv,).
    axes : tuple
        Of each joint its parent, of each coordinate its joint.
    memory : tuple
        Own motions, their changes, dV, A, dA; dJ; and what
        :func:`~exo_pin.chain.kinematics.kernels.closure_kernels.new_scratch` makes.
    V, U : ndarray
        Shape (joints, 6), twists of the joints along v and u.
    """
    joints, local, kinds, lengths, rows, _, supports, coupled, polynomials = loops
    parents, owners = axes
    own, turned, dV, A, dA, _, (frames, squares, parts) = memory
    dV[0], A[0], dA[0] = 0.0, 0.0, 0.0
    _own_motions(J, owners, v, own)
    _own_motions(J, owners, w, turned)
    for j in range(1, len(parents)):
        _add_turning(U, j, own, j, turned, j)
        for i in range(6):
            dV[j, i] = dV[parents[j], i] + turned[j, i]
            A[j, i], dA[j, i] = A[parents[j], i], dA[parents[j], i]
        _add_turning(V, j, own, j, A, j)
        _add_turning(dV, j, own, j, dA, j)
        _add_turning(V, j, turned, j, dA, j)
    a, b, Q, S, P = frames[0], frames[1], frames[2, :3], squares[0], squares[1]
    d, ignored, T, Tu, dT, W, dW = parts[0], parts[1], parts[2], parts[3], parts[4], parts[5], parts[6]
    pv, pu, dpv, spin = parts[7, :3], parts[8, :3], parts[9, :3], parts[10:13]
    # Relative to b: twists along v and u and the former's change, accelerations and their change.
    rv, ru, dv, ra, da = parts[13], parts[14], parts[15], parts[16], parts[17]
    for c in range(len(kinds)):
        first, count = rows[c], rows[c + 1] - rows[c]
        out[first : first + count] = 0.0
        if kinds[c] >= COUPLED_ANGLE or not (moves_within(supports, c, u) or moves_within(supports, c, w)):
            continue
        relative_pose(poses, joints, local, c, a, b, d, Q)
        project(kinds[c], d, Q, lengths[c], ignored[:count], S[:count])
        i, k, p = joints[c, 0], joints[c, 1], b[3]
        for s in range(6):
            rv[s], ru[s], dv[s] = V[i, s] - V[k, s], U[i, s] - U[k, s], dV[i, s] - dV[k, s]
            ra[s], da[s] = A[i, s] - A[k, s], dA[i, s] - dA[k, s]
        # How the closure's point moves on b along v and u, and the former's change; the turning of a, in its own axes.
        for s in range(3):
            pv[s], pu[s], dpv[s] = V[k, s], U[k, s], dV[k, s]
            spin[0, s] = a[s, 0] * V[i, 3] + a[s, 1] * V[i, 4] + a[s, 2] * V[i, 5]
            spin[1, s] = a[s, 0] * U[i, 3] + a[s, 1] * U[i, 4] + a[s, 2] * U[i, 5]
            spin[2, s] = a[s, 0] * dV[i, 3] + a[s, 1] * dV[i, 4] + a[s, 2] * dV[i, 5]
        add_cross(V[k, 3:], p, 1.0, pv)
        add_cross(U[k, 3:], p, 1.0, pu)
        add_cross(dV[k, 3:], p, 1.0, dpv)
        add_cross(V[k, 3:], pu, 1.0, dpv)
        add_cross(spin[1], spin[0], -1.0, spin[2])
        twist_at(rv, p, a, 1.0, T)
        twist_at(ru, p, a, 1.0, Tu)
        add_cross(rv[3:], pu, 1.0, dv)
        twist_at(dv, p, a, 1.0, dT)
        _turn(spin[1], T, dT)
        # The relative acceleration that v makes, in the axes of a, and its change, with the turning of these axes.
        add_cross(rv[3:], pv, 1.0, ra)
        twist_at(ra, p, a, 1.0, W)
        add_cross(ra[3:], pu, 1.0, da)
        add_cross(dv[3:], pv, 1.0, da)
        add_cross(rv[3:], dpv, 1.0, da)
        twist_at(da, p, a, 1.0, dW)
        _turn(spin[1], W, dW)
        _turn(spin[2], T, dW)
        _turn(spin[0], dT, dW)
        _turn(spin[0], T, W)
        _add_product(S[:count], dW, out[first : first + count])
        if not projection_turns(kinds[c]):
            continue
        project_rate_change(kinds[c], d, Q, T, Tu, P[:count])
        _add_product(P[:count], T, out[first : first + count])
        project_rate(kinds[c], d, Q, dT, P[:count])
        _add_product(P[:count], T, out[first : first + count])
        project_rate(kinds[c], d, Q, T, P[:count])
        _add_product(P[:count], dT, out[first : first + count])
        project_rate(kinds[c], d, Q, Tu, P[:count])
        _add_product(P[:count], W, out[first : first + count])
    couple_rate_change(q, v, u, w, coupled, polynomials, out)


@kernel(inline=True)
def _turn(omega: Any, twist: Any, out: Any) -> None:
    """Subtract ω × of both parts of a twist."""
    add_cross(omega, twist, -1.0, out)
    add_cross(omega, twist[3:], -1.0, out[3:])


@kernel(inline=True)
def _add_product(P: Any, twist: Any, out: Any) -> None:
    for i in range(len(out)):
        for j in range(6):
            out[i] += P[i, j] * twist[j]


@kernel
def motion_changes(
    poses: Any, J: Any, v: Any, a: Any, q: Any, rate: Any, axes: Any, loops: Any, scales: Any, order: Any, rank: int,
    factors: Any, moved: Any, along: Any, scratch: Any, memory: Any,
) -> None:  # fmt: skip
    """Changes of the motion with its independent coordinates, velocities and accelerations.

    Parameters
    ----------
    poses, J, axes, loops, q
        As for :func:`drift_change`.
    v, a : ndarray
        Shape (nv,).
    rate : ndarray
        Shape (rows, nv), time derivative of the constraint Jacobian.
    scales : tuple
        As for :func:`exo_pin.chain.kinematics.rank.least_motion`.
    order, rank, factors
        What :func:`exo_pin.chain.kinematics.kernels.dependent_kernels.fill_dependent` fills and returns.
    moved : ndarray
        Shape (4, 3, nv, d), zeros but for the reduced Jacobian in the first: changes of q, of v and of a, filled, each
        with q_i, v_i and a_i of the independent coordinates.
    along : ndarray
        Shape (d, rows, nv), filled: ∂J along each column of the reduced Jacobian.
    scratch, memory : tuple
        What :func:`~exo_pin.chain.kinematics.kernels.closure_kernels.new_scratch` and :func:`new_change_memory` make.
    """
    joints, dJ, vectors = memory
    own = joints[0], joints[1], joints[2], joints[3], joints[4], dJ, scratch
    V, U = joints[5], joints[6]
    d, height, nv = along.shape
    dq, dv, da = moved[0, 0], moved[1], moved[2]
    drift, first, second = vectors[0, :height], vectors[1, :height], vectors[2, :height]
    direction, speed = vectors[3, :nv], vectors[4, :nv]
    _twists_along(J, axes, v, own[0], V)
    for k in range(d):
        for i in range(nv):
            direction[i] = dv[1, i, k] = da[2, i, k] = dq[i, k]
        _rate_along(poses, J, direction, axes, loops, q, own, U, along[k], drift)
        for r in range(height):
            first[r] = second[r] = 0.0
            for i in range(nv):
                first[r] -= along[k, r, i] * v[i]
                second[r] -= rate[r, i] * direction[i]
            second[r] += first[r]
        # a by v: J̇ of v along the column, and the other way round.
        _follow(order, rank, factors, scales, first, dv[0], k)
        _follow(order, rank, factors, scales, second, da[1], k)
        for i in range(nv):
            speed[i] = dv[0, i, k]
        drift_change(poses, J, v, direction, speed, axes, loops, q, own, V, U, drift)
        for r in range(height):
            drift[r] = -drift[r]
            for i in range(nv):
                drift[r] -= along[k, r, i] * a[i]
        _follow(order, rank, factors, scales, drift, da[0], k)


@kernel
def _follow(order: Any, rank: int, factors: Any, scales: Any, right: Any, out: Any, k: int) -> None:
    """Fill the dependent coordinates of column k of x with J x = right, which is used up."""
    row_scale, column, _ = scales
    W, diagonal, half = factors
    for r in range(len(right)):
        right[r] *= row_scale[r]
    solve_factored(W, diagonal, half, rank, right)
    for i in range(rank):
        out[order[i], k] = column[order[i]] * right[i]
