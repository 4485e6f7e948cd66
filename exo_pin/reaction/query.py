"""The reaction query: poses, motion and load in, forces out."""

from __future__ import annotations

from typing import Literal, NamedTuple, get_args

import numpy as np
from scipy.spatial.transform import Rotation

from ..design import Arm, Load, Mechanism, Motion
from ..errors import InvalidInput, SolverFailed
from ..progress import track
from ..validation import FloatArray, as_choice
from ..wrist.forces import STATUS, classify
from ..wrist.inverse import inverse_kinematics
from ..wrist.kernels import arm_load
from ..wrist.stacks import Query, as_query
from .bounds import ConstraintBounds, SideForceBounds
from .certificate import Certificate, is_determined
from .choice import Pose, Socket, Weights, choose
from .cone import GlenoidCone
from .equilibrium import Equilibrium, EquilibriumModel
from .infeasibility import Infeasibility, Shortfall
from .infeasible import shortfall
from .limits import ActuatorBounds, ForceLimits
from .program import duality_gap, least_force
from .result import Optimum, Reaction

__all__ = ["QUERY_STATUS", "Split", "reaction"]

#: The closed form's status codes and what only a query with limits can find.
QUERY_STATUS = (*STATUS, "infeasible", "out_of_stroke")

Split = Literal["spherical", "minimal", "standalone"]
_CHOSEN_BY = {
    "spherical": "limbs without side force are assumed (g = 0)",
    "minimal": "the side forces of least shoulder force are assumed",
    "standalone": "a shoulder that carries nothing is assumed (F_s = 0)",
}


class _Chosen(NamedTuple):
    """f and g of one pose, and how good they are as an optimum."""

    f: FloatArray
    g: FloatArray
    kkt: float = 0.0
    gap: float = 0.0
    unique: bool = True


class _Wanted(NamedTuple):
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


def reaction(
    model: EquilibriumModel,
    orientation: Rotation,
    motion: Motion | None = None,
    load: Load | None = None,
    split: str = "spherical",
    constraint_bounds: ConstraintBounds = None,
    *,
    actuator_bounds: ActuatorBounds = None,
    cone: GlenoidCone | None = None,
    weights: Weights | None = None,
    progress: bool = False,
) -> Reaction:
    """Forces on arm, shoulder and torso; see :meth:`exo_pin.ShoulderExo.reaction`."""
    _check_options(split, constraint_bounds, cone, weights)
    mechanism = model.mechanism
    if split == "standalone" and mechanism.is_upu.sum() < 3:
        raise InvalidInput(
            f"a wrist without a shoulder needs at least 3 UPU limbs to hold its centre, got {mechanism.is_upu.sum()}"
        )
    if motion is not None:
        mechanism.require_arm("motion", inertia=True)
    query = as_query(orientation, motion, load)
    n = mechanism.limb_count

    def lengths() -> FloatArray:
        return inverse_kinematics(mechanism.geometry, orientation).lengths.reshape(-1, n)

    limits = ForceLimits(actuator_bounds, query.shape, n, lengths)
    bounds = SideForceBounds(constraint_bounds, query.shape, n, limits.one_signed)
    wanted = _Wanted(split, bounds, limits, cone, weights)
    answer = _Answer(mechanism, query)
    answer.status[(answer.status < STATUS.index("singular")) & ~limits.reachable] = QUERY_STATUS.index("out_of_stroke")
    quaternions = orientation.as_quat().reshape(-1, 4)
    rows = np.flatnonzero(answer.status < STATUS.index("singular")).tolist()
    for row in track(rows, "reaction", progress):
        R = query.matrices[row]
        q = model.configuration(R, quaternions[row])
        outside = np.concatenate([query.force[row], query.moment[row]])
        state = model.equilibrium(R, q, query.velocity[row], query.acceleration[row], outside)
        answer.fill(row, state, wanted)
    trivial = split == "minimal" and bounds.is_free and bool(mechanism.is_upu.sum() >= 3)
    trivial = trivial and cone is None and weights is None
    return answer.finished(query, wanted, trivial)


def _check_options(
    split: str, constraint_bounds: ConstraintBounds, cone: GlenoidCone | None, weights: Weights | None
) -> None:
    """Refuse options that do not belong together."""
    as_choice("split", split, get_args(Split))
    if constraint_bounds is not None and split != "minimal":
        raise InvalidInput(f'constraint_bounds belong to split="minimal", got split={split!r}')
    if weights is not None and split != "minimal":
        raise InvalidInput(f'weights belong to split="minimal", got split={split!r}')
    if cone is not None and split == "standalone":
        raise InvalidInput('a glenoid cone bounds F_s, which split="standalone" sets to zero')
    for name, value, kind in (("cone", cone, GlenoidCone), ("weights", weights, Weights)):
        if value is not None and not isinstance(value, kind):
            raise InvalidInput(f"expected {name} to be a {kind.__name__}, got {type(value).__name__}")


class _Answer:
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
        self.kkt, self.gap, self.unique = np.full(count, np.nan), np.full(count, np.nan), np.zeros(count, dtype=bool)
        self.shortfalls: dict[int, Shortfall] = {}

    def fill(self, row: int, state: Equilibrium, wanted: _Wanted) -> None:
        """Solve one pose."""
        f0, stress = _tensions(state)
        try:
            missing = self._missing(row, state, wanted, f0)
            if missing is not None:
                self.shortfalls[row] = missing
                self.status[row] = QUERY_STATUS.index("infeasible")
                return
            if wanted.needs_program or (stress.size and not wanted.limits.is_free):
                chosen = _Chosen(*choose(self._pose(row, state, wanted, f0)))
            else:
                chosen = self._choose(row, state, wanted, f0, stress)
        except SolverFailed:
            self.status[row] = QUERY_STATUS.index("not_solved")
            return
        self.f[row], self.g[row], self.kkt[row], self.gap[row], self.unique[row] = chosen
        self.shoulder[row], closure = _apply(state, chosen)
        self.spherical[row] = _apply(state, _Chosen(f0, np.zeros_like(f0)))[0]
        self.on_arm[row] = closure - state.limb_share
        self.on_torso[row] = -closure
        self._certify(row, state, stress)

    def _missing(self, row: int, state: Equilibrium, wanted: _Wanted, f0: FloatArray) -> Shortfall | None:
        """What a pose lacks to be held; without any limit it lacks nothing."""
        if wanted.limits.is_free and (wanted.cone is None or wanted.cone.penalty is not None):
            return None
        return shortfall(self._pose(row, state, wanted, f0))

    def _pose(self, row: int, state: Equilibrium, wanted: _Wanted, f0: FloatArray) -> Pose:
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

    def _choose(self, row: int, state: Equilibrium, wanted: _Wanted, f0: FloatArray, stress: FloatArray) -> _Chosen:
        """f and g of the wanted split. What is open are tensions that balance themselves, and side forces."""
        g = np.zeros_like(f0)
        if wanted.split == "spherical":
            return _Chosen(f0, g)
        own, side = stress.shape[1], state.shoulder_of_g[:, self.upu]
        effect = np.hstack([state.shoulder_of_f @ stress, side])
        constant = state.shoulder + state.shoulder_of_f @ f0
        free = np.full(own, np.inf)
        lower, upper = np.full(len(f0), -np.inf), np.full(len(f0), np.inf)
        if wanted.split == "minimal":
            lower, upper = wanted.side_bounds.at(row, f0)
        low, high = np.concatenate([-free, lower[self.upu]]), np.concatenate([free, upper[self.upu]])
        best = least_force(constant, effect, low, high)
        g[self.upu] = best.variables[own:]
        size = float(np.abs(constant).max()) or 1.0
        gap = size * duality_gap(constant / size, effect, low / size, high / size, best.variables / size)
        return _Chosen(f0 + stress @ best.variables[:own], g, best.residual, gap, best.unique)

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

    def finished(self, query: Query, wanted: _Wanted, trivial: bool) -> Reaction:
        """Shape everything to the caller's stack."""
        shape = query.shape

        def stacked(array: np.ndarray) -> np.ndarray:
            return array.reshape((*shape, *array.shape[1:]))

        arm_force, arm_moment, device = _arm_loads(self.mechanism, query)
        limbs = self.on_arm.sum(axis=1)
        largest = np.maximum(
            np.abs(self.shoulder).max(axis=1), np.abs(self.on_arm[:, :, :3]).max(axis=(1, 2), initial=0.0)
        )
        largest = np.maximum(largest, np.abs(arm_force).max(axis=1))
        miss = np.maximum(
            np.abs(self.shoulder + limbs[:, :3] + arm_force).max(axis=1),
            np.abs(limbs[:, 3:] + arm_moment).max(axis=1) / self.radius,
        )
        residual = np.divide(miss, largest, out=np.where(np.isnan(miss), np.nan, 0.0), where=largest > 0.0)
        size, reference = np.linalg.norm(self.shoulder, axis=1), np.linalg.norm(self.spherical, axis=1)
        nothing = 1e-12 * largest
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(reference > nothing, size / reference, np.where(size > nothing, np.inf, np.nan))
        ratio[np.isnan(size)] = np.nan
        certificate = Certificate(
            stacked(self.undetermined),
            stacked(self.redundant),
            stacked(self.f_unique),
            stacked(self.g_unique),
            stacked(self.shoulder_unique),
            stacked(self.torso_unique),
            _CHOSEN_BY[wanted.split]
            + ("" if wanted.limits.is_free else ", within the limits of the limbs")
            + ("" if wanted.cone is None else ", with regard to the socket"),
        )
        arm = self.mechanism.arm
        weight = None
        if arm is not None and arm.body_mass is not None:
            weight = arm.body_mass * float(np.linalg.norm(self.mechanism.gravity))
        return Reaction(
            shoulder_force=stacked(self.shoulder),
            actuator_forces=stacked(self.f),
            constraint_forces=stacked(self.g),
            limb_wrenches=stacked(self.on_arm),
            cuff_wrench=stacked(limbs + device),
            harness_wrenches=stacked(self.on_torso),
            spherical_force=stacked(self.spherical),
            ratio=stacked(ratio),
            split=wanted.split,
            status=np.array(QUERY_STATUS)[self.status].reshape(shape),
            margin=stacked(self.margin),
            determinant=stacked(self.determinant),
            residual=stacked(residual),
            certificate=certificate,
            body_weight=weight,
            trivial=trivial,
            optimum=Optimum(stacked(self.kkt), stacked(self.gap), stacked(self.unique)),
            infeasibility=(
                Infeasibility.from_rows(shape, self.mechanism.limb_count, self.shortfalls) if self.shortfalls else None
            ),
        )


def _tensions(state: Equilibrium) -> tuple[FloatArray, FloatArray]:
    """Tensions of least norm that balance the moment, and a basis (n, n - 3) of those that balance themselves."""
    A = state.moment_of_f
    n = A.shape[1]
    if n == 3:
        return np.asarray(np.linalg.solve(A, state.moment), dtype=np.float64), np.empty((3, 0))
    U, values, Vt = np.linalg.svd(A)
    return Vt[:3].T @ ((U.T @ state.moment) / values), Vt[3:].T


def _apply(state: Equilibrium, chosen: _Chosen) -> tuple[FloatArray, FloatArray]:
    """F_s, shape (3,), and closure wrenches, shape (n, 6)."""
    closure = state.closure + chosen.f[:, None] * state.closure_of_f + chosen.g[:, None] * state.closure_of_g
    shoulder = state.shoulder + state.shoulder_of_f @ chosen.f + state.shoulder_of_g @ chosen.g
    return shoulder, closure


def _arm_loads(mechanism: Mechanism, query: Query) -> tuple[FloatArray, FloatArray, FloatArray]:
    """What arm and device add to the balance, by Newton and Euler in closed form and not through Pinocchio.

    Returns force (N, 3) and moment (N, 3) about O on the whole arm, load included, and the wrench (N, 6) of the
    device's own parts, without the load.
    """
    arm = mechanism.require_arm("weight")
    nothing = np.zeros_like(query.force)
    force, moment = _carried(arm, mechanism.gravity, query, query.force, query.moment)
    device = np.zeros((len(force), 6))
    for part in arm.parts:
        if part.device:
            device += np.concatenate(_carried(part, mechanism.gravity, query, nothing, nothing), axis=1)
    return force, moment, device


def _carried(
    body: Arm, gravity: FloatArray, query: Query, force: FloatArray, moment: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Weight, inertia and load of a body that turns with the arm: force and moment about O, shape (N, 3) each."""
    total_force, total_moment = np.empty_like(force), np.empty_like(moment)
    inertia = np.zeros((3, 3)) if body.inertia is None else body.inertia_about_origin
    arm_load(
        query.matrices,
        body.mass,
        body.centre_of_mass,
        inertia,
        gravity,
        query.velocity,
        query.acceleration,
        force,
        moment,
        total_force,
        total_moment,
    )
    return total_force, total_moment
