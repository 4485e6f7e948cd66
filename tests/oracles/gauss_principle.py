"""Friction and stops as Gauss's principle: a convex program in the accelerations, which Clarabel solves.

Of all accelerations that keep the loops closed and move no joint into its stop, the motion minimises

    ½ (a - a_smooth)ᵀ M (a - a_smooth) + Σ max(-low a, -high a)

with the sum over the coordinates with friction at rest. exo_pin solves the dual problem, in the forces, by an active
set; an interior-point method in the accelerations shares neither the formulation nor the algorithm.
"""

import clarabel
import numpy as np
from scipy import sparse

#: Rows of an orthonormal basis below this belong to coordinates that the loops lock.
LOCKED = 1e-9


def gauss_acceleration(M, motions, smooth, friction, stops):
    """The acceleration, shape (nv,).

    ``motions`` is a basis of the velocities that keep the loops closed; ``smooth`` the acceleration without friction at
    rest and stops; ``friction`` are (index, low, high), ``stops`` (index, side).
    """
    basis, start = motions.copy(), smooth.copy()
    locked = np.linalg.norm(basis, axis=1) < LOCKED
    basis[locked] = 0.0
    start[locked & (np.abs(start) < LOCKED * max(1.0, np.abs(start).max()))] = 0.0
    count, size = basis.shape[1], basis.shape[1] + len(friction)
    P = np.zeros((size, size))
    P[:count, :count] = np.triu(motions.T @ M @ motions)
    cost = np.concatenate([np.zeros(count), np.ones(len(friction))])
    rows, sides = [], []
    for j, (i, low, high) in enumerate(friction):
        for bound in (low, high):
            row = np.zeros(size)
            row[:count], row[count + j] = -bound * basis[i], -1.0
            rows.append(row)
            sides.append(bound * start[i])
    for i, side in stops:
        rows.append(np.concatenate([-side * basis[i], np.zeros(len(friction))]))
        sides.append(side * start[i])
    if not rows or not count:
        return smooth
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-12
    problem = (sparse.csc_matrix(P), cost, sparse.csc_matrix(np.array(rows)), np.array(sides))
    found = clarabel.DefaultSolver(*problem, [clarabel.NonnegativeConeT(len(sides))], settings).solve()
    assert "Solved" in str(found.status), found.status
    return smooth + motions @ np.array(found.x)[:count]
