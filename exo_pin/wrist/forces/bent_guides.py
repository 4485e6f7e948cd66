"""Side wrenches of guides that bend: the turn of their ends enters the crosses of the universal joints.

A guide from A_i to B_i is a beam whose ends turn against the line between them by the rotation vectors θ_A and θ_B across
it and twist by ψ about it. With the ends as exp [θ_A] and exp [θ_B] exp [ψ s] put them, its strain energy to third order
is

    U = ½ (θ_A, θ_B) F⁻¹ (θ_A, θ_B) + ½ τ² / (l/GJ + 2/k_t),      τ = ψ + ½ s · (θ_A × θ_B)
    F = l/(6 EI) [[2, -1], [-1, 2]] + 2/(k_j l²) [[1, 1], [1, 1]] + 1/k_t [[1, 0], [0, 1]]

with k_j and k_t the stiffness of its joints. The second part of τ is the turn about s that two bends in different
planes make (half of what two rotations that follow each other do not commute by); it couples torque and bending. Large
turns of the crosses are exact: X_A = Y_A × t_A with t_A = exp [θ_A] s, likewise X_B, and ψ is the angle about s from X_A
to X_B, both turned back by their θ. The four components of θ are those of least U, at which the couples about the four
revolute axes vanish. Then

    T = τ / (l/GJ + 2/k_t)        couple at each end = T e / (e · t),  e = Y × X        force = (C_A - C_B) × s / l

and the force along s is none. With θ = 0 in the crosses this is the straight guide of
:mod:`exo_pin.wrist.forces.side_forces`, and in the limit of small forces the two agree.

Assumed: bending and torsion are linear in curvature and twist (Kirchhoff's rod) and the ends turn by moderate angles:
what is left out is of the square of θ, relative to what is here. The section is round; the slide carries no force
along A_i B_i.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.validation import FloatArray
from .finite_turns import turn_coefficients
from .side_forces import (
    SideWrenches,
    StraightGuides,
    angle_about,
    dot,
    length_of,
    reciprocal_couples,
    unit,
    unit_wrenches,
)

__all__ = ["bent_wrenches", "largest_deflection"]

#: Newton's steps for θ, and the change of θ, rad, below which the next one is below rounding.
_STEPS, _NEAR = 12, 1e-9
#: Imaginary step of the second derivatives of U.
_STEP = 1e-30
#: Places along a guide at which its deflection is looked at.
_PLACES = np.linspace(0.0, 1.0, 41)


class _Guides(NamedTuple):
    """What U depends on besides θ, for M guides: frame (X, s × X, s), axes Y, and the stiffness of the guide.

    ``both`` and ``each`` are the entries of F⁻¹ off and on its diagonal, N m; ``torsion`` is 1/(l/GJ + 2/k_t).
    """

    x: FloatArray
    v: FloatArray
    s: FloatArray
    y_base: FloatArray
    y_arm: FloatArray
    each: FloatArray
    both: FloatArray
    torsion: FloatArray

    @property
    def real(self) -> _Guides:
        return _Guides(*(np.ascontiguousarray(part.real) for part in self))


class _Ends(NamedTuple):
    """What the turns of the ends lead to: ∂U/∂θ, shape (M, 4), T, shape (M,), and the couples for T = 1, (M, 3)."""

    slopes: FloatArray
    torque: FloatArray
    couple_base: FloatArray
    couple_arm: FloatArray


def bent_wrenches(
    guides: StraightGuides,
    flexibility: FloatArray,
    resists: NDArray[np.bool_],
    is_upu: NDArray[np.bool_],
    copies: int = 1,
) -> tuple[SideWrenches, FloatArray]:
    """Side wrenches of guides that bend, and the turns of their ends.

    Every operation on the imaginary parts is exact to first order, for derivatives by complex steps.

    Parameters
    ----------
    guides : StraightGuides
        N poses.
    flexibility, resists : ndarray
        As :func:`exo_pin.wrist.forces.side_forces.guide_flexibility`.
    is_upu : ndarray of bool
        Shape (n,).
    copies : int
        So many poses in a row have the same real parts.

    Returns
    -------
    wrenches : SideWrenches
        Of unit size where the force along X_i, halfway between X_Ai and X_Bi of the straight guide, is 1. ``stiffness``
        is the reciprocal of twice the energy of that wrench, and ``deflection`` is g over it. NaN where the guide is
        bent so far that no stable shape is near (it buckles).
    ends : ndarray
        θ_A and θ_B along X_i and s × X_i, shape (N, n, 4), rad.
    """
    blank = guides.folded | ~is_upu
    couples = reciprocal_couples(guides)
    straight = unit_wrenches(guides, *couples, flexibility, blank, resists)
    straight = straight._replace(
        folded=np.asarray((guides.folded & is_upu).any(axis=1)),
        twist=np.where(blank, 0.0, angle_about(guides.directions, guides.x_base, guides.x_arm)),
    )
    bends = ~blank & resists
    ends = np.zeros((*blank.shape, 4), dtype=straight.twist.dtype)
    if not bends.any():
        return straight, ends
    own = _of(guides, flexibility, bends)
    # The straight guide's wrench under its twist is where the search starts.
    g = (straight.stiffness * straight.torque * straight.twist)[bends]
    start = _turns_under(own, -g[:, None] * couples[2][bends], g[:, None] * couples[1][bends])
    turns = _settled(own, start, copies, bends)
    ends[bends] = turns
    found = _ends(own, turns)
    length = guides.lengths[bends]
    force = np.cross(found.couple_base - found.couple_arm, own.s) / length[:, None]
    size = dot(force, own.x)
    part = [np.array(array, dtype=ends.dtype) for array in couples]
    for array, own_part in zip(part, (force, found.couple_arm, found.couple_base), strict=True):
        array[bends] = own_part / size[:, None]
    bent = unit_wrenches(guides, *part, flexibility, blank, resists)
    deflection = np.zeros(blank.shape, dtype=ends.dtype)
    deflection[bends] = found.torque * size / bent.stiffness[bends]
    return bent._replace(folded=straight.folded, twist=straight.twist, deflection=deflection), ends


def largest_deflection(ends: FloatArray) -> FloatArray:
    """How far guides bend off the line A_i B_i, over its length, shape (...), for turns of shape (..., 4)."""
    shape = np.stack([_PLACES * (1.0 - _PLACES) ** 2, -(_PLACES**2) * (1.0 - _PLACES)])
    off = np.einsum("ep,...ec->...pc", shape, ends.reshape(*ends.shape[:-1], 2, 2))
    return np.asarray(np.sqrt((off**2).sum(axis=-1)).max(axis=-1))


def _of(guides: StraightGuides, flexibility: FloatArray, bends: NDArray[np.bool_]) -> _Guides:
    """The guides that bend, one row each."""
    bending, torsion, across, couple = np.moveaxis(np.broadcast_to(flexibility, (*bends.shape, 4))[bends], -1, 0)
    length, s = guides.lengths[bends], guides.directions[bends]
    x = unit(guides.x_base[bends] + guides.x_arm[bends])
    shear = 2.0 * across / length**2
    own, other = length / 3.0 * bending + shear + couple, -length / 6.0 * bending + shear
    scale = 1.0 / (own * own - other * other)
    springs = own * scale, -other * scale, 1.0 / (length * torsion + 2.0 * couple)
    return _Guides(x, np.cross(s, x), s, guides.y_base[bends], guides.y_arm[bends], *springs)


def _turns_under(own: _Guides, couple_base: FloatArray, couple_arm: FloatArray) -> FloatArray:
    """θ under couples on the two ends: F times them."""
    scale = 1.0 / (own.each**2 - own.both**2)
    first, second = own.each * scale, -own.both * scale
    at = [np.stack([dot(couple, own.x), dot(couple, own.v)], axis=-1) for couple in (couple_base, couple_arm)]
    first, second = first[:, None], second[:, None]
    return np.concatenate([first * at[0] + second * at[1], second * at[0] + first * at[1]], axis=-1)


def _settled(own: _Guides, start: FloatArray, copies: int, bends: NDArray[np.bool_]) -> FloatArray:
    """θ of least U: Newton's method for the first of each ``copies`` poses, and one more step for all of them."""
    count = len(bends)
    first = np.broadcast_to((np.arange(count) % copies == 0)[:, None], bends.shape)[bends]
    where = np.zeros(bends.shape, dtype=np.intp)
    where[bends] = np.cumsum(first) - 1
    # A copy has the solution of the pose that it is a copy of: the same limb in the first row.
    leader = where[np.arange(count) // copies * copies][bends]
    real = _Guides(*(part[first] for part in own)).real
    turns, second = _least(real, np.ascontiguousarray(start[first].real))
    turns, second = turns[leader].astype(start.dtype), second[leader]
    return np.asarray(turns - np.linalg.solve(second, _ends(own, turns).slopes[..., None])[..., 0])


def _least(own: _Guides, turns: FloatArray) -> tuple[FloatArray, FloatArray]:
    """θ of least U and ∂²U/∂θ², NaN where no minimum is near."""
    count = len(turns)
    wide = _Guides(*(np.repeat(part, 4, axis=0) for part in own))
    steps = np.tile(1j * _STEP * np.eye(4), (count, 1))
    for _ in range(_STEPS):
        found = _ends(wide, np.repeat(turns, 4, axis=0) + steps).slopes.reshape(count, 4, 4)
        slopes, second = found[:, 0].real, found.imag / _STEP
        good = np.isfinite(second).all(axis=(1, 2))
        second[~good] = np.eye(4)
        change = np.where(good[:, None], -np.linalg.solve(second, slopes[..., None])[..., 0], np.nan)
        turns = turns + change
        if not (np.abs(change) > _NEAR).any():
            break
    stable = good & (np.linalg.eigvalsh(0.5 * (second + np.swapaxes(second, 1, 2)))[:, 0] > 0.0)
    with np.errstate(invalid="ignore"):
        stable &= np.abs(change).max(axis=1) <= _NEAR
    turns[~stable] = np.nan
    return turns, second


def _ends(own: _Guides, turns: FloatArray) -> _Ends:
    """∂U/∂θ, torque and couples at given turns, shape (M, 4)."""
    first = turns[:, :1] * own.x + turns[:, 1:2] * own.v
    last = turns[:, 2:3] * own.x + turns[:, 3:] * own.v
    x_base, couple_base, slope_base = _cross_of(own.s, own.y_base, first)
    x_arm, couple_arm, slope_arm = _cross_of(own.s, own.y_arm, last)
    twist = angle_about(own.s, x_base, x_arm) + 0.5 * dot(own.s, np.cross(first, last))
    torque = own.torsion * twist
    each, both, T = own.each[:, None], own.both[:, None], torque[:, None]
    on_base = each * first + both * last + T * (slope_base + 0.5 * np.cross(last, own.s))
    on_arm = both * first + each * last + T * (0.5 * np.cross(own.s, first) - slope_arm)
    slopes = [dot(part, axis) for part in (on_base, on_arm) for axis in (own.x, own.v)]
    return _Ends(np.stack(slopes, axis=-1), torque, couple_base, couple_arm)


def _cross_of(s: FloatArray, y: FloatArray, turn: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """X of a turned end, turned back; the couple e / (e · t) across both axes of its joint; J_lᵀ of that couple.

    An end that turns by δθ keeps X · Y = 0 only if it turns about its own axis, too: by -(J_lᵀ e) · δθ / (e · t).
    """
    sine, near, far = (part[..., 0] for part in turn_coefficients(turn))
    across = np.cross(turn, s)
    twice = np.cross(turn, across)
    t = s + sine * across + near * twice
    x = unit(np.cross(y, t))
    e = np.cross(y, x)
    couple = e / dot(e, t)[:, None]
    around = np.cross(turn, couple)
    slope = couple - near * around + far * np.cross(turn, around)
    back = np.cross(turn, x)
    return x - sine * back + near * np.cross(turn, back), couple, slope
