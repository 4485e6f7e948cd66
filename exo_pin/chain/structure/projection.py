"""The relative motion of closure frames, compiled: residual, Jacobian and drift of every closure type, by its rules.

A closure joins frame a of one body to frame b of another. Its relative pose is expressed in the axes of a:

* displacement ``d = R_aᵀ (p_a - p_b)``, from b to a;
* turn ``θ = log(R_bᵀ R_a)``, the rotation vector that takes b to a (its components in a and b are the same);
* tilt ``t``, the x and y of the least rotation that takes b's z axis to a's.

The relative twist ``V = (R_aᵀ (v_a - v_b), R_aᵀ (ω_a - ω_b))``, velocities of the body points at p_b, is exactly
``(d', θ')`` as long as θ = 0, and ``d'`` always. A closure is a projection ``S`` of this twist: its Jacobian rows are
``S V``, and its residual is a function whose rate on closed loops is ``S V``. Its kind is the sum of two rules, of the
rows in metres and of those in radians (:data:`LINEAR`, :data:`ANGULAR`):

=========== ==== ===================== ===============================================
S is constant in the axes of a except for "cross" and "length", whose rate enters the drift. Since θ and t are their
own images under the derivative of the logarithm, a Newton step on these rows is exact in them however large the turn.

Layout of ``poses``, shape (..., 4, 3): rows 0 to 2 are the columns of R, row 3 is p, as Pinocchio stores them.
World Jacobians are transposed, shape (nv, 6), linear part first, about the world's origin.
"""

from __future__ import annotations

import math
from typing import Any

from ...core.compiled import kernel

_LENGTH, _TILT, _LOG, _CROSS = 8, 16, 32, 48
_ANGULAR = 48
#: The kinds of couplings, by the unit of their row; no other kind is as large.
COUPLED_ANGLE, COUPLED_LENGTH = 64, 65

#: Rules of the rows in metres: which axes of a the displacement must not have, bit by bit, or its length.
LINEAR = {"": 0, "x": 1, "y": 2, "xy": 3, "z": 4, "xz": 5, "yz": 6, "xyz": 7, "length": _LENGTH}
#: Rules of the rows in radians: their number and their part of the kind.
ANGULAR = {"": (0, 0), "xy": (2, _TILT), "xyz": (3, _LOG), "cross": (1, _CROSS), "joints": (1, COUPLED_ANGLE)}

#: Below this distance the line between two points has no direction, m.
_NO_DIRECTION = 1e-12


@kernel(inline=True, fills=True)
def compose(parent: Any, local: Any, out: Any) -> None:
    """Pose of ``local`` in ``parent``; both and ``out`` have shape (4, 3)."""
    for k in range(3):
        x, y, z, p = parent[0, k], parent[1, k], parent[2, k], parent[3, k]
        for i in range(3):
            out[i, k] = local[i, 0] * x + local[i, 1] * y + local[i, 2] * z
        out[3, k] = local[3, 0] * x + local[3, 1] * y + local[3, 2] * z + p


@kernel(fills=True)
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


@kernel(fills=True)
def relative_pose(poses: Any, joints: Any, local: Any, c: int, a: Any, b: Any, d: Any, Q: Any) -> None:
    """Fill the world poses of the closure's frames and their relative pose."""
    compose(poses[joints[c, 0]], local[c, 0], a)
    compose(poses[joints[c, 1]], local[c, 1], b)
    for i in range(3):
        d[i] = a[i, 0] * (a[3, 0] - b[3, 0]) + a[i, 1] * (a[3, 1] - b[3, 1]) + a[i, 2] * (a[3, 2] - b[3, 2])
        for j in range(3):
            Q[i, j] = b[i, 0] * a[j, 0] + b[i, 1] * a[j, 1] + b[i, 2] * a[j, 2]


@kernel(fills=True)
def _tilt(Q: Any, out: Any) -> None:
    """x and y of the least rotation from b's z axis to a's, in the axes of a."""
    # b's z axis in the axes of a is the last row of Q; turning it to (0, 0, 1) is about (y, -x, 0).
    x, y, z = Q[2, 0], Q[2, 1], Q[2, 2]
    sine = math.hypot(x, y)
    if sine < 1e-150:
        # Parallel, or opposite: then any axis will do.
        out[0], out[1] = (0.0, 0.0) if z >= 0.0 else (math.pi, 0.0)
        return
    factor = math.atan2(sine, z) / sine
    out[0], out[1] = factor * y, -factor * x


@kernel(fills=True)
def project(kind: int, d: Any, Q: Any, length: float, out: Any, S: Any) -> None:
    """Residual rows of one closure and the projection S, shape (rows, 6), that its Jacobian takes of the twist."""
    S[:] = 0.0
    if kind >= COUPLED_ANGLE:
        # The wrench of a multiplier of one, on no body: it gives the multiplier its size among the forces.
        out[0] = 0.0
        S[0, 2 if kind == COUPLED_LENGTH else 5] = 1.0
        return
    first, turn = 0, kind & _ANGULAR
    if kind & _LENGTH:
        size = math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        out[0], first = size - length, 1
        if size < _NO_DIRECTION:
            # Coinciding points may part in any direction.
            S[0, 2] = 1.0
        else:
            for i in range(3):
                S[0, i] = d[i] / size
    for i in range(3):
        if kind >> i & 1:
            out[first] = d[i]
            S[first, i] = 1.0
            first += 1
    if turn == _CROSS:
        # x_a × y_b in the axes of a; y_b there is the middle row of Q.
        sine, size = Q[1, 0], math.hypot(Q[1, 1], Q[1, 2])
        out[first] = math.atan2(sine, size)
        if size < _NO_DIRECTION:
            S[first, 5] = 1.0
        else:
            S[first, 4], S[first, 5] = -Q[1, 2] / size, Q[1, 1] / size
        return
    for i in range(first, out.shape[0]):
        S[i, 3 + i - first] = 1.0
    if turn == _LOG:
        _log(Q, out[first : first + 3])
    elif turn == _TILT:
        _tilt(Q, out[first : first + 2])


@kernel(fills=True)
def projection_turns(kind: int) -> bool:
    """Whether S changes in the axes of a; couplings have none."""
    return kind < COUPLED_ANGLE and (kind & _LENGTH != 0 or kind & _ANGULAR == _CROSS)


@kernel(fills=True)
def project_rate(kind: int, d: Any, Q: Any, twist: Any, out: Any) -> None:
    """Rate of S in the axes of a, shape (rows, 6), while frame a moves with the relative twist."""
    out[:] = 0.0
    if kind & _LENGTH:
        size = math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        if size >= _NO_DIRECTION:
            along = (d[0] * twist[0] + d[1] * twist[1] + d[2] * twist[2]) / size
            for i in range(3):
                out[0, i] = (twist[i] - along * d[i] / size) / size
    if kind & _ANGULAR == _CROSS:
        size = math.hypot(Q[1, 1], Q[1, 2])
        if size < _NO_DIRECTION:
            return
        # y_b in the axes of a turns with -ω: its rate is y × ω.
        y_rate = Q[1, 2] * twist[3] - Q[1, 0] * twist[5]
        z_rate = Q[1, 0] * twist[4] - Q[1, 1] * twist[3]
        # S is (-z, y)/|(y, z)| in the plane across x_a: it turns by the angle's rate.
        turning, last = (Q[1, 1] * z_rate - Q[1, 2] * y_rate) / (size * size), out.shape[0] - 1
        out[last, 4], out[last, 5] = -turning * Q[1, 1] / size, -turning * Q[1, 2] / size


@kernel(fills=True)
def project_rate_change(kind: int, d: Any, Q: Any, twist: Any, along: Any, out: Any) -> None:
    """Change of :func:`project_rate` at a constant twist, while frame a moves with the relative twist ``along``."""
    out[:] = 0.0
    if kind & _LENGTH:
        size = math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        if size >= _NO_DIRECTION:
            # S is n = d/|d|, its rate (V - n n·V)/|d|.
            rate = (d[0] * along[0] + d[1] * along[1] + d[2] * along[2]) / size
            own = (d[0] * twist[0] + d[1] * twist[1] + d[2] * twist[2]) / size
            turning = 0.0
            for i in range(3):
                turning += (along[i] - rate * d[i] / size) / size * twist[i]
            for i in range(3):
                n = d[i] / size
                out[0, i] = (
                    -((along[i] - rate * n) / size * own + n * turning + (twist[i] - n * own) * rate / size) / size
                )
    if kind & _ANGULAR == _CROSS:
        x, y, z = Q[1, 0], Q[1, 1], Q[1, 2]
        square = y * y + z * z
        if math.sqrt(square) < _NO_DIRECTION:
            return
        # S turns by the rate φ' = -ω_x + x (y ω_y + z ω_z)/(y² + z²), and y_b by y_b × ω.
        dx, dy, dz = y * along[5] - z * along[4], z * along[3] - x * along[5], x * along[4] - y * along[3]
        part = y * twist[4] + z * twist[5]
        own, other = x * part / square - twist[3], x * (y * along[4] + z * along[5]) / square - along[3]
        change = (dx * part + x * (dy * twist[4] + dz * twist[5])) / square
        change -= 2.0 * x * part * (y * dy + z * dz) / (square * square)
        size, last = math.sqrt(square), out.shape[0] - 1
        out[last, 4] = (-change * y + own * other * z) / size
        out[last, 5] = (-change * z - own * other * y) / size
