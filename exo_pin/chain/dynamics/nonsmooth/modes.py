"""Modes of motion: which joints stick, slide or rest on their stops. Within a mode the motion is smooth.

In a mode the coordinates that stick are constraints a_i = 0 beside the loops, and joints that slide have constant
friction. A mode ends where the force of a coordinate that sticks leaves its range, a sliding joint comes to rest, or a
joint reaches its stop.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from ....core.errors import SolverFailed
from ....core.records import Record
from ....core.validation import FloatArray
from ...structure.chain_state import ChainState
from ..equations.equations_of_motion import moving_loops
from .contact_forces import Contacts
from .projected_motion import Applied, acceleration, projected_motion, response_at

#: Singular values of the rows that stick below this share of the largest count as zero. Coordinates that stick depend
#: on each other in some poses, and next to these rounding over σ² would be taken for their friction: below the second
#: share, no force answers what rounding, a share of the largest acceleration, may ask for.
_RANK, _WEAK, _NOISE = 1e-8, 1e-3, 1e-11
#: Acceleration of a coordinate that sticks, as a share of the largest, above which the loops move it.
_MOVED = 1e-10


@dataclass(frozen=True, eq=False)
class ContactMode(Record):
    """One mode.

    Attributes
    ----------
    state : ChainState
        The chain.
    sliding : ndarray
        Shape (nv,), friction of the joints that slide, N and N m.
    sign : ndarray of int
        Shape (nv,), direction in which a joint with friction slides; 0 for all others.
    held : Contacts
        Those that stick and the stops with joints that rest on them.
    """

    state: ChainState
    sliding: FloatArray
    sign: NDArray[np.int64]
    held: Contacts

    @property
    def index(self) -> NDArray[np.int64]:
        """Coordinates of v that are held, each once."""
        return np.unique(self.held.place)

    def acceleration(self, q: FloatArray, v: FloatArray, applied: Applied) -> tuple[FloatArray, FloatArray]:
        """Acceleration, shape (nv,), and forces in the coordinates of :attr:`index`, the least if redundant."""
        a, force, _, _ = self._solved(q, v, applied)
        return a, force

    def margin(self, q: FloatArray, v: FloatArray, applied: Applied) -> float:
        """How far the forces of the held coordinates are within their ranges, below zero if they cannot be.

        At least one must be held. As a share of half the range of friction, or of the largest force for stops.
        Redundant forces are those with the largest margin, by a linear program.
        """
        held = self.held
        _, force, rows, moved = self._solved(q, v, applied)
        if moved:
            return -1.0
        index, column = self.index, self.state.topology.column[held.place]
        half = np.where(np.isfinite(held.high - held.low), 0.5 * (held.high - held.low), 0.0) * column
        scaled = force * self.state.topology.column[index]
        size = max(float(half.max(initial=0.0)), float(np.abs(scaled).max(initial=0.0))) or 1.0
        weight = np.where(half > 0.0, half, size)
        place = np.searchsorted(index, held.place)
        effect = rows[place]
        low, high = held.low * column, held.high * column
        if len(place) == len(index) and _independent(effect):
            found = scaled[place]
            return float(np.minimum((found - low) / weight, (high - found) / weight).min())
        return _largest_margin(effect.T, rows.T @ scaled, low, high, weight)

    def _solved(
        self, q: FloatArray, v: FloatArray, applied: Applied
    ) -> tuple[FloatArray, FloatArray, FloatArray, bool]:
        """Acceleration, forces, the held rows of the response, scaled, and whether the loops move a held one."""
        index, applied = self.index, applied.plus(self.sliding)
        if not len(index):
            none = np.array([])
            return acceleration(self.state, q, v, applied), none, none, False
        moving_loops(self.state, q, v)
        motion = projected_motion(self.state, q, v, applied)
        (rows, start), column = motion.of(index), motion.column[index]
        size = float(np.abs(motion.a / motion.column).max())
        scaled = _held_forces(rows, start, _NOISE * size)
        a = motion.a + motion.response @ (rows.T @ scaled)
        left = float(np.abs(start + rows @ (rows.T @ scaled)).max())
        return a, scaled / column, rows, left > _MOVED * size + 1e-12


def _independent(rows: FloatArray) -> bool:
    """Whether the rows are linearly independent."""
    if rows.shape[0] > rows.shape[1]:
        return False
    values = np.linalg.svd(rows, compute_uv=False)
    return bool(values[-1] > _WEAK * values[0])


def _held_forces(rows: FloatArray, start: FloatArray, noise: float = 0.0) -> FloatArray:
    """The least forces f with rows rowsᵀ f = -start, but for ``noise`` in weak directions, continuous in all."""
    if not rows.size:
        return np.zeros(len(rows))
    U, values, _ = np.linalg.svd(rows, full_matrices=False)
    asked, weak = U.T @ start, (_WEAK * values[0]) ** 2
    asked = np.sign(asked) * np.maximum(np.abs(asked) - noise * weak / np.maximum(values**2 + weak, 1e-300), 0.0)
    counts = values > _RANK * values[0]
    return np.asarray(-U[:, counts] @ (asked[counts] / values[counts] ** 2))


def _largest_margin(A: FloatArray, b: FloatArray, low: FloatArray, high: FloatArray, weight: FloatArray) -> float:
    """Largest s with A f = b and low + s weight <= f <= high - s weight."""
    count = len(low)
    unit = float(weight.max())
    weight, low, high, b = weight / unit, low / unit, high / unit, b / unit
    # Redundant rows of A f = b would disagree in their rounding; weak ones that ask for no force bind none.
    U, values, Vt = np.linalg.svd(A, full_matrices=False)
    largest, asked = max(float(values.max(initial=0.0)), 1e-300), np.abs(U.T @ b)
    asks = (values > _WEAK * largest) | (asked > _NOISE * float(np.abs(b).max(initial=0.0)))
    kept = (values > _RANK * largest) & asks
    equal = np.hstack([Vt[kept], np.zeros((int(kept.sum()), 1))])
    right = (U[:, kept].T @ b) / values[kept]
    below, above = np.isfinite(low), np.isfinite(high)
    eye = np.eye(count)
    rows = np.vstack([np.column_stack([-eye[below], weight[below]]), np.column_stack([eye[above], weight[above]])])
    sides = np.concatenate([-low[below], high[above]])
    cost = np.zeros(count + 1)
    cost[-1] = -1.0
    limits = [(None, None)] * count + [(None, 1.0)]
    found = scipy.optimize.linprog(cost, A_ub=rows, b_ub=sides, A_eq=equal, b_eq=right, bounds=limits, method="highs")
    if found.status != 0:
        raise SolverFailed("HiGHS", np.inf, f"margin of friction at rest: {found.message}")
    return float(-found.fun)


def at_rest(state: ChainState, q: FloatArray, v: FloatArray, index: NDArray[np.int64]) -> FloatArray:
    """The velocity after the least impulses that bring coordinates of v to rest, shape (nv,)."""
    if not len(index) or not v[index].any():
        return v
    motion = response_at(state, q)
    rows, _ = motion.of(index)
    speed = v[index] / motion.column[index]
    after = v + motion.response @ (rows.T @ _held_forces(rows, speed, _NOISE * float(np.abs(v / motion.column).max())))
    after[index] = 0.0
    return np.asarray(after)
