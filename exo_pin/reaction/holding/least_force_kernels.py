"""What tensions within their limits can hold, and the least shoulder force they leave, over stacks of poses.

Limbs carry no side force (g = 0), as cables and bare muscles.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.compiled import kernel
from ...numerics.bounded.polytope_program import least_sum_force
from ...numerics.vectors import (
    SINGULAR,
    SINGULAR_MARGIN,
    add,
    along_normals,
    cross,
    dot,
    limb,
    matrix,
    root,
    triple,
    vector,
    weight_load,
)
from ...wrist.forces.force_kernels import open_effects, spherical_forces
from ...wrist.forces.wrench_feasibility import moment_margin
from ...wrist.limbs import fill_limbs, largest_radius, pose_status


@kernel(stack=True)
def three_limb_stack(
    R: Any, base: Any, platform: Any, base_offset: Any, cuff_offset: Any, arm: Any, gravity: Any, F: Any, M: Any,
    low: Any, high: Any, margin: Any, f: Any, shoulder: Any,
) -> None:  # fmt: skip
    """:func:`holding_stack` for three limbs, whose tensions equilibrium determines.

    The moments that they supply form a parallelepiped with one pair of faces a limb. Opposite faces are
    (high_k - low_k) times the lever of a_k = b_k × s_k across the other two apart, and f_k says where between them.
    """
    a1, a2, a3 = vector(base, 0), vector(base, 1), vector(base, 2)
    p1, p2, p3 = vector(platform, 0), vector(platform, 1), vector(platform, 2)
    centre, g, radius = (arm[1], arm[2], arm[3]), (gravity[0], gravity[1], gravity[2]), largest_radius(platform)
    fixed, same, still = low.shape[0] == 1, F.shape[0] == 1, base_offset.shape[0] == 1
    for k in range(R.shape[0]):
        row, load = 0 if fixed else k, 0 if same else k
        held, carried = vector(base_offset, 0 if still else k), vector(cuff_offset, 0 if still else k)
        pose = matrix(R[k])
        _, s1, X1, _, h1, folded1 = limb(pose, add(a1, held), add(p1, carried))
        _, s2, X2, _, h2, folded2 = limb(pose, add(a2, held), add(p2, carried))
        _, s3, X3, _, h3, folded3 = limb(pose, add(a3, held), add(p3, carried))
        _, W, weight_moment = weight_load(pose, arm[0], centre, g)
        Mx, My, Mz = M[load, 0] + weight_moment[0], M[load, 1] + weight_moment[1], M[load, 2] + weight_moment[2]
        volume = abs(triple(X1, X2, X3))
        weakest = min(h1, min(h2, h3)) / radius
        if folded1 | folded2 | folded3 or volume * weakest < SINGULAR_MARGIN:
            continue
        y = along_normals((Mx, My, Mz), X1, X2, X3)
        f1, f2, f3 = y[0] / h1, y[1] / h2, y[2] / h3
        c1, c2, c3 = cross(X2, X3), cross(X3, X1), cross(X1, X2)
        room = h1 * volume / root(dot(c1, c1)) * min(f1 - low[row, 0], high[row, 0] - f1)
        room = min(room, h2 * volume / root(dot(c2, c2)) * min(f2 - low[row, 1], high[row, 1] - f2))
        room = min(room, h3 * volume / root(dot(c3, c3)) * min(f3 - low[row, 2], high[row, 2] - f3))
        margin[k] = room
        if room >= 0.0:
            f[k, 0], f[k, 1], f[k, 2] = f1, f2, f3
            for j in range(3):
                shoulder[k, j] = f1 * s1[j] + f2 * s2[j] + f3 * s3[j] - F[load, j] - W[j]


@kernel(stack=True)
def holding_stack(
    R: Any, base: Any, platform: Any, base_offset: Any, cuff_offset: Any, arm: Any, gravity: Any, F: Any, M: Any,
    low: Any, high: Any, margin: Any, f: Any, shoulder: Any,
) -> None:  # fmt: skip
    """Fill the margin of the moments that can be held, and the tensions of least shoulder force.

    Parameters
    ----------
    R : ndarray
        Shape (N, 3, 3).
    base, platform : ndarray
        Shape (n, 3), m, about the device's own centre.
    base_offset, cuff_offset : ndarray
        Where that centre lies, seen from O: held by the base, base frame, and carried by the cuff, arm frame; shape
        (N, 3), or (1, 3) for all poses, m.
    arm, gravity : ndarray
        Mass and centre of mass of the arm, shape (4,), kg and m; shape (3,), m/s².
    F, M : ndarray
        Load on the arm beside its weight, N, and its moment about O, N m, shape (N, 3), or (1, 3) for all poses.
    low, high : ndarray
        Limits of the tensions, N, shape (N, n), or (1, n) for all poses.
    margin, f, shoulder : ndarray
        Full of NaN; written: (N,), N m, the largest disturbing moment of any direction that is held besides, negative
        where the arm is not held, NaN in a singular pose; (N, n), N, and (N, 3), N, NaN where no tensions within the
        limits hold the arm.
    """
    n = base.shape[0]
    m = n - 3
    each = base.shape
    b, s, X, Q, U = np.empty(each), np.empty(each), np.empty(each), np.empty(each), np.empty((3, 3))
    length, reach, arms = np.empty(n), np.empty(n), np.empty(each)
    N, G, z, none = np.empty((n, m)), np.empty((3, m)), np.empty(m), np.empty(0, dtype=np.int64)
    direction, relief_low, relief_high = np.empty(3), np.empty(n), np.empty(n)
    A, B = np.empty(each), np.empty(each)
    fixed, same, still = low.shape[0] == 1, F.shape[0] == 1, base_offset.shape[0] == 1
    centre, g, moment = (arm[1], arm[2], arm[3]), (gravity[0], gravity[1], gravity[2]), np.empty(3)
    for k in range(R.shape[0]):
        row, load = 0 if fixed else k, 0 if same else k
        shift = 0 if still else k
        for i in range(n):
            for j in range(3):
                A[i, j], B[i, j] = base[i, j] + base_offset[shift, j], platform[i, j] + cuff_offset[shift, j]
        fill_limbs(matrix(R[k]), A, B, b, s, X, length, reach)
        status, size = pose_status(X, reach, none)
        if status >= SINGULAR or size < SINGULAR_MARGIN:
            continue
        _, W, weight_moment = weight_load(matrix(R[k]), arm[0], centre, g)
        for j in range(3):
            moment[j] = M[load, j] + weight_moment[j]
        force = (F[load, 0] + W[0], F[load, 1] + W[1], F[load, 2] + W[2])
        spherical_forces(s, X, reach, force, (moment[0], moment[1], moment[2]), f[k], shoulder[k], Q, U)
        for i in range(n):
            for j in range(3):
                arms[i, j] = -reach[i] * X[i, j]
        margin[k] = moment_margin(arms, moment, low[row], high[row], direction, relief_low, relief_high)
        held = margin[k] >= 0.0
        if held:
            open_effects(s, X, none, Q, N, G)
            held = least_sum_force(shoulder[k], G, f[k], N, low[row], high[row], z)
        if not held:
            f[k, :], shoulder[k, :] = np.nan, np.nan
            continue
        for j in range(m):
            for i in range(n):
                f[k, i] += N[i, j] * z[j]
            for i in range(3):
                shoulder[k, i] += G[i, j] * z[j]
