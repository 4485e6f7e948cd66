"""Closure wrenches of the limbs for given efforts, compiled: joint rows and couples (UPU), pure forces (SPS)."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.compiled import kernel
from ..numerics.vectors import cross, vector


@kernel(stack=True)
def upu_closures(
    rows: Any, limbs: Any, columns: Any, radius: Any, massless: bool, J: Any, tau: Any, share: Any, closure: Any,
    of_f: Any, of_g: Any,
) -> None:  # fmt: skip
    """Fill the closure wrenches of the UPU limbs: five joint rows and the couple at B_i for six components of λ_i.

    Of a wrench (F, M) about O the couple at B along n = b/|b| × X is n·M - |b| X·F, and the joint platform_x, about the
    axis X through B, has the column (b × X, X) in the tree's Jacobian.

    Source: thesis (D-13), (D-14), (D-15), (D-17), (D-18).

    Parameters
    ----------
    rows : ndarray of int
        Poses to fill.
    limbs, columns, radius : ndarray
        Indices of the UPU limbs, shape (m,), the columns of their joints, shape (m, 5), and |B_i|, shape (n,), m.
    massless : bool
        Whether no limb has mass.
    J, tau : ndarray
        The tree's Jacobian and the joint efforts of the open tree, shapes (N, 6, nv) and (N, nv).
    share : ndarray
        Wrenches that move and carry the limbs, shape (N, n, 6).
    closure, of_f, of_g : ndarray
        λ_i at f = g = 0 and its change, shape (N, n, 6), written.
    """
    system, target = np.empty((6, 6)), np.empty((6, 3))
    for r in range(rows.shape[0]):
        k = rows[r]
        for m in range(limbs.shape[0]):
            i = limbs[m]
            for j in range(5):
                for e in range(6):
                    system[j, e] = J[k, e, columns[m, j]]
            for e in range(3):
                system[5, e] = -radius[i] * system[1, 3 + e]
                system[5, 3 + e] = system[1, e] / radius[i]
            target[:] = 0.0
            if not massless:
                for j in range(5):
                    target[j, 0] = tau[k, columns[m, j]]
                for e in range(6):
                    target[5, 0] += system[5, e] * share[k, i, e]
            target[2, 1] = 1.0
            target[5, 2] = radius[i]
            solved = np.linalg.solve(system, target)
            for e in range(6):
                closure[k, i, e], of_f[k, i, e] = solved[e, 0], solved[e, 1]
                # Side wrenches are forces through O: what the solution has as moment is rounding.
                of_g[k, i, e] = solved[e, 2] if e < 3 else 0.0


@kernel(stack=True)
def sps_closures(
    s: Any, limbs: Any, slides: Any, base: Any, length: Any, b: Any, tau: Any, share: Any, closure: Any, of_f: Any
) -> None:
    """Fill the SPS limbs: a pure force through A_i, also where the limb points at O.

    Along the limb the slide's row gives it, across the limb the moment balance of the limb about B_i.

    Source: thesis (D-6), (D-14), (D-15).

    Parameters
    ----------
    s : ndarray
        Directions of the limbs, shape (N, n, 3).
    limbs, slides : ndarray
        Indices of the SPS limbs, shape (m,), and the columns of the slides of all limbs, shape (n,).
    base : ndarray
        A_i, shape (n, 3), m.
    length, b : ndarray
        Lengths of the limbs and OB_i, shapes (N, n) and (N, n, 3).
    tau : ndarray
        Joint efforts of the open tree, shape (N, nv).
    share : ndarray
        Wrenches that move and carry the limbs, shape (N, n, 6).
    closure, of_f : ndarray
        λ_i at f = 0 and its change, shape (N, n, 6), written.
    """
    for k in range(s.shape[0]):
        for i in limbs:
            s_i, a_i, force_i = vector(s[k], i), vector(base, i), vector(share[k], i)
            turning = cross(vector(b[k], i), force_i)
            about_B = (share[k, i, 3] - turning[0], share[k, i, 4] - turning[1], share[k, i, 5] - turning[2])
            across = cross(s_i, about_B)
            reach = length[k, i] if length[k, i] > 0.0 else 1.0
            along = tau[k, slides[i]]
            force = (
                across[0] / reach - along * s_i[0],
                across[1] / reach - along * s_i[1],
                across[2] / reach - along * s_i[2],
            )
            moment, arm = cross(a_i, force), cross(a_i, s_i)
            for e in range(3):
                closure[k, i, e], closure[k, i, 3 + e] = force[e], moment[e]
                of_f[k, i, e], of_f[k, i, 3 + e] = -s_i[e], -arm[e]
