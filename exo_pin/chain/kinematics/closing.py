"""Closing the loops: damped Gauss-Newton on the configuration manifold, the least movement at every step."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ...core.compiled import kernel
from ...core.errors import BeyondLimits, LoopNotClosed
from ...core.validation import FloatArray, as_positive
from ..structure.chain_state import Structure
from ..structure.joint_limits import Limits, limits_of

__all__ = ["Closing"]

#: Damping relative to the scaled gap. It has to vanish with the gap, so that the last steps are Newton's, but no
#: faster: redundant closures contradict each other in proportion to the square of the gap, and undamped they would
#: be obeyed by moves of the order of the gap along what should stay put.
_DAMPING = 1e-2
#: Least damping, so that the matrix of redundant closures stays positive definite in rounded arithmetic.
_LEAST_DAMPING = 1e-13
#: Damping at which no step helps any more.
_MOST_DAMPING = 1e6
#: Stuck is where so many steps have not brought the gap below this fraction. Even next to a singularity every step
#: halves the gap; at a minimum that is not zero it settles.
_PATIENCE, _PROGRESS = 8, 0.8
#: Spread of the first restart, rad and characteristic lengths; it doubles up to the largest.
_FIRST_SPREAD, _LARGEST_SPREAD = 0.1, 1.6


_NONE = np.zeros(0, dtype=np.int64)


class Closing(Structure):
    """Closing the loops of a chain."""

    def close(
        self,
        q: ArrayLike,
        hold: Iterable[str] = (),
        tolerance: float = 1e-12,
        max_iterations: int = 60,
        respect_limits: bool = False,
        restarts: int = 8,
    ) -> FloatArray:
        """Close the loops, moving as little as possible.

        Damped Gauss-Newton on the configuration manifold. Every step is the least one, with metres divided by
        :attr:`characteristic_length`; the answer is near the nearest closed configuration, and is q itself if q
        is closed. Where the steps get stuck at an open loop, they start again from configurations drawn around q,
        nearer ones first, always the same ones.

        Parameters
        ----------
        q : array_like
            Shape (nq,), where to start.
        hold : iterable of str
            Joints that must not move.
        tolerance : float
            Largest residual of a closed loop, m and rad.
        max_iterations : int
            At most so many steps from every start.
        respect_limits : bool
            Keep every joint within its limits; otherwise :meth:`beyond_limits` tells which are not.
        restarts : int
            At most so many new starts; 0 keeps to the branch that q is on.

        Returns
        -------
        ndarray
            Shape (nq,), with the residual within ``tolerance``.

        Raises
        ------
        LoopNotClosed
            If the loops do not close; the error carries the best configuration, its residual and the number of
            steps. An open loop is never returned.
        BeyondLimits
            If they close, but only beyond the joint limits that were to be respected.
        """
        held = self.velocity_indices(hold) if hold else _NONE
        if type(tolerance) is not float or not 0.0 < tolerance < math.inf:
            tolerance = as_positive("tolerance", tolerance)
        return self._close(
            self._configuration(q),
            held,
            tolerance,
            max(int(max_iterations), 0),
            respect_limits,
            max(int(restarts), 0),
        )[0]

    def beyond_limits(self, q: ArrayLike) -> tuple[str, ...]:
        """Names of the joints that stand outside their limits at q.

        Limits are those of ``model.lowerPositionLimit`` and ``upperPositionLimit`` for joints whose coordinates are
        angles or lengths; quaternions and endless hinges have none.
        """
        limits, value = self._limits, self._configuration(q)
        here = value[limits.q_index]
        outside = (here < limits.lower) | (here > limits.upper)
        return tuple(dict.fromkeys(limits.joints[k] for k in np.flatnonzero(outside)))

    @property
    def _limits(self) -> Limits:
        return limits_of(self._model)

    def _close(
        self,
        start: FloatArray,
        held: np.ndarray,
        tolerance: float,
        iterations: int,
        respect_limits: bool = False,
        restarts: int = 0,
    ) -> tuple[FloatArray, int]:
        """:meth:`close` after its checks; also tells the number of steps."""
        weight = self._topology.weight
        if held.size:
            weight = weight.copy()
            weight[held] = 0.0
        limits = self._limits if respect_limits else None
        best = _attempt(self, start, weight, tolerance, iterations, limits)
        if best.closed:
            return best.q, best.steps
        steps, spread = best.steps, _FIRST_SPREAD
        rng = np.random.default_rng(0)
        for _ in range(restarts if weight.any() else 0):
            if best.closed or not best.stuck:
                break
            away = np.sqrt(weight) * rng.uniform(-spread, spread, len(weight))
            spread = min(2 * spread, _LARGEST_SPREAD)
            other = _attempt(self, pin.integrate(self._model, start, away), weight, tolerance, iterations, limits)
            steps += other.steps
            if other.closed or other.residual < best.residual:
                best = other
            best.stuck = True
        if best.closed:
            return best.q, steps
        if respect_limits:
            free = _attempt(self, start, weight, tolerance, iterations, None)
            if free.closed:
                raise BeyondLimits(free.q, self.beyond_limits(free.q))
        raise LoopNotClosed(best.q, best.residual, steps)


@dataclass(slots=True)
class _Attempt:
    """Where one start led to."""

    q: FloatArray
    residual: float
    steps: int
    closed: bool
    stuck: bool


def _attempt(
    chain: Structure, q: FloatArray, weight: FloatArray, tolerance: float, iterations: int, limits: Limits | None
) -> _Attempt:
    """Gauss-Newton from one start.

    Parameters
    ----------
    chain : Structure
        The chain.
    q : ndarray
        Shape (nq,), where to start.
    weight : ndarray
        Shape (nv,), mobility of each coordinate: 0 for held ones, the squared characteristic length for metres.
    tolerance : float
        Largest residual of a closed loop, m and rad.
    iterations : int
        At most so many linearisations.
    limits : Limits or None
        To be kept.
    """
    work, scale = chain._workspace, chain._topology.row_scale
    if limits is not None:
        q = limits.clipped(q, weight)
    worst = work.linearise(q)
    if worst <= tolerance and (limits is None or limits.holds(q)):
        return _Attempt(q.copy(), worst, 0, True, False)
    gap, jacobian, move = work.gap, work.jacobian, work.move
    size = mark = _scaled_norm(gap, scale)
    factor, count = 1.0, 0
    for count in range(1, iterations + 1):
        damping = max(_DAMPING * factor * size, _LEAST_DAMPING)
        _step(jacobian, gap, scale, weight, damping, move)
        if limits is not None:
            _keep_within(limits, q, jacobian, gap, scale, weight, damping, move)
        trial = pin.integrate(chain.model, q, move)
        worst_there = work.linearise(trial)
        size_there = _scaled_norm(gap, scale)
        if worst_there <= tolerance and (limits is None or limits.holds(trial)):
            return _Attempt(trial, worst_there, count, True, False)
        if size_there < size:
            # A good step earns less damping, a poor one more.
            factor *= 0.3 if size_there < 0.25 * size else 3.0 if size_there > 0.75 * size else 1.0
            q, size, worst = trial, size_there, worst_there
        else:
            factor *= 10.0
            if factor * size * _DAMPING > _MOST_DAMPING or not math.isfinite(size):
                return _Attempt(q.copy(), worst, count, False, True)
            work.linearise(q)
        if count % _PATIENCE == 0:
            if size > _PROGRESS * mark:
                return _Attempt(q.copy(), worst, count, False, True)
            mark = size
    return _Attempt(q.copy(), worst, count, False, False)


def _keep_within(
    limits: Limits,
    q: FloatArray,
    jacobian: FloatArray,
    gap: FloatArray,
    scale: FloatArray,
    weight: FloatArray,
    damping: float,
    move: FloatArray,
) -> None:
    """Bend a step so that it stays within the limits: what would leave stops there, and the others step anew."""
    weight = weight.copy()
    stopped = np.zeros_like(move)
    for _ in range(len(limits.v_index)):
        here = q[limits.q_index] + stopped[limits.v_index]
        there = here + move[limits.v_index]
        over = ((there < limits.lower) | (there > limits.upper)) & (weight[limits.v_index] > 0.0)
        if not over.any():
            break
        index = limits.v_index[over]
        stopped[index] = np.clip(there[over], limits.lower[over], limits.upper[over]) - q[limits.q_index[over]]
        weight[index] = 0.0
        _step(jacobian, gap + jacobian @ stopped, scale, weight, damping, move)
    move += stopped


@kernel
def _scaled_norm(gap: Any, scale: Any) -> float:
    """Length of the gap, metres divided by the characteristic length."""
    total = 0.0
    for i in range(len(gap)):
        total += (gap[i] * scale[i]) ** 2
    return math.sqrt(total)


@kernel
def _step(jacobian: Any, gap: Any, row_scale: Any, weight: Any, damping: float, out: Any) -> None:
    """Fill the damped least step towards a closed configuration.

    Minimises |D (J x + r)|² + damping |x|²_{W⁻¹} with D = diag(row_scale), W = diag(weight): x = W Jᵀ D y with
    (D J W Jᵀ D + damping I) y = -D r, solved by Cholesky. A coordinate of weight 0 is held.

    Parameters
    ----------
    jacobian, gap : ndarray
        Shape (rows, nv) and (rows,).
    row_scale, weight : ndarray
        Shape (rows,) and (nv,).
    damping : float
        Above zero, relative to the mean of the matrix's diagonal.
    out : ndarray
        Shape (nv,), filled.
    """
    n, nv = jacobian.shape
    A, y = np.empty((n, n)), np.empty(n)
    trace = 0.0
    for i in range(n):
        for j in range(i + 1):
            total = 0.0
            for k in range(nv):
                total += jacobian[i, k] * jacobian[j, k] * weight[k]
            A[i, j] = total * row_scale[i] * row_scale[j]
        trace += A[i, i]
        y[i] = -row_scale[i] * gap[i]
    shift = damping * trace / n
    for i in range(n):
        A[i, i] += shift
    for i in range(n):
        for j in range(i + 1):
            total = A[i, j]
            for k in range(j):
                total -= A[i, k] * A[j, k]
            A[i, j] = math.sqrt(total) if i == j else total / A[j, j]
        total = y[i]
        for k in range(i):
            total -= A[i, k] * y[k]
        y[i] = total / A[i, i]
    for i in range(n - 1, -1, -1):
        total = y[i]
        for k in range(i + 1, n):
            total -= A[k, i] * y[k]
        y[i] = total / A[i, i]
    for k in range(nv):
        total = 0.0
        for i in range(n):
            total += jacobian[i, k] * row_scale[i] * y[i]
        out[k] = weight[k] * total
