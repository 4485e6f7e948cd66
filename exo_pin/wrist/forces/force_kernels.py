"""Forces of one pose of massless limbs in closed form, compiled: limbs without side force, and a wrist alone.

The formulas of :mod:`exo_pin.numerics.vectors`, with their symbols and signs. The affine state that ``exo.reaction``
solves (:mod:`exo_pin.wrist.forces.affine_state`) is computed otherwise, from closure wrenches of any limbs:
tests/reaction/batch checks one by the other.
"""

from __future__ import annotations

from typing import Any

from ...core.compiled import kernel
from ...numerics.small_linear import complete_basis, least_norm, orthonormalise
from ...numerics.vectors import along_normals, vector

#: Relative singular value of the effects of undetermined forces below which limbs alone do not hold the arm.
_LOST_HOLD = 1e-9


@kernel
def spherical_forces(s: Any, X: Any, reach: Any, F: Any, M: Any, f: Any, shoulder: Any, Q: Any, U: Any) -> None:
    """Fill f and F_s of limbs that carry no side force, (D-22) and (D-29).

    F and M, tuples, are what limbs and shoulder carry. With more than three limbs f has the least sum of squares: with
    J the matrix of rows b_i × s_i = Q U, it is f = Q (Uᵀ)⁻¹ M. Q, shape (n, 3), is left for :func:`open_effects`.

    Source: thesis (D-6), (D-10), (D-21), (D-22), (D-30).
    """
    n = X.shape[0]
    if n == 3:
        y = along_normals(M, vector(X, 0), vector(X, 1), vector(X, 2))
        for i in range(3):
            f[i] = y[i] / reach[i]
    else:
        for i in range(n):
            for j in range(3):
                Q[i, j] = -reach[i] * X[i, j]
        orthonormalise(Q, U, 3)
        y0 = M[0] / U[0, 0]
        y1 = (M[1] - U[0, 1] * y0) / U[1, 1]
        y2 = (M[2] - U[0, 2] * y0 - U[1, 2] * y1) / U[2, 2]
        for i in range(n):
            f[i] = Q[i, 0] * y0 + Q[i, 1] * y1 + Q[i, 2] * y2
    for j in range(3):
        shoulder[j] = -F[j]
        for i in range(n):
            shoulder[j] += f[i] * s[i, j]


@kernel
def open_effects(s: Any, X: Any, upu: Any, Q: Any, N: Any, G: Any) -> None:
    """Fill G, shape (3, n - 3 + u): the effect on F_s of each force that equilibrium does not determine.

    First the n - 3 sets of tensions that balance themselves, the columns of N, shape (n, n - 3), orthonormal; then the
    side forces of the u limbs whose indices are ``upu``.
    """
    n = s.shape[0]
    complete_basis(Q, N)
    for j in range(3):
        for k in range(n - 3):
            G[j, k] = 0.0
            for i in range(n):
                G[j, k] += N[i, k] * s[i, j]
        for k in range(upu.shape[0]):
            G[j, n - 3 + k] = X[upu[k], j]


@kernel
def standalone_forces(
    s: Any, X: Any, upu: Any, Q: Any, f: Any, g: Any, shoulder: Any, N: Any, G: Any, c: Any, z: Any
) -> bool:
    """Forces of limbs that carry everything, (D-25): change f and g of :func:`spherical_forces` so that F_s = 0.

    With more than three limbs the f and g of least sum of squares. Returns whether the limbs can.

    Source: thesis (D-25).
    """
    n = s.shape[0]
    if n == 3:
        y = along_normals((shoulder[0], shoulder[1], shoulder[2]), vector(X, 0), vector(X, 1), vector(X, 2))
        for i in range(3):
            g[i] = y[i]
    else:
        open_effects(s, X, upu, Q, N, G)
        for j in range(3):
            c[j] = shoulder[j]
        if least_norm(G, c, z, _LOST_HOLD) < 3:
            return False
        add_open(upu, N, z, f, g)
    for j in range(3):
        shoulder[j] = 0.0
    return True


@kernel
def add_open(upu: Any, N: Any, z: Any, f: Any, g: Any) -> None:
    """Add the undetermined forces z, in the order of :func:`open_effects`, to f and g."""
    n = f.shape[0]
    for k in range(n - 3):
        for i in range(n):
            f[i] += N[i, k] * z[k]
    for k in range(upu.shape[0]):
        g[upu[k]] += z[n - 3 + k]
