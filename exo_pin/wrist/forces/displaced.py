"""Equilibrium in closed form with the device's centre off the shoulder's.

A device whose centre is not the shoulder's has two effects. The limbs act about the shoulder and not about their own
centre, which changes their tensions; and as the arm turns, the centre of the base and that of the cuff move apart,
which strains limbs and shoulder. Both are solved in the displaced geometry (:mod:`exo_pin.wrist.forces.side_forces`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_finite
from ...design import Mechanism
from ...load_case import CentreOffset
from ...load_case.pose_stacks import Query
from ...numerics.vectors import NEAR_MARGIN, SINGULAR_MARGIN, margin_of_values
from ..limbs import STATUS
from .affine_state import AffineState, BalancedTensions, EquilibriumParts
from .limb_inertia import limb_loads
from .side_forces import SideWrenches, side_wrenches

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
    try:
        sides = [np.broadcast_to(side, (*shape, 3)).reshape(-1, 3) for side in (offset.base, offset.cuff)]
    except ValueError:
        raise InvalidInput(
            f"expected centre_offset to broadcast to {(*shape, 3)}, got {offset.base.shape} and {offset.cuff.shape}"
        ) from None
    return sides[0], sides[1]


class Displaced:
    """Equilibrium of a stack of poses with the device's centre off the shoulder's.

    Parameters
    ----------
    mechanism : Mechanism
        With the assumptions of :mod:`exo_pin.wrist.forces.limb_inertia` for limbs with mass.
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
        n = mechanism.limb_count
        if side is None:
            side = side_wrenches(mechanism, query.matrices, base, cuff, base_points)
        self.side: SideWrenches = side
        closure = share = np.zeros((len(force), n, 6))
        if not mechanism.limbs_are_massless:
            closure, share = limb_loads(mechanism, query, base, cuff, side.folded, base_points)
        self.state = AffineState.of_closures(
            closure,
            -np.concatenate([side.directions, side.moment_arms], axis=-1),
            -np.concatenate([side.forces, np.where(np.abs(side.moments) < _NO_ARM, 0.0, side.moments)], axis=-1),
            share,
            share.sum(axis=1) - np.concatenate([force, moment], axis=-1),
        )
        self.tensions = BalancedTensions.of(self.state)
        self.margin: FloatArray = margin_of_values(self.tensions.singular_values)
        self.status = np.zeros(len(self.margin), dtype=np.int8)
        self.status[self.margin < NEAR_MARGIN] = STATUS.index("near_singular")
        self.status[self.margin < SINGULAR_MARGIN] = STATUS.index("singular")
        self.status[side.folded] = STATUS.index("folded")
        self.determinant: FloatArray = np.full(len(self.margin), np.nan)
        if n == 3:
            arms = np.swapaxes(side.moment_arms, 1, 2)
            lengths = np.linalg.norm(arms, axis=1)
            far = lengths > _NO_ARM
            volume = -np.linalg.det(arms) / np.prod(np.where(far, lengths, 1.0), axis=1)
            self.determinant = np.where(far.all(axis=1), volume, 0.0)

    @property
    def parts(self) -> EquilibriumParts:
        """State, tensions, stiffness and misfit along the side wrenches, status, margin and determinant."""
        side = self.side
        return self.state, self.tensions, side.stiffness, side.misfit, self.status, self.margin, self.determinant
