"""What equilibrium leaves open of a closed chain, by dense linear algebra and recursion with given multipliers."""

import itertools

import numpy as np
from scipy.linalg import null_space
from tree_forces import tree_forces


class Open:
    """All multipliers that make a motion: λ = start + stresses z, from the passive joints' rows of M a + h = τ + Jᵀλ.

    Every force is told by the tree's recursion with these multipliers (``tree_forces``), not by the certificate's maps.
    """

    def __init__(self, chain, q, v=None, a=None, external=None, actuated=None):
        self.chain, self.motion, self.external = chain, (q, v, a), external
        passive = np.ones(chain.model.nv, dtype=bool)
        passive[chain.velocity_indices(chain.roles.actuated if actuated is None else actuated)] = False
        J, tau = chain.constraint_jacobian(q)[:, passive], tree_forces(chain, q, v, a, external=external).tau[passive]
        self.start = np.linalg.lstsq(J.T, tau, rcond=1e-11)[0]
        assert np.abs(J.T @ self.start - tau).max(initial=0.0) < 1e-8
        self.stresses = null_space(J.T, rcond=1e-9) if J.size else np.eye(len(J))
        self.size = self.stresses.shape[1]

    def forces(self, z):
        return tree_forces(self.chain, *self.motion, self.start + self.stresses @ z, self.external)

    def wrench(self, name, z, frame="world", at="origin"):
        forces = self.forces(z)
        if name in [closure.name for closure in self.chain.closures if closure.type == "coupling"]:
            # No wrench of bodies; it counts with its multiplier.
            row = self.chain.rows(name).start
            entry = 2 if self.chain._state.topology.row_metres[row] else 5
            return np.eye(6)[entry] * (self.start + self.stresses @ z)[row]
        if name in [closure.name for closure in self.chain.closures]:
            return forces.closure_wrench(name, at, frame)
        return forces.joint_wrench(name, at, frame)

    def affine(self, tell):
        """Value at z = 0 and its change per unit of z, of anything that is affine in z."""
        constant = np.atleast_1d(tell(np.zeros(self.size)))
        return constant, np.column_stack([tell(unit) - constant for unit in np.eye(self.size)])

    def everything(self, z):
        """Wrenches of all joints and closures about their own points, moments over the characteristic length."""
        names = [*list(self.chain.model.names)[1:], *(closure.name for closure in self.chain.closures)]
        rows = np.array([self.wrench(name, z) for name in names])
        rows[:, 3:] /= self.chain.characteristic_length
        return rows.reshape(-1)


def vertices(C, c):
    """All corners of C z <= c, by trying every set of rows."""
    size, found = C.shape[1], []
    for rows in itertools.combinations(range(len(c)), size):
        corner, rank = C[list(rows)], np.linalg.svd(C[list(rows)], compute_uv=False)
        if rank[-1] < 1e-9 * rank[0]:
            continue
        z = np.linalg.solve(corner, c[list(rows)])
        if (C @ z <= c + 1e-7).all():
            found.append(z)
    return np.array(found)


def settled(constant, effect, z, N, rounding):
    """The z within z + range N with least |constant + effect z|, and the directions that are still open."""
    U, values, Vt = np.linalg.svd(effect @ N)
    rank = int((values > rounding).sum())
    z = z - N @ (Vt[:rank].T @ ((U[:, :rank].T @ (constant + effect @ z)) / values[:rank]))
    return z, N @ Vt[rank:].T


def compact(constant, effect):
    """Fewer rows with the same |constant + effect z| for every z."""
    if len(constant) <= effect.shape[1] + 1:
        return constant, effect
    R = np.linalg.qr(np.column_stack([effect, constant]), mode="r")
    return R[:, -1], R[:, :-1]


def lexicographic(goal, metric, C, c, rounding=1e-9):
    """The z with C z <= c that makes |goal| and then |metric| least, by trying every set of rows as equalities.

    ``goal`` and ``metric`` are (constant, effect); what is below ``rounding`` of the largest effect is none.
    """
    size, best = goal[1].shape[1], (np.inf, np.inf, None)
    rounding = rounding * np.abs(metric[1]).max(initial=1.0)
    goal, metric = compact(*goal), compact(*metric)
    for count in range(min(len(c), size) + 1):
        for rows in itertools.combinations(range(len(c)), count):
            A, b = C[list(rows)], c[list(rows)]
            z, N = np.zeros(size), np.eye(size)
            for constant, effect in ((-b, A), goal, metric):
                z, N = settled(constant, effect, z, N, rounding)
            if count and np.abs(A @ z - b).max() > 1e-8:
                continue
            if len(c) and (C @ z > c + 1e-8).any():
                continue
            one, two = (float(np.linalg.norm(constant + effect @ z)) for constant, effect in (goal, metric))
            if one < best[0] - 1e-8 or (one < best[0] + 1e-8 and two < best[1]):
                best = (min(one, best[0]), two, z)
    return best
