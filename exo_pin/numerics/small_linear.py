"""Linear algebra of a few unknowns in space, compiled: orthonormal bases and least squares of three equations.

Householder's QR with column pivoting, compiled, for matrices of a few dozen rows.

LAPACK's, which SciPy has, cannot be called from compiled code of ours, and its call takes longer than the work.
"""

from __future__ import annotations

import math
from typing import Any

from ..core.compiled import kernel

#: Relative size of a singular value below which a direction does not count.
RANK_TOLERANCE = 1e-12
#: Relative length of a row below which it is rounding noise.
_NOISE = 1e-14
#: Sweeps of Jacobi rotations, far more than their quadratic convergence needs.
_SWEEPS = 30


@kernel(fills=True)
def copy_numbers(given: Any, out: Any) -> None:
    """Copy one row of numbers into another that does not overlap it, which Numba would have to find out.

    Numba compiles ``out[:] = given`` with the text of an error for other shapes, which takes seconds.
    """
    for k in range(len(given)):
        out[k] = given[k]


@kernel(inline=True, fills=True)
def _cleared(N: Any, j: int, Q: Any, k: int) -> float:
    """Take the part along the unit column k of Q out of column j of N; return its length."""
    overlap = 0.0
    for i in range(Q.shape[0]):
        overlap += Q[i, k] * N[i, j]
    for i in range(Q.shape[0]):
        N[i, j] -= overlap * Q[i, k]
    return overlap


@kernel(inline=True, fills=True)
def _scaled_to_one(N: Any, j: int) -> float:
    """Scale column j of N to length 1; return its length before."""
    square = 0.0
    for i in range(N.shape[0]):
        square += N[i, j] * N[i, j]
    length = math.sqrt(square)
    for i in range(N.shape[0]):
        N[i, j] /= length
    return length


@kernel(fills=True)
def orthonormalise(Q: Any, U: Any, columns: int) -> None:
    """Replace the first columns of Q, of full rank, by an orthonormal basis, with Q_before = Q_after U.

    Gram-Schmidt is run twice, which makes Q orthonormal to rounding. U is upper triangular; entries below its
    diagonal are not changed.
    """
    for j in range(columns):
        for k in range(j):
            U[k, j] = 0.0
        for _ in range(2):
            for k in range(j):
                U[k, j] += _cleared(Q, j, Q, k)
        U[j, j] = _scaled_to_one(Q, j)


@kernel(fills=True)
def complete_basis(Q: Any, N: Any) -> None:
    """Fill N, shape (n, n - 3), with an orthonormal basis of the orthogonal complement of Q, shape (n, 3)."""
    n = Q.shape[0]
    for column in range(n - 3):
        # Take the unit vector with the smallest part in the basis so far.
        best, least = 0, 2.0
        for i in range(n):
            held = Q[i, 0] ** 2 + Q[i, 1] ** 2 + Q[i, 2] ** 2
            for k in range(column):
                held += N[i, k] ** 2
            if held < least:
                best, least = i, held
        for i in range(n):
            N[i, column] = 0.0
        N[best, column] = 1.0
        for _ in range(2):
            for k in range(3):
                _cleared(N, column, Q, k)
            for k in range(column):
                _cleared(N, column, N, k)
        _scaled_to_one(N, column)


@kernel(inline=True, fills=True)
def _row_square(A: Any, p: int) -> float:
    """Square of the length of row p."""
    square = 0.0
    for i in range(A.shape[1]):
        square += A[p, i] * A[p, i]
    return square


@kernel(fills=True)
def row_rank(A: Any, c: Any, tolerance: float) -> int:
    """Turn the three rows of A, shape (3, m), by one orthogonal matrix until they are orthogonal.

    The same is done to the three numbers c, so that A z = c keeps its solutions. Rows are sorted by length, the
    singular values of A, longest first: one-sided Jacobi rotations. The rank is returned, and rows beyond it are noise.
    """
    m = A.shape[1]
    for _ in range(_SWEEPS):
        turned = False
        for p in range(2):
            for q in range(p + 1, 3):
                pp, qq, pq = 0.0, 0.0, 0.0
                for i in range(m):
                    pp += A[p, i] * A[p, i]
                    qq += A[q, i] * A[q, i]
                    pq += A[p, i] * A[q, i]
                swap = qq > pp
                # A row that is rounding noise beside the other has no direction.
                noise = min(pp, qq) <= _NOISE * _NOISE * max(pp, qq)
                if noise or abs(pq) <= 1e-15 * math.sqrt(pp * qq):
                    if not swap:
                        continue
                    cosine, sine = 0.0, 1.0
                else:
                    slope = (pp - qq) / (2.0 * pq)
                    tangent = math.copysign(1.0, slope) / (abs(slope) + math.sqrt(1.0 + slope * slope))
                    cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
                    sine = cosine * tangent
                    if swap:
                        cosine, sine = -sine, cosine
                turned = True
                for i in range(m):
                    first = cosine * A[p, i] + sine * A[q, i]
                    A[q, i] = cosine * A[q, i] - sine * A[p, i]
                    A[p, i] = first
                first = cosine * c[p] + sine * c[q]
                c[q] = cosine * c[q] - sine * c[p]
                c[p] = first
        if not turned:
            break
    rank, largest = 0, 0.0
    for p in range(3):
        square = _row_square(A, p)
        largest = max(largest, square)
        if square > tolerance * tolerance * largest:
            rank += 1
    return rank


@kernel(fills=True)
def least_norm(A: Any, c: Any, z: Any, tolerance: float) -> int:
    """z of least |c + A z| and, of those, of least norm; the rank of A is returned.

    A, shape (3, m), and c are overwritten.
    """
    rank = row_rank(A, c, tolerance)
    m = A.shape[1]
    for i in range(m):
        z[i] = 0.0
    for p in range(rank):
        square = _row_square(A, p)
        for i in range(m):
            z[i] -= A[p, i] * c[p] / square
    return rank


@kernel(fills=True)
def solve_cholesky(A: Any, x: Any) -> None:
    """Solve A y = x by Cholesky for a symmetric positive definite matrix, in place: y replaces x.

    LAPACK is no faster on small matrices, and starts threads on larger ones.

    Parameters
    ----------
    A : ndarray
        Shape (n, n), of which the lower triangle is used and overwritten.
    x : ndarray
        Shape (n,).
    """
    n = len(x)
    for i in range(n):
        for j in range(i + 1):
            total = A[i, j]
            for k in range(j):
                total -= A[i, k] * A[j, k]
            A[i, j] = math.sqrt(total) if i == j else total / A[j, j]
        total = x[i]
        for k in range(i):
            total -= A[i, k] * x[k]
        x[i] = total / A[i, i]
    for i in range(n - 1, -1, -1):
        total = x[i]
        for k in range(i + 1, n):
            total -= A[k, i] * x[k]
        x[i] = total / A[i, i]


@kernel(fills=True)
def pivoted_qr(W: Any, allowed: Any, order: Any, cut: float, diagonal: Any, half: Any) -> int:
    """Factor the columns of a matrix, each time the one that is farthest from the span of those taken before.

    Parameters
    ----------
    W : ndarray
        Shape (n + k, m): n columns of m numbers, one after the other, and k more that only take part as right sides.
        On return the first ``rank`` have the triangle above its diagonal and, from there on, the reflectors; the others
        are multiplied by Qᵀ.
    allowed : ndarray of bool
        Shape (n,), which columns may be taken.
    order : ndarray of int
        Shape (n,), filled: the columns in their order in W on return.
    cut : float
        Columns no longer than this, next to those taken, are not taken.
    diagonal, half : ndarray
        Shape (min(m, n),), filled: the triangle's diagonal, and half the squares of the reflectors.

    Returns
    -------
    int
        The rank.
    """
    n, m, rank, best, longest = len(order), W.shape[1], 0, -1, cut * cut
    for c in range(n):
        order[c] = c
        total = _square(W[c])
        if allowed[c] and total > longest:
            best, longest = c, total
    while best >= 0:
        order[rank], order[best] = order[best], order[rank]
        one, other = W[rank], W[best]
        for r in range(m):
            one[r], other[r] = other[r], one[r]
        size, pivot = math.sqrt(longest), W[rank, rank]
        diagonal[rank] = -size if pivot > 0.0 else size
        W[rank, rank] = pivot - diagonal[rank]
        half[rank] = longest + size * abs(pivot)
        best, longest = -1, cut * cut
        reflect_rows(W, half, rank, W, rank + 1)
        rank += 1
        for c in range(rank, n):
            total = _square(W[c, rank:])
            if allowed[order[c]] and total > longest:
                best, longest = c, total
    return rank


@kernel(fills=True)
def reflect_rows(W: Any, half: Any, k: int, B: Any, first: int) -> None:
    """:func:`reflect` for the rows of B from one on."""
    if W.shape[1] == 6:
        _reflect_six(W[k], k, 1.0 / half[k], B, first)
        return
    for s in range(first, len(B)):
        reflect(W, half, k, B[s])


@kernel(inline=True, fills=True)
def _reflect_six(v: Any, k: int, size: float, B: Any, first: int) -> None:
    """:func:`reflect_rows` of the six rows of a closure that leaves no motion, without loops along them."""
    a, b, c = v[0] if k < 1 else 0.0, v[1] if k < 2 else 0.0, v[2] if k < 3 else 0.0
    d, e, f = v[3] if k < 4 else 0.0, v[4] if k < 5 else 0.0, v[5]
    for s in range(first, len(B)):
        own = B[s]
        along = (a * own[0] + b * own[1]) + (c * own[2] + d * own[3]) + (e * own[4] + f * own[5])
        along *= size
        own[0] -= along * a
        own[1] -= along * b
        own[2] -= along * c
        own[3] -= along * d
        own[4] -= along * e
        own[5] -= along * f


@kernel(inline=True, fills=True)
def _square(b: Any) -> float:
    """Square of the length of a vector."""
    total = 0.0
    for r in range(len(b)):
        total += b[r] * b[r]
    return total


@kernel(fills=True)
def reflect(W: Any, half: Any, k: int, b: Any) -> None:
    """Apply one reflector to b, of at least as many numbers as W has in a column."""
    v, own, along = W[k, k:], b[k:], 0.0
    for r in range(len(v)):
        along += v[r] * own[r]
    along /= half[k]
    for r in range(len(v)):
        own[r] -= along * v[r]


@kernel(fills=True)
def solve_triangle(W: Any, diagonal: Any, rank: int, b: Any) -> None:
    """Replace the first ``rank`` numbers of b, which is multiplied by Qᵀ, by the solution with the triangle."""
    for j in range(rank - 1, -1, -1):
        column = W[j]
        last = b[j] / diagonal[j]
        for i in range(j):
            b[i] -= column[i] * last
        b[j] = last


@kernel(fills=True)
def solve_transposed(W: Any, diagonal: Any, half: Any, rank: int, b: Any) -> None:
    """Replace b, zero beyond ``rank``, by the least x with b as its products with the columns that were taken."""
    for i in range(rank):
        for k in range(i):
            b[i] -= W[i, k] * b[k]
        b[i] /= diagonal[i]
    for k in range(rank - 1, -1, -1):
        reflect(W, half, k, b)


@kernel(fills=True)
def solve_factored(W: Any, diagonal: Any, half: Any, rank: int, b: Any) -> None:
    """Replace the first ``rank`` numbers of b by the least-squares solution in the columns that were taken."""
    for k in range(rank):
        reflect(W, half, k, b)
    solve_triangle(W, diagonal, rank, b)
