"""Compiled parts of the equilibrium through Pinocchio: joint angles of closed limbs, and their closure wrenches.

See :mod:`exo_pin.wrist_chain.equilibrium` for the equations.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..core.compiled import kernel
from ..numerics.vectors import dot, matrix, turn_back, vector

__all__ = ["joint_angles", "upu_closures"]


@kernel(stack=True)
def joint_angles(
    R: Any, base: Any, b: Any, s: Any, X: Any, length: Any, reach: Any, about_a: Any, about_b: Any, angles: Any
) -> None:
    """Fill the angles of platform_y, platform_x, base_x and base_y, rad, and the slide, m, of all limbs.

    Source: thesis (D-4), (D-11), (D-12).

    Parameters
    ----------
    R : ndarray
        Poses, shape (N, 3, 3).
    base : ndarray
        Points A_i, shape (n, 3), m.
    b, s, X, length, reach : ndarray
        Of :class:`exo_pin.wrist.limbs.Limbs`.
    about_a, about_b : ndarray
        Shape (n, 6): sine and cosine per unit of X of its turn about -a_i, base frame, and about -b_i, arm frame.
    angles : ndarray
        Shape (N, n, 5), written.
    """
    for k in range(R.shape[0]):
        pose = matrix(R[k])
        for i in range(base.shape[0]):
            axis, along, own = vector(X[k], i), vector(s[k], i), turn_back(pose, vector(X[k], i))
            sine = about_b[i, 0] * own[0] + about_b[i, 1] * own[1] + about_b[i, 2] * own[2]
            cosine = about_b[i, 3] * own[0] + about_b[i, 4] * own[1] + about_b[i, 5] * own[2]
            angles[k, i, 0] = math.atan2(sine, cosine)
            angles[k, i, 1] = math.atan2(reach[k, i], -dot(vector(b[k], i), along))
            angles[k, i, 2] = math.atan2(-reach[k, i], -dot(vector(base, i), along))
            sine = about_a[i, 0] * axis[0] + about_a[i, 1] * axis[1] + about_a[i, 2] * axis[2]
            cosine = about_a[i, 3] * axis[0] + about_a[i, 4] * axis[1] + about_a[i, 5] * axis[2]
            angles[k, i, 3] = math.atan2(sine, cosine)
            angles[k, i, 4] = length[k, i]


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
