"""Friction and stops as a linear complementarity problem in the forces, which Drake's Moby solver (Lemke) solves.

With P = Z (Zᵀ M Z)⁻¹ Zᵀ for a basis Z of the motions that keep the loops closed, forces f make a = a_smooth + P f.

- A stop on one side, f = side u: u >= 0 and side a >= 0, one of them zero.
- Friction between low and high, f = low + u, with a = p - n: p >= 0 and u >= 0, one of them zero; n >= 0 and
  high - low - u >= 0, one of them zero.

Drake's plants have no dry friction in joints; this program of theirs takes it.
"""

import numpy as np
from pydrake.solvers import MathematicalProgram, MobyLcpSolver


def complementary_acceleration(M, motions, smooth, friction, stops):
    """The acceleration, shape (nv,), or None where Lemke's method ends without an answer; see gauss_acceleration."""
    P = motions @ np.linalg.solve(motions.T @ M @ motions, motions.T)
    places = [i for i, _ in stops] + [i for i, _, _ in friction]
    signs = np.array([float(side) for _, side in stops] + [1.0] * len(friction))
    count, rubbing = len(places), len(friction)
    if not count:
        return smooth
    start = smooth + sum((low * P[:, i] for i, low, _ in friction), np.zeros(len(smooth)))
    A = np.zeros((count + rubbing, count + rubbing))
    A[:count, :count] = signs[:, None] * P[np.ix_(places, places)] * signs
    A[len(stops) : count, count:] = np.eye(rubbing)
    A[count:, len(stops) : count] = -np.eye(rubbing)
    constant = np.concatenate([signs * start[places], [high - low for _, low, high in friction]])
    program = MathematicalProgram()
    x = program.NewContinuousVariables(len(A), "x")
    program.AddLinearComplementarityConstraint(A, constant, x)
    solved = MobyLcpSolver().Solve(program, None, None)
    if not solved.is_success():
        return None
    found = solved.GetSolution(x)
    slack, size = A @ found + constant, max(1.0, np.abs(constant).max())
    if min(found.min(), slack.min(), -np.abs(found * slack).max()) < -1e-8 * size:
        return None  # it says solved, and the conditions are not met
    forces = signs * found[:count]
    return start + P[:, places] @ forces
