"""What stiffness makes of the part that equilibrium leaves open, and what a misaligned device does.

The ball joint gives way by δ under the force it carries, the guides of UPU limbs by g_i / k_i under theirs. With
F_s0 the shoulder force at g = 0 (so that N = -F_s0 is the load at O that the limbs' tensions leave), X the matrix of
columns X_i and K_X = Σ k_i X_i X_iᵀ:

    δ = (K_s + K_X)⁻¹ N          g_i = k_i X_i · δ          F_s = -K_s δ

This is the δ that makes the strain energy ½ δᵀ K_s δ + ½ Σ k_i (X_i · δ)² - N · δ least. δ is taken to be small
against the limbs: lever arms and directions are those at δ = 0.

A device whose centre is not the shoulder's does two things. The limbs act about the shoulder and not about their own
centre, so that their tensions change, too; and the centre held by the base and the one carried by the cuff part as the
arm turns, which strains limbs and shoulder. Both are solved in the displaced geometry
(:mod:`exo_pin.wrist.forces.side_forces`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput, MissingData
from ...core.validation import FloatArray, as_finite
from ...design import Mechanism
from ...load_case import CentreOffset
from ...load_case.pose_stacks import Query
from ...wrist.forces.closed_form import STATUS
from ...wrist.forces.side_forces import SideWrenches, side_wrenches
from ...wrist.kernels import NEAR_MARGIN, SINGULAR_MARGIN

__all__ = ["Displaced", "as_offset", "shoulder_stiffness"]


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


def shoulder_stiffness(mechanism: Mechanism) -> FloatArray:
    """K_s, shape (3, 3), N/m.

    Raises
    ------
    MissingData
        If the mechanism has none; no value was found in the literature, so nothing is assumed.
    """
    if mechanism.shoulder.stiffness is None:
        raise MissingData(["shoulder stiffness"], 'split="elastic"', mechanism.name)
    return mechanism.shoulder.stiffness


class Displaced:
    """Equilibrium of a stack of poses with the device's centre off the shoulder's, massless limbs.

    Shoulder force and tensions are affine in the side forces: f = f0 + f_of_g g and F_s = shoulder + shoulder_of_g g.

    Parameters
    ----------
    mechanism : Mechanism
        With massless limbs.
    query : Query
        Poses.
    base, cuff : ndarray
        Offsets of :func:`as_offset`.
    force, moment : ndarray
        What limbs and shoulder carry, shape (N, 3): weight, inertia and load, moment about O.

    Attributes
    ----------
    side : SideWrenches
        Directions, lever arms, side wrenches and stiffnesses.
    f0, f_of_g, self_stress : ndarray
        Shape (N, n), (N, n, n) and (N, n, n - 3).
    shoulder, shoulder_of_g : ndarray
        Shape (N, 3), (N, 3, n).
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
    ) -> None:
        n = mechanism.limb_count
        self.side: SideWrenches = side_wrenches(mechanism, query.matrices, base, cuff)
        arms = np.swapaxes(self.side.moment_arms, 1, 2)
        directions, sides = (np.swapaxes(v, 1, 2) for v in (self.side.directions, self.side.forces))
        radius = np.linalg.norm(mechanism.geometry.platform_points, axis=-1).max()
        U, values, Vt = np.linalg.svd(arms)
        self.margin: FloatArray = values[:, 2] / radius
        self.status = np.zeros(len(values), dtype=np.int8)
        self.status[self.margin < NEAR_MARGIN] = STATUS.index("near_singular")
        self.status[self.margin < SINGULAR_MARGIN] = STATUS.index("singular")
        self.status[self.side.folded] = STATUS.index("folded")
        self.determinant: FloatArray = np.full(len(values), np.nan)
        if n == 3:
            lengths = np.linalg.norm(arms, axis=1)
            self.determinant = -np.linalg.det(arms) / np.prod(np.where(lengths > 0.0, lengths, 1.0), axis=1)
        usable = values > 0.0
        inverse = np.divide(1.0, values, out=np.zeros_like(values), where=usable)
        # Tensions of least norm that make a moment, shape (N, n, 3).
        tensions = np.einsum("kji,kj,klj->kil", Vt[:, :3], inverse, U)
        self.self_stress: FloatArray = np.swapaxes(Vt[:, 3:], 1, 2)
        self.f0: FloatArray = np.einsum("kij,kj->ki", tensions, moment)
        self.f_of_g: FloatArray = -tensions @ np.swapaxes(self.side.moments, 1, 2)
        self.shoulder: FloatArray = np.einsum("kij,kj->ki", directions, self.f0) - force
        self.shoulder_of_g: FloatArray = sides + directions @ self.f_of_g

    def elastic_side_forces(self, stiffness: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Side forces and displacement of the joint's centre that the stiffnesses decide.

        Parameters
        ----------
        stiffness : ndarray
            K_s, shape (3, 3), N/m.

        Returns
        -------
        g, delta : ndarray
            Shape (N, n), N, and (N, 3), m; NaN where shoulder and limbs together leave a direction free.
        """
        k, sides = self.side.stiffness, self.side.forces
        whole, target = self.elastic_system(stiffness)
        solvable = np.linalg.cond(whole) < 1e12
        solvable &= self.status < STATUS.index("singular")
        delta = np.full_like(target, np.nan)
        delta[solvable] = np.linalg.solve(whole[solvable], target[solvable][..., None])[..., 0]
        return k * (np.einsum("kni,ki->kn", sides, delta) + self.side.misfit), delta

    def elastic_system(self, stiffness: FloatArray) -> tuple[FloatArray, FloatArray]:
        """K_s + K_X and the load N, shape (N, 3, 3), N/m, and (N, 3), N: (K_s + K_X) δ = N, misfit included."""
        pushed = self.shoulder_of_g * self.side.stiffness[:, None, :]
        whole = stiffness + pushed @ self.side.forces
        return whole, -self.shoulder - np.einsum("kij,kj->ki", pushed, self.side.misfit)

    def limb_wrenches(self, f: FloatArray, g: FloatArray) -> FloatArray:
        """Force and moment about O of every limb on the arm, shape (N, n, 6)."""
        side = self.side
        force = f[..., None] * side.directions + g[..., None] * side.forces
        moment = f[..., None] * side.moment_arms + g[..., None] * side.moments
        return -np.concatenate([force, moment], axis=-1)
