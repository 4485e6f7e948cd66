"""Equilibrium in closed form with the device's centre off the shoulder's.

A device whose centre is not the shoulder's has two effects. The limbs act about the shoulder and not about their own
centre, which changes their tensions; and as the arm turns, the centre of the base and that of the cuff move apart,
which strains limbs and shoulder. Both are solved in the displaced geometry (:mod:`exo_pin.wrist.forces.side_forces`).

Equilibrium of a stack of poses of the elastic device, as an affine state for all splits and limits.

At the displaced geometry forces are affine in f and g, as in :mod:`exo_pin.wrist.forces.displaced`; and the law of the
guides, g_i = k_i t_i φ_i, is that of a device with the misfit t_i φ_i - S_i · δ there. The linear equations of that
device have the δ of the nonlinear equilibrium as their solution.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.validation import FloatArray, as_finite, broadcast_to
from ...design import Mechanism
from ...load_case import CentreOffset
from ...load_case.pose_stacks import Query
from ...numerics.vectors import NEAR_MARGIN, SINGULAR_MARGIN, margin_of_values
from ..limbs import STATUS
from .affine_state import AffineState, BalancedTensions, EquilibriumParts
from .bent_guides import largest_deflection
from .elastic_equilibrium import ElasticEquations
from .side_forces import SideWrenches, limb_loads, side_wrenches

#: Lever arm about O below which a force has none, m: rounding.
_NO_ARM = 1e-13


def as_offset(offset: CentreOffset | ArrayLike, shape: tuple[int, ...]) -> tuple[FloatArray, FloatArray]:
    """Base and cuff offsets for a stack of N poses, shape (N, 3) each, m.

    Parameters
    ----------
    offset : CentreOffset or array_like
        A bare offset shifts base and cuff together.
    shape : tuple of int
        Stack shape (...).
    """
    if not isinstance(offset, CentreOffset):
        offset = CentreOffset.together(as_finite("centre_offset", offset, (3,), stack=True))
    sides = (broadcast_to("centre_offset", side, (*shape, 3)) for side in (offset.base, offset.cuff))
    base, cuff = (side.reshape(-1, 3) for side in sides)
    return base, cuff


class Displaced:
    """Equilibrium of a stack of poses with the device's centre off the shoulder's.

    Parameters
    ----------
    mechanism : Mechanism
        With the assumptions of :mod:`exo_pin.wrist.forces.side_forces` for limbs with mass.
    query : Query
        Poses.
    base, cuff : ndarray
        Offsets of :func:`as_offset`.
    force, moment : ndarray
        Load on limbs and shoulder together, shape (N, 3): weight, inertia and load of the arm, moment about O.
    base_points : ndarray, optional
        Points of a rotated base ring, shape (N, n, 3), m, about its own centre; those of the geometry if left out.
    side : SideWrenches, optional
        Those of guides that bend; of straight guides if left out.

    Attributes
    ----------
    side : SideWrenches
        Directions, lever arms, side wrenches and stiffnesses.
    state : AffineState
        The equilibrium.
    tensions : BalancedTensions
        Its tensions.
    status : ndarray of int8
        Index into the names of status.
    margin, determinant : ndarray
        Shape (N,), of the lever arms about the shoulder.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        query: Query,
        base: FloatArray,
        cuff: FloatArray,
        force: FloatArray,
        moment: FloatArray,
        base_points: FloatArray | None = None,
        side: SideWrenches | None = None,
    ) -> None:
        if side is None:
            side = side_wrenches(mechanism, query.matrices, base, cuff, base_points)
        self.side: SideWrenches = side
        closure, share = limb_loads(mechanism, query, base, cuff, side.folded, base_points)
        self.state = AffineState.of_closures(
            closure,
            -np.concatenate([side.directions, side.moment_arms], axis=-1),
            -np.concatenate([side.forces, np.where(np.abs(side.moments) < _NO_ARM, 0.0, side.moments)], axis=-1),
            share,
            share.sum(axis=1) - np.concatenate([force, moment], axis=1),
        )
        self.tensions = BalancedTensions.of(self.state)
        self.margin: FloatArray = margin_of_values(self.tensions.singular_values)
        self.status = np.zeros(len(self.margin), dtype=np.int8)
        self.status[self.margin < NEAR_MARGIN] = STATUS.index("near_singular")
        self.status[self.margin < SINGULAR_MARGIN] = STATUS.index("singular")
        self.status[side.folded] = STATUS.index("folded")
        self.determinant: FloatArray = np.full(len(self.margin), np.nan)
        if mechanism.limb_count == 3:
            arms = np.swapaxes(side.moment_arms, 1, 2)
            lengths = np.linalg.norm(arms, axis=1)
            far = lengths > _NO_ARM
            volume = -np.linalg.det(arms) / np.prod(np.where(far, lengths, 1.0), axis=1)
            self.determinant = np.where(far.all(axis=1), volume, 0.0)

    @property
    def parts(self) -> EquilibriumParts:
        """State, tensions, stiffness and misfit along the side wrenches, status, margin and determinant."""
        side = self.side
        return self.state, self.tensions, side.stiffness, side.deflection, self.status, self.margin, self.determinant


class PartDisplacements(NamedTuple):
    """Displacements of the parts, N poses.

    Attributes
    ----------
    arm : ndarray
        Orientation of the arm, shape (N, 3, 3).
    displacement : ndarray
        δ, shape (N, 3), m.
    harness, cuff : ndarray
        Displacement and rotation vector of base ring against torso (base frame) and of platform against arm (arm
        frame), shape (N, 6), m and rad; zero where rigid.
    twist : ndarray
        φ_i of the guides, shape (N, n), rad.
    bending : ndarray
        Deflection of the guides from the line A_i B_i, over its length, shape (N, n); NaN where they have no stable
        shape.
    lengths : ndarray
        Of the limbs, shape (N, n), m.
    forces : ndarray or None
        f of locked actuators, shape (N, n), N.
    """

    arm: FloatArray
    displacement: FloatArray
    harness: FloatArray
    cuff: FloatArray
    twist: FloatArray
    bending: FloatArray
    lengths: FloatArray
    forces: FloatArray | None


class MovedDevice:
    """The device at given unknowns of the elastic equations.

    Parameters
    ----------
    equations : ElasticEquations
        Of N poses.
    rows : ndarray of int
        Some of the poses, k of them.
    x : ndarray
        Shape (k, m), the unknowns.

    Attributes
    ----------
    displaced : Displaced
        Its equilibrium, k poses, moments about the displaced centre of the arm's joint.
    misfit : ndarray
        Shape (k, n), m.
    loads : tuple of ndarray
        Of the displaced arm, as :func:`exo_pin.load_case.pose_stacks.arm_loads` returns.
    movement : PartDisplacements
        Displacements of the parts.
    """

    def __init__(self, equations: ElasticEquations, rows: NDArray[np.intp], x: FloatArray) -> None:
        at, arm = equations.place(rows, x, np.ones(len(rows)))
        self.loads = equations.loads(rows, arm)
        mechanism, query = equations.mechanism, equations.query_at(rows, at)
        side, turns = equations.sides(at, equations.ends[rows])
        lost = np.isnan(turns).any(axis=(1, 2))
        if lost.any():
            # No stable shape of a guide is near: no equilibrium either, and the forces of straight guides have no NaN.
            straight = side_wrenches(mechanism, at.matrices, at.base, at.cuff, at.base_points)
            pairs = zip(side, straight, strict=True)
            side = SideWrenches(
                *(np.where(lost.reshape(-1, *[1] * (one.ndim - 1)), other, one) for one, other in pairs)
            )
        self.displaced = Displaced(mechanism, query, at.base, at.cuff, *self.loads[:2], at.base_points, side)
        delta, (harness, cuff) = equations.centre(x), (x[:, part] for part in equations.parts[2:])
        self.misfit: FloatArray = side.deflection - (side.forces @ delta[..., None])[..., 0]
        ends = (mechanism.geometry.platform_points + at.cuff[:, None]) @ np.swapaxes(at.matrices, 1, 2)
        none = np.zeros((len(rows), 6))
        self.movement = PartDisplacements(
            arm,
            delta,
            harness if harness.size else none,
            cuff if cuff.size else none,
            side.twist,
            largest_deflection(turns),
            np.linalg.norm(ends - at.base_points - at.base[:, None], axis=-1),
            x[:, equations.parts[3].stop :] if equations.locked else None,
        )
