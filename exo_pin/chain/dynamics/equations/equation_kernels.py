"""Equations of motion of a chain, and the wrenches of all its joints and closures, compiled.

Acceleration in the null space of the closures, compiled, where no singular value is in doubt.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ....core.compiled import kernel
from ....numerics.small_linear import copy_numbers, solve_cholesky
from ...kinematics.kernels.closure_kernels import add_cross, fill_rate, fill_residual, fill_units, new_scratch
from ...kinematics.kernels.dependent_kernels import nearest_motion
from ...structure.memory.chain_buffers import unpacked_constants


@kernel
def moving_loops(
    poses: Any, J: Any, dJ: Any, v: Any, loops: Any, q: Any, scales: Any, gap: Any, jacobian: Any, rate: Any,
    drift: Any, singular: bool,
) -> Any:  # fmt: skip
    """Fill residual, Jacobian, its rate and drift of all closures: all that forward dynamics needs of the loops.

    Parameters
    ----------
    poses, J, dJ, v, loops, q
        As for the functions of :mod:`exo_pin.chain.kinematics.kernels.closure_kernels`.
    scales : tuple
        As for :func:`exo_pin.chain.kinematics.rank.least_motion`.
    gap, jacobian, rate, drift : ndarray
        Shapes (rows,), (rows, nv), (rows, nv), (rows,), filled.
    singular : bool
        Whether to examine how near a singular configuration is.

    Returns
    -------
    tuple
        The largest residual; the same scaled; the largest opening by v, scaled; the scaled size of v; whether the
        configuration is certainly far enough from a singular one; whether the numbers of q and v are finite.
    """
    row_scale, column, _ = scales
    scratch = new_scratch()
    worst = fill_residual(poses, J, loops, q, scratch, gap, jacobian)
    scaled = _scaled(gap, row_scale)
    drift[:] = 0.0
    _, opening, speed, finite = missed(jacobian, drift, v, row_scale, column)
    fill_rate(poses, J, dJ, v, loops, q, scratch, rate, drift)
    finite = finite and math.isfinite(q.sum())
    regular = singular and finite and math.isfinite(worst)
    if regular:
        _, _, regular = nearest_motion(jacobian, drift, scales, len(poses), scaled, False)
    return worst, scaled, opening, speed, regular, finite


@kernel
def _scaled(gap: Any, row_scale: Any) -> float:
    """The largest residual, scaled."""
    largest = 0.0
    for i in range(len(gap)):
        largest = max(largest, abs(gap[i] * row_scale[i]))
    return largest


@kernel
def _size(v: Any, column: Any) -> float:
    """The largest number of a velocity or acceleration, scaled; NaN if one is."""
    size = 0.0
    for k in range(len(v)):
        if math.isnan(v[k]):
            return math.nan
        size = max(size, abs(v[k] / column[k]))
    return size


@kernel
def missed(jacobian: Any, drift: Any, a: Any, row_scale: Any, column: Any) -> Any:
    """Error J a + drift of an acceleration in the closures' rows.

    Parameters
    ----------
    jacobian, drift : ndarray
        Shapes (rows, nv) and (rows,).
    a : ndarray
        Shape (nv,).
    row_scale, column : ndarray
        Shapes (rows,) and (nv,), which take metres to characteristic lengths.

    Returns
    -------
    tuple
        The largest error; the same scaled; the scaled size of a; whether the numbers of a are finite.
    """
    largest, scaled, size, total = 0.0, 0.0, 0.0, 0.0
    for i in range(len(drift)):
        error = drift[i]
        for k in range(len(a)):
            error += jacobian[i, k] * a[k]
        largest, scaled = max(largest, abs(error)), max(scaled, abs(row_scale[i] * error))
    for k in range(len(a)):
        size = max(size, abs(a[k] / column[k]))
        total += a[k]
    return largest, scaled, size, math.isfinite(total)


@kernel
def _tree_wrenches(poses: Any, forces: Any, out: Any) -> None:
    """Express joints' wrenches in world axes about the world's origin.

    Parameters
    ----------
    poses : ndarray
        Shape (njoints, 4, 3): rows 0 to 2 are the columns of R, row 3 is p.
    forces : ndarray
        Shape (njoints, 6), in local axes about the local origin.
    out : ndarray
        Shape (njoints, 6), filled.
    """
    for j in range(len(poses)):
        R, p, wrench = poses[j], poses[j, 3], out[j]
        for k in range(3):
            wrench[k] = forces[j, 0] * R[0, k] + forces[j, 1] * R[1, k] + forces[j, 2] * R[2, k]
            wrench[3 + k] = forces[j, 3] * R[0, k] + forces[j, 4] * R[1, k] + forces[j, 5] * R[2, k]
        add_cross(p, wrench, 1.0, wrench[3:])


@kernel
def wrenches_of(poses: Any, tree: Any, unit: Any, carried: Any, loops: Any, columns: Any, out: Any) -> None:
    """Wrenches of joints and closures, each about its own point, for several sets of multipliers.

    Parameters
    ----------
    poses : ndarray
        Shape (njoints, 4, 3).
    tree : ndarray
        Shape (njoints, 6), the joints' wrenches at λ = 0 about the world's origin, counted in the first set only.
    unit : ndarray
        Wrenches of unit multipliers, shape (rows, 6).
    carried, loops
        As in :class:`exo_pin.chain.structure.topology.Topology`.
    columns : ndarray
        Shape (rows, sets), multipliers.
    out : ndarray
        Shape (6 parts, sets), filled: the joints but the world's, then the closures.
    """
    joints, local, _, _, rows, _, _, _, _ = loops
    count, sets, closures = len(poses) - 1, columns.shape[1], len(joints)
    own = np.zeros((closures, 6, sets))
    for c in range(closures):
        for i in range(rows[c], rows[c + 1]):
            for k in range(6):
                for s in range(sets):
                    own[c, k, s] += unit[i, k] * columns[i, s]
    p = np.empty(3)
    for i in range(len(out) // 6):
        block = out[6 * i : 6 * i + 6]
        if i < count:
            for k in range(6):
                for s in range(sets):
                    block[k, s] = tree[i + 1, k] if s == 0 else 0.0
                for c in range(closures):
                    if carried[i + 1, c] != 0.0:
                        for s in range(sets):
                            block[k, s] -= carried[i + 1, c] * own[c, k, s]
            copy_numbers(poses[i + 1, 3], p)
        else:
            c = i - count
            for k in range(6):
                copy_numbers(own[c, k], block[k])
            pose, place = poses[joints[c, 1]], local[c, 1, 3]
            for k in range(3):
                p[k] = place[0] * pose[0, k] + place[1] * pose[1, k] + place[2] * pose[2, k] + pose[3, k]
        for s in range(sets):
            block[3, s] -= p[1] * block[2, s] - p[2] * block[1, s]
            block[4, s] -= p[2] * block[0, s] - p[0] * block[2, s]
            block[5, s] -= p[0] * block[1, s] - p[1] * block[0, s]


@kernel(inline=True)
def split_terms(flat: Any, shape: Any) -> Any:
    """Windows on one block of numbers, and where it goes on.

    To make an array takes as long as the work on it: the terms of a state are one block, that of a stack one array.

    Parameters
    ----------
    flat : ndarray
        Shape (at least rows (nv + 6) + 18 njoints,).
    shape : tuple of int
        rows, nv, njoints.

    Returns
    -------
    tuple
        Jacobian, shape (rows, nv); unit wrenches, shape (rows, 6); joints' wrenches about the world's origin, shape
        (njoints, 6); poses, shape (njoints, 4, 3); the place behind them.
    """
    rows, nv, count = shape
    unit, tree, place, end = rows * nv, rows * (nv + 6), rows * (nv + 6) + 6 * count, rows * (nv + 6) + 18 * count
    return (
        flat[:unit].reshape((rows, nv)),
        flat[unit:tree].reshape((rows, 6)),
        flat[tree:place].reshape((count, 6)),
        flat[place:end].reshape((count, 4, 3)),
        end,
    )


@kernel(inline=True)
def fill_equations(
    poses: Any, J: Any, dJ: Any, forces: Any, local: bool, v: Any, a: Any, moves: bool, loops: Any, q: Any,
    scales: Any, rate: Any, terms: Any, scratch: Any, openings: Any,
) -> Any:  # fmt: skip
    """Terms of the closures in the equations of motion, and the opening of the loops by state and motion.

    Parameters
    ----------
    poses, J, dJ, loops, q
        As for the functions of :mod:`exo_pin.chain.kinematics.kernels.closure_kernels`.
    forces : ndarray
        Shape (njoints, 6), the joints' wrenches at λ = 0.
    local : bool
        Whether these are in the joints' axes about their origins, as RNEA leaves them, or in the world's about its own.
    v, a : ndarray
        Shape (nv,).
    moves : bool
        Whether the opening by v and a is needed.
    scales : tuple
        As for :func:`exo_pin.chain.kinematics.rank.least_motion`.
    rate : ndarray
        Shape (rows, nv), filled with the Jacobian's rate if the opening is needed.
    terms : tuple of ndarray
        What :func:`split_terms` returns, filled.
    scratch : tuple
        What :func:`~exo_pin.chain.kinematics.kernels.closure_kernels.new_scratch` makes.
    openings : ndarray
        Shape (at least 2, rows), of which two are overwritten.

    Returns
    -------
    tuple
        The largest residual, the same scaled; and scaled, speed, acceleration plus its square, and the largest opening
        by either.
    """
    row_scale, column, _ = scales
    height, (jacobian, unit, tree, own_poses, _) = len(row_scale), terms
    gap, drift = openings[0], openings[1]
    for j in range(len(poses)):
        for i in range(4):
            for k in range(3):
                own_poses[j, i, k] = poses[j, i, k]
    worst = fill_residual(poses, J, loops, q, scratch, gap, jacobian)
    fill_units(poses, loops, scratch, unit)
    if local:
        _tree_wrenches(poses, forces, tree)
    else:
        for j in range(len(poses)):
            for k in range(6):
                tree[j, k] = forces[j, k]
    scaled, opening_v, opening_a = _scaled(gap, row_scale), 0.0, 0.0
    if moves:
        fill_rate(poses, J, dJ, v, loops, q, scratch, rate, drift)
        for r in range(height):
            gap[r] = 0.0
        _, opening_v, _, _ = missed(jacobian, gap, v, row_scale, column)
        _, opening_a, _, _ = missed(jacobian, drift, a, row_scale, column)
    speed, size = _size(v, column), _size(a, column)
    return worst, scaled, speed, size + speed * speed, opening_v, opening_a


@kernel
def _inverse_size(A: Any) -> float:
    """Sum of squares of the inverse of the Cholesky factor of a symmetric matrix, which replaces its lower triangle.

    It is infinite if a pivot is not above zero: the smallest eigenvalue is not smaller than one over it.
    """
    n, total = len(A), 0.0
    for i in range(n):
        for j in range(i + 1):
            part = A[i, j]
            for k in range(j):
                part -= A[i, k] * A[j, k]
            if i == j:
                if not part > 0.0:
                    return math.inf
                A[i, i] = math.sqrt(part)
            else:
                A[i, j] = part / A[j, j]
    inverse = np.empty(n)
    for j in range(n):
        inverse[j] = 1.0 / A[j, j]
        total += inverse[j] * inverse[j]
        for i in range(j + 1, n):
            part = 0.0
            for k in range(j, i):
                part -= A[i, k] * inverse[k]
            inverse[i] = part / A[i, i]
            total += inverse[i] * inverse[i]
    return total


@kernel
def clear_motion(
    poses: Any, J: Any, dJ: Any, v: Any, q: Any, constants: Any, gap: Any, jacobian: Any, rate: Any, drift: Any,
    lower: Any, forces: Any, bounds: Any,
) -> Any:  # fmt: skip
    """Loops of a moving chain, and its acceleration a = a_0 + Z z with J Z = 0.

    Parameters
    ----------
    poses, J, dJ, v, q, gap, jacobian, rate, drift
        As for :func:`.equation_kernels.moving_loops`.
    constants : tuple
        What :func:`~exo_pin.chain.structure.memory.chain_buffers.packed_constants` packs: to hand over more arrays
        takes longer than all else here in a chain of one loop.
    lower : ndarray
        Shape (nv, nv), the lower half of the open tree's mass matrix.
    forces : ndarray
        Shape (nv,), what accelerates the open tree, N and N m.
    bounds : tuple of float
        Tolerance of the geometry, scaled, 0 for an exact one; the largest scaled residual of closed loops; the share of
        the largest inertia below which a motion has none.

    Returns
    -------
    tuple
        What :func:`.equation_kernels.moving_loops` returns, regular only where it is known from the projection;
        whether the acceleration is certain; it,
        shape (nv,); what :func:`.equation_kernels.missed` returns for it.
    """
    loops, scales, _, _ = unpacked_constants(constants[0], constants[1])
    worst, scaled, opening, speed, regular, finite = moving_loops(
        poses, J, dJ, v, loops, q, scales, gap, jacobian, rate, drift, False
    )
    row_scale, column, _ = scales
    tolerance, closed, massless = bounds
    nv, clear, a = len(v), False, np.zeros(len(v))
    M, heaviest = np.empty((nv, nv)), 0.0
    for i in range(nv):
        for k in range(i + 1):
            M[i, k] = M[k, i] = lower[i, k] * column[i] * column[k]
        heaviest = max(heaviest, abs(M[i, i]))
    if scaled <= closed or tolerance > 0.0:
        known = tolerance if tolerance > 0.0 else scaled
        start, basis, regular = nearest_motion(jacobian, -drift, scales, len(poses), known, True)
        count = basis.shape[1]
        A, z, push = np.zeros((count, count)), np.zeros(count), np.empty(nv)
        for i in range(nv):
            push[i] = column[i] * forces[i]
            for k in range(nv):
                push[i] -= M[i, k] * start[k] / column[k]
        trace = 0.0
        for s in range(count):
            for i in range(nv):
                z[s] += basis[i, s] * push[i]
                if basis[i, s] != 0.0:
                    for k in range(nv):
                        part = basis[i, s] * M[i, k]
                        for t in range(s + 1):
                            A[s, t] += part * basis[k, t]
            trace += A[s, s]
        clear = massless * max(trace, heaviest) * _inverse_size(A.copy()) < 1.0
        if clear:
            solve_cholesky(A, z)
            for i in range(nv):
                a[i] = start[i]
                for s in range(count):
                    a[i] += column[i] * basis[i, s] * z[s]
    found = worst, scaled, opening, speed, regular, finite
    return found, clear, a, missed(jacobian, drift, a, row_scale, column)
