"""How many freedoms a closed chain has at a pose, and how many of its constraints say the same."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..validation import FloatArray, frozen

if TYPE_CHECKING:
    from .model import ClosedChain

__all__ = ["Mobility", "mobility", "rank_tolerance"]


@dataclass(frozen=True, eq=False)
class Mobility:
    """Rank of the constraints of a closed chain at one configuration.

    Attributes
    ----------
    rows : int
        Constraint rows, those of the closures and one per locked coordinate.
    coordinates : int
        Velocity coordinates of the tree, nv.
    rank : int
        Rank of the constraint Jacobian.
    singular_values : ndarray
        Shape (min(rows, coordinates),), descending, of the Jacobian with metres divided by
        ``characteristic_length``: they have no unit.
    tolerance : float
        Singular values at or below it count as zero, see :func:`rank_tolerance`.
    characteristic_length : float
        Length that weighs metres against radians, m.
    """

    rows: int
    coordinates: int
    rank: int
    singular_values: FloatArray
    tolerance: float
    characteristic_length: float

    @property
    def degrees_of_freedom(self) -> int:
        """Freedoms that the constraints leave, to first order."""
        return self.coordinates - self.rank

    @property
    def redundant(self) -> int:
        """Constraint rows that say nothing new: so many multipliers are statically undetermined."""
        return self.rows - self.rank

    @property
    def smallest(self) -> float:
        """The smallest singular value that counts; 0 for none. It goes to zero towards a singularity."""
        return float(self.singular_values[self.rank - 1]) if self.rank else 0.0


def rank_tolerance(shape: tuple[int, int], largest: float, joints: int, residual: float) -> float:
    """Singular values of a scaled constraint Jacobian that may be zero.

    A perturbation E of a matrix moves its singular values by at most |E|₂ <= max(shape) max|E_ij|. Entries of the
    scaled Jacobian are of order one times ``largest``. They carry one rounding per joint on their path, and the
    configuration itself is off by the loops' residual, which they follow to first order.

    Parameters
    ----------
    shape : tuple of int
        Of the matrix.
    largest : float
        Its largest singular value.
    joints : int
        Number of joints of the tree.
    residual : float
        Largest scaled residual of the loops.
    """
    return max(shape) * largest * (joints * float(np.finfo(float).eps) + residual)


def mobility(chain: ClosedChain, q: FloatArray, locked: np.ndarray) -> Mobility:
    """See :meth:`ClosedChain.mobility`."""
    work, top = chain._workspace, chain._topology
    work.linearise(q)
    column_scale = np.where(top.metres, top.length, 1.0)
    scaled = work.jacobian * top.row_scale[:, None] * column_scale
    stacked = np.concatenate([scaled, np.eye(chain.model.nv)[locked]])
    values = np.linalg.svd(stacked, compute_uv=False) if stacked.size else np.zeros(0)
    largest = float(values[0]) if values.size else 0.0
    gap = float(np.abs(work.gap * top.row_scale).max(initial=0.0))
    tolerance = rank_tolerance(stacked.shape, largest, chain.model.njoints, gap)
    rank = int(np.count_nonzero(values > tolerance))
    return Mobility(stacked.shape[0], chain.model.nv, rank, frozen(values), tolerance, top.length)
