"""Side wrenches: the wrench that a UPU limb can transmit besides its force, its stiffness, and misalignment.

A limb between two universal joints transmits, besides the force along its line, one more wrench: the one that does
no work in any of its four revolute joints. In a wrist whose centres coincide it is a pure force along X_i through O.
Where the device's centre is not the shoulder's, the centres of base and cuff move apart as the arm turns, the axes Y_Ai
and Y_Bi no longer intersect, and the wrench is a screw. It is computed from the four conditions, not assumed to be a
force.

The stiffness against that wrench is that of a beam from A_i to B_i (Euler and Bernoulli, Saint-Venant), with its
joints' elasticity in series: the strain energy of the unit wrench is half its compliance 1/k_i. With coinciding
centres this is 1/k_i = h² l / GJ + [(b·s)³ - (a·s)³] / (3 EI).

Weight and inertia of limbs with mass, in closed form, with the device's centre off the shoulder's.

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

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.records import keeps_read_only
from ...core.validation import FloatArray
from ...design import LimbBody, Mechanism
from ...load_case.pose_stacks import Query
from ...numerics.analytic_vectors import angle_about, dot, length_of, unit
from ...numerics.vectors import FOLDED_SINE


class SideWrenches(NamedTuple):
    """Limbs in a stack of N poses, moments about the anatomical centre O, base frame.

    Attributes
    ----------
    directions : ndarray
        s_i, shape (N, n, 3).
    moment_arms : ndarray
        Moment of the unit force s_i at B_i, shape (N, n, 3), m.
    forces, moments : ndarray
        The side wrench of unit size: the limb pulls the arm with -g_i (force, moment); shape (N, n, 3), unit vectors
        and moments in m. g_i is the whole force across the limb, positive towards X_i.
    stiffness : ndarray
        k_i, shape (N, n), N/m; zero for SPS limbs and bare muscles.
    folded : ndarray of bool
        Shape (N,): whether a UPU limb lies on a line through its centre and has no such wrench.
    twist : ndarray
        φ_i, shape (N, n), rad, within ±π: the angle about s_i from X_Ai to X_Bi, the twist that the crosses of the
        two universal joints give a straight guide; exact at any displacement.
    deflection : ndarray
        φ_i times the moment of the unit side wrench along the limb, shape (N, n), m: displacement on which g_i = k_i
        times it does work; for a small gap between the centres the distance of these along the side wrench.
    bending, torque : ndarray
        Largest bending moment in the guide and its torque under the side wrench of unit size, shape (N, n), m.
    """

    directions: FloatArray
    moment_arms: FloatArray
    forces: FloatArray
    moments: FloatArray
    stiffness: FloatArray
    folded: np.ndarray
    twist: FloatArray
    deflection: FloatArray
    bending: FloatArray
    torque: FloatArray


def side_wrenches(
    mechanism: Mechanism,
    matrices: FloatArray,
    base_offset: FloatArray,
    cuff_offset: FloatArray,
    base_points: FloatArray | None = None,
) -> SideWrenches:
    """Side wrenches and stiffnesses of all limbs.

    Parameters
    ----------
    mechanism : Mechanism
        Geometry about the device's own centre, limb kinds and guides.
    matrices : ndarray
        Poses, shape (N, 3, 3).
    base_offset, cuff_offset : ndarray
        Device's centre seen from the anatomical one: held by the base, in the base frame, and carried by the
        cuff, in the arm frame; shape (N, 3), m.
    base_points : ndarray, optional
        Points of a rotated base ring, shape (N, n, 3), m, about its own centre; those of the geometry if left out.
    """
    geometry = mechanism.geometry
    points = geometry.base_points if base_points is None else base_points
    guides = straight_guides(points, geometry.platform_points, matrices, base_offset, cuff_offset)
    return unit_wrenches(guides, reciprocal_couples(guides), *guide_flexibility(mechanism), mechanism.is_upu)


def guide_flexibility(mechanism: Mechanism) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Flexibility of each limb, and which limbs have side stiffness.

    Returns
    -------
    flexibility : ndarray
        1/EI, 1/GJ, and the reciprocal stiffness of a joint across the limb and against twist, shape (n, 4).
    resists : ndarray of bool
        Shape (n,): guides with bending and torsional rigidity.
    """
    flexibility, resists = np.zeros((mechanism.limb_count, 4)), np.zeros(mechanism.limb_count, dtype=bool)
    for i, limb in enumerate(mechanism.limbs):
        guide = limb.guide
        if guide is None or guide.bending_rigidity == 0.0 or guide.torsional_rigidity == 0.0:
            continue
        resists[i] = True
        flexibility[i] = 1.0 / np.array(
            [guide.bending_rigidity, guide.torsional_rigidity, guide.joint_stiffness, guide.joint_twist_stiffness]
        )
    return flexibility, resists


@keeps_read_only
class StraightGuides(NamedTuple):
    """Straight guides between their joints, N poses of n limbs, base frame.

    Attributes
    ----------
    directions : ndarray
        s_i, shape (N, n, 3).
    lengths : ndarray
        l_i, shape (N, n), m.
    ends : ndarray
        B_i about O, shape (N, n, 3), m.
    y_base, y_arm, x_base, x_arm : ndarray
        Axes of the universal joints: Y fixed to base and arm, X = Y × s / |Y × s| of the guide; shape (N, n, 3).
    folded : ndarray of bool
        Shape (N, n): limbs along an axis that is fixed to base or arm.
    """

    directions: FloatArray
    lengths: FloatArray
    ends: FloatArray
    y_base: FloatArray
    y_arm: FloatArray
    x_base: FloatArray
    x_arm: FloatArray
    folded: NDArray[np.bool_]


def straight_guides(
    base_points: FloatArray,
    platform_points: FloatArray,
    matrices: FloatArray,
    base_offset: FloatArray,
    cuff_offset: FloatArray,
) -> StraightGuides:
    """Guides and joint axes.

    Every operation is analytic, as are those of the functions below, so that numbers with a tiny imaginary part give
    exact derivatives (complex step).

    Parameters
    ----------
    base_points, platform_points : ndarray
        Shape (n, 3) or (N, n, 3), m.
    matrices, base_offset, cuff_offset : ndarray
        As :func:`side_wrenches`.
    """
    carried = np.einsum("kij,kj->ki", matrices, cuff_offset)
    arm = platform_points @ np.swapaxes(matrices, 1, 2)
    a, p = base_points + base_offset[:, None], arm + carried[:, None]
    span = p - a
    s = unit(span)
    # Axes of the joints that point to the centres: fixed to base and arm.
    y_base = np.broadcast_to(-unit(base_points), s.shape)
    y_arm = -unit(arm)
    across_base, across_arm = np.cross(y_base, s), np.cross(y_arm, s)
    folded = np.minimum(length_of(across_base).real, length_of(across_arm).real)[..., 0] < FOLDED_SINE
    return StraightGuides(s, length_of(span)[..., 0], p, y_base, y_arm, unit(across_base), unit(across_arm), folded)


def unit_wrenches(
    guides: StraightGuides,
    wrench: tuple[FloatArray, ...],
    flexibility: FloatArray,
    resists: NDArray[np.bool_],
    is_upu: NDArray[np.bool_],
) -> SideWrenches:
    """Wrenches of unit size with force and couples at B_i and A_i, none in folded and in SPS limbs."""
    s, blank = guides.directions, guides.folded | ~is_upu
    force, couple_arm, couple_base = (np.where(blank[..., None], 0.0, vector) for vector in wrench)
    stiffness = _stiffness(flexibility, guides, force, couple_arm, couple_base)
    twist = np.where(blank, 0.0, angle_about(s, guides.x_base, guides.x_arm))
    torque = dot(couple_arm, s)
    return SideWrenches(
        directions=s,
        moment_arms=np.cross(guides.ends, s),
        forces=force,
        moments=couple_arm + np.cross(guides.ends, force),
        stiffness=np.where(blank | ~resists, 0.0, stiffness),
        folded=np.asarray((guides.folded & is_upu).any(axis=1)),
        twist=twist,
        deflection=torque * twist,
        bending=np.maximum(_across(couple_arm, s).real, _across(couple_base, s).real),
        torque=torque,
    )


def _across(couple: FloatArray, s: FloatArray) -> FloatArray:
    """Size of the part of a couple that is perpendicular to the limb."""
    return length_of(np.cross(couple, s))[..., 0]


def reciprocal_couples(guides: StraightGuides) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The wrench that does no work in the four revolute joints: force, couple at B_i and couple at A_i, per unit.

    The force is a unit vector without a part along the limb, (X + β (s × X)) / √(1 + β²), with X halfway between the
    two joints' own axes: g_i is the side force itself, positive towards X. With a centre offset β is not zero, and the
    part along X alone is less than the force. The couple at B_i is perpendicular to both axes there, μ (Y_B × X_B).
    The couple at A_i must be perpendicular to both axes there, which gives two linear equations for μ and β.

    Source: thesis (D-13), (D-14), (D-15), (D-16), (D-17), (D-18).
    """
    s, length, _, y_base, y_arm, x_base, x_arm = guides[:7]
    X = unit(x_base + x_arm)
    T = np.cross(s, X)
    across = np.cross(y_arm, x_arm)
    a11, a12, b1 = dot(across, y_base), -length * dot(X, y_base), -length * dot(T, y_base)
    a21, a22, b2 = dot(across, x_base), -length * dot(X, x_base), -length * dot(T, x_base)
    # Cramer's rule, scaled by the size of the force in place of the determinant, which may vanish far off centre.
    along, aside, couple = a11 * a22 - a12 * a21, a11 * b2 - a21 * b1, b1 * a22 - b2 * a12
    size = signed_root(along * along + aside * aside, along)
    force = (along / size)[..., None] * X + (aside / size)[..., None] * T
    couple_arm = (couple / size)[..., None] * across
    return force, couple_arm, couple_arm + length[..., None] * np.cross(s, force)


def signed_root(square: FloatArray, sign: FloatArray) -> FloatArray:
    """√square with the sign of the real part of ``sign``; 1 where it is zero."""
    some = square != 0.0
    return np.where(some, np.sqrt(np.where(some, square, 1.0)) * np.where(sign.real < 0.0, -1.0, 1.0), 1.0)


def _stiffness(
    flexibility: FloatArray, guides: StraightGuides, force: FloatArray, couple_arm: FloatArray, couple_base: FloatArray
) -> FloatArray:
    """k_i from the strain energy of the unit wrench, shape (N, n); a number without meaning where there is none."""
    s, length = guides.directions, guides.lengths
    twist = dot(couple_arm, s)
    bend_arm = couple_arm - twist[..., None] * s
    bend_base = couple_base - dot(couple_base, s)[..., None] * s
    bending = length / 3 * (dot(bend_base, bend_base) + dot(bend_base, bend_arm) + dot(bend_arm, bend_arm))
    couples = dot(couple_arm, couple_arm) + dot(couple_base, couple_base)
    each = np.stack([bending, twist**2 * length, 2.0 * dot(force, force), couples], axis=-1)
    compliance = (each * flexibility).sum(axis=-1)
    return np.asarray(1.0 / np.where(compliance.real > 0.0, compliance, 1.0))


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
        turning = (np.zeros_like(omega), np.zeros_like(eta)), (omega, eta)
        along = np.zeros((len(good), 1))
        for body, at, y, (rate, change), is_base in zip(
            (limb.base_body, limb.platform_body), (a, p), (y_base, seat), turning, (True, False), strict=True
        ):
            if body is None:
                continue
            spin = line.spin(y, rate, change) if limb.kind == "UPU" else None
            wrench = line.needed(body, at, is_base, spin, mechanism.gravity)
            share[good, i] += wrench
            if not is_base:
                along = _dot(wrench[:, :3], line.s)
        closure[good, i] = share[good, i] + line.on_arm(share[good, i], along, y_base, limb.kind == "UPU")
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

        (Ω - ω) · (x × y) = 0, and its derivative; y may have any length and either sign.
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
