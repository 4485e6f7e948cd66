"""The least shoulder force within bounds by an exact active-set method, compiled, for millions of poses.

    minimise |c + G z|  over  low <= z <= high,     c in space, G of shape (3, m), m small

The force c + G z is unique. Where z is not, the shortest is taken, as :func:`exo_pin.reaction.least_force` does.

1. The unbounded answer of least norm is the answer if it lies within the bounds.
2. Else bounded-variable least squares (Lawson and Hanson; Stark and Parker, Computational Statistics 10 (1995) 129):
   a set of free variables with independent columns, three at most, is grown by the variable that pays most, measured
   along what its column adds to the span of those that are free already, so that a weak direction is judged by what it
   can gain and not by its small gradient. Every round makes the force strictly less, so no set of free variables comes
   twice and the method ends; a round that rounding denies its gain is taken back and its variable set aside.
3. If G has not full column rank: the shortest z with this force, by a primal active-set method that moves inside
   {G z unchanged, low <= z <= high}. Variables leave and enter the working set by least index. That excludes a cycle
   at a degenerate point: let t be the largest index that comes and goes in it. When t leaves, its multiplier alone has
   the wrong sign among the indices up to t; when it enters, it alone of them blocks the step p. So the step's slope
   Σ multiplier_i p_i would not be negative, though the step goes downhill.

The duality gap bounds from above by how much the answer can miss the least force; it is computed from the answer alone.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from ..errors import InfeasibleBounds, InvalidInput
from ..validation import FloatArray
from ..wrist.formulas import along_normals, dot, root, triple
from ..wrist.linear import RANK_TOLERANCE, least_norm, orthonormalise, row_rank

__all__ = ["GAP_TOLERANCE", "LeastForces", "Workspace", "duality_gap", "least_bounded", "least_forces", "workspace"]

#: Duality gap, relative to the largest force of the problem, with which an answer is given.
GAP_TOLERANCE = 1e-8
#: Gain of a direction, relative to the largest force of the problem, that counts as nothing.
_NO_GAIN = 1e-14
#: Relative step of z and relative multiplier that count as zero while the shortest z is sought.
_NO_STEP = 1e-13
_NO_MULTIPLIER = 1e-11
#: Determinant, relative to what the columns' lengths allow, above which three columns are independent beyond doubt.
_CLEARLY_INDEPENDENT = 1e-6
#: Rounds after which the search gives up; the methods end by themselves, this only guards against a wrong proof.
_ROUNDS = 1000

_compile = njit(cache=True, error_model="numpy", nogil=True)
# Inlined: handing arrays to a function counts references to each, which would take longer than what it does with them.
_inline = njit(cache=True, error_model="numpy", nogil=True, forceinline=True)


class Workspace(NamedTuple):
    """Scratch arrays for programs of m variables, so that the kernels allocate nothing per pose."""

    A: Any
    c: Any
    Q: Any
    U: Any
    goal: Any
    saved: Any
    movable: Any
    mark: Any


@_compile
def workspace(m: int) -> Workspace:
    """Make the scratch arrays."""
    A, Q, U = np.empty((3, m)), np.empty((m, 3)), np.empty((3, 3))
    indices, mark = np.empty(m, dtype=np.int64), np.empty(m, dtype=np.int64)
    return Workspace(A, np.empty(3), Q, U, np.empty(m), np.empty(m), indices, mark)


@_inline
def _column(G: Any, i: int) -> Any:
    return G[0, i], G[1, i], G[2, i]


@_inline
def _force(c: Any, G: Any, z: Any) -> Any:
    """The force c + G z."""
    x, y, w = c[0], c[1], c[2]
    for i in range(G.shape[1]):
        x, y, w = x + G[0, i] * z[i], y + G[1, i] * z[i], w + G[2, i] * z[i]
    return x, y, w


@_inline
def _size(v: Any) -> float:
    return root(dot(v, v))


@_inline
def _scale(c: Any, low: Any, high: Any) -> float:
    """The largest force of the problem."""
    scale = 0.0
    for j in range(3):
        scale = max(scale, abs(c[j]))
    for i in range(low.shape[0]):
        for bound in (low[i], high[i]):
            if abs(bound) < np.inf:
                scale = max(scale, abs(bound))
    return scale


@_inline
def _unbounded(c: Any, G: Any, z: Any, work: Workspace) -> int:
    """Fill z with the answer of least norm without bounds; return the rank of G."""
    m = G.shape[1]
    if m == 3:
        # Three side forces of a pose away from the singular surface.
        X1, X2, X3 = _column(G, 0), _column(G, 1), _column(G, 2)
        size = root(dot(X1, X1) * dot(X2, X2) * dot(X3, X3))
        if abs(triple(X1, X2, X3)) > _CLEARLY_INDEPENDENT * size:
            z[0], z[1], z[2] = along_normals((c[0], c[1], c[2]), X1, X2, X3)
            return 3
    for j in range(3):
        work.c[j] = c[j]
        for i in range(m):
            work.A[j, i] = G[j, i]
    return least_norm(work.A, work.c, z, RANK_TOLERANCE)


@_inline
def _within(z: Any, low: Any, high: Any) -> bool:
    for i in range(z.shape[0]):  # noqa: SIM110 - numba compiles no generators
        if not (low[i] <= z[i] <= high[i]):
            return False
    return True


@_inline
def _without(v: Any, q: Any) -> Any:
    overlap = dot(v, q)
    return v[0] - overlap * q[0], v[1] - overlap * q[1], v[2] - overlap * q[2]


@_inline
def _across(v: Any, q1: Any, q2: Any, q3: Any) -> Any:
    """The part of v across the orthonormal q; done twice, which brings it to rounding."""
    v = _without(_without(_without(v, q1), q2), q3)
    return _without(_without(_without(v, q1), q2), q3)


@_inline
def _basis(G: Any, i1: int, i2: int, i3: int) -> Any:
    """Orthonormal basis q of the columns of the free variables and, u_jj, what each adds to those before it.

    An index of -1 stands for none: q is zero there and u is one.
    """
    q1 = q2 = q3 = (0.0, 0.0, 0.0)
    u1 = u2 = u3 = 1.0
    if i1 >= 0:
        q1 = _column(G, i1)
        u1 = _size(q1)
        q1 = (q1[0] / u1, q1[1] / u1, q1[2] / u1)
    if i2 >= 0:
        q2 = _across(_column(G, i2), q1, q3, q3)
        u2 = _size(q2)
        q2 = (q2[0] / u2, q2[1] / u2, q2[2] / u2)
    if i3 >= 0:
        q3 = _across(_column(G, i3), q1, q2, q3)
        u3 = _size(q3)
        q3 = (q3[0] / u3, q3[1] / u3, q3[2] / u3)
    return q1, q2, q3, u1, u2, u3


@_inline
def _share(z: float, goal: float, low: float, high: float) -> float:
    """How much of the way from z to its goal a variable can go; more than one if the goal lies inside its bounds."""
    if low < goal < high:
        return 2.0
    bound = low if goal <= low else high
    return max((bound - z) / (goal - z), 0.0) if goal != z else 0.0


@_inline
def _moved(z: Any, i: int, goal: float, share: float, low: Any, high: Any) -> None:
    """Take variable i that share of its way, and onto its bound if that is where the way ends."""
    if share >= 1.0:
        z[i] = goal
    else:
        z[i] += share * (goal - z[i])
    z[i] = min(max(z[i], low[i]), high[i])


@_inline
def _entrant(
    r: Any, G: Any, low: Any, high: Any, z: Any, basis: Any, free: Any, tried: Any, gain: float, largest: float
) -> int:
    """The variable whose release lowers the force r most, -1 if none gains more than ``gain``."""
    q1, q2, q3 = basis
    best, most = -1, gain
    for i in range(G.shape[1]):
        if i == free[0] or i == free[1] or i == free[2] or tried[i] or not low[i] < high[i]:
            continue
        part = _across(_column(G, i), q1, q2, q3)
        size = _size(part)
        if size <= RANK_TOLERANCE * largest:
            continue  # its column adds nothing to the span of the free ones
        slope = dot(part, r) / size
        if abs(slope) > most and ((slope < 0.0 and z[i] < high[i]) or (slope > 0.0 and z[i] > low[i])):
            best, most = i, abs(slope)
    return best


@_compile
def _descend(c: Any, G: Any, low: Any, high: Any, z: Any, scale: float, tried: Any) -> None:
    """Least |c + G z| within the bounds, from z within them: step 2 of the module's description.

    The free variables are i1, i2, i3, filled from the first, -1 for none.
    """
    largest = 0.0
    for i in range(G.shape[1]):
        tried[i] = 0
        largest = max(largest, _size(_column(G, i)))
    i1 = i2 = i3 = -1
    q1 = q2 = q3 = (0.0, 0.0, 0.0)
    r = _force(c, G, z)
    size = _size(r)
    for _ in range(_ROUNDS):
        across = _across(r, q1, q2, q3)
        i = _entrant(across, G, low, high, z, (q1, q2, q3), (i1, i2, i3), tried, _NO_GAIN * scale, largest)
        if i < 0 or i3 >= 0:
            return
        i1, i2, i3 = (i, -1, -1) if i1 < 0 else ((i1, i, -1) if i2 < 0 else (i1, i2, i))
        k1, k2, k3 = i1, i2, i3
        z1, z2, z3 = z[i1], z[max(i2, 0)], z[max(i3, 0)]
        while i1 >= 0:
            # Least squares of the free variables: the change that it takes, by back substitution.
            q1, q2, q3, u1, u2, u3 = _basis(G, i1, i2, i3)
            t3 = -dot(q3, r) / u3
            t2 = -(dot(q2, r) + (dot(q2, _column(G, i3)) * t3 if i3 >= 0 else 0.0)) / u2
            t1 = dot(q1, r) + (dot(q1, _column(G, i2)) * t2 if i2 >= 0 else 0.0)
            t1 = -(t1 + (dot(q1, _column(G, i3)) * t3 if i3 >= 0 else 0.0)) / u1
            goal1, goal2, goal3 = z[i1] + t1, z[max(i2, 0)] + t2, z[max(i3, 0)] + t3
            share1 = _share(z[i1], goal1, low[i1], high[i1])
            share2 = _share(z[i2], goal2, low[i2], high[i2]) if i2 >= 0 else 2.0
            share3 = _share(z[i3], goal3, low[i3], high[i3]) if i3 >= 0 else 2.0
            share = min(share1, share2, share3)
            _moved(z, i1, goal1, share, low, high)
            if i2 >= 0:
                _moved(z, i2, goal2, share, low, high)
            if i3 >= 0:
                _moved(z, i3, goal3, share, low, high)
            r = _force(c, G, z)
            if not share <= 1.0:
                break
            # One met its bound: put it there exactly, and go on with the others.
            if share1 == share:
                z[i1] = low[i1] if goal1 <= low[i1] else high[i1]
                i1, i2, i3 = i2, i3, -1
            elif share2 == share:
                z[i2] = low[i2] if goal2 <= low[i2] else high[i2]
                i2, i3 = i3, -1
            else:
                z[i3] = low[i3] if goal3 <= low[i3] else high[i3]
                i3 = -1
            r = _force(c, G, z)
        now = _size(r)
        if now < size:
            size = now
            for j in range(G.shape[1]):
                tried[j] = 0
        else:
            # Rounding ate the gain. Take it back; whatever was free stands still and is found again if it pays.
            z[k1] = z1
            if k2 >= 0:
                z[k2] = z2
            if k3 >= 0:
                z[k3] = z3
            r = _force(c, G, z)
            tried[i] = 1
            i1 = i2 = i3 = -1
        q1, q2, q3, _, _, _ = _basis(G, i1, i2, i3)


@_compile
def _shorten(c: Any, G: Any, low: Any, high: Any, z: Any, scale: float, work: Workspace) -> None:
    """Shortest z within the bounds with the same force: step 3 of the module's description."""
    m = G.shape[1]
    A, movable, held, effect = work.A, work.movable, work.mark, work.c
    goal, Q, U = work.goal, work.Q, work.U
    r = _force(c, G, z)
    v = 0
    for i in range(m):
        slope = dot(_column(G, i), r)
        pressed = (z[i] == low[i] and slope > 1e-10 * scale) or (z[i] == high[i] and slope < -1e-10 * scale)
        if low[i] < high[i] and not pressed:
            for j in range(3):
                A[j, v] = G[j, i]
            movable[v] = i
            held[v] = 0
            v += 1
    if v == 0:
        return
    effect[:] = 0.0
    rank = row_rank(A[:, :v], effect, RANK_TOLERANCE)
    if rank == v:
        return
    for _ in range(_ROUNDS):
        longest, count = 0.0, 0
        for k in range(v):
            longest = max(longest, abs(z[movable[k]]))
            if not held[k]:
                for j in range(rank):
                    Q[count, j] = A[j, k]
                count += 1
        if count < rank:
            return
        orthonormalise(Q[:count], U, rank)
        # Shortest values of the variables that are not held, with the same effect: their part in the span of Q.
        for j in range(rank):
            overlap, k_free = 0.0, 0
            for k in range(v):
                if not held[k]:
                    overlap += Q[k_free, j] * z[movable[k]]
                    k_free += 1
            effect[j] = overlap
        largest_step, k_free = 0.0, 0
        for k in range(v):
            goal[k] = z[movable[k]]
            if not held[k]:
                goal[k] = 0.0
                for j in range(rank):
                    goal[k] += Q[k_free, j] * effect[j]
                k_free += 1
                largest_step = max(largest_step, abs(goal[k] - z[movable[k]]))
        slack = _NO_STEP * longest
        if largest_step <= slack:
            for k in range(v):
                z[movable[k]] = min(max(goal[k], low[movable[k]]), high[movable[k]])
            # Multipliers λ of the unchanged effect: Aᵀ λ = z for the variables that are not held.
            for j in range(rank - 1, -1, -1):
                for k in range(j + 1, rank):
                    effect[j] -= U[j, k] * effect[k]
                effect[j] /= U[j, j]
            released = -1
            for k in range(v):
                i = movable[k]
                if held[k]:
                    multiplier = z[i]
                    for j in range(rank):
                        multiplier -= A[j, k] * effect[j]
                    if held[k] * multiplier < -_NO_MULTIPLIER * longest:
                        released = k
                        break
            if released < 0:
                return
            held[released] = 0
            continue
        share, blocking = 1.0, -1
        for k in range(v):
            i = movable[k]
            # What overshoots by rounding alone does not block: holding it could cost the others their rank.
            if held[k] or low[i] - slack <= goal[k] <= high[i] + slack:
                continue
            bound = low[i] if goal[k] < low[i] else high[i]
            reached = max((bound - z[i]) / (goal[k] - z[i]), 0.0)
            if reached < share:
                share, blocking = reached, k
        for k in range(v):
            i = movable[k]
            if not held[k]:
                z[i] = min(max(z[i] + share * (goal[k] - z[i]), low[i]), high[i])
        if blocking >= 0:
            i = movable[blocking]
            at_low = goal[blocking] < low[i]
            z[i] = low[i] if at_low else high[i]
            held[blocking] = 1 if at_low else -1


@_inline
def duality_gap(c: Any, G: Any, low: Any, high: Any, z: Any, scale: float) -> float:
    """By how much |c + G z| can at most exceed the least force.

    For every z' within the bounds, force · (c + G z') >= force · c + Σ min(gradient_i low_i, gradient_i high_i), so
    that sum over |force| bounds the least force from below; so does 0. A gradient along an unbounded variable counts
    as zero when it is below 1e-8 of ``scale``, the largest force of the problem.
    """
    r = _force(c, G, z)
    size = _size(r)
    if size == 0.0:
        return 0.0
    least = dot(r, (c[0], c[1], c[2]))
    for i in range(G.shape[1]):
        slope = dot(_column(G, i), r)
        bound = low[i] if slope > 0.0 else high[i]
        if abs(bound) < np.inf:
            least += slope * bound
        elif abs(slope) > GAP_TOLERANCE * scale:
            return size
    gap = min(size, max(0.0, size - least / size))
    return gap if gap >= 0.0 else np.inf  # NaN is no answer


@_compile
def least_bounded(c: Any, G: Any, low: Any, high: Any, z: Any, work: Workspace) -> float:
    """Fill z with the answer and return its duality gap relative to the largest force of the problem.

    Parameters
    ----------
    c, G : ndarray
        Shapes (3,) in N and (3, m), dimensionless.
    low, high : ndarray
        Shape (m,), N, low <= high, infinite where there is no bound.
    z : ndarray
        Shape (m,), N, written.
    work : Workspace
        Scratch for m variables.
    """
    rank = _unbounded(c, G, z, work)
    scale = _scale(c, low, high)
    m = G.shape[1]
    if not _within(z, low, high):
        for i in range(m):
            z[i] = min(max(0.0 if rank < m else z[i], low[i]), high[i])
        _descend(c, G, low, high, z, scale, work.mark)
        if rank < m:
            size = _size(_force(c, G, z))
            for i in range(m):
                work.saved[i] = z[i]
            _shorten(c, G, low, high, z, scale, work)
            if not _size(_force(c, G, z)) <= size + _NO_STEP * scale:
                for i in range(m):
                    z[i] = work.saved[i]
    if scale == 0.0:
        return 0.0
    return duality_gap(c, G, low, high, z, scale) / scale


@_compile
def _solve_stack(c: Any, G: Any, low: Any, high: Any, z: Any, gap: Any) -> None:
    work = workspace(G.shape[2])
    for k in range(c.shape[0]):
        gap[k] = least_bounded(c[k], G[k], low[k], high[k], z[k], work)


class LeastForces(NamedTuple):
    """Answers of :func:`least_forces`, programs along the first axis.

    Attributes
    ----------
    variables : ndarray
        z, shape (N, m), N.
    forces : ndarray
        c + G z, shape (N, 3), N.
    gaps : ndarray
        Shape (N,): by how much |c + G z| can at most exceed the least, relative to the largest force (in c or a
        finite bound) of the program.
    """

    variables: FloatArray
    forces: FloatArray
    gaps: FloatArray


def least_forces(constants: FloatArray, effects: FloatArray, lower: FloatArray, upper: FloatArray) -> LeastForces:
    """Minimise |c + G z| over lower <= z <= upper for many programs at once, without a solver.

    Parameters
    ----------
    constants : ndarray
        c, shape (N, 3), N.
    effects : ndarray
        G, shape (N, 3, m), dimensionless.
    lower, upper : ndarray
        Shape (N, m), N, infinite where there is no bound.

    Returns
    -------
    LeastForces

    Raises
    ------
    InvalidInput
        If shapes do not fit, or something is NaN.
    InfeasibleBounds
        If a lower bound stands above its upper bound.
    """
    c, G, low, high = (np.array(part, dtype=np.float64, order="C") for part in (constants, effects, lower, upper))
    if c.ndim != 2 or c.shape[1] != 3 or G.shape[:2] != c.shape or G.ndim != 3:
        raise InvalidInput(f"expected constants (N, 3) and effects (N, 3, m), got {c.shape} and {G.shape}")
    if low.shape != (G.shape[0], G.shape[2]) or high.shape != low.shape:
        raise InvalidInput(f"expected bounds of shape {(G.shape[0], G.shape[2])}, got {low.shape} and {high.shape}")
    if not (np.isfinite(c).all() and np.isfinite(G).all()) or np.isnan(low).any() or np.isnan(high).any():
        raise InvalidInput("expected finite constants and effects, and bounds without NaN")
    crossed = np.flatnonzero((low > high).any(axis=0))
    if crossed.size:
        raise InfeasibleBounds(crossed)
    z, gap = np.empty(low.shape), np.empty(len(c))
    _solve_stack(c, G, low, high, z, gap)
    return LeastForces(z, c + np.einsum("kji,ki->kj", G, z), gap)
