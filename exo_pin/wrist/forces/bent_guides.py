"""Side wrenches of guides that bend: the turn of their ends enters the crosses of the universal joints.

A guide from A_i to B_i is a beam whose ends rotate against the line between them, by rotation vectors θ_A and θ_B
perpendicular to it, and against each other by ψ about it. With the ends at exp [θ_A] and exp [θ_B] exp [ψ s], its
strain energy to third order is

    U = ½ (θ_A, θ_B) F⁻¹ (θ_A, θ_B) + ½ τ² / (l/GJ + 2/k_t),      τ = ψ + ½ s · (θ_A × θ_B)
    F = l/(6 EI) [[2, -1], [-1, 2]] + 2/(k_j l²) [[1, 1], [1, 1]] + 1/k_t [[1, 0], [0, 1]]

with k_j and k_t the stiffness of its joints. The second part of τ is the rotation about s due to bending in two planes;
it couples torque and bending. The joint axes are exact at any rotation: X_A is perpendicular to Y_A and to t_A = exp
[θ_A] s, likewise X_B, and ψ is the angle about s from X_A to X_B, both rotated back by their θ. The four components of
θ are those of least U, at which the couples about the four revolute axes vanish. Then

    T = τ / (l/GJ + 2/k_t)        couple at each end = T e / (e · t),  e = Y × X        force = (C_A - C_B) × s / l

With θ = 0 in the crosses this is the straight guide of :mod:`exo_pin.wrist.forces.side_forces`, and in the limit of
small forces the two agree.

Assumed: bending and torsion linear in curvature and twist (Kirchhoff's rod), a round section, small rotations
of the ends (neglected terms are of relative size θ²), and a slide without force along A_i B_i.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.validation import FloatArray
from ...numerics.analytic_vectors import solved, turn_coefficients, unit
from .side_forces import SideWrenches, StraightGuides, reciprocal_couples, signed_root, unit_wrenches

#: Steps with the second derivatives of torsion and bending without their coupling, and steps with all of them.
_ROUGH_STEPS, _STEPS = 3, 12
#: Change of θ, rad, below which Newton's next one is below rounding.
_NEAR = 1e-9
#: Imaginary step of the second derivatives of U.
_STEP = 1e-30
#: Points along a guide at which its deflection is computed.
_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])
_PLACES = np.linspace(0.0, 1.0, 41)


class _Guides(NamedTuple):
    """Data of U besides θ, for M guides: frame (X, s × X, s), shape (3, M), axes Y, (3, 2, M), and stiffness.

    ``each`` and ``both`` are the entries of F⁻¹ on and off its diagonal, N m; ``torsion`` is 1/(l/GJ + 2/k_t).
    """

    x: FloatArray
    v: FloatArray
    s: FloatArray
    y: FloatArray
    each: FloatArray
    both: FloatArray
    torsion: FloatArray


class _Ends(NamedTuple):
    """Results of the rotations of the ends, M guides.

    Attributes
    ----------
    slopes : ndarray
        ∂U/∂θ, shape (4, M), N m.
    twisting : ndarray
        ∂τ/∂θ, shape (4, M).
    torque : ndarray
        T, shape (M,), N m.
    couple_base, couple_arm : ndarray
        For T = 1, shape (3, M).
    """

    slopes: FloatArray
    twisting: FloatArray
    torque: FloatArray
    couple_base: FloatArray
    couple_arm: FloatArray


def bent_wrenches(
    guides: StraightGuides,
    flexibility: FloatArray,
    resists: NDArray[np.bool_],
    is_upu: NDArray[np.bool_],
    start: FloatArray,
    copies: int = 1,
) -> tuple[SideWrenches, FloatArray]:
    """Side wrenches of guides that bend, and the turns of their ends.

    Imaginary parts are exact to first order, for derivatives by complex steps.

    Parameters
    ----------
    guides : StraightGuides
        N poses.
    flexibility, resists : ndarray
        As :func:`exo_pin.wrist.forces.side_forces.guide_flexibility`.
    is_upu : ndarray of bool
        Shape (n,).
    start : ndarray
        ``ends`` nearby, from which to search.
    copies : int
        Number of consecutive poses with the same real parts.

    Returns
    -------
    wrenches : SideWrenches
        Of the size at which the force is 1, positive towards X_i, halfway between X_Ai and X_Bi of the straight guide.
        ``stiffness`` is the reciprocal of twice the energy of that wrench, and ``deflection`` is g over it. NaN where
        no stable shape of the guide is near (it buckles).
    ends : ndarray
        θ_A and θ_B along X_i and s × X_i, shape (N, n, 4), rad.
    """
    bends = is_upu & resists & ~guides.folded
    ends = np.zeros((*bends.shape, 4), dtype=guides.lengths.dtype)
    deflection = np.zeros(bends.shape, dtype=ends.dtype)
    wrench = [np.array(part, dtype=ends.dtype) for part in reciprocal_couples(guides)]
    if bends.any():
        own = _guides_of(guides, flexibility, bends)
        turns = _settled(own, start[bends].T, copies, bends)
        found = _ends(own, turns)
        force = _cross(found.couple_base - found.couple_arm, own.s) / guides.lengths[bends]
        size = signed_root(_dot(force, force), _dot(force, own.x))
        for part, unit_part in zip(wrench, (force, found.couple_arm, found.couple_base), strict=True):
            part[bends] = (unit_part / size).T
        ends[bends], deflection[bends] = turns.T, found.torque * size
    side = unit_wrenches(guides, tuple(wrench), flexibility, resists, is_upu)
    return side._replace(deflection=deflection / np.where(side.stiffness.real > 0.0, side.stiffness, 1.0)), ends


def largest_deflection(ends: FloatArray) -> FloatArray:
    """Deflection of guides from the line A_i B_i, over its length, shape (...), for rotations of shape (..., 4)."""
    shape = [_PLACES * (1.0 - _PLACES) ** 2, -(_PLACES**2) * (1.0 - _PLACES)]
    off = np.einsum("ep,...ec->...pc", shape, ends.reshape(*ends.shape[:-1], 2, 2))
    return np.asarray(np.sqrt((off**2).sum(axis=-1)).max(axis=-1))


def _guides_of(guides: StraightGuides, flexibility: FloatArray, bends: NDArray[np.bool_]) -> _Guides:
    """The guides that bend, one column each."""
    bending, torsion, across, couple = np.broadcast_to(flexibility, (*bends.shape, 4))[bends].T
    length = guides.lengths[bends]
    s, y_base, y_arm, x = (
        np.ascontiguousarray(part[bends].T)
        for part in (guides.directions, guides.y_base, guides.y_arm, unit(guides.x_base + guides.x_arm))
    )
    shear = 2.0 * across / length**2
    own, other = length / 3.0 * bending + shear + couple, -length / 6.0 * bending + shear
    scale = 1.0 / (own * own - other * other)
    springs = own * scale, -other * scale, 1.0 / (length * torsion + 2.0 * couple)
    return _Guides(x, _cross(s, x), s, np.stack([y_base, y_arm], axis=1), *springs)


def _settled(own: _Guides, near: FloatArray, copies: int, bends: NDArray[np.bool_]) -> FloatArray:
    """θ of least U, shape (4, M): found for the first of each ``copies`` poses, and one more step for all of them."""
    count = len(bends)
    first = np.broadcast_to((np.arange(count) % copies == 0)[:, None], bends.shape)[bends]
    where = np.zeros(bends.shape, dtype=np.intp)
    where[bends] = np.cumsum(first) - 1
    # The solution of a copy is that of the same limb in the pose that it is a copy of.
    leader = where[np.arange(count) // copies * copies][bends]
    real = _Guides(*(np.ascontiguousarray(part[..., first].real) for part in own))
    turns, second = _least(real, near[:, first])
    turns, second = turns[:, leader], second[leader]
    with np.errstate(invalid="ignore"):
        return np.asarray(turns - solved(second, _ends(own, turns).slopes.T).T)


def _least(own: _Guides, start: FloatArray) -> tuple[FloatArray, FloatArray]:
    """θ of least U, shape (4, M), NaN where no minimum is near, and ∂²U/∂θ², shape (M, 4, 4)."""
    turns, second, good = _newton(own, start if start.any() else _roughly(own, start))
    if not good.all() and start.any():
        again = np.flatnonzero(~good)
        few = _Guides(*(part[..., again] for part in own))
        turns[:, again], second[again], good[again] = _newton(few, _roughly(few, np.zeros((4, len(again)))))
    turns[:, ~good] = np.nan
    return turns, second


def _roughly(own: _Guides, turns: FloatArray) -> FloatArray:
    """θ near those of least U, without the coupling of torsion and bending in ∂²U/∂θ² (Gauss and Newton)."""
    plain = np.zeros((turns.shape[1], 4, 4))
    for i in range(4):
        plain[:, i, i], plain[:, i, i - 2] = own.each, own.both
    for _ in range(_ROUGH_STEPS):
        found = _ends(own, turns)
        twisting = found.twisting.T
        second = plain + (own.torsion[:, None] * twisting)[:, :, None] * twisting[:, None]
        turns = turns - solved(second, found.slopes.T).T
    return turns


def _newton(own: _Guides, turns: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """θ, ∂²U/∂θ² there, and whether it is a minimum, by Newton's method."""
    count = turns.shape[1]
    four = _Guides(*(np.repeat(part, 4, axis=-1) for part in own))
    steps = np.tile(1j * _STEP * np.eye(4), count)
    for _ in range(_STEPS):
        slopes = _ends(four, np.repeat(turns, 4, axis=1) + steps).slopes.reshape(4, count, 4)
        second = np.moveaxis(slopes.imag, 1, 0) / _STEP
        change = solved(second, slopes[:, :, 0].real.T).T
        turns = turns - change
        if not (np.abs(change) > _NEAR).any():
            break
    # Elsewhere the change is no number, which is not near.
    second[~np.isfinite(second).all(axis=(1, 2))] = np.eye(4)
    stable = np.linalg.eigvalsh(second)[:, 0] > 0.0
    with np.errstate(invalid="ignore"):
        near = np.abs(change).max(axis=0) <= _NEAR
    return turns, second, np.asarray(stable & near)


def _ends(own: _Guides, turns: FloatArray) -> _Ends:
    """Slopes, torque and couples at given turns, shape (4, M)."""
    split = turns.reshape(2, 2, -1)
    both = split[:, 0, None] * own.x + split[:, 1, None] * own.v
    s, y = own.s[:, None], own.y
    turn = np.ascontiguousarray(np.swapaxes(both, 0, 1))
    x, couple, slope = _cross_of(s, y, turn)
    angle = 2.0 * np.arctan(_dot(_cross(x[:, 0], x[:, 1]), own.s) / (1.0 + _dot(x[:, 0], x[:, 1])))
    across = _cross(turn, s)
    torque = own.torsion * (angle + 0.5 * _dot(turn[:, 0], across[:, 1]))
    # ∂τ/∂θ, of the base's end and of the arm's.
    slope += 0.5 * across[:, ::-1]
    twisting = np.stack([_dot(slope, own.x[:, None]), _dot(slope, own.v[:, None])], axis=1)
    twisting[1] = -twisting[1]
    twisting = twisting.reshape(4, -1)
    bent = (own.each * split + own.both * split[::-1]).reshape(4, -1)
    return _Ends(bent + torque * twisting, twisting, torque, couple[:, 0], couple[:, 1])


def _cross_of(s: FloatArray, y: FloatArray, turn: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """X of turned ends, turned back; the couple e / (e · t) across both axes of the joint; J_lᵀ of that couple.

    An end that turns by δθ keeps X · Y = 0 only if it turns about its own axis, too: by -(J_lᵀ e) · δθ / (e · t).
    """
    sine, near, far = turn_coefficients(_dot(turn, turn))
    across = _cross(turn, s)
    t = s + sine * across + near * _cross(turn, across)
    x = _cross(y, t)
    x = x / np.sqrt(_dot(x, x))
    e = _cross(y, x)
    couple = e / _dot(e, t)
    around, back = _cross(turn, couple), _cross(turn, x)
    slope = couple - near * around + far * _cross(turn, around)
    return x - sine * back + near * _cross(turn, back), couple, slope


def _cross(u: FloatArray, v: FloatArray) -> FloatArray:
    """u × v of vectors of shape (3, ...): several times as fast as numpy's."""
    out = u[_NEXT] * v[_LAST]
    out -= u[_LAST] * v[_NEXT]
    return np.asarray(out)


def _dot(u: FloatArray, v: FloatArray) -> FloatArray:
    return np.asarray((u * v).sum(axis=0))
