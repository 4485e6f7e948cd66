"""Wrenches that the multipliers of all closures make, and how they change, compiled."""

from __future__ import annotations

from typing import Any

from ....core.compiled import kernel
from ...structure.projection import project, project_rate, relative_pose
from .closure_kernels import add_cross, new_scratch, twist_at


@kernel
def unit_wrenches(poses: Any, loops: Any, out: Any) -> None:
    """Fill the wrench that the body of frame a receives for a multiplier of one, row by row.

    The force part is also how a shift of frame a against frame b changes the residual.

    Parameters
    ----------
    poses, loops
        As for :func:`exo_pin.chain.kinematics.kernels.closure_kernels.residual`.
    out : ndarray
        Shape (rows, 6), filled: force and moment about the world's origin, world axes.
    """
    fill_units(poses, loops, new_scratch(), out)


@kernel(fills=True)
def fill_units(poses: Any, loops: Any, scratch: Any, out: Any) -> None:
    """:func:`unit_wrenches` with what :func:`~exo_pin.chain.kinematics.kernels.closure_kernels.new_scratch` makes."""
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


@kernel
def closure_wrench_rates(
    poses: Any, J: Any, directions: Any, loops: Any, c: int, multipliers: Any, rates: Any, out: Any
) -> None:
    """Change of one closure's wrench on the body of frame a, in the axes of a about the closure's point.

    Parameters
    ----------
    poses, J, loops
        As for :func:`exo_pin.chain.kinematics.kernels.closure_kernels.jacobian_rate`.
    directions : ndarray
        Shape (columns, nv), how the configuration changes.
    c : int
        The closure.
    multipliers, rates : ndarray
        λ, shape (rows,), and how it changes, shape (columns, rows).
    out : ndarray
        Shape (6, columns), filled.
    """
    joints, local, kinds, lengths, rows, signs, _, _, _ = loops
    frames, squares, parts = new_scratch()
    a, b, Q, S, dS = frames[0], frames[1], frames[2, :3], squares[0], squares[1]
    d, ignored, twist, V = parts[0], parts[1], parts[2], parts[3]
    relative_pose(poses, joints, local, c, a, b, d, Q)
    first, count = rows[c], rows[c + 1] - rows[c]
    project(kinds[c], d, Q, lengths[c], ignored[:count], S[:count])
    for s in range(len(directions)):
        twist[:] = 0.0
        for k in range(directions.shape[1]):
            for i in range(6):
                twist[i] += J[k, i] * signs[c, k] * directions[s, k]
        twist_at(twist, b[3], a, 1.0, V)
        project_rate(kinds[c], d, Q, V, dS[:count])
        for j in range(6):
            total = 0.0
            for i in range(count):
                total += S[i, j] * rates[s, first + i] + dS[i, j] * multipliers[first + i]
            out[j, s] = total
