"""Mass matrix of the open tree, and motions without inertia."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pinocchio as pin

from ...core.validation import FloatArray
from .motion_axes import motion_axes, q_slice, symmetric, v_slice
from .topology import Topology

if TYPE_CHECKING:
    from .chain_state import ChainState

#: A motion whose inertia is below this share of the largest counts as moving no mass.
MASSLESS = 1e-13
#: Travel of slides up to which a bound of the inertia holds, characteristic lengths.
_TRAVEL = 10.0


class InertiaBound(NamedTuple):
    """Where every motion of the open tree has inertia, known from the bodies alone.

    Attributes
    ----------
    everywhere : bool
        Whether every motion has inertia as long as the slides stay within their travel.
    travelling : ndarray of int
        Indices in q of joints that move a body's origin and do not stand on the world.
    travel : float
        Largest size of those coordinates.
    """

    everywhere: bool
    travelling: np.ndarray
    travel: float


def inertia_bound(model: pin.Model, topology: Topology) -> InertiaBound:
    """A bound of the mass matrix that holds at all configurations.

    With twists V and inertias I of the bodies, metres divided by the characteristic length, 2T = Σ Vᵀ I V. A joint's
    rate is no larger than |V| + x |V_parent| over the least singular value σ of its subspace, where x = 1 + |p| is
    the size of the change of origin by p. Hence |v|² <= 2 Σ_b (1/σ_b² + Σ_children x²/σ²) |V_b|², and with μ_b the
    least principal inertia of a body, λ_min >= 1 / (2 max_b (1/σ_b² + Σ_children x²/σ²)/μ_b). The trace, with x over
    the whole reach of a subtree, bounds λ_max. Bodies without inertia and joints whose axes change give no bound.
    """
    length, axes = topology.length, motion_axes(model)
    scale = np.array([length] * 3 + [1.0] * 3)
    count = model.njoints
    lightest, heavy, strength, shift, size = (np.zeros(count) for _ in range(5))
    strength[0] = np.inf
    travelling: list[int] = []
    for joint in range(1, count):
        sizes = np.linalg.eigvalsh(model.inertias[joint].matrix() * scale[:, None] * scale)
        lightest[joint], heavy[joint] = sizes[0], sizes[-1]
        column = topology.column[v_slice(model, joint)]
        subspace = axes[joint] / scale[:, None] * column
        strength[joint] = np.linalg.svd(subspace, compute_uv=False)[-1] if len(column) else np.inf
        size[joint] = (subspace**2).sum()
        if model.parents[joint]:
            shift[joint] = np.linalg.norm(model.jointPlacements[joint].translation) / length
            if np.abs(subspace[:3]).max(initial=0.0) > 0.0:
                shift[joint] += np.sqrt(3.0) * _TRAVEL * max(np.abs(subspace[:3]).max(), 1.0)
                own = q_slice(model, joint)
                travelling += range(own.start, own.stop)
    lightest[0] = np.inf
    if count == 1 or not (lightest.min() > 0.0 and (model.armature >= 0.0).all()):
        return InertiaBound(False, np.array([], dtype=np.int64), 0.0)
    needed, reach, carried = 1.0 / strength**2, np.zeros(count), heavy.copy()
    for joint in range(count - 1, 0, -1):
        parent = model.parents[joint]
        needed[parent] += ((1.0 + shift[joint]) / strength[joint]) ** 2
        reach[parent] = max(reach[parent], reach[joint] + shift[joint])
        carried[parent] += carried[joint]
    least = 1.0 / (2.0 * (needed / lightest).max())
    most = (size * (1.0 + reach) ** 2 * carried)[1:].sum() + (model.armature * topology.column**2).sum()
    return InertiaBound(bool(least > MASSLESS * most), np.array(travelling, dtype=np.int64), _TRAVEL * min(length, 1.0))


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


def has_inertia(state: ChainState, q: FloatArray) -> bool:
    """Whether every motion of the open tree has inertia, as Pinocchio needs it."""
    bound = state.inertia_bound
    if bound.everywhere and not (len(bound.travelling) and np.abs(q[bound.travelling]).max() > bound.travel):
        return True
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
