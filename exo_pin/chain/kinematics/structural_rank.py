"""The rank of loops away from singular poses, which rows of rounded loops agree, and closing them in the others."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ...core.validation import FloatArray
from ..structure.chain_state import CLOSED, ChainState
from .loops import scaled_jacobian
from .rank import rank_tolerance

__all__ = ["agreeing_rows", "measured_agreement", "settled", "structural_rank"]

#: Number of poses around one that give the regular ranks, and the distance of the first, rad and characteristic
#: lengths; each is twice as far as the one before. Singular poses are a set of measure zero: most of them are regular.
_NEIGHBOURS, _NEAR = 4, 0.05
#: Residual of loops that are closed, m and rad.
_CLOSED = 1e-12
#: What rounding leaves of the residual of exact loops, characteristic lengths and rad.
_EXACT = 1e-14
#: Most steps of settling, a step that leaves the neighbourhood, characteristic lengths and rad, most damping over the
#: square of the opening, and an opening at which there is nothing to settle.
_SETTLING, _FAR, _MOST_DAMPING, _SETTLED = 40, 0.5, 1e8, 1e-14
#: How far from the mean an error of the digits may lie, over the root of the mean square.
_SPREADS = 4.0
#: The same of a loop as it is drawn.
_DRAWN = 3.0
#: How far it lies with certainty at most: the root mean square of 16 geometries is itself known to a sixth.
_MOST_SPREADS = 5.0


def structural_rank(state: ChainState, q: FloatArray, passive: NDArray[np.intp] | None) -> int:
    """Rank of the scaled constraint Jacobian, or of some of its columns, away from singular poses.

    It is the largest at q and around it, found once for a chain.
    """
    key = None if passive is None else passive.tobytes()
    if key not in state.structural_ranks:
        columns = slice(None) if passive is None else passive
        found = 0
        for J, opening in _jacobians(state, q):
            values = np.linalg.svd(J[:, columns], compute_uv=False)
            found = max(found, _rank(state, values, max(state.tolerance, opening)))
        state.structural_ranks[key] = found
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
    for J, opening in _jacobians(state, q):
        if opening > max(CLOSED, state.contradiction):
            continue
        values = np.linalg.svd(J, compute_uv=False)
        exact, rounded = _rank(state, values, 0.0), _rank(state, values, state.tolerance)
        if exact > rounded:
            zero = _zero(state, values, state.tolerance)
            if values[rounded] > 0.1 * zero or (rounded and values[rounded - 1] < 10.0 * zero):
                return None
            found = max(found, (exact - rounded, float(values[rounded])))
    return found


class Agreement(NamedTuple):
    """Rows of loops that agree within the digits of their geometry.

    Attributes
    ----------
    rows : int
        How many rows agree with others, and not exactly.
    size : float
        The largest of their singular values.
    tolerance : float
        The tolerance of the geometry that makes them agree and leaves the loops open by what the digits do, m and rad.
        0 if none is needed.
    """

    rows: int
    size: float
    tolerance: float


def measured_agreement(
    state: ChainState, others: Sequence[ChainState], q: FloatArray, tolerance: float
) -> Agreement | None:
    """Which rows agree, by how other digits move the singular values of a chain away from singular poses.

    For each rank that the tolerance leaves open, the chain and the others are closed in the directions of that many
    singular values. The others' Jacobians differ from this one by errors of its own size. To first order the singular
    values that should be zero are those of the error in the directions of the redundant rows and the motions, uᵀ E v,
    and the smallest that should not is moved by uᵀ E v of its own directions. A rank falls if at some pose five times
    the root of the mean square of such errors does not explain the first ones. It stands if, moreover, at some pose
    forty times as much does not explain the last; others may be beside singular poses.

    Parameters
    ----------
    state : ChainState
        The chain, its geometry taken as exact.
    others : sequence of ChainState
        The same chain with other digits.
    q : ndarray
        Shape (nq,), closed within the tolerance.
    tolerance : float
        Of the geometry, characteristic lengths and rad: only ranks that it may change are tried.

    Returns
    -------
    Agreement or None
        No rows where every lower rank falls; None where none or several stand.
    """
    values, Vt = np.linalg.svd(scaled_jacobian(state, q)[0])[1:]
    least = int(np.count_nonzero(values > 10.0 * _zero(state, values, tolerance)))
    starts, motions = [q], Vt[least:].T
    if motions.shape[1]:
        away = motions @ np.random.default_rng(0).normal(size=(motions.shape[1], _NEIGHBOURS))
        away *= _NEAR * 2.0 ** np.arange(_NEIGHBOURS) / np.abs(away).max(axis=0)
        starts = [pin.integrate(state.model, q, state.topology.column * step) for step in away.T]
    exact, opened = _rank(state, values, 0.0), _drawn_opening(state, others, q, least)
    found = [one for k in range(least, exact) if (one := _agreement(state, others, starts, k)) is not None]
    if not found:
        seen = [_errors(state, others, start, exact) for start in starts]
        return Agreement(0, 0.0, max([opened, *(one.tolerance for one in seen if one is not None)]))
    standing = [one for one in found if one.tolerance < np.inf]
    return standing[0]._replace(tolerance=max(opened, standing[0].tolerance)) if len(standing) == 1 else None


class _Errors(NamedTuple):
    """Singular values at a pose, and what the digits explain."""

    zero: float  # the largest that should be zero
    explained: float  # by the digits, of these, at most
    least: float  # that should not be zero, over that of the tolerance
    tolerance: float  # of the geometry, m and rad, that explains all
    rows: int  # that agree, and not exactly


def _errors(state: ChainState, others: Sequence[ChainState], start: FloatArray, rank: int) -> _Errors | None:
    """What a rank makes of the singular values near a configuration; None where the loops do not settle."""
    there = _settled(state, start, rank)
    nearby = [] if there is None else [(other, _settled(other, there, rank)) for other in others]
    if there is None or any(place is None for _, place in nearby):
        return None
    J = scaled_jacobian(state, there)[0]
    U, values, Vt = np.linalg.svd(J)
    opening, errors = _opening(state), []
    for other, place in nearby:
        assert place is not None
        error = U.T @ (scaled_jacobian(other, place)[0] - J) @ Vt.T
        block = error[rank:, rank:]
        smallest = abs(float(error[rank - 1, rank - 1])) if rank else 0.0
        errors.append((float(np.linalg.norm(block, 2)) if block.size else 0.0, smallest))
    # Of those that should be zero, and of the smallest that should not.
    spread = _SPREADS * np.sqrt(np.mean(np.square(errors), axis=0))
    explained, shift = np.maximum(spread, _zero(state, values, _EXACT)).tolist()
    unit = max(1.0, 1.0 / state.topology.length)
    zero, most = float(values[rank:].max(initial=0.0)), explained * _MOST_SPREADS / _SPREADS
    needed = max(opening, max(explained, shift, min(zero, most)) / (_zero(state, values, 1.0) * unit))
    least = float(values[rank - 1]) / _zero(state, values, needed * unit) if rank else np.inf
    return _Errors(zero, most, least, needed, _rank(state, values, 0.0) - rank)


def _agreement(
    state: ChainState, others: Sequence[ChainState], starts: Sequence[FloatArray], rank: int
) -> Agreement | None:
    """What a rank makes of the rows: None if it falls; an infinite tolerance if it does not stand."""
    result = Agreement(0, 0.0, np.inf)
    for start in starts:
        found = _errors(state, others, start, rank)
        if found is not None and found.zero > found.explained:
            return None
        if found is not None and found.least >= 10.0:
            needed = max(found.tolerance, result.tolerance if result.tolerance < np.inf else 0.0)
            result = Agreement(max(result.rows, found.rows), max(result.size, found.zero), needed)
    return result


def _opening(state: ChainState) -> float:
    """The tolerance of a geometry whose loops are open as where the buffers stand, and by three times more.

    A closed loop may be open by ten times the tolerance and the number of joints.
    """
    return 0.3 * state.scaled_gap() / (state.model.njoints * max(1.0, 1.0 / state.topology.length))


def _drawn_opening(state: ChainState, others: Sequence[ChainState], q: FloatArray, rank: int) -> float:
    """The tolerance that explains how other digits open the loops as drawn, along all but that many singular values.

    In a singular pose no motion closes these: they stay open by what the digits make, and not by what one file's do.
    """
    U, unit = np.linalg.svd(scaled_jacobian(state, q)[0])[0][:, rank:], max(1.0, 1.0 / state.topology.length)
    opened = []
    for other in others:
        settled(other, q, rank)
        opened.append(np.linalg.norm(U.T @ (other.buffers.gap * other.topology.row_scale)))
    return _DRAWN * float(np.sqrt(np.mean(np.square(opened)) / state.model.njoints)) / unit


def settled(
    state: ChainState, start: FloatArray, rank: int | None, weight: FloatArray | None = None
) -> tuple[FloatArray, float]:
    """The configuration beside a start that closes the loops in the directions of the largest singular values.

    Rows of a rounded geometry that agree with others by its digits cannot be closed, and would pull along motions that
    the exact loops allow. Steps are damped where a full one opens the loops, as beside a dead point.

    Parameters
    ----------
    state : ChainState
        The chain.
    start : ndarray
        Shape (nq,).
    rank : int or None
        How many singular values. If left out those that are certain, by the digits and by the opening of the loops:
        off them rows agree no better than they are open.
    weight : ndarray, optional
        Shape (nv,), as for :func:`exo_pin.chain.kinematics.closing_steps.attempt`.

    Returns
    -------
    q : ndarray
        Shape (nq,); the buffers are linearised there.
    left : float
        What is left open in these directions, characteristic lengths and rad.
    """
    top, q, damping = state.topology, start, 0.0
    column = top.column if weight is None else np.sqrt(weight)

    def directions(q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Singular values, motions and openings along each, and what may be open in the others."""
        state.buffers.linearise(q)
        gap = state.buffers.gap * top.row_scale
        J = state.buffers.jacobian * top.row_scale[:, None] * column
        U, values, Vt = np.linalg.svd(J, full_matrices=False)
        known = max(state.tolerance, float(np.abs(gap).max(initial=0.0)))
        count = _rank(state, values, known) if rank is None else rank
        return values[:count], Vt[:count], U[:, :count].T @ gap

    values, Vt, gap = directions(q)
    left = float(np.linalg.norm(gap))
    for _ in range(_SETTLING):
        if not left > _SETTLED:
            break
        move = -Vt.T @ (values * gap / (np.square(values) + max(damping * left * left, _SETTLED**2)))
        move *= min(1.0, _FAR / max(float(np.abs(move).max(initial=0.0)), _FAR))
        there = pin.integrate(state.model, q, column * move)
        others = directions(there)
        if len(others[0]) >= len(values) and float(np.linalg.norm(others[2][: len(values)])) < left:
            q, damping, (values, Vt, gap) = there, 0.1 * damping if damping > 1e-3 else 0.0, others
            left = float(np.linalg.norm(gap))
        elif np.abs(move).max(initial=0.0) < _CLOSED or damping > _MOST_DAMPING:
            break
        else:
            damping = max(1.0, 10.0 * damping)
    state.buffers.linearise(q)
    return q, left


def _settled(state: ChainState, q: FloatArray, rank: int) -> FloatArray | None:
    """:func:`settled` where that stays beside q, else None."""
    there, left = settled(state, q, rank)
    away = pin.difference(state.model, q, there) / state.topology.column
    return there if left < 10.0 * _CLOSED and np.abs(away).max(initial=0.0) < _FAR else None


def _jacobians(state: ChainState, q: FloatArray) -> Iterator[tuple[FloatArray, float]]:
    """Scaled constraint Jacobians at q and around it, and how far the loops are open there, scaled.

    Each is closed in as few directions as leave the loops open by no more than their digits do.
    """
    rng, top = np.random.default_rng(0), state.topology
    away = _NEAR * 2.0 ** np.arange(_NEIGHBOURS)[:, None] * rng.uniform(-1.0, 1.0, (_NEIGHBOURS, state.nv))
    digits = state.tolerance * state.model.njoints
    for step in (np.zeros(state.nv), *away):
        start = there = pin.integrate(state.model, q, top.column * step)
        for rank in (None, *range(1, min(state.row_count, state.nv) + 1)):
            there = settled(state, start, rank)[0]
            opening = state.scaled_gap()
            if opening <= max(digits, _CLOSED):
                break
        yield scaled_jacobian(state, there)[0], opening


def _zero(state: ChainState, values: NDArray[Any], gap: float) -> float:
    rows, columns = state.row_count, state.nv
    return float(rank_tolerance((rows, columns), float(values.max(initial=0.0)), state.model.njoints, gap))


def _rank(state: ChainState, values: NDArray[Any], gap: float) -> int:
    # Loops of an exact geometry are closed to rounding of their own.
    return int(np.count_nonzero(values > _zero(state, values, max(gap, _EXACT))))
