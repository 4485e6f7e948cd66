"""Guides of a device that bend and twist, as springs between the two halves of a limb.

The halves end in points P and C, with unit vectors t_P and t_C of the guide's ends and w_P and w_C across them. With s
along P C, the ends are turned against the line by θ_P and θ_C (exp [θ] s = t), and against each other about it by ψ,
the angle from w_P to w_C, both turned back. The strain energy is that of :mod:`exo_pin.wrist.forces.bent_guides`, where
the equations of the universal joints are solved for one limb at a time; here the joints are those of the chain:

    U = ½ (θ_P, θ_C) F⁻¹ (θ_P, θ_C) + ½ τ² / (l/GJ + 2/k_t),      τ = ψ + ½ s · (θ_P × θ_C)

Its slopes over turns of the two ends, by complex steps, are the couples on them, and the force across the limb balances
these. Along it the guide bears nothing: the slide's drive acts there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin

from ...chain.structure.motion_axes import q_slice, v_slice
from ...core.validation import FloatArray
from ...design import LimbGuide
from ...numerics.analytic_vectors import angle_about, cross_matrix, dot, turn_coefficients
from .guided_limbs import GuidedLimb

#: Coefficients of arcsin x / x in x², enough for ends that turn by half a radian.
_ARCSIN = np.cumprod([1.0, *((2 * n - 1) / (2 * n) for n in range(1, 24))]) / (2.0 * np.arange(24) + 1.0)
#: Imaginary step, and the largest sine of an end's turn for which the series is exact.
_STEP, _LARGEST = 1e-30, 0.6


class PlacedGuide(NamedTuple):
    """A guide in the trees of a device.

    Attributes
    ----------
    name : str
        Its joint, a free flight in the place of the limb's slide.
    held, own : slice
        Its coordinates in q of the held tree, and in v of the free one.
    guide : LimbGuide
        Its stiffness.
    near, far : ndarray
        P in the axes of the joint's placement, and C in those of the body that it carries, shape (3,), m.
    along : ndarray
        Unit vector from P to C of the straight guide, in both, shape (3,).
    """

    name: str
    held: slice
    own: slice
    guide: LimbGuide
    near: FloatArray
    far: FloatArray
    along: FloatArray

    def displacement(self, q: FloatArray, base: FloatArray, cuff: FloatArray) -> FloatArray:
        """θ_P and θ_C, shape (6,), rad, in the axes of the joint's placement."""
        span, R = self._span(q)
        s = span / np.linalg.norm(span)
        return np.concatenate([_turn(s, t) for t in (self.along, R @ self.along)])

    def load(self, q: FloatArray, base: FloatArray, cuff: FloatArray) -> FloatArray:
        """Generalised force of the guide on its joint in the free tree, shape (6,); NaN of one that bends too far."""
        span, R = self._span(q)
        length = float(np.linalg.norm(span))
        s = span / length
        ends = np.stack([self.along, R @ self.along])
        w = np.cross(self.along, np.eye(3)[np.abs(self.along).argmin()])
        w /= np.linalg.norm(w)
        sides = np.stack([w, R @ w])
        # Each end turned about each axis.
        turned = np.eye(3) + 1j * _STEP * cross_matrix(np.eye(3))
        t = np.repeat(ends[None].astype(complex), 6, axis=0)
        x = np.repeat(sides[None].astype(complex), 6, axis=0)
        for end in range(2):
            mine = slice(3 * end, 3 * end + 3)
            t[mine, end], x[mine, end] = turned @ ends[end], turned @ sides[end]
        near, far = np.split(-_energy(self.guide, length, s, t, x).imag / _STEP, 2)
        force = np.cross(s, near + far) / length
        about = far + np.cross(R @ self.far, force)
        return np.concatenate([R.T @ force, R.T @ about])

    def along_motion(self, q: FloatArray) -> FloatArray:
        """Motion of its joint that lengthens the limb and strains no guide, shape (6, 1)."""
        span, R = self._span(q)
        return np.concatenate([R.T @ span, np.zeros(3)])[:, None] / np.linalg.norm(span)

    def _span(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """From P to C, shape (3,), m, and the turn of the body against the joint's placement."""
        own = q[self.held]
        R = pin.Quaternion(own[3:]).matrix()
        return own[:3] + R @ self.far - self.near, R


def placed_guide(held: pin.Model, free: pin.Model, limb: GuidedLimb) -> PlacedGuide:
    """The guide of a limb in the trees of a device."""
    slices = q_slice(held, held.getJointId(limb.joint)), v_slice(free, free.getJointId(limb.joint))
    assert limb.part.guide is not None
    return PlacedGuide(limb.joint, *slices, limb.part.guide, limb.near, limb.far, limb.along)


def _energy(guide: LimbGuide, length: float, s: FloatArray, t: FloatArray, x: FloatArray) -> FloatArray:
    """U of ends t and of vectors x across them, shape (k, 2, 3): shape (k,), N m."""
    shear, couple = 2.0 / (guide.joint_stiffness * length**2), 1.0 / guide.joint_twist_stiffness
    own = length / (3.0 * guide.bending_rigidity) + shear + couple
    other = -length / (6.0 * guide.bending_rigidity) + shear
    scale = 1.0 / (own * own - other * other)
    torsion = 1.0 / (length / guide.torsional_rigidity + 2.0 * couple)
    turn = _turn(s, t)
    back = _turned_back(turn, x)
    twist = angle_about(s, back[:, 0], back[:, 1]) + 0.5 * dot(np.cross(turn[:, 0], turn[:, 1]), s)
    each = 0.5 * own * (turn * turn).sum(axis=(1, 2)) - other * dot(turn[:, 0], turn[:, 1])
    return np.asarray(scale * each + 0.5 * torsion * twist**2)


def _turn(s: FloatArray, t: FloatArray) -> FloatArray:
    """θ across s with exp [θ] s = t, of shape (..., 3); NaN where it is large."""
    across = np.cross(s, t)
    square = (across * across).sum(axis=-1, keepdims=True)
    factor = np.polynomial.polynomial.polyval(square, _ARCSIN)
    fits = (square.real < _LARGEST**2) & (dot(t, s).real > 0.0)[..., None]
    return np.asarray(np.where(fits, factor * across, np.nan))


def _turned_back(turn: FloatArray, x: FloatArray) -> FloatArray:
    """exp [-θ] x."""
    sine, near, _ = turn_coefficients((turn * turn).sum(axis=-1, keepdims=True))
    around = np.cross(turn, x)
    return np.asarray(x - sine * around + near * np.cross(turn, around))
