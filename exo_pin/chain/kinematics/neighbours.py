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
            yield nearest_closed(state, start, held, 1e-12, 30)[0]
        except LoopNotClosed:
            continue


def structural_rank(state: ChainState, q: FloatArray, passive: NDArray[np.int64] | None) -> int:
    """Rank of the scaled constraint Jacobian, or of some of its columns, at q or beside it, whichever is more.

    It is found once for a chain, whose geometry is rounded.
    """
    key = None if passive is None else passive.tobytes()
    if key not in state.structural_ranks:
        J = scaled_jacobian(state, q)[0]
        values, Vt = np.linalg.svd(J)[1:]
        motions = Vt[_rank(state, values, J) :].T
        found = [J, *(scaled_jacobian(state, there)[0] for there in neighbours(state, q, motions, np.zeros(0, int)))]
        own = found if passive is None else [J[:, passive] for J in found]
        ranks = [_rank(state, np.linalg.svd(J, compute_uv=False), J) for J in own]
        state.structural_ranks[key] = max(ranks)
    return state.structural_ranks[key]


def _rank(state: ChainState, values: NDArray[Any], J: FloatArray) -> int:
    largest = float(values.max(initial=0.0))
    return int(np.count_nonzero(values > rank_tolerance(J.shape, largest, state.model.njoints, state.tolerance)))
