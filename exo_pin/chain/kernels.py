"""The relative motion of closure frames, compiled: one residual, one Jacobian, one drift for every closure type.

A closure joins frame a of one body to frame b of another. Its relative pose is told as a sees it, in the axes of a:

* displacement ``d = R_aᵀ (p_a - p_b)``, how far a stands from b;
* turn ``θ = log(R_bᵀ R_a)``, the rotation vector that takes b to a (its components in a and b are the same).

The relative twist ``V = (R_aᵀ (v_a - v_b), R_aᵀ (ω_a - ω_b))``, velocities of the body points at p_b, is exactly
``(d', θ')`` as long as θ = 0, and ``d'`` always. A closure type selects what it forbids of both: its residual rows
are the selected components of (d, θ), its Jacobian rows those of V. Since θ is its own image under the derivative
of the logarithm, a Newton step on these rows is exact in θ however large the turn.

Layout of ``poses``, shape (..., 4, 3): rows 0 to 2 are the columns of R, row 3 is p, as Pinocchio keeps them.
World Jacobians are transposed, shape (nv, 6), linear part first, about the world's origin.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

__all__ = ["closure_wrenches", "drift", "residual", "residual_jacobian"]

_compile = njit(cache=True, error_model="numpy")

_RIGID, _SPHERICAL = 0, 1


@_compile
def _compose(parent: Any, local: Any, out: Any) -> None:
    """Pose of ``local`` in ``parent``; both and ``out`` have shape (4, 3)."""
    for i in range(4):
        for k in range(3):
            out[i, k] = local[i, 0] * parent[0, k] + local[i, 1] * parent[1, k] + local[i, 2] * parent[2, k]
    for k in range(3):
        out[3, k] += parent[3, k]


@_compile
def _log(Q: Any, out: Any) -> None:
    """Rotation vector of Q (shape (3, 3), entries Q[i, j]), accurate for small and large turns."""
    trace = Q[0, 0] + Q[1, 1] + Q[2, 2]
    if trace > 0.0:
        # The quaternion's vector part carries the full accuracy of a small turn.
        w = 0.5 * math.sqrt(1.0 + trace)
        x = (Q[2, 1] - Q[1, 2]) / (4.0 * w)
        y = (Q[0, 2] - Q[2, 0]) / (4.0 * w)
        z = (Q[1, 0] - Q[0, 1]) / (4.0 * w)
    elif Q[0, 0] >= Q[1, 1] and Q[0, 0] >= Q[2, 2]:
        x = 0.5 * math.sqrt(max(1.0 + Q[0, 0] - Q[1, 1] - Q[2, 2], 0.0))
        w = (Q[2, 1] - Q[1, 2]) / (4.0 * x)
        y = (Q[0, 1] + Q[1, 0]) / (4.0 * x)
        z = (Q[0, 2] + Q[2, 0]) / (4.0 * x)
    elif Q[1, 1] >= Q[2, 2]:
        y = 0.5 * math.sqrt(max(1.0 + Q[1, 1] - Q[0, 0] - Q[2, 2], 0.0))
        w = (Q[0, 2] - Q[2, 0]) / (4.0 * y)
        x = (Q[0, 1] + Q[1, 0]) / (4.0 * y)
        z = (Q[1, 2] + Q[2, 1]) / (4.0 * y)
    else:
        z = 0.5 * math.sqrt(max(1.0 + Q[2, 2] - Q[0, 0] - Q[1, 1], 0.0))
        w = (Q[1, 0] - Q[0, 1]) / (4.0 * z)
        x = (Q[0, 2] + Q[2, 0]) / (4.0 * z)
        y = (Q[1, 2] + Q[2, 1]) / (4.0 * z)
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    norm = math.sqrt(x * x + y * y + z * z)
    factor = 2.0 if norm == 0.0 else 2.0 * math.atan2(norm, w) / norm
    out[0], out[1], out[2] = factor * x, factor * y, factor * z


@_compile
def _relative(poses: Any, joints: Any, local: Any, c: int, a: Any, b: Any, d: Any, Q: Any) -> None:
    """Fill the world poses of the closure's frames and their relative pose."""
    _compose(poses[joints[c, 0]], local[c, 0], a)
    _compose(poses[joints[c, 1]], local[c, 1], b)
    for i in range(3):
        d[i] = a[i, 0] * (a[3, 0] - b[3, 0]) + a[i, 1] * (a[3, 1] - b[3, 1]) + a[i, 2] * (a[3, 2] - b[3, 2])
        for j in range(3):
            Q[i, j] = b[i, 0] * a[j, 0] + b[i, 1] * a[j, 1] + b[i, 2] * a[j, 2]


@_compile
def _fill_residual(kind: int, d: Any, Q: Any, out: Any) -> None:
    """Residual rows of one closure."""
    for i in range(3):
        out[i] = d[i]
    if kind == _RIGID:
        _log(Q, out[3:6])


@_compile
def _largest(values: Any) -> float:
    """Largest absolute value; NaN if one is NaN, so that no comparison with a tolerance lets it pass."""
    largest = 0.0
    for value in values:
        if math.isnan(value):
            return math.nan
        largest = max(largest, abs(value))
    return largest


@_compile
def residual(poses: Any, joints: Any, local: Any, kinds: Any, rows: Any, out: Any) -> float:
    """Fill the residual of all closures and return its largest entry.

    Parameters
    ----------
    poses : ndarray
        Shape (njoints, 4, 3), world poses of the joints.
    joints : ndarray of int
        Shape (m, 2), the joints that carry frames a and b.
    local : ndarray
        Shape (m, 2, 4, 3), the closure's frames in those joints.
    kinds, rows : ndarray of int
        Shape (m,) type codes; shape (m + 1,) first row of each closure.
    out : ndarray
        Shape (rows,), m and rad.
    """
    a, b, d, Q = np.empty((4, 3)), np.empty((4, 3)), np.empty(3), np.empty((3, 3))
    for c in range(len(kinds)):
        _relative(poses, joints, local, c, a, b, d, Q)
        _fill_residual(kinds[c], d, Q, out[rows[c] : rows[c + 1]])
    return _largest(out)


@_compile
def residual_jacobian(
    poses: Any, J: Any, joints: Any, local: Any, kinds: Any, rows: Any, signs: Any, out: Any, jacobian: Any
) -> float:
    """Fill residual and Jacobian of all closures and return the largest residual.

    Parameters
    ----------
    poses, joints, local, kinds, rows, out
        As for :func:`residual`.
    J : ndarray
        Shape (nv, 6), the joints' world Jacobian.
    signs : ndarray
        Shape (m, nv): +1 for coordinates that move frame a only, -1 for frame b only, 0 otherwise.
    jacobian : ndarray
        Shape (rows, nv), filled.
    """
    a, b, d, Q = np.empty((4, 3)), np.empty((4, 3)), np.empty(3), np.empty((3, 3))
    for c in range(len(kinds)):
        _relative(poses, joints, local, c, a, b, d, Q)
        first, count = rows[c], rows[c + 1] - rows[c]
        _fill_residual(kinds[c], d, Q, out[first : first + count])
        for k in range(J.shape[0]):
            sign = signs[c, k]
            if sign == 0.0:
                for i in range(count):
                    jacobian[first + i, k] = 0.0
                continue
            wx, wy, wz = J[k, 3], J[k, 4], J[k, 5]
            # v + ω × p_b
            vx = J[k, 0] + wy * b[3, 2] - wz * b[3, 1]
            vy = J[k, 1] + wz * b[3, 0] - wx * b[3, 2]
            vz = J[k, 2] + wx * b[3, 1] - wy * b[3, 0]
            for i in range(3):
                jacobian[first + i, k] = sign * (a[i, 0] * vx + a[i, 1] * vy + a[i, 2] * vz)
            if count == 6:
                for i in range(3):
                    jacobian[first + 3 + i, k] = sign * (a[i, 0] * wx + a[i, 1] * wy + a[i, 2] * wz)
    return _largest(out)


@_compile
def drift(poses: Any, J: Any, dJ: Any, v: Any, joints: Any, local: Any, rows: Any, supports: Any, out: Any) -> None:
    """Fill the drift, (d/dt Jacobian) v, of all closures.

    Parameters
    ----------
    poses, J, joints, local, rows
        As for :func:`residual_jacobian`.
    dJ : ndarray
        Shape (nv, 6), time derivative of the world Jacobian.
    v : ndarray
        Shape (nv,).
    supports : ndarray
        Shape (m, 2, nv): 1 for coordinates that move frame a (b), else 0.
    out : ndarray
        Shape (rows,), m/s² and rad/s².
    """
    a, b = np.empty((4, 3)), np.empty((4, 3))
    twist_a, twist_b, bias, acceleration = np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    for c in range(len(rows) - 1):
        _compose(poses[joints[c, 0]], local[c, 0], a)
        _compose(poses[joints[c, 1]], local[c, 1], b)
        twist_a[:], twist_b[:], bias[:] = 0.0, 0.0, 0.0
        for k in range(len(v)):
            in_a, in_b = supports[c, 0, k] * v[k], supports[c, 1, k] * v[k]
            for i in range(6):
                twist_a[i] += J[k, i] * in_a
                twist_b[i] += J[k, i] * in_b
                bias[i] += dJ[k, i] * (in_a - in_b)
        p = b[3]
        # Velocity of the point p_b of frame b, and relative twist of the body points there.
        moving = np.cross(twist_b[3:], p) + twist_b[:3]
        spin = twist_a[3:] - twist_b[3:]
        relative = twist_a[:3] - twist_b[:3] + np.cross(spin, p)
        omega = twist_a[3:]
        # d/dt of R_aᵀ (v + ω × p_b) and of R_aᵀ ω, world-coordinate bias first.
        acceleration[:3] = bias[:3] + np.cross(bias[3:], p) + np.cross(spin, moving) - np.cross(omega, relative)
        acceleration[3:] = bias[3:] - np.cross(omega, spin)
        first, count = rows[c], rows[c + 1] - rows[c]
        for i in range(count):
            axis, part = i % 3, 3 * (i // 3)
            out[first + i] = (
                a[axis, 0] * acceleration[part]
                + a[axis, 1] * acceleration[part + 1]
                + a[axis, 2] * acceleration[part + 2]
            )


@_compile
def _add_wrench(pose: Any, force: Any, moment: Any, sign: float, out: Any) -> None:
    """Add a wrench about the world's origin, world axes, to the one of a joint, in its own frame."""
    p = pose[3]
    mx = moment[0] - (p[1] * force[2] - p[2] * force[1])
    my = moment[1] - (p[2] * force[0] - p[0] * force[2])
    mz = moment[2] - (p[0] * force[1] - p[1] * force[0])
    for i in range(3):
        out[i] += sign * (pose[i, 0] * force[0] + pose[i, 1] * force[1] + pose[i, 2] * force[2])
        out[3 + i] += sign * (pose[i, 0] * mx + pose[i, 1] * my + pose[i, 2] * mz)


@_compile
def closure_wrenches(poses: Any, multipliers: Any, joints: Any, local: Any, rows: Any, wrenches: Any, out: Any) -> None:
    """Turn multipliers into wrenches on the bodies that the closures join.

    Parameters
    ----------
    poses, joints, local, rows
        As for :func:`residual`.
    multipliers : ndarray
        Shape (rows,), N and N m.
    wrenches : ndarray
        Shape (m, 6), filled: the wrench on the body of frame a, force and moment about the world's origin,
        world axes.
    out : ndarray
        Shape (njoints, 6); both bodies' wrenches are added, each in its joint's own frame.
    """
    a, b = np.empty((4, 3)), np.empty((4, 3))
    for c in range(len(rows) - 1):
        _compose(poses[joints[c, 0]], local[c, 0], a)
        _compose(poses[joints[c, 1]], local[c, 1], b)
        first, count = rows[c], rows[c + 1] - rows[c]
        for k in range(6):
            wrenches[c, k] = 0.0
        for i in range(count):
            axis, part = i % 3, 3 * (i // 3)
            for k in range(3):
                wrenches[c, part + k] += a[axis, k] * multipliers[first + i]
        force, moment, p = wrenches[c, :3], wrenches[c, 3:], b[3]
        moment[0] += p[1] * force[2] - p[2] * force[1]
        moment[1] += p[2] * force[0] - p[0] * force[2]
        moment[2] += p[0] * force[1] - p[1] * force[0]
        _add_wrench(poses[joints[c, 0]], force, moment, 1.0, out[joints[c, 0]])
        _add_wrench(poses[joints[c, 1]], force, moment, -1.0, out[joints[c, 1]])
