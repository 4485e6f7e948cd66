"""All closures of a chain at once, compiled: residual, Jacobian and its rate, and the least step that closes them.

What a closure type forbids is defined in :mod:`exo_pin.chain.structure.projection`; everything here goes through
its projection, except couplings, which join positions of joints
(:mod:`exo_pin.chain.structure.couplings`).

Wrenches that the multipliers of all closures make, and how they change, compiled.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ....core.compiled import kernel
from ....numerics.small_linear import solve_cholesky
from ...structure.couplings import couple, couple_rates
from ...structure.projection import COUPLED_ANGLE, project, project_rate, projection_turns, relative_pose


@kernel(fills=True)
def _largest(values: Any) -> float:
    """Largest absolute value; NaN if one is NaN, so that no comparison with a tolerance lets it pass."""
    largest = 0.0
    for value in values:
        if math.isnan(value):
            return math.nan
        largest = max(largest, abs(value))
    return largest


@kernel
def new_scratch() -> Any:
    """Frames, matrices and rows for functions that make no array: to make one takes longer than to fill a small one."""
    return np.empty((3, 4, 3)), np.empty((3, 6, 6)), np.empty((20, 6))


@kernel
def residual_jacobian(poses: Any, J: Any, loops: Any, q: Any, out: Any, jacobian: Any) -> float:
    """Fill residual and Jacobian of all closures and return the largest residual.

    Parameters
    ----------
    poses : ndarray
        Shape (njoints, 4, 3), world poses of the joints.
    J : ndarray
        Shape (nv, 6), the joints' world Jacobian; no rows where the residual alone is needed.
    loops : tuple of ndarray
        The closures, :attr:`exo_pin.chain.structure.topology.Topology.loops`.
    q : ndarray
        Shape (nq,).
    out : ndarray
        Shape (rows,), m and rad.
    jacobian : ndarray
        Shape (rows, nv), filled; no rows where the residual alone is needed.
    """
    return fill_residual(poses, J, loops, q, new_scratch(), out, jacobian)


@kernel(fills=True)
def fill_residual(poses: Any, J: Any, loops: Any, q: Any, scratch: Any, out: Any, jacobian: Any) -> float:
    """:func:`residual_jacobian` with what :func:`new_scratch` makes."""
    joints, local, kinds, lengths, rows, signs, _, coupled, polynomials = loops
    frames, squares, parts = scratch
    a, b, Q, S, d, V = frames[0], frames[1], frames[2, :3], squares[0], parts[0], parts[1]
    for c in range(len(kinds)):
        relative_pose(poses, joints, local, c, a, b, d, Q)
        first, count, kind = rows[c], rows[c + 1] - rows[c], kinds[c]
        project(kind, d, Q, lengths[c], out[first : first + count], S[:count])
        turns, own = projection_turns(kind), jacobian[first : first + count]
        own[:] = 0.0
        for k in range(J.shape[0]):
            sign = signs[c, k]
            if sign == 0.0 or kind >= COUPLED_ANGLE:
                continue
            twist_at(J[k], b[3], a, sign, V)
            if not turns:
                # The rows are components of the twist.
                filled = 0
                for j in range(3):
                    if kind >> j & 1:
                        own[filled, k] = V[j]
                        filled += 1
                for j in range(filled, count):
                    own[j, k] = V[3 + j - filled]
                continue
            for i in range(count):
                total = 0.0
                for j in range(6):
                    total += S[i, j] * V[j]
                own[i, k] = total
    couple(q, coupled, polynomials, out, jacobian)
    return _largest(out)


@kernel(fills=True)
def twist_at(twist: Any, p: Any, a: Any, sign: float, out: Any) -> None:
    """A world twist about the origin, referred to the point p, in the axes of a."""
    wx, wy, wz = twist[3], twist[4], twist[5]
    vx = twist[0] + wy * p[2] - wz * p[1]
    vy = twist[1] + wz * p[0] - wx * p[2]
    vz = twist[2] + wx * p[1] - wy * p[0]
    for i in range(3):
        out[i] = sign * (a[i, 0] * vx + a[i, 1] * vy + a[i, 2] * vz)
        out[3 + i] = sign * (a[i, 0] * wx + a[i, 1] * wy + a[i, 2] * wz)


@kernel(fills=True)
def add_cross(u: Any, v: Any, sign: float, out: Any) -> None:
    """Add ± u × v to ``out``."""
    out[0] += sign * (u[1] * v[2] - u[2] * v[1])
    out[1] += sign * (u[2] * v[0] - u[0] * v[2])
    out[2] += sign * (u[0] * v[1] - u[1] * v[0])


@kernel
def jacobian_rate(poses: Any, J: Any, dJ: Any, v: Any, loops: Any, q: Any, out: Any, drift: Any) -> None:
    """Fill the time derivative of the closures' Jacobian, and the drift, its product with v.

    Parameters
    ----------
    poses, J, loops, q
        As for :func:`residual_jacobian`.
    dJ : ndarray
        Shape (nv, 6), time derivative of the world Jacobian.
    v : ndarray
        Shape (nv,).
    out : ndarray
        Shape (rows, nv), filled.
    drift : ndarray
        Shape (rows,), filled, m/s² and rad/s².
    """
    fill_rate(poses, J, dJ, v, loops, q, new_scratch(), out, drift)


@kernel(fills=True)
def moves_within(supports: Any, c: int, v: Any) -> bool:
    """Whether a velocity moves the bodies of closure c against each other; as one body they change none of its rows."""
    found = False
    for k in range(len(v)):
        found = found or (v[k] != 0.0 and supports[c, 0, k] != supports[c, 1, k])
    return found


@kernel(fills=True)
def fill_rate(poses: Any, J: Any, dJ: Any, v: Any, loops: Any, q: Any, scratch: Any, out: Any, drift: Any) -> None:
    """:func:`jacobian_rate` with what :func:`new_scratch` makes."""
    joints, local, kinds, lengths, rows, _, supports, coupled, polynomials = loops
    frames, squares, parts = scratch
    a, b, Q, S, dS = frames[0], frames[1], frames[2, :3], squares[0], squares[1]
    ignored, twist_a, twist_b, V, W, relative, moving = (
        parts[0], parts[1], parts[2], parts[3], parts[4], parts[5], parts[6],
    )  # fmt: skip
    point, omega, d = parts[7], parts[8], parts[9]
    for c in range(len(rows) - 1):
        first, count = rows[c], rows[c + 1] - rows[c]
        if not moves_within(supports, c, v):
            out[first : first + count], drift[first : first + count] = 0.0, 0.0
            continue
        relative_pose(poses, joints, local, c, a, b, d, Q)
        project(kinds[c], d, Q, lengths[c], ignored[:count], S[:count])
        twist_a[:], twist_b[:] = 0.0, 0.0
        for k in range(len(v)):
            for i in range(6):
                twist_a[i] += J[k, i] * supports[c, 0, k] * v[k]
                twist_b[i] += J[k, i] * supports[c, 1, k] * v[k]
        p = b[3]
        for i in range(6):
            moving[i] = twist_a[i] - twist_b[i]
        twist_at(moving, p, a, 1.0, relative)
        turns = projection_turns(kinds[c])
        if turns:
            project_rate(kinds[c], d, Q, relative, dS[:count])
        # Velocity of the point p_b of frame b, and the turning of a in its own axes.
        for i in range(3):
            point[i] = twist_b[i]
        add_cross(twist_b[3:], p, 1.0, point)
        for i in range(3):
            omega[i] = a[i, 0] * twist_a[3] + a[i, 1] * twist_a[4] + a[i, 2] * twist_a[5]
        drift[first : first + count] = 0.0
        for k in range(len(v)):
            sign = supports[c, 0, k] - supports[c, 1, k]
            if sign == 0.0:
                for i in range(count):
                    out[first + i, k] = 0.0
                continue
            # d/dt of R_aᵀ (v + ω × p_b) and R_aᵀ ω: what changes in the world, less the turning of a's axes.
            x, y, z = sign * J[k, 3], sign * J[k, 4], sign * J[k, 5]
            vx = sign * J[k, 0] + y * p[2] - z * p[1]
            vy = sign * J[k, 1] + z * p[0] - x * p[2]
            vz = sign * J[k, 2] + x * p[1] - y * p[0]
            dx, dy, dz = sign * dJ[k, 3], sign * dJ[k, 4], sign * dJ[k, 5]
            wx = sign * dJ[k, 0] + dy * p[2] - dz * p[1] + y * point[2] - z * point[1]
            wy = sign * dJ[k, 1] + dz * p[0] - dx * p[2] + z * point[0] - x * point[2]
            wz = sign * dJ[k, 2] + dx * p[1] - dy * p[0] + x * point[1] - y * point[0]
            for i in range(3):
                V[i] = a[i, 0] * vx + a[i, 1] * vy + a[i, 2] * vz
                V[3 + i] = a[i, 0] * x + a[i, 1] * y + a[i, 2] * z
                W[i] = a[i, 0] * wx + a[i, 1] * wy + a[i, 2] * wz
                W[3 + i] = a[i, 0] * dx + a[i, 1] * dy + a[i, 2] * dz
            for i in (0, 3):
                W[i] -= omega[1] * V[i + 2] - omega[2] * V[i + 1]
                W[i + 1] -= omega[2] * V[i] - omega[0] * V[i + 2]
                W[i + 2] -= omega[0] * V[i + 1] - omega[1] * V[i]
            for i in range(count):
                total = 0.0
                for j in range(6):
                    total += S[i, j] * W[j]
                if turns:
                    for j in range(6):
                        total += dS[i, j] * V[j]
                out[first + i, k] = total
                drift[first + i] += total * v[k]
    couple_rates(q, v, coupled, polynomials, out, drift)


@kernel(fills=True)
def scaled_norm(gap: Any, scale: Any) -> float:
    """Length of the gap, metres divided by the characteristic length."""
    total = 0.0
    for i in range(len(gap)):
        total += (gap[i] * scale[i]) ** 2
    return math.sqrt(total)


@kernel
def least_step(jacobian: Any, gap: Any, row_scale: Any, weight: Any, damping: float, blocks: Any, out: Any) -> None:
    """Fill the damped least step towards a closed configuration.

    Minimises |D (J x + r)|² + damping |x|²_{W⁻¹} with D = diag(row_scale), W = diag(weight): x = W Jᵀ D y with
    (D J W Jᵀ D + damping I) y = -D r, solved by Cholesky, block by block. A coordinate of weight 0 does not move.

    Parameters
    ----------
    jacobian, gap : ndarray
        Shape (rows, nv) and (rows,).
    row_scale, weight : ndarray
        Shape (rows,) and (nv,).
    damping : float
        Above zero, relative to the mean of the matrix's diagonal.
    blocks : tuple of ndarray
        As in :mod:`exo_pin.chain.structure.topology`.
    out : ndarray
        Shape (nv,), filled.
    """
    rows, columns, row_starts, column_starts = blocks
    widest, highest = 0, 0
    for b in range(len(row_starts) - 1):
        highest = max(highest, row_starts[b + 1] - row_starts[b])
        widest = max(widest, column_starts[b + 1] - column_starts[b])
    # Scaled columns, one after the other, so that the inner loop runs along memory.
    B, A, y = np.empty((widest, highest)), np.empty((highest, highest)), np.empty(highest)
    trace = 0.0
    for i in range(jacobian.shape[0]):
        total = 0.0
        for k in range(jacobian.shape[1]):
            total += jacobian[i, k] * jacobian[i, k] * weight[k]
        trace += total * row_scale[i] * row_scale[i]
    shift = damping * trace / jacobian.shape[0]
    out[:] = 0.0
    for b in range(len(row_starts) - 1):
        own, moved = rows[row_starts[b] : row_starts[b + 1]], columns[column_starts[b] : column_starts[b + 1]]
        n = len(own)
        A[:n, :n] = 0.0
        for k in range(len(moved)):
            for i in range(n):
                B[k, i] = row_scale[own[i]] * jacobian[own[i], moved[k]]
            for i in range(n):
                part = B[k, i] * weight[moved[k]]
                if part != 0.0:
                    for j in range(i + 1):
                        A[i, j] += part * B[k, j]
        for i in range(n):
            A[i, i] += shift
            y[i] = -row_scale[own[i]] * gap[own[i]]
        solve_cholesky(A[:n, :n], y[:n])
        for k in range(len(moved)):
            total = 0.0
            for i in range(n):
                total += B[k, i] * y[i]
            out[moved[k]] = weight[moved[k]] * total


@kernel(fills=True)
def fill_units(poses: Any, loops: Any, scratch: Any, out: Any) -> None:
    """Fill the wrench that the body of frame a receives for a multiplier of one, row by row.

    The force part is also how a shift of frame a against frame b changes the residual.

    Parameters
    ----------
    poses, loops
        As for :func:`residual_jacobian`.
    scratch : tuple
        What :func:`new_scratch` makes.
    out : ndarray
        Shape (rows, 6), filled: force and moment about the world's origin, world axes.
    """
    joints, local, kinds, lengths, rows, _, _, _, _ = loops
    frames, squares, parts = scratch
    a, b, Q, S, d, ignored = frames[0], frames[1], frames[2, :3], squares[0], parts[0], parts[1]
    for c in range(len(rows) - 1):
        relative_pose(poses, joints, local, c, a, b, d, Q)
        first, count = rows[c], rows[c + 1] - rows[c]
        project(kinds[c], d, Q, lengths[c], ignored[:count], S[:count])
        for i in range(count):
            wrench = out[first + i]
            for k in range(3):
                wrench[k] = S[i, 0] * a[0, k] + S[i, 1] * a[1, k] + S[i, 2] * a[2, k]
                wrench[3 + k] = S[i, 3] * a[0, k] + S[i, 4] * a[1, k] + S[i, 5] * a[2, k]
            add_cross(b[3], wrench, 1.0, wrench[3:])
