"""The loop over poses of three limbs without bounds, several poses at once, compiled.

The input are unit quaternions. Each pose is computed by itself, so that the result does not depend on the blocks or on
the number of threads, to the last bit.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.compiled import kernel
from ...numerics.vectors import (
    SINGULAR,
    along_normals,
    gram,
    limb,
    margin_of_moments,
    root,
    second_invariant,
    status_code,
    triple,
    vector,
)
from .map_blocks import FX, FY, FZ, LANES, MX, MY, MZ, ROWS, Device, Outputs, Terms, X, Y, Z, fill_block, pose

# Where the rows of the results begin in a block.
F1, F2, F3, G1, G2, G3, SX, SY, SZ = (np.uint64(row * LANES) for row in range(6, 15))
STATUS, MARGIN, SIZE = (np.uint64(row * LANES) for row in range(15, 18))


@kernel
def _three_limbs(lanes: Any, base: Any, platform: Any, standalone: bool, w: Any) -> None:
    """One block of poses of three limbs, without bounds.

    It has no branch and calls no function, so that the compiler can vectorise it over poses.
    """
    a1, a2, a3 = vector(base, 0), vector(base, 1), vector(base, 2)
    p1, p2, p3 = vector(platform, 0), vector(platform, 1), vector(platform, 2)
    side, rest = (1.0, 0.0) if standalone else (0.0, 1.0)
    for k in range(lanes):
        R = pose(w, k)
        _, s1, X1, _, h1, folded1 = limb(R, a1, p1)
        _, s2, X2, _, h2, folded2 = limb(R, a2, p2)
        _, s3, X3, _, h3, folded3 = limb(R, a3, p3)
        gram1, gram2, gram3 = gram(X1, h1), gram(X2, h2), gram(X3, h3)
        second = second_invariant(
            (
                gram1[0] + gram2[0] + gram3[0],
                gram1[1] + gram2[1] + gram3[1],
                gram1[2] + gram2[2] + gram3[2],
                gram1[3] + gram2[3] + gram3[3],
                gram1[4] + gram2[4] + gram3[4],
                gram1[5] + gram2[5] + gram3[5],
            )
        )
        volume = triple(X1, X2, X3) * h1 * h2 * h3
        margin = margin_of_moments(h1 * h1 + h2 * h2 + h3 * h3, second, volume)
        code = status_code(folded1 | folded2 | folded3, margin)
        # Added to a part of the moment it makes all forces of a singular pose NaN, without a branch; to what is zero by
        # assumption, it takes away the sign of the zero.
        blank = np.nan if code >= SINGULAR else 0.0
        y = along_normals((w[MX + k] + blank, w[MY + k], w[MZ + k]), X1, X2, X3)
        f1, f2, f3 = y[0] / h1, y[1] / h2, y[2] / h3
        Sx = f1 * s1[0] + f2 * s2[0] + f3 * s3[0] - w[FX + k]
        Sy = f1 * s1[1] + f2 * s2[1] + f3 * s3[1] - w[FY + k]
        Sz = f1 * s1[2] + f2 * s2[2] + f3 * s3[2] - w[FZ + k]
        g = along_normals((Sx, Sy, Sz), X1, X2, X3)
        Sx, Sy, Sz = rest * Sx + blank, rest * Sy + blank, rest * Sz + blank
        w[F1 + k], w[F2 + k], w[F3 + k] = f1, f2, f3
        w[G1 + k], w[G2 + k], w[G3 + k] = side * g[0] + blank, side * g[1] + blank, side * g[2] + blank
        w[SX + k], w[SY + k], w[SZ + k] = Sx, Sy, Sz
        w[STATUS + k], w[MARGIN + k], w[SIZE + k] = float(code), margin, root(Sx * Sx + Sy * Sy + Sz * Sz)


@kernel(inline=True)
def _copy_vectors(w: Any, x: Any, y: Any, z: Any, start: int, lanes: Any, out: Any) -> None:
    if out.shape[0]:
        block = out[start:]
        for k in range(lanes):
            block[k, X], block[k, Y], block[k, Z] = w[x + k], w[y + k], w[z + k]


@kernel(inline=True)
def _copy_numbers(w: Any, row: Any, start: int, lanes: Any, out: Any) -> None:
    if out.shape[0]:
        block = out[start:]
        for k in range(lanes):
            block[k] = w[row + k]


@kernel(stack=True)
def map_three(q: Any, device: Device, terms: Terms, standalone: bool, out: Outputs) -> None:
    """Splits "spherical" and "standalone" of three limbs.

    Parameters
    ----------
    q : ndarray
        Unit quaternions, shape (N, 4), scalar last.
    device, terms, out : NamedTuple
        The mechanism, the query, and the arrays for the results.
    standalone : bool
        Whether F_s = 0 (three UPU limbs), else g = 0.
    """
    count = q.shape[0]
    w = np.empty(ROWS * LANES)
    for start in range(0, count, LANES):
        lanes = fill_block(q, start, terms, w)
        _three_limbs(lanes, device.base, device.platform, standalone, w)
        _copy_vectors(w, SX, SY, SZ, start, lanes, out.shoulder)
        _copy_vectors(w, F1, F2, F3, start, lanes, out.f)
        _copy_vectors(w, G1, G2, G3, start, lanes, out.g)
        _copy_numbers(w, STATUS, start, lanes, out.status)
        _copy_numbers(w, MARGIN, start, lanes, out.margin)
        _copy_numbers(w, SIZE, start, lanes, out.magnitude)
