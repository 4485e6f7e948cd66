"""Equations of motion of the plant in minimal coordinates on the rotation group, compiled.

The arm turns about O: I ω' + ω × I ω = M, with I about O in the base frame, and

    M = Σ T_i (s_i × b_i) + C × m g + load + stops - c ω - μ z_s

(a limb pulls with -T_i s_i at b_i). The orientation is R = exp(ξ) R_0 with R_0 that at the start of a step, so that
ξ' = ω - ξ × ω/2 + c(|ξ|) ξ × (ξ × ω) and no chart is ever left. The tensions T_i are those of the drives
(:mod:`.drive_kernels`), the friction z of the shoulder is that of :mod:`.friction_kernels`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from ....core.compiled import kernel
from ....core.validation import FloatArray
from ....numerics.vectors import cross, dot, limb, matrix, rotation_matrix, turn, vector
from .drive_kernels import drive_rates, manifold_rates
from .friction_kernels import slip
from .stop_kernels import stop_moment

#: Columns of :attr:`Tables.shoulder`.
SHOULDER = (
    "viscous", "coulomb", "presliding", "stops", "stop_centre", "stop_half", "side", "stop_stiffness", "stop_damping",
)  # fmt: skip


class Tables(NamedTuple):
    """What the equations of a plant with n limbs are made of; all arrays of floats.

    Attributes
    ----------
    base, platform : ndarray
        Shape (n, 3), A_i in the base frame and B_i in the arm's, m.
    centre, gravity : ndarray
        Shape (3,): centre of mass in the arm's axes, m; m/s².
    mass : float
        kg.
    inertia, inverse : ndarray
        Shape (3, 3): inertia about O in the arm's axes, kg m², and its inverse.
    force, point : ndarray
        Shape (3,): a constant force in the base frame, N, and where it acts, arm's axes, m.
    law : ndarray
        Shape (n, I, J), N, coefficients of the static laws by powers of strain and bar.
    muscles, motors : ndarray
        Shapes (n, len(COLUMNS)) and (n, len(MOTOR_COLUMNS)): the drive of each limb in the one or the other.
    shoulder, air : ndarray
        Shapes (len(SHOULDER),) and (len(AIR),).
    """

    base: FloatArray
    platform: FloatArray
    centre: FloatArray
    gravity: FloatArray
    mass: float
    inertia: FloatArray
    inverse: FloatArray
    force: FloatArray
    point: FloatArray
    law: FloatArray
    muscles: FloatArray
    motors: FloatArray
    shoulder: FloatArray
    air: FloatArray


def state_size(n: int) -> int:
    """Length of the state of a plant with n limbs.

    ξ, ω (3 each), state of the drives (n: absolute pressure of a muscle, length that a motor drive lets out), friction
    of the drives (n) and of the shoulder (3), pressure of the manifold; then integrals: work of the tensions (n), of
    air and motors (n), loss in the drives (n), in the shoulder, air from the supply and air to the atmosphere, kg;
    then speed of the motor drives (n), and the integral of their electric power (n).
    """
    return 13 + 7 * n


@kernel
def turned(x: float, y: float, z: float) -> Any:
    """Quaternion (x, y, z, w) of the rotation vector."""
    square = x * x + y * y + z * z
    angle = math.sqrt(square)
    factor = math.sin(0.5 * angle) / angle if angle > 1e-4 else 0.5 - square / 48.0
    return factor * x, factor * y, factor * z, math.cos(0.5 * angle)


@kernel
def moved_quaternion(q: Any, y: Any) -> Any:
    """Quaternion (x, y, z, w) of exp(ξ) R_0, of length 1 to rounding."""
    a = turned(y[0], y[1], y[2])
    return (
        a[3] * q[0] + a[0] * q[3] + a[1] * q[2] - a[2] * q[1],
        a[3] * q[1] - a[0] * q[2] + a[1] * q[3] + a[2] * q[0],
        a[3] * q[2] + a[0] * q[1] - a[1] * q[0] + a[2] * q[3],
        a[3] * q[3] - a[0] * q[0] - a[1] * q[1] - a[2] * q[2],
    )


@kernel
def rows_of(q: Any, y: Any) -> Any:
    """Rows of the matrix exp(ξ) R_0."""
    x, yy, z, w = moved_quaternion(q, y)
    return rotation_matrix(x, yy, z, w)


@kernel
def _chart_rate(y: Any, w: Any, out: Any) -> None:
    """ξ' for an angular velocity in the base frame."""
    xi = (y[0], y[1], y[2])
    square = dot(xi, xi)
    angle = math.sqrt(square)
    if angle > 1e-3:
        factor = 1.0 / square - (1.0 + math.cos(angle)) / (2.0 * angle * math.sin(angle))
    else:
        factor = 1.0 / 12.0 + square / 720.0
    first = cross(xi, w)
    second = cross(xi, first)
    for j in range(3):
        out[j] = w[j] - 0.5 * first[j] + factor * second[j]


@kernel
def rates(t: Any, flows: Any, q: Any, y: Any, out: Any) -> None:
    """Fill the rates of the state ``y`` relative to the orientation of the quaternion ``q`` (x, y, z, w).

    Source: thesis (D-2), (D-6), (D-10).
    """
    n = t.base.shape[0]
    R = rows_of(q, y)
    w = (y[3], y[4], y[5])
    _chart_rate(y, w, out)
    C = turn(R, t.centre)
    M = cross(C, (t.mass * t.gravity[0], t.mass * t.gravity[1], t.mass * t.gravity[2]))
    lever = cross(turn(R, t.point), (t.force[0], t.force[1], t.force[2]))
    Mx, My, Mz = M[0] + lever[0], M[1] + lever[1], M[2] + lever[2]
    drawn, let_out = 0.0, 0.0
    for i in range(n):
        b, s, _, length, _, _ = limb(R, vector(t.base, i), vector(t.platform, i))
        speed = dot(cross(b, s), w)
        pull, filled, vented = drive_rates(t, flows, i, y, speed, length, out)
        moment = cross(s, b)
        Mx += pull * moment[0]
        My += pull * moment[1]
        Mz += pull * moment[2]
        drawn += filled
        let_out += vented
    joint = t.shoulder
    loss = 0.0
    if joint[3] > 0.0:
        stop, loss, _ = stop_moment(R, w, joint[4], joint[5], joint[6], joint[7], joint[8])
        Mx, My, Mz = Mx + stop[0], My + stop[1], Mz + stop[2]
    z = (y[6 + 2 * n], y[7 + 2 * n], y[8 + 2 * n])
    slipping = slip(dot(w, z), math.sqrt(dot(z, z))) * math.sqrt(dot(w, w))
    for j in range(3):
        out[6 + 2 * n + j] = (w[j] - slipping * z[j]) / joint[2]
    Mx -= joint[0] * w[0] + joint[1] * z[0]
    My -= joint[0] * w[1] + joint[1] * z[1]
    Mz -= joint[0] * w[2] + joint[1] * z[2]
    out[10 + 5 * n] = loss + joint[0] * dot(w, w) + joint[1] * dot(z, w)
    _turn_arm(t, R, w, (Mx, My, Mz), out)
    manifold_rates(t, y, drawn, let_out, out)


@kernel
def _turn_arm(t: Any, R: Any, w: Any, M: Any, out: Any) -> None:
    """Angular acceleration from the moment about O."""
    back = ((R[0][0], R[1][0], R[2][0]), (R[0][1], R[1][1], R[2][1]), (R[0][2], R[1][2], R[2][2]))
    own, moment = turn(back, w), turn(back, M)
    inertia, inverse = matrix(t.inertia), matrix(t.inverse)
    gyroscopic = cross(own, turn(inertia, own))
    own = turn(inverse, (moment[0] - gyroscopic[0], moment[1] - gyroscopic[1], moment[2] - gyroscopic[2]))
    acceleration = turn(R, own)
    for j in range(3):
        out[3 + j] = acceleration[j]
