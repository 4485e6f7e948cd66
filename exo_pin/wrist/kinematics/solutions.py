"""Solutions of n equations u_i · R v_i = c_i, and the rows of modes that they are written to, compiled."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import kernel
from ...core.records import keeps_read_only
from ...core.validation import FloatArray
from ...numerics.vectors import cross, matrix, turn, vector
from .assembly import CONTINUUM, assemble, fill_rows, margin_of, rotate


@keeps_read_only
class Joints(NamedTuple):
    """The joints of a wrist, as all forward kinematics takes them.

    Attributes
    ----------
    base, platform : ndarray
        A_i and B_i, shape (n, 3), m.
    u, v : ndarray
        Unit vectors along them, shape (n, 3).
    a, b : ndarray
        Their lengths, shape (n,), m.
    frames : ndarray
        {A_i}, shape (n, 3, 3).
    triples : ndarray of int
        Shape (T, 3), triples of limbs to solve with, best first; used for n > 3.
    reference : ndarray
        Shape (4,), quaternion of the pose that modes are ordered from.
    """

    base: FloatArray
    platform: FloatArray
    u: FloatArray
    v: FloatArray
    a: FloatArray
    b: FloatArray
    frames: FloatArray
    triples: NDArray[np.int64]
    reference: FloatArray


class Modes(NamedTuple):
    """Up to W modes for each of N rows, which kernels fill.

    Attributes
    ----------
    q : ndarray
        Unit quaternions (x, y, z, w), shape (N, W, 4).
    residual, margin : ndarray
        Shape (N, W), the margin with a sign.
    number : ndarray of int
        Shape (N,): how many there are, or :data:`CONTINUUM`.
    """

    q: FloatArray
    residual: FloatArray
    margin: FloatArray
    number: NDArray[np.int64]


class Solutions(NamedTuple):
    """Room for the solutions of one set of equations: rotations, signed margins and residuals, NaN for none."""

    R: FloatArray
    margins: FloatArray
    residuals: FloatArray


@kernel
def quaternion(R: Any, q: Any) -> None:
    """Write the unit quaternion (x, y, z, w) of a rotation matrix, from its largest component (Shepperd)."""
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    best, k = trace, 3
    for j in range(3):
        if R[j, j] > best:
            best, k = R[j, j], j
    if k == 3:
        q[3] = 1.0 + trace
        q[0], q[1], q[2] = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    else:
        j, m = (k + 1) % 3, (k + 2) % 3
        q[k] = 1.0 + 2.0 * R[k, k] - trace
        q[j], q[m] = R[j, k] + R[k, j], R[m, k] + R[k, m]
        q[3] = R[m, j] - R[j, m]
    size = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    for j in range(4):
        q[j] *= size


@kernel
def half_cosine(p: Any, q: Any) -> float:
    """Cosine of half the angle between the rotations of two unit quaternions."""
    return abs(p[0] * q[0] + p[1] * q[1] + p[2] * q[2] + p[3] * q[3])


@kernel
def insert(modes: Modes, row: int, place: int, count: int, q: Any, residual: float, margin: float) -> None:
    """Put a mode at a place among the first ``count`` modes of a row."""
    for m in range(count, place, -1):
        modes.q[row, m] = modes.q[row, m - 1]
        modes.residual[row, m] = modes.residual[row, m - 1]
        modes.margin[row, m] = modes.margin[row, m - 1]
    modes.q[row, place] = q
    modes.residual[row, place], modes.margin[row, place] = residual, margin


@kernel
def write_modes(found: Solutions, number: int, reference: Any, modes: Modes, row: int, start: int) -> int:
    """Insert ``number`` solutions after the first ``start`` modes of a row, ordered by angle from the reference.

    Returns the number of modes that the row has then, or :data:`CONTINUUM` if that is the ``number``.
    """
    if number == CONTINUUM:
        return CONTINUUM
    fresh = np.empty(4)
    count = start
    for k in range(number):
        if math.isnan(found.residuals[k]):
            continue
        quaternion(found.R[k], fresh)
        near = half_cosine(fresh, reference)
        place = count
        while place > 0 and half_cosine(modes.q[row, place - 1], reference) < near:
            place -= 1
        insert(modes, row, place, count, fresh, found.residuals[k], found.margins[k])
        count += 1
    return count


@kernel
def _least_squares(R: Any, u: Any, v: Any, c: Any) -> float:
    """Turn R, a solution of some three of u_i·Rv_i = c_i, to the least sum of squares over all n (Gauss and Newton).

    Returns that sum.
    """
    rows, error = np.empty(u.shape), np.empty(u.shape[0])
    for _ in range(50):
        fill_rows(R, u, v, c, rows, error)
        step = np.linalg.solve(rows.T @ rows + 1e-15 * np.eye(3), rows.T @ error)
        size = math.sqrt(step @ step)
        if size > 0.3:
            step *= 0.3 / size
        rotate(R, step[0], step[1], step[2])
        if size < 1e-15:
            break
    fill_rows(R, u, v, c, rows, error)
    return float(error @ error)


@kernel
def solve(u: Any, v: Any, c: Any, triples: Any, found: Solutions) -> int:
    """Solutions of n equations: of three exactly, of more from the first triple that has isolated solutions."""
    R, margins = found.R, found.margins
    if u.shape[0] == 3:
        return assemble(u, v, c, R, margins)
    rows = np.empty((3, 3))
    for t in range(triples.shape[0]):
        number = assemble(u[triples[t]], v[triples[t]], c[triples[t]], R, margins)
        if number == CONTINUUM:
            continue
        selected = 0
        squares = np.empty(number)
        for k in range(number):
            square, fresh = _least_squares(R[k], u, v, c), True
            for m in range(selected):
                if np.abs(R[m] - R[k]).max() <= 1e-6:
                    fresh = False
                    # A root that comes from afar may stop short of the one that another starts from.
                    if square < squares[m]:
                        R[m], squares[m] = R[k], square
            if fresh:
                squares[selected] = square
                R[selected] = R[k]
                # The best margin of all triples counts: the other limbs hold what one triple does not.
                margins[selected] = 0.0
                for s in range(triples.shape[0]):
                    for e in range(3):
                        i = triples[s, e]
                        turned = turn(matrix(R[selected]), vector(v, i))
                        rows[e, 0], rows[e, 1], rows[e, 2] = cross(turned, vector(u, i))
                    margins[selected] = max(margins[selected], abs(margin_of(rows)))
                selected += 1
        return selected
    return CONTINUUM
