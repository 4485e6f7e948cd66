"""Mass matrix of the open tree, and motions without inertia."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from ...core.validation import FloatArray
from .motion_axes import symmetric

if TYPE_CHECKING:
    from .chain_state import ChainState

#: A motion whose inertia is below this share of the largest counts as moving no mass.
MASSLESS = 1e-13


def lawful_moments(moments: FloatArray) -> FloatArray:
    """The nearest principal moments of inertia that a body may have, ascending: none negative or above the others' sum.

    Parameters
    ----------
    moments : ndarray
        Shape (3,), ascending, kg m².
    """
    nearest = np.maximum(moments, 0.0)
    beyond = nearest[2] - nearest[1] - nearest[0]
    return nearest if beyond <= 0.0 else np.asarray(nearest + beyond / 3.0 * np.array([1.0, 1.0, -1.0]))


def inertia_matrix(state: ChainState, q: FloatArray) -> FloatArray:
    """M, shape (nv, nv), rotors included. Pinocchio fills the upper half."""
    nv = state.model.nv
    found: FloatArray = symmetric(np.reshape(pin.crba(state.model, state.buffers.data, q), (nv, nv)).T)
    return found


def heaviest(M: FloatArray) -> float:
    """Largest entry of the diagonal."""
    return float(np.abs(np.diag(M)).max(initial=0.0))


def massless_joints(state: ChainState, q: FloatArray, basis: FloatArray) -> list[str]:
    """Joints that move in the motion of least inertia among those of a basis, the most moved first."""
    column = state.topology.column
    M = inertia_matrix(state, q) * column[:, None] * column
    way = np.abs(basis @ np.linalg.eigh(basis.T @ M @ basis)[1][:, 0])
    names = [str(name) for name in list(state.model.names)[1:]]
    moved = {name: float(way[state.velocity_slice(name)].max(initial=0.0)) for name in names}
    largest = max(moved.values())
    return sorted((name for name in names if moved[name] > 0.1 * largest), key=lambda name: -moved[name])
