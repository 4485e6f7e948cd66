"""Weight and inertia of limbs with mass, in closed form, with the device's centre off the shoulder's.

Each half of a limb is a rigid body of revolution that starts at its own universal joint. The joint at A_i is fixed to
the torso, the one at B_i turns with the arm about the anatomical centre O. Assumed:

- The two halves stay on the line from A_i to B_i: motion by the strain of guides and shoulder, some millimetres at
  most, is neglected.
- The spin of a half of a UPU limb about that line follows from its own joint: its axis X stays perpendicular to the
  joint's Y, which is fixed to the torso or to the arm. Where the centres do not coincide the two rates differ, which
  twists the guide. An SPS limb may spin at any rate, and its axial inertia is neglected.
- The offset is that of the pose: the velocity of a moving centre is not known and is neglected.

With s along the limb, Ω = s × ṡ + σ s and Newton and Euler for each half:

    force = m (c̈ - gravity)          moment about its centre = J_t s × s̈ + J_a (σ̇ s + σ ṡ)
"""

from __future__ import annotations

import numpy as np

from ...core.validation import FloatArray
from ...design import LimbBody, Mechanism
from ...load_case.pose_stacks import Query
from ...numerics.analytic_vectors import unit


def limb_loads(
    mechanism: Mechanism,
    query: Query,
    base: FloatArray,
    cuff: FloatArray,
    folded: np.ndarray,
    base_points: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Wrenches of limbs with mass at f = g = 0, base frame, moments about O.

    f_i = 0 leaves the slide without a force along the limb, g_i = 0 the joint at B_i without a couple, as in
    :mod:`exo_pin.wrist_chain.equilibrium`.

    Parameters
    ----------
    mechanism : Mechanism
        The design.
    query : Query
        N poses with their motion.
    base, cuff : ndarray
        Centre offsets, shape (N, 3), m.
    folded : ndarray of bool
        Shape (N,): poses without an answer, whose rows are zero.
    base_points : ndarray, optional
        Points of a rotated base ring, shape (N, n, 3), m, about its own centre; those of the geometry if left out.

    Like the poses and offsets they may be complex: every operation is analytic.

    Returns
    -------
    closure, share : ndarray
        Shape (N, n, 6): wrench of the torso on each limb, and the part of it that carries and moves the limb.
    """
    shape = (len(query.matrices), mechanism.limb_count, 6)
    if base_points is None:
        base_points = np.broadcast_to(mechanism.geometry.base_points, (*shape[:2], 3))
    kind = np.result_type(query.matrices, base, cuff, base_points)
    closure, share = np.zeros(shape, dtype=kind), np.zeros(shape, dtype=kind)
    good = np.flatnonzero(~folded)
    R, omega, eta = query.matrices[good], query.velocity[good], query.acceleration[good]
    for i, limb in enumerate(mechanism.limbs):
        if limb.mass == 0.0:
            continue
        seat = R @ mechanism.geometry.platform_points[i]
        y_base = base_points[good, i]
        a = y_base + base[good]
        p = seat + (R @ cuff[good][..., None])[..., 0]
        line = _Line(a, p, omega, eta)
        # Of either sign: X turns with Y.
        axes = (y_base, seat)
        turning = (np.zeros_like(omega), np.zeros_like(eta)), (omega, eta)
        along = np.zeros((len(good), 1))
        for body, at, y, (rate, change), is_base in zip(
            (limb.base_body, limb.platform_body), (a, p), axes, turning, (True, False), strict=True
        ):
            if body is None:
                continue
            spin = line.spin(unit(y), rate, change) if limb.kind == "UPU" else None
            wrench = line.needed(body, at, is_base, spin, mechanism.gravity)
            share[good, i] += wrench
            if not is_base:
                along = _dot(wrench[:, :3], line.s)
        closure[good, i] = share[good, i] + line.on_arm(share[good, i], along, unit(axes[0]), limb.kind == "UPU")
    return closure, share


class _Line:
    """The line of one limb from A to B and its motion, shapes (N, 3)."""

    def __init__(self, a: FloatArray, p: FloatArray, omega: FloatArray, eta: FloatArray) -> None:
        velocity = np.cross(omega, p)
        self.p_change = np.cross(eta, p) + np.cross(omega, velocity)
        self.a, self.p = a, p
        self.length = np.sqrt(_dot(p - a, p - a))
        self.s = (p - a) / self.length
        rate = _dot(self.s, velocity)
        self.s_rate = (velocity - rate * self.s) / self.length
        stretch = _dot(self.s, self.p_change) + _dot(self.s_rate, velocity)
        self.s_change = (self.p_change - stretch * self.s - 2.0 * rate * self.s_rate) / self.length

    def spin(self, y: FloatArray, omega: FloatArray, eta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """σ and its rate, shape (N, 1), for which X = y × s/|y × s| stays perpendicular to y, which turns with ω.

        (Ω - ω) · (x × y) = 0, and its derivative.
        """
        x = unit(np.cross(y, self.s))
        normal = np.cross(x, y)
        along = _dot(self.s, normal)
        across = np.cross(self.s, self.s_rate)
        sigma = _dot(omega - across, normal) / along
        turn = across + sigma * self.s
        normal_rate = np.cross(np.cross(turn, x), y) + np.cross(x, np.cross(omega, y))
        rest = np.cross(self.s, self.s_change) + sigma * self.s_rate - eta
        return sigma, -(_dot(rest, normal) + _dot(turn - omega, normal_rate)) / along

    def needed(
        self,
        body: LimbBody,
        at: FloatArray,
        is_base: bool,
        spin: tuple[FloatArray, FloatArray] | None,
        gravity: FloatArray,
    ) -> FloatArray:
        """Wrench that carries and moves one half, moment about O, shape (N, 6)."""
        distance = body.centre if is_base else -body.centre
        centre = at + distance * self.s
        change = distance * self.s_change + (0.0 if is_base else self.p_change)
        force = body.mass * (change - gravity)
        moment = body.transverse_inertia * np.cross(self.s, self.s_change)
        if spin is not None:
            moment = moment + body.axial_inertia * (spin[1] * self.s + spin[0] * self.s_rate)
        return np.concatenate([force, moment + np.cross(centre, force)], axis=1)

    def on_arm(self, share: FloatArray, along: FloatArray, y: FloatArray, is_upu: bool) -> FloatArray:
        """Wrench of the limb on the arm at f = g = 0: a force at B_i, shape (N, 6).

        Along the limb it carries and moves the platform half, ``along``; perpendicular to it there is no moment about
        the free axes of the joint at A_i.
        """
        about_a = share[:, 3:] - np.cross(self.a, share[:, :3])
        # Moment l s × F of the force F, about the free axes only.
        couple = -about_a
        if is_upu:
            x = unit(np.cross(y, self.s))
            t = np.cross(self.s, x)
            couple = _dot(couple, x) * x + _dot(couple, y) / _dot(t, y) * t
        force = -along * self.s - np.cross(self.s, couple) / self.length
        return np.concatenate([force, np.cross(self.p, force)], axis=1)


def _dot(u: FloatArray, v: FloatArray) -> FloatArray:
    return np.asarray((u * v).sum(axis=1, keepdims=True))
