"""Least solutions and null spaces of stacks of matrices whose ranks are to be found, compiled.

Two pivoted factorisations take the place of singular values: Aᵀ P = Q R gives the rank r, the row space Q₁ and the null
space Q₂; C = A Q₁ has full rank, and C P' = Q' R' gives the range, its complement and the least solutions.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..core.compiled import kernel
from .small_linear import pivoted_qr, reflect, solve_triangle


@kernel
def _new_room(size: int) -> Any:
    """Arrays for matrices and right sides of as many rows and columns."""
    flat, numbers = (np.empty(2 * size * size), np.empty(2 * size * size)), (np.empty(size), np.empty(size))
    return flat, np.ones(size, dtype=np.bool_), np.empty((2, size), dtype=np.int64), np.empty((4, size)), numbers


@kernel(fills=True)
def _turned(W: Any, half: Any, rank: int, b: Any) -> None:
    """Multiply b by the orthogonal factor."""
    for k in range(rank - 1, -1, -1):
        reflect(W, half, k, b)


@kernel(fills=True)
def _factor_range(W: Any, V: Any, rank: int, room: Any) -> None:
    """Fill the first vectors of V with C, from the factors of Aᵀ in W, and factor them."""
    _, allowed, orders, numbers, _ = room
    for i in range(V.shape[1]):
        for j in range(rank):
            entry = W[i, j] if i >= rank or j < i else 0.0
            V[j, orders[0, i]] = numbers[0, i] if j == i else entry
    pivoted_qr(V[:rank], allowed[:rank], orders[1, :rank], 0.0, numbers[2], numbers[3])


@kernel(stack=True, cost=10)
def solve_and_span(A: Any, b: Any, cut: float, least: Any, null: Any, left: Any, ranks: Any) -> None:
    """Least solutions of Aᵀ x = b, where they exist by least squares, and orthonormal bases of both null spaces.

    Parameters
    ----------
    A : ndarray
        Shape (N, m, n).
    b : ndarray
        Right sides as rows, shape (N, k, n).
    cut : float
        Part of the longest row, up to which what a row has beside others is none.
    least : ndarray
        Shape (N, k, m), filled: the solutions.
    null, left : ndarray
        Shapes (N, n, n) and (N, m, m), filled: from row r on, vectors that A, or Aᵀ, takes to zero; before, zeros.
    ranks : ndarray of int
        Shape (N,), filled: r.
    """
    (_, m, n), k = A.shape, b.shape[1]
    room = _new_room(max(m, n) + k + 1)
    flat, allowed, orders, numbers, _ = room
    W = flat[0][: (m + k) * n].reshape((m + k, n))
    for s in range(len(A)):
        longest = 0.0
        for i in range(m):
            total = 0.0
            for j in range(n):
                W[i, j] = A[s, i, j]
                total += W[i, j] * W[i, j]
            longest = max(longest, total)
        for i in range(k):
            for j in range(n):
                W[m + i, j] = b[s, i, j]
        r = pivoted_qr(W, allowed[:m], orders[0, :m], cut * math.sqrt(longest), numbers[0], numbers[1])
        V = flat[1][: r * m].reshape((r, m))
        _factor_range(W, V, r, room)
        ranks[s] = r
        for i in range(k):
            for j in range(m):
                least[s, i, j] = 0.0
            for j in range(r):
                total = W[m + i, orders[1, j]]
                for t in range(j):
                    total -= V[j, t] * least[s, i, t]
                least[s, i, j] = total / numbers[2, j]
            _turned(V, numbers[3], r, least[s, i])
        _fill_span(W, numbers[1], r, null[s])
        _fill_span(V, numbers[3], r, left[s])


@kernel(fills=True)
def _fill_span(W: Any, half: Any, rank: int, out: Any) -> None:
    """Fill an orthonormal basis of what the taken columns do not span, from row ``rank`` on."""
    for i in range(len(out)):
        for j in range(len(out)):
            out[i, j] = 1.0 if i == j and i >= rank else 0.0
        if i >= rank:
            _turned(W, half, rank, out[i])


@kernel(stack=True, cost=10)
def fill_least_in_order(effects: Any, present: Any, ends: Any, cut: float, found: Any) -> None:
    """Multiples x that make each of several quantities e + E x least, the first ones first, and x least of these.

    Parameters
    ----------
    effects, present : ndarray
        E and e of all quantities one below the other, shapes (N, rows, n) and (N, rows, k).
    ends : ndarray of int
        Row behind each quantity.
    cut : float
        Effect, relative to the largest of all or to one, that is none.
    found : ndarray
        x, shape (N, k, n), filled.
    """
    (_, rows, n), k = effects.shape, present.shape[2]
    room, basis, other = _new_room(max(rows, n) + k + 1), np.empty((n, n)), np.empty((n, n))
    flat, allowed, orders, numbers, (y, z) = room
    for s in range(len(effects)):
        scale, left, first = 1.0, n, 0
        for i in range(rows):
            for j in range(n):
                scale = max(scale, abs(effects[s, i, j]))
        for i in range(n):
            for j in range(n):
                basis[i, j] = 1.0 if i == j else 0.0
        found[s] = 0.0
        for end in ends:
            start, m, first = first, end - first, end
            if left == 0 or m == 0:
                continue
            W = flat[0][: m * left].reshape((m, left))
            for i in range(m):
                for t in range(left):
                    W[i, t] = 0.0
                    for j in range(n):
                        W[i, t] += effects[s, start + i, j] * basis[t, j]
            r = pivoted_qr(W, allowed[:m], orders[0, :m], cut * scale, numbers[0], numbers[1])
            V = flat[1][: (r + 1) * m].reshape((r + 1, m))
            _factor_range(W, V, r, room)
            for c in range(k):
                for i in range(m):
                    V[r, i] = -present[s, start + i, c]
                    for j in range(n):
                        V[r, i] -= effects[s, start + i, j] * found[s, c, j]
                for t in range(r):
                    reflect(V, numbers[3], t, V[r])
                solve_triangle(V, numbers[2], r, V[r])
                for t in range(left):
                    z[t] = 0.0
                for t in range(r):
                    z[orders[1, t]] = V[r, t]
                _turned(W, numbers[1], r, z[:left])
                for t in range(left):
                    for j in range(n):
                        found[s, c, j] += z[t] * basis[t, j]
            for t in range(r, left):
                for i in range(left):
                    y[i] = 1.0 if i == t else 0.0
                _turned(W, numbers[1], r, y[:left])
                for j in range(n):
                    other[t, j] = 0.0
                    for i in range(left):
                        other[t, j] += y[i] * basis[i, j]
            for t in range(r, left):
                for j in range(n):
                    basis[t - r, j] = other[t, j]
            left -= r
