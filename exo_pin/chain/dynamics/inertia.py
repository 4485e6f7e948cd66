"""Mass matrix of the open tree, and motions without inertia."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ...core.validation import FloatArray
from ..structure.chain_state import ChainState

__all__ = ["MASSLESS", "has_inertia", "heaviest", "inertia_matrix", "massless_joints"]

#: A motion whose inertia is below this share of the largest counts as moving no mass.
MASSLESS = 1e-13


def inertia_matrix(state: ChainState, q: FloatArray) -> FloatArray:
    """M, shape (nv, nv), rotors included. Pinocchio fills the upper half."""
    nv = state.model.nv
    upper = np.triu(np.reshape(pin.crba(state.model, state.workspace.data, q), (nv, nv)))
    return np.asarray(upper + np.triu(upper, 1).T)


def heaviest(M: FloatArray) -> float:
    """Largest entry of the diagonal."""
    return float(np.abs(np.diag(M)).max(initial=0.0))


def has_inertia(state: ChainState, q: FloatArray) -> bool:
    """Whether every motion of the open tree has inertia, as Pinocchio needs it."""
    column = state.topology.column
    sizes = np.linalg.eigvalsh(inertia_matrix(state, q) * column[:, None] * column)
    return bool(sizes[0] > MASSLESS * sizes[-1])


def massless_joints(state: ChainState, q: FloatArray, basis: FloatArray) -> list[str]:
    """Joints that move in the motion of least inertia among those of a basis, the most moved first."""
    column = state.topology.column
    M = inertia_matrix(state, q) * column[:, None] * column
    way = np.abs(basis @ np.linalg.eigh(basis.T @ M @ basis)[1][:, 0])
    names = [str(name) for name in list(state.model.names)[1:]]
    moved = {name: float(way[state.velocity_slice(name)].max(initial=0.0)) for name in names}
    largest = max(moved.values())
    return sorted((name for name in names if moved[name] > 0.1 * largest), key=lambda name: -moved[name])
