"""Closed configurations beside one, where ranks are regular."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ...core.errors import LoopNotClosed
from ...core.validation import FloatArray
from ..structure.chain_state import ChainState
from .closing import nearest_closed
from .rank import rank_tolerance
from .reduced_kinematics import scaled_jacobian

#: Number of neighbouring poses that give the regular ranks, and their distance, rad and characteristic lengths.
#: Singular poses are a set of measure zero: random neighbours are regular.
_NEIGHBOURS, _NEAR = 3, 0.05
#: Residual of loops that are closed, m and rad.
_CLOSED = 1e-12


def neighbours(state: ChainState, q: FloatArray, motions: FloatArray, held: NDArray[np.intp]) -> Iterator[FloatArray]:
    """Some closed configurations beside q, where held coordinates are as in q.

    Parameters
    ----------
    state : ChainState
        The chain.
    q : ndarray
        Shape (nq,), closed.
    motions : ndarray
        Shape (nv, k), a basis of the motions there, scaled.
    held : ndarray of int
        Coordinates of v.
    """
    rng = np.random.default_rng(0)
    for _ in range(_NEIGHBOURS if motions.shape[1] else 0):
        away = motions @ rng.normal(size=motions.shape[1])
        start = pin.integrate(state.model, q, state.topology.column * away * (_NEAR / np.abs(away).max()))
        try:
            yield nearest_closed(state, start, held, _CLOSED, 30)[0]
        except LoopNotClosed:
            continue


def structural_rank(state: ChainState, q: FloatArray, passive: NDArray[np.int64] | None) -> int:
    """Rank of the scaled constraint Jacobian, or of some of its columns, at q or beside it, whichever is more.

    It is found once for a chain, whose geometry is rounded.
    """
    key = None if passive is None else passive.tobytes()
    if key not in state.structural_ranks:
        columns = slice(None) if passive is None else passive
        sizes = [np.linalg.svd(J[:, columns], compute_uv=False) for J in _jacobians(state, q)]
        state.structural_ranks[key] = max(_rank(state, values, state.tolerance) for values in sizes)
    return state.structural_ranks[key]


def agreeing_rows(state: ChainState, q: FloatArray) -> tuple[int, float] | None:
    """How many rows agree with others within the tolerance of the geometry, away from singular poses, and not exactly.

    Parameters
    ----------
    state : ChainState
        A chain with a tolerance.
    q : ndarray
        Shape (nq,), closed.

    Returns
    -------
    tuple or None
        The number of such rows, and the largest of their singular values. None where the tolerance leaves no clear
        choice: a singular value between a tenth of that of the rank and ten times it.
    """
    found = (0, 0.0)
    for J in _jacobians(state, q):
        values = np.linalg.svd(J, compute_uv=False)
        exact, rounded = _rank(state, values, 0.0), _rank(state, values, state.tolerance)
        if exact > rounded:
            zero = _zero(state, values, state.tolerance)
            if values[rounded] > 0.1 * zero or (rounded and values[rounded - 1] < 10.0 * zero):
                return None
            found = max(found, (exact - rounded, float(values[rounded])))
    return found


def _jacobians(state: ChainState, q: FloatArray) -> Iterator[FloatArray]:
    """Scaled constraint Jacobians at q and beside it."""
    J = scaled_jacobian(state, q)[0]
    yield J
    values, Vt = np.linalg.svd(J)[1:]
    for there in neighbours(state, q, Vt[_rank(state, values, state.tolerance) :].T, np.zeros(0, dtype=int)):
        yield scaled_jacobian(state, there)[0]


def _zero(state: ChainState, values: NDArray[Any], gap: float) -> float:
    rows, columns = state.row_count, state.nv
    return float(rank_tolerance((rows, columns), float(values.max(initial=0.0)), state.model.njoints, gap))


def _rank(state: ChainState, values: NDArray[Any], gap: float) -> int:
    # Loops of an exact geometry are closed to rounding of their own.
    return int(np.count_nonzero(values > _zero(state, values, max(gap, _CLOSED))))
