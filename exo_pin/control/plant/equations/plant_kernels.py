"""Equations of motion of the plant in minimal coordinates on the rotation group, compiled.

The arm turns about O: I ω' + ω × I ω = M, with I about O in the base frame, and

    M = Σ T_i (s_i × b_i) + C × m g + load + stops - c ω - μ z_s

(a limb pulls with -T_i s_i at b_i). The orientation is R = exp(ξ) R_0 with R_0 that at the start of a step, so that
ξ' = ω - ξ × ω/2 + c(|ξ|) ξ × (ξ × ω) and no chart is ever left. The tensions T_i are those of the drives
(:mod:`.drive_kernels`), the friction z of the shoulder is that of :func:`.drive_kernels.slip`.

**Stops.** The range of the dummy's shoulder unit (Table 5-6) ends at elastic stops. The unit turns freely about Y; its
universal joint allows |θx - c| + |θz| <= h in the Y-X-Z angles. A point outside is pushed back by a spring and a
damper, with the potential k d²/2 of the depth d = |θx - c| + |θz| - h:

    M = -(k d + c_d d') (∂d/∂θx e_x + ∂d/∂θz e_z)

with the corners of |.| rounded off over 0.01 rad (|.| is smaller there, by at most as much). e_x and e_z are the
gradients of the angles, x' = Ry e_x and w, the part of the arm's own z axis across Y divided by cos² θx. At θx = 90°
the unit locks and w is infinite: within 6° of it the moment is held at its value there. Of the two triples of angles
of an orientation the one with the smaller depth counts, as for the criterion "shoulder_range".

Integration of the plant from one instant to another: Dormand and Prince, order 5(4), on the rotation group.

A Runge-Kutta-Munthe-Kaas method: the orientation is a rotation vector relative to that at the start of each step, and
the step's end is the next one's start. The quaternion is brought to length 1 there, against rounding.

Source: E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., Table II.5.2;
H. Munthe-Kaas, High order Runge-Kutta methods on manifolds, Appl. Numer. Math. 29 (1999) 115.
"""

from __future__ import annotations

import math
from functools import cache
from itertools import accumulate, pairwise
from typing import Any, NamedTuple

import numpy as np

from ....core.compiled import kernel
from ....core.validation import FloatArray
from ....numerics.small_linear import copy_numbers
from ....numerics.vectors import cross, dot, limb, matrix, rotation_matrix, turn, vector
from .drive_kernels import drive_rates, limb_numbers, manifold_rates, slip

#: Radius by which the corners of the diamond are rounded off, rad: at a sharp one the moment would jump.
_CORNER = 0.01
#: Least cos² of the angle of the universal joint.
_LOCK = 1e-2


@kernel
def _rounded(value: float) -> Any:
    """|value| with its corner rounded off, and its slope."""
    root = math.sqrt(value * value + _CORNER * _CORNER)
    return root - _CORNER, value / root


@kernel(cost=301)
def stop_moment(R: Any, w: Any, centre: float, half: float, side: float, stiffness: float, damping: float) -> Any:
    """Moment of the stops on the arm about O in N m, the power that they take in W, and their potential in J.

    ``R`` rows of the rotation matrix, ``w`` angular velocity; ``side`` 1 for the left shoulder, -1 for the right.
    """
    zero = (0.0, 0.0, 0.0)
    abduction = side * math.asin(min(max(-R[1][2], -1.0), 1.0))
    axial = math.atan2(R[1][0], R[1][1])
    off, by_x = _rounded(abduction - centre)
    aside, by_z = _rounded(axial)
    by_x, depth = side * by_x, off + aside - half
    turned = axial - math.pi if axial > 0.0 else axial + math.pi
    off, slope = _rounded(math.pi - abduction - centre)
    aside, other = _rounded(turned)
    if off + aside - half < depth:
        by_x, by_z, depth = -side * slope, other, off + aside - half
    if depth <= 0.0:
        return zero, 0.0, 0.0
    # θy of the triple with cos θx > 0.
    flexion = math.atan2(R[0][2], R[2][2])
    x_axis = (math.cos(flexion), 0.0, -math.sin(flexion))
    cosine = max(R[1][0] * R[1][0] + R[1][1] * R[1][1], _LOCK)
    z_axis = (R[0][2] / cosine, 0.0, R[2][2] / cosine)
    gradient = (by_x * x_axis[0] + by_z * z_axis[0], 0.0, by_x * x_axis[2] + by_z * z_axis[2])
    rate = dot(gradient, w)
    push = stiffness * depth + damping * rate
    # A stop does not pull.
    push = max(push, 0.0)
    loss = (push - stiffness * depth) * rate
    return (-push * gradient[0], -push * gradient[1], -push * gradient[2]), loss, 0.5 * stiffness * depth * depth


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


#: Parts of the state of a plant with n limbs, in their order: numbers a limb, other numbers, and the unit in which
#: tolerances are equal. Pressures are absolute; a motor's drive has the length that it lets out in place of one. From
#: ``tension_work`` on, but for the speeds of motor drives, they are integrals since the motion began.
STATE = {
    "turn": (0, 3, 1.0), "angular_velocity": (0, 3, 1.0), "drives": (1, 0, 1e4), "drive_friction": (1, 0, 1.0),
    "shoulder_friction": (0, 3, 1.0), "manifold": (0, 1, 1e4), "tension_work": (1, 0, 1.0), "source_work": (1, 0, 1.0),
    "drive_loss": (1, 0, 1.0), "shoulder_loss": (0, 1, 1.0), "air_used": (0, 1, 1e-5), "air_vented": (0, 1, 1e-5),
    "drive_speeds": (1, 0, 0.1), "electric_energy": (1, 0, 1.0),
}  # fmt: skip
#: Unit of the length that a motor drive lets out.
_POSITION = 0.1


@cache
def state_places(n: int) -> dict[str, slice]:
    """Where each part of the state of a plant with n limbs is; the last one ends with it."""
    ends = list(accumulate((each * n + other for each, other, _ in STATE.values()), initial=0))
    return {name: slice(*pair) for name, pair in zip(STATE, pairwise(ends), strict=True)}


def state_parts(y: FloatArray) -> dict[str, FloatArray]:
    """The parts of a state, or of several of shape (..., 13 + 7 n), as views."""
    return {name: y[..., place] for name, place in state_places((y.shape[-1] - 13) // 7).items()}


def tolerances(tables: Tables, rtol: float) -> FloatArray:
    """Absolute tolerances of the state, shape (13 + 7 n,)."""
    atol = np.empty(13 + 7 * len(tables.base))
    for (_, _, unit), part in zip(STATE.values(), state_parts(atol).values(), strict=True):
        part[:] = rtol * unit
    state_parts(atol)["drives"][tables.motors[:, 0] > 0.0] = rtol * _POSITION
    return atol


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


# Always compiled, as the integration is: what a run reports does not depend on its length.
@kernel(stack=True, cost=301)
def observe(Q: Any, Y: Any, acts: Any, t: Any, motion: Any, limbs: Any, energy: Any) -> None:
    """Fill what a run reports at N instants.

    ``Q`` (N, 4) quaternions, ``Y`` (N, size) states with ξ = 0, ``acts`` (N, n, 4) the last columns of :data:`FLOWS`.
    ``motion`` (N, 9): angular acceleration, and the moments of friction and stops on the arm. ``limbs`` (N, n, 6):
    length, its rate, tension, the bladder's contraction, force of the motor, and energy stored in the drive.
    ``energy`` (N, 2): kinetic, potential of weight, load and stops.
    """
    n = t.base.shape[0]
    flows = np.zeros((n, 10))
    out = np.zeros(Y.shape[1])
    for k in range(len(Q)):
        for i in range(n):
            copy_numbers(acts[k, i], flows[i, 6:])
        rates(t, flows, Q[k], Y[k], out)
        R, w = rows_of(Q[k], Y[k]), vector(Y[:, 3:6], k)
        joint = t.shoulder
        stop, potential = (0.0, 0.0, 0.0), 0.0
        if joint[3] > 0.0:
            stop, _, potential = stop_moment(R, w, joint[4], joint[5], joint[6], joint[7], joint[8])
        for j in range(3):
            motion[k, j] = out[3 + j]
            motion[k, 3 + j] = -joint[0] * w[j] - joint[1] * Y[k, 6 + 2 * n + j]
            motion[k, 6 + j] = stop[j]
        for i in range(n):
            b, s, _, length, _, _ = limb(R, vector(t.base, i), vector(t.platform, i))
            speed = dot(cross(b, s), w)
            limbs[k, i, 0], limbs[k, i, 1] = length, speed
            pull, bladder, force, stored = limb_numbers(t, flows, i, Y[k], speed, length)
            limbs[k, i, 2], limbs[k, i, 3], limbs[k, i, 4], limbs[k, i, 5] = pull, bladder, force, stored
        own = turn(((R[0][0], R[1][0], R[2][0]), (R[0][1], R[1][1], R[2][1]), (R[0][2], R[1][2], R[2][2])), w)
        energy[k, 0] = 0.5 * dot(own, turn(matrix(t.inertia), own))
        C, point = turn(R, t.centre), turn(R, t.point)
        potential -= t.mass * (t.gravity[0] * C[0] + t.gravity[1] * C[1] + t.gravity[2] * C[2])
        energy[k, 1] = potential - t.force[0] * point[0] - t.force[1] * point[1] - t.force[2] * point[2]


#: How an integration ended.
DONE, TOO_SMALL, NOT_FINITE = 0, 1, 2
#: Most steps in one call.
_MOST = 200_000
#: Least step, s, and the limits of the change of a step.
_LEAST, _SHRINK, _GROW, _SAFETY = 1e-13, 0.2, 5.0, 0.9

_A = (
    (1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    (3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0),
    (44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0),
    (19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0),
    (9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0),
    (35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0),
)
#: Weights of the fifth order less those of the fourth.
_E = (71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0)


@kernel
def _place(q: Any, y: Any) -> None:
    """Turn the quaternion by ξ, which becomes zero."""
    x, yy, z, w = moved_quaternion(q, y)
    size = math.sqrt(x * x + yy * yy + z * z + w * w)
    q[0], q[1], q[2], q[3] = x / size, yy / size, z / size, w / size
    for j in range(3):
        y[j] = 0.0


@kernel(cost=301)
def advance(t: Any, flows: Any, q: Any, y: Any, duration: float, step: float, rtol: float, atol: Any) -> Any:
    """Change ``q`` and ``y`` to what they are ``duration`` seconds later, with constant flows.

    ``step`` is tried first; ``atol``, shape (size,), in the units of the state. Returns how it ended, the steps taken,
    a good next step in s, and the time that is left, s.
    """
    size = len(y)
    k = np.zeros((7, size))
    trial, new = np.zeros(size), np.zeros(size)
    left, taken = duration, 0
    rates(t, flows, q, y, k[0])
    while left > 0.0:
        last = step >= left * (1.0 - 1e-12)
        h = left if last else step
        for stage in range(6):
            for j in range(size):
                total = 0.0
                for m in range(stage + 1):
                    total += _A[stage][m] * k[m, j]
                trial[j] = y[j] + h * total
            rates(t, flows, q, trial, k[stage + 1])
        error = 0.0
        for j in range(size):
            new[j] = trial[j]
            off = 0.0
            for m in range(7):
                off += _E[m] * k[m, j]
            scale = atol[j] + rtol * max(abs(y[j]), abs(new[j]))
            error = max(error, abs(h * off) / scale)
            if not math.isfinite(new[j]):
                error = math.inf
        factor = _GROW
        if error > 0.0:
            factor = min(_GROW, max(_SHRINK, _SAFETY * error ** (-0.2)))
        if error <= 1.0:
            taken += 1
            left = 0.0 if last else left - h
            for j in range(size):
                y[j] = new[j]
                k[0, j] = k[6, j]
            _place(q, y)
            # ξ' at ξ = 0 is ω; the other rates are those of the last stage.
            for j in range(3):
                k[0, j] = y[3 + j]
            # A step cut short at the end says nothing about the next one.
            step = max(step, h * factor) if last else h * factor
        else:
            step = h * factor
            if h < _LEAST:
                return (NOT_FINITE if error == math.inf else TOO_SMALL), taken, step, left
        if taken > _MOST:
            return TOO_SMALL, taken, step, left
    return DONE, taken, step, left
