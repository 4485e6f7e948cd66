"""The arrays of an answer while they are filled, and what is the same for every split."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..core.errors import SolverFailed
from ..core.validation import FloatArray
from ..design import Mechanism
from ..load_case.pose_stacks import Query
from ..wrist.forces.closed_form import STATUS, classify
from ..wrist.forces.side_forces import side_wrenches
from ..wrist.kernels import NEAR_MARGIN, SINGULAR_MARGIN
from ..wrist_chain.equilibrium import Equilibrium
from .constraints.glenoid_cone import GlenoidCone
from .constraints.limb_limits import ForceLimits
from .constraints.side_force_bounds import SideForceBounds
from .indeterminacy.certificate import is_determined
from .indeterminacy.infeasibility import Shortfall
from .indeterminacy.infeasible_poses import shortfall
from .splits.elastic import shoulder_stiffness
from .splits.least_shoulder_force import duality_gap, least_force
from .splits.limb_and_side_forces import Pose, Socket, Weights, choose

__all__ = ["QUERY_STATUS", "STANDARD_GRAVITY", "Answer", "Wanted", "is_trivial"]

#: The closed form's status codes and what only a query with limits can find.
QUERY_STATUS = (*STATUS, "infeasible", "out_of_stroke")

#: Gravity by which a person's weight is counted, m/s², whatever the design's gravity is.
STANDARD_GRAVITY = 9.81
#: Ratio of singular values below which what is open does not reach every shoulder force.
_REACHES = 1e-9


def is_trivial(effect: FloatArray, lower: FloatArray, upper: FloatArray) -> bool:
    """Whether what has no bound reaches every shoulder force, so that the least one is zero by construction.

    Parameters
    ----------
    effect : ndarray
        Shoulder force per N of each open force, shape (3, m).
    lower, upper : ndarray
        Bounds, shape (m,), N.
    """
    free = effect[:, np.isinf(lower) & np.isinf(upper)]
    if free.shape[1] < 3:
        return False
    values = np.linalg.svd(free, compute_uv=False)
    return bool(values[2] > _REACHES * values[0])


class Chosen(NamedTuple):
    """f and g of one pose, and how good they are as an optimum."""

    f: FloatArray
    g: FloatArray
    kkt: float = 0.0
    gap: float = 0.0
    unique: bool = True


class Wanted(NamedTuple):
    """What a query asks of every pose."""

    split: str
    side_bounds: SideForceBounds
    limits: ForceLimits
    cone: GlenoidCone | None
    weights: Weights | None

    @property
    def needs_program(self) -> bool:
        """Whether f and g have to be chosen together, whatever the number of limbs."""
        return self.cone is not None or self.weights is not None


class Answer:
    """The arrays of a :class:`Reaction` while they are filled, poses along the first axis."""

    def __init__(self, mechanism: Mechanism, query: Query) -> None:
        count, n = len(query.matrices), mechanism.limb_count
        self.mechanism, self.upu = mechanism, np.flatnonzero(mechanism.is_upu)
        self.radius = float(np.linalg.norm(mechanism.geometry.platform_points, axis=-1).max())
        self.status, self.margin, self.determinant = classify(mechanism, query.matrices)
        self.shoulder, self.spherical = np.full((count, 3), np.nan), np.full((count, 3), np.nan)
        self.f, self.g = np.full((count, n), np.nan), np.full((count, n), np.nan)
        self.on_arm, self.on_torso = np.full((count, n, 6), np.nan), np.full((count, n, 6), np.nan)
        self.undetermined = np.full(count, -1)
        self.redundant = np.full(count, -1)
        self.f_unique, self.g_unique = np.zeros((count, n), dtype=bool), np.zeros((count, n), dtype=bool)
        self.shoulder_unique, self.torso_unique = np.zeros((count, 3), dtype=bool), np.zeros(count, dtype=bool)
        self.trivial = np.zeros(count, dtype=bool)
        self.kkt, self.gap, self.unique = np.full(count, np.nan), np.full(count, np.nan), np.zeros(count, dtype=bool)
        self.shortfalls: dict[int, Shortfall] = {}
        self.displacement: FloatArray | None = None
        self.stiffness: FloatArray | None = None

    def fill(self, row: int, state: Equilibrium, wanted: Wanted) -> None:
        """Solve one pose."""
        f0, stress = _tensions(state)
        try:
            missing = self._missing(row, state, wanted, f0)
            if missing is not None:
                self.shortfalls[row] = missing
                self.status[row] = QUERY_STATUS.index("infeasible")
                return
            if wanted.needs_program or (stress.size and not wanted.limits.is_free):
                chosen = Chosen(*choose(self._pose(row, state, wanted, f0)))
            else:
                chosen = self._choose(row, state, wanted, f0, stress)
        except SolverFailed:
            self.status[row] = QUERY_STATUS.index("not_solved")
            return
        if self.status[row] >= STATUS.index("singular"):
            return
        self.f[row], self.g[row], self.kkt[row], self.gap[row], self.unique[row] = chosen
        self.shoulder[row], closure = _apply(state, chosen)
        self.spherical[row] = _apply(state, Chosen(f0, np.zeros_like(f0)))[0]
        self.on_arm[row] = closure - state.limb_share
        self.on_torso[row] = -closure
        self._certify(row, state, stress)

    def _missing(self, row: int, state: Equilibrium, wanted: Wanted, f0: FloatArray) -> Shortfall | None:
        """What a pose lacks to be held; without any limit it lacks nothing."""
        if wanted.limits.is_free and (wanted.cone is None or wanted.cone.penalty is not None):
            return None
        return shortfall(self._pose(row, state, wanted, f0))

    def _pose(self, row: int, state: Equilibrium, wanted: Wanted, f0: FloatArray) -> Pose:
        """The program of one pose."""
        side, cone, weights = self.mechanism.side, wanted.cone, wanted.weights
        alone = wanted.split == "standalone"
        g_low, g_high = (bound[self.upu] for bound in wanted.side_bounds.at(row, f0))
        if wanted.split == "spherical":
            g_low = g_high = np.zeros(self.upu.size)
        goal = None
        if wanted.split == "minimal":
            goal = np.eye(3) if weights is None else weights.root(side)
        return Pose(
            state,
            self.radius,
            wanted.limits.lower[row],
            wanted.limits.upper[row],
            g_low,
            g_high,
            self.upu,
            wanted.side_bounds.by_tension,
            None if cone is None else Socket(*cone.half_spaces(side), cone.penalty),
            goal,
            0.0 if weights is None else weights.tension,
            alone,
        )

    def _choose(self, row: int, state: Equilibrium, wanted: Wanted, f0: FloatArray, stress: FloatArray) -> Chosen:
        """f and g of the wanted split. What is open are tensions that balance themselves, and side forces."""
        g, split = np.zeros_like(f0), wanted.split
        if split == "spherical":
            return Chosen(f0, g)
        if split == "elastic":
            return self._elastic(row, state, f0)
        own, side = stress.shape[1], state.shoulder_of_g[:, self.upu]
        effect = np.hstack([state.shoulder_of_f @ stress, side])
        constant = state.shoulder + state.shoulder_of_f @ f0
        low, high = np.full(len(f0), -np.inf), np.full(len(f0), np.inf)
        if split == "minimal":
            low, high = wanted.side_bounds.at(row, f0)
        free = np.full(own, np.inf)
        lower, upper = np.concatenate([-free, low[self.upu]]), np.concatenate([free, high[self.upu]])
        if split == "standalone":
            self.judge_standalone(row, effect)
        else:
            self.trivial[row] = wanted.limits.is_free and is_trivial(effect, lower, upper)
        if self.status[row] >= STATUS.index("singular"):
            return Chosen(f0, g)
        best = least_force(constant, effect, lower, upper)
        g[self.upu] = best.variables[own:]
        size = float(np.abs(constant).max()) or 1.0
        gap = size * duality_gap(constant / size, effect, lower / size, upper / size, best.variables / size)
        return Chosen(f0 + stress @ best.variables[:own], g, best.residual, gap, best.unique)

    def judge_standalone(self, row: int, effect: FloatArray) -> None:
        """Mark a pose in which the limbs alone hold the centre badly, or not at all.

        What counts is the smallest singular value of the effect of what is open on the shoulder force: dimensionless,
        N of force at O per N of limb force. ``margin`` stays that of the moments.
        """
        reach = float(np.linalg.svd(effect, compute_uv=False)[-1]) if effect.shape[1] >= 3 else 0.0
        if reach < SINGULAR_MARGIN:
            self.status[row] = STATUS.index("singular")
        elif reach < NEAR_MARGIN:
            self.status[row] = STATUS.index("near_singular")

    def prepare_elastic(self, query: Query) -> None:
        """Side stiffnesses of all poses, and room for the displacement of the shoulder's centre."""
        none = np.zeros((len(query.matrices), 3))
        self.stiffness = side_wrenches(self.mechanism, query.matrices, none, none).stiffness
        self.displacement = np.full((len(query.matrices), 3), np.nan)

    def _elastic(self, row: int, state: Equilibrium, f0: FloatArray) -> Chosen:
        """δ = (K_s + Σ k_i X_i X_iᵀ)⁻¹ N and g_i = k_i X_i · δ, with N the load that tensions leave at O."""
        assert self.stiffness is not None
        assert self.displacement is not None
        k, X = self.stiffness[row], np.nan_to_num(state.limb_axes)
        whole = shoulder_stiffness(self.mechanism) + (X.T * k) @ X
        load = -(state.shoulder + state.shoulder_of_f @ f0)
        if not np.linalg.cond(whole) < 1e12:
            raise SolverFailed("elastic split", np.inf, "shoulder and limbs together leave a direction free")
        delta = np.linalg.solve(whole, load)
        self.displacement[row] = delta
        return Chosen(f0, k * (X @ delta))

    def _certify(self, row: int, state: Equilibrium, stress: FloatArray) -> None:
        """Which reactions change with a self-stress, Wojtyra's criterion."""
        own, side = stress.shape[1], self.upu.size
        n = len(stress)
        self.undetermined[row] = own + side
        self.redundant[row] = side
        of_f = np.hstack([stress, np.zeros((n, side))])
        of_g = np.zeros((n, own + side))
        of_g[self.upu, own + np.arange(side)] = 1.0
        self.f_unique[row], self.g_unique[row] = is_determined(of_f), is_determined(of_g)
        shoulder = state.shoulder_of_f @ of_f + state.shoulder_of_g @ of_g
        self.shoulder_unique[row] = is_determined(shoulder)
        # The torso feels the limbs and, through the ball joint at O, the shoulder.
        limbs = state.closure_of_f.T @ of_f + state.closure_of_g.T @ of_g
        limbs[:3] += shoulder
        limbs[3:] /= self.radius
        self.torso_unique[row] = bool(is_determined(limbs).all())

    def refuse_what_is_not_finite(self) -> None:
        """A row that overflowed has no answer, and says so."""
        if np.isfinite(self.shoulder.sum() + self.f.sum() + self.g.sum() + self.on_arm.sum()):
            return
        arrays = (self.shoulder, self.f, self.g, self.on_arm.reshape(len(self.f), self.f.shape[1] * 6))
        finite = np.all([np.isfinite(array).all(axis=1) for array in arrays], axis=0)
        lost = ~finite & (self.status < STATUS.index("singular"))
        self.status[lost] = STATUS.index("not_solved")
        for array in (self.shoulder, self.spherical, self.f, self.g, self.on_arm, self.on_torso):
            array[lost] = np.nan
        self.undetermined[lost] = -1


def _tensions(state: Equilibrium) -> tuple[FloatArray, FloatArray]:
    """Tensions of least norm that balance the moment, and a basis (n, n - 3) of those that balance themselves.

    Source: thesis (D-20), (D-21), (D-22).
    """
    A = state.moment_of_f
    n = A.shape[1]
    if n == 3:
        return np.asarray(np.linalg.solve(A, state.moment), dtype=np.float64), np.empty((3, 0))
    U, values, Vt = np.linalg.svd(A)
    return Vt[:3].T @ ((U.T @ state.moment) / values), Vt[3:].T


def _apply(state: Equilibrium, chosen: Chosen) -> tuple[FloatArray, FloatArray]:
    """F_s, shape (3,), and closure wrenches, shape (n, 6).

    Source: thesis (D-27), (D-28), (D-29), (D-30).
    """
    closure = state.closure + chosen.f[:, None] * state.closure_of_f + chosen.g[:, None] * state.closure_of_g
    shoulder = state.shoulder + state.shoulder_of_f @ chosen.f + state.shoulder_of_g @ chosen.g
    return shoulder, closure
