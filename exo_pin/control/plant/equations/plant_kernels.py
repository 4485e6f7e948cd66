"""Equations of motion of the plant in minimal coordinates on the rotation group, compiled.

The arm turns about O: I ω' + ω × I ω = M, with I about O in the base frame, and

    M = Σ T_i (s_i × b_i) + C × m g + load + stops - c ω - μ z_s

(a limb pulls with -T_i s_i at b_i). The orientation is R = exp(ξ) R_0 with R_0 that at the start of a step, so that
ξ' = ω - ξ × ω/2 + c(|ξ|) ξ × (ξ × ω) and no chart is ever left. The air of muscle i, of absolute pressure p and volume
V, with polytropic exponent κ:

    V p' = κ (R T ṁ - p V')        V' = (dV/dx) (x_l l-rate + x_p p')

Friction is force or moment (bound) z, elastoplastic: z' = (v - α |v| z)/δ with the presliding displacement δ. α is 0
while |z| < 0.7 or the motion unloads, so that the joint sticks elastically and without creep, and rises to 1 at
|z| = 1, where it slides (P. Dupont, V. Hayward, B. Armstrong, F. Altpeter, Single state elastoplastic friction models,
IEEE Trans. Automatic Control 47 (2002) 787).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from ....core.compiled import kernel
from ....core.validation import FloatArray
from ....muscle.valve.flow import ATMOSPHERE, GAS_CONSTANT, REFERENCE_TEMPERATURE, mass_flow
from ....numerics.vectors import cross, dot, limb, matrix, rotation_matrix, turn, vector
from .muscle_kernels import COLUMNS, air_volume, tension
from .stop_kernels import stop_moment

__all__ = [
    "AIR",
    "FLOWS",
    "SHOULDER",
    "Tables",
    "air_rates",
    "arm_load",
    "moved_quaternion",
    "rates",
    "rows_of",
    "state_size",
    "tensions",
    "turned",
]

#: Columns of :attr:`Tables.shoulder`, :attr:`Tables.air` and of the flows of a muscle.
SHOULDER = (
    "viscous", "coulomb", "presliding", "stops", "stop_centre", "stop_half", "side", "stop_stiffness", "stop_damping",
)  # fmt: skip
AIR = ("exponent", "supply", "regulator", "regulator_ratio", "manifold")
FLOWS = ("fill", "fill_ratio", "vent", "vent_ratio", "leak", "leak_ratio", "intact")
_PRESLIDING = COLUMNS.index("presliding")
#: |z| of the friction below which it is elastic.
_ELASTIC = 0.7
#: Moment of a stop that only a trial step has, N m.
_STRONGEST = 1e6


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
    muscles : ndarray
        Shape (n, len(COLUMNS)).
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
    shoulder: FloatArray
    air: FloatArray


def state_size(n: int) -> int:
    """Length of the state of a plant with n limbs.

    ξ, ω (3 each), absolute pressures (n), friction of the muscles (n) and of the shoulder (3), pressure of the
    manifold; then integrals: work of the tensions (n), of the air on the bladders (n), loss in the muscles (n), in the
    shoulder, air from the supply and air to the atmosphere, kg.
    """
    return 13 + 5 * n


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
def _slip(loaded: float, size: float) -> float:
    """α of the friction, for z · v and |z|."""
    if loaded <= 0.0 or size <= _ELASTIC:
        return 0.0
    if size >= 1.0:
        return 1.0
    return 0.5 - 0.5 * math.cos(math.pi * (size - _ELASTIC) / (1.0 - _ELASTIC))


@kernel
def _muscle_rates(t: Any, flows: Any, i: int, y: Any, speed: float, length: float, out: Any) -> Any:
    """Air and friction of one muscle: fill its rates and return its tension."""
    n = t.base.shape[0]
    row = t.muscles[i]
    p, z = y[6 + i], y[6 + n + i]
    pull, loss, bladder, by_x, by_p = tension(t.law, row, i, length, speed, p - ATMOSPHERE, z)
    volume, area = air_volume(row, bladder)
    supply = y[9 + 2 * n]
    filled = mass_flow(supply, p, flows[i, 0], flows[i, 1])
    vented = mass_flow(p, ATMOSPHERE, flows[i, 2], flows[i, 3]) + mass_flow(p, ATMOSPHERE, flows[i, 4], flows[i, 5])
    inflow = GAS_CONSTANT * REFERENCE_TEMPERATURE * (filled - vented)
    exponent = t.air[0]
    swept = area * by_x * -speed
    rate = exponent * (inflow - p * swept) / (volume + exponent * p * area * by_p)
    out[6 + i] = rate
    out[6 + n + i] = (-speed - _slip(-speed * z, abs(z)) * abs(speed) * z) / row[_PRESLIDING]
    intact = flows[i, 6]
    pull, loss = intact * pull, intact * loss
    out[10 + 2 * n + i] = -pull * speed
    out[10 + 3 * n + i] = (p - ATMOSPHERE) * (swept + area * by_p * rate)
    out[10 + 4 * n + i] = loss
    return pull, filled, vented


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
        pull, filled, vented = _muscle_rates(t, flows, i, y, speed, length, out)
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
    slipping = _slip(dot(w, z), math.sqrt(dot(z, z))) * math.sqrt(dot(w, w))
    for j in range(3):
        out[6 + 2 * n + j] = (w[j] - slipping * z[j]) / joint[2]
    Mx -= joint[0] * w[0] + joint[1] * z[0]
    My -= joint[0] * w[1] + joint[1] * z[1]
    Mz -= joint[0] * w[2] + joint[1] * z[2]
    out[10 + 5 * n] = loss + joint[0] * dot(w, w) + joint[1] * dot(z, w)
    _turn_arm(t, R, w, (Mx, My, Mz), out)
    _manifold(t, y, drawn, let_out, out)


@kernel
def _manifold(t: Any, y: Any, drawn: float, let_out: float, out: Any) -> None:
    """Pressure of the manifold, if it is not held by its regulator, and the air that comes and goes."""
    n = t.base.shape[0]
    fresh = drawn
    out[9 + 2 * n] = 0.0
    if t.air[4] > 0.0:
        fresh = mass_flow(t.air[1], y[9 + 2 * n], t.air[2], t.air[3])
        out[9 + 2 * n] = t.air[0] * GAS_CONSTANT * REFERENCE_TEMPERATURE * (fresh - drawn) / t.air[4]
    out[11 + 5 * n] = fresh
    out[12 + 5 * n] = let_out


@kernel
def air_rates(t: Any, flows: Any, lengths: Any, speeds: Any, y: Any, out: Any) -> None:
    """Fill the rates of air and muscle friction for given lengths of the limbs and their rates, shape (n,) each.

    The places of the state that belong to the arm and its shoulder are left as they are.
    """
    drawn, let_out = 0.0, 0.0
    for i in range(t.base.shape[0]):
        _, filled, vented = _muscle_rates(t, flows, i, y, speeds[i], lengths[i], out)
        drawn += filled
        let_out += vented
    _manifold(t, y, drawn, let_out, out)


@kernel
def tensions(t: Any, lengths: Any, speeds: Any, air: Any, out: Any) -> None:
    """Fill the tensions, shape (n,), for absolute pressures and friction of the muscles ``air``, shape (2 n, ...)."""
    n = t.base.shape[0]
    for i in range(n):
        out[i] = tension(t.law, t.muscles[i], i, lengths[i], speeds[i], air[i] - ATMOSPHERE, air[n + i])[0]


@kernel
def arm_load(t: Any, q: Any, v: Any, out: Any) -> None:
    """Fill force and moment about O of load and stops, base frame, shape (6,), for ω in the arm's axes."""
    R = rotation_matrix(q[0], q[1], q[2], q[3])
    lever = cross(turn(R, t.point), t.force)
    for j in range(3):
        out[j], out[3 + j] = t.force[j], lever[j]
    joint = t.shoulder
    if joint[3] > 0.0:
        stop, _, _ = stop_moment(R, turn(R, v), joint[4], joint[5], joint[6], joint[7], joint[8])
        for j in range(3):
            # In a trial step that the integrator will refuse the depth may be anything.
            out[3 + j] += min(max(stop[j], -_STRONGEST), _STRONGEST)


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
