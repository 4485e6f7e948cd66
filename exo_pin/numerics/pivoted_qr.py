"""Householder's QR with column pivoting, compiled, for matrices of a few dozen rows.

LAPACK's, which SciPy has, cannot be called from compiled code of ours, and its call takes longer than the work.
"""

from __future__ import annotations

import math
from typing import Any

from ..core.compiled import kernel


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
    n, m, rank = len(order), W.shape[1], 0
    for c in range(n):
        order[c] = c
    while rank < min(m, n):
        best, longest = -1, cut * cut
        for c in range(rank, n):
            if allowed[order[c]]:
                total = 0.0
                for r in range(rank, m):
                    total += W[c, r] * W[c, r]
                if total > longest:
                    best, longest = c, total
        if best < 0:
            break
        order[rank], order[best] = order[best], order[rank]
        for r in range(m):
            W[rank, r], W[best, r] = W[best, r], W[rank, r]
        size, pivot = math.sqrt(longest), W[rank, rank]
        diagonal[rank] = -size if pivot > 0.0 else size
        W[rank, rank] = pivot - diagonal[rank]
        half[rank] = longest + size * abs(pivot)
        # What reflect() does, without a call and a division for each column.
        scale = 1.0 / half[rank]
        for c in range(rank + 1, len(W)):
            along = 0.0
            for r in range(rank, m):
                along += W[rank, r] * W[c, r]
            along *= scale
            for r in range(rank, m):
                W[c, r] -= along * W[rank, r]
        rank += 1
    return rank


@kernel(fills=True)
def reflect(W: Any, half: Any, k: int, b: Any) -> None:
    """Apply one reflector to b, of at least as many numbers as W has in a column."""
    along = 0.0
    for r in range(k, W.shape[1]):
        along += W[k, r] * b[r]
    along /= half[k]
    for r in range(k, W.shape[1]):
        b[r] -= along * W[k, r]


@kernel(fills=True)
def solve_triangle(W: Any, diagonal: Any, rank: int, b: Any) -> None:
    """Replace the first ``rank`` numbers of b, which is multiplied by Qᵀ, by the solution with the triangle."""
    for i in range(rank - 1, -1, -1):
        for j in range(i + 1, rank):
            b[i] -= W[j, i] * b[j]
        b[i] /= diagonal[i]


@kernel(fills=True)
def solve_factored(W: Any, diagonal: Any, half: Any, rank: int, b: Any) -> None:
    """Replace the first ``rank`` numbers of b by the least-squares solution in the columns that were taken."""
    for k in range(rank):
        reflect(W, half, k, b)
    solve_triangle(W, diagonal, rank, b)
