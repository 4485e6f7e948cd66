"""The interface of a split, the assumption on forces that equilibrium alone does not determine, and the rigid ones.

Split "minimal": the side forces within their bounds that make the shoulder force least.

Split "standalone": the wrist without a shoulder, F_s = 0, (D-25).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.compiled import kernel
from ...core.errors import InvalidInput, SolverFailed
from ...core.validation import FloatArray
from ...design import Mechanism
from ...numerics.bounded.box_program import least_force, least_forces
from ...numerics.bounded.polytope_program import FEW, least_sum_force
from ...numerics.quadratic import LeastSquares, judged
from ...numerics.vectors import NEAR_MARGIN, SINGULAR_MARGIN
from ...wrist.limbs import STATUS
from .limb_and_side_forces import Choice, PoseProgram, choose
from .pose_stack import PoseStack

#: Distance from a limit, relative to the largest tension, below which a tension is on it: rounding.
_ON_LIMIT = 1e-10
#: Imbalance, relative to the largest tension, above which the pose is left to a program, a tenth of the answer's own.
_EXACT = 1e-10


class Split(ABC):
    """A way to choose what equilibrium does not determine: tensions that balance themselves, and side forces.

    A class of your own, passed as ``split=`` as an instance, works like those that come with the package: give it a
    name, an assumption and a program. Only derivatives and worst cases are of known equations, and
    refuse it.

    Attributes
    ----------
    name : str
        Name of the split.
    assumption : str
        The assumption in words, for the certificate.
    criterion : str
        By what one of many sets of forces is chosen, in words; empty where nothing is left to choose.
    options : frozenset of str
        Those of "constraint_bounds", "weights" and "cone" that it supports.
    refusals : dict of str to str
        Reason why it does not support an option, where physics gives one.
    chooses_tensions : bool
        Whether tensions that equilibrium does not determine can be chosen within limits; otherwise these are checked.
    chooses_sides : bool
        Whether it chooses g together with f, so that the moment balance may leave f free with three limbs.
    determines_sides : bool
        Whether it determines g by physics and not by a choice.
    moves : bool
        Whether forces are those of a displaced geometry: :class:`.Elastic` and its children.

    Examples
    --------
    >>> class Twisted(ep.reaction.Split):
    ...     name, assumption = "twisted", "a side force of 3 N in every limb"
    ...
    ...     def choose(self, poses, rows, answer):
    ...         answer.put_determined(rows, poses.tensions.f[rows], np.full_like(poses.tensions.f[rows], 3.0))
    ...
    ...     def program(self, poses, row):
    ...         three = np.full(poses.upu.size, 3.0)
    ...         return poses.program(row, g_low=three, g_high=three, upu=poses.upu)
    >>> exo = ep.load("prototype")
    >>> exo.reaction(exo.pose(30, 30), split=Twisted(), limits="none").constraint_forces
    array([3., 3., 3.])
    """

    name: ClassVar[str]
    assumption: ClassVar[str]
    criterion: ClassVar[str] = ""
    options: ClassVar[frozenset[str]] = frozenset()
    refusals: ClassVar[dict[str, str]] = {}
    chooses_sides: ClassVar[bool] = False
    determines_sides: ClassVar[bool] = False
    moves: ClassVar[bool] = False
    chooses_tensions: bool = True

    def caption(self, mechanism: Mechanism) -> str:
        """The assumption in a few words, for pictures."""
        return self.assumption

    def assumed(self, mechanism: Mechanism) -> str:
        """The assumption in words, for this device."""
        return self.assumption

    def check(self, mechanism: Mechanism) -> None:  # noqa: B027 - most have nothing to check
        """Raise if the split does not apply to a design."""

    def offsets(self, matrices: FloatArray, base: FloatArray, cuff: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Centre offsets of base and cuff that count, shape (N, 3) each, m."""
        return base, cuff

    @abstractmethod
    def program(self, poses: PoseStack, row: int) -> PoseProgram:
        """The program of one pose within its limits."""

    def choose(self, poses: PoseStack, rows: NDArray[np.intp], answer: Chosen) -> None:
        """Fill f and g of some poses as they are without limits of f, cone and weights: those of plain equilibrium."""
        answer.put_determined(rows, *self.plain(poses, rows))

    def plain(self, poses: PoseStack, rows: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
        """f and g of plain equilibrium, shape (k, n), N: what would be needed in poses that cannot be held.

        Tensions of least norm and no side forces, unless the split determines them.
        """
        f = poses.tensions.f[rows]
        return f, np.zeros_like(f)

    def choose_within(self, poses: PoseStack, rows: NDArray[np.intp], answer: Chosen) -> NDArray[np.intp]:
        """Fill poses whose forces within limits of f alone need no program; return the rows that are left."""
        return rows

    def judged(self, poses: PoseStack, row: int, f: FloatArray, g: FloatArray) -> Choice:
        """Optimality of forces of one pose that :meth:`choose_within` left unjudged."""
        raise NotImplementedError(type(self).__name__)

    def judge(self, poses: PoseStack, rows: NDArray[np.intp], answer: Chosen) -> None:  # noqa: B027 - most need not
        """Mark poses that are singular for this split alone."""

    def extras(self, poses: PoseStack, answer: Chosen) -> dict[str, FloatArray]:
        """Further fields of the result, poses along the first axis."""
        return {}


class Chosen:
    """Forces of N poses while they are chosen.

    Attributes
    ----------
    status : ndarray of int8
        Index into :data:`exo_pin.reaction.answer.QUERY_STATUS`: whether equilibrium has an answer.
    unmet : ndarray of int8
        Shape (N,): 0 where all known limits are met, else why not, as an index into the same.
    f, g : ndarray
        Shape (N, n), N.
    kkt, gap, unique, trivial : ndarray
        Shape (N,), see :class:`exo_pin.reaction.Optimum` and :class:`exo_pin.Reaction`.
    unjudged : ndarray of bool
        Shape (N,): poses whose optimality is computed on demand, by :meth:`Split.judged`.
    """

    def __init__(self, status: NDArray[np.int8], n: int) -> None:
        count = len(status)
        self.status, self.unmet = status, np.zeros(count, dtype=np.int8)
        self.f, self.g = np.full((2, count, n), np.nan)
        self.kkt, self.gap = np.full((2, count), np.nan)
        self.unique, self.trivial, self.unjudged = np.zeros((3, count), dtype=bool)

    def put(self, row: int, choice: Choice) -> None:
        """Fill one pose."""
        self.f[row], self.g[row], self.kkt[row], self.gap[row], self.unique[row] = choice

    def put_least_force(self, split: Split, poses: PoseStack, row: int, lower: FloatArray, upper: FloatArray) -> None:
        """Fill one pose with the forces of least |F_s|, of several with those of least sum of squares of f and g.

        ``lower`` and ``upper`` bound what :meth:`PoseStack.effect` multiplies.
        """
        try:
            if poses.state.moment_of_g[row][:, poses.upu].any():
                # Side forces load the tensions: the least self-balancing part is not the least sum of squares.
                free = np.full(self.f.shape[1], np.inf)
                self.put(row, choose(split.program(poses, row)._replace(f_low=-free, f_high=free)))
                return
            best = least_force(poses.tensions.shoulder[row], poses.effect(row), lower, upper)
        except SolverFailed:
            self.status[row] = STATUS.index("not_solved")
            return
        self.put(row, Choice(*poses.forces(row, best.variables), best.residual, best.gap, best.unique))

    def put_determined(self, rows: NDArray[np.intp], f: FloatArray, g: FloatArray) -> None:
        """Fill poses without a choice, shapes (k, n)."""
        self.f[rows], self.g[rows] = f, g
        self.kkt[rows] = self.gap[rows] = 0.0
        self.unique[rows] = True


def shortest_tensions(
    f: FloatArray, self_stress: FloatArray, lower: FloatArray, upper: FloatArray, scales: FloatArray | None = None
) -> FloatArray:
    """The f + N y of least norm within limits, shape (M, n), N; NaN where there is none, or rounding decides.

    Parameters
    ----------
    f, lower, upper : ndarray
        Tensions that balance M poses, and limits, shape (M, n), N.
    self_stress : ndarray
        N, tensions that balance themselves, shape (M, n, m), columns orthonormal once divided by ``scales``.
    scales : ndarray, optional
        What each tension is divided by in the norm, shape (n,).
    """
    if scales is not None:
        parts = f / scales, self_stress / scales[:, None], lower / scales, upper / scales
        return np.clip(scales * shortest_tensions(*parts), lower, upper)
    out = np.full_like(f, np.nan)
    if self_stress.shape[2] <= FEW:
        shortest_within(f, np.ascontiguousarray(self_stress), lower, upper, out)
        return np.clip(out, lower, upper)
    # What self-stress cannot change has three components: the shortest of the tensions in a box that give them.
    carried = np.swapaxes(np.linalg.svd(self_stress)[0][..., self_stress.shape[2] :], 1, 2)
    wanted = (carried @ f[..., None])[..., 0]
    nearest = least_forces(-wanted, carried, lower, upper)
    held = np.abs(nearest.forces).max(axis=1) <= _EXACT * np.abs(wanted).max(axis=1)
    out[held] = nearest.variables[held]
    return out


@kernel(stack=True)
def shortest_within(f: Any, N: Any, low: Any, high: Any, out: Any) -> None:
    """Write the f + N z of least norm within the limits, row by row; rows without one are not written.

    |f + N z|² and |Nᵀ f + z|² differ by a constant, because the columns of N are orthonormal.

    Parameters
    ----------
    f, low, high : ndarray
        Shape (M, n), N.
    N : ndarray
        Shape (M, n, m), m = 1, 2 or 3, columns orthonormal.
    out : ndarray
        Shape (M, n), N.
    """
    n, m = N.shape[1:]
    c, G, z = np.zeros(3), np.zeros((3, m)), np.empty(m)
    for j in range(m):
        G[j, j] = 1.0
    for k in range(N.shape[0]):
        for j in range(m):
            c[j] = 0.0
            for i in range(n):
                c[j] += N[k, i, j] * f[k, i]
        if least_sum_force(c, G, f[k], N[k], low[k], high[k], z):
            for i in range(n):
                out[k, i] = f[k, i]
                for j in range(m):
                    out[k, i] += N[k, i, j] * z[j]


class Spherical(Split):
    """g = 0, as for bare pneumatic muscles; of tensions that balance themselves, those of least norm."""

    name = "spherical"
    assumption = "limbs that carry no side force (g = 0)"
    criterion = "least sum of squares of the tensions"
    options = frozenset({"cone"})

    def caption(self, mechanism: Mechanism) -> str:
        """The assumption in a few words."""
        if not mechanism.has_limbs:
            return "the cuff puts no more couple on the arm than equilibrium needs"
        return "limbs carry no side force"

    def assumed(self, mechanism: Mechanism) -> str:
        """The assumption in words: of limbs, or of the cuff of any other device."""
        if mechanism.has_limbs:
            return self.assumption
        return "a cuff that puts no couple on the arm beyond what equilibrium needs (g = 0)"

    def program(self, poses: PoseStack, row: int) -> PoseProgram:
        """Tensions of least norm within their limits."""
        return poses.program(row)

    def choose_within(self, poses: PoseStack, rows: NDArray[np.intp], answer: Chosen) -> NDArray[np.intp]:
        """Tensions of least norm within their limits.

        Left are poses that cannot be held, or so nearly that rounding decides.
        """
        own = poses.tensions
        if not own.self_stress.shape[2]:
            return rows
        low, high = poses.limits.lower[rows], poses.limits.upper[rows]
        scales = None if poses.sharing is None else poses.sharing.scales
        f = shortest_tensions(own.f[rows], own.self_stress[rows], low, high, scales)
        scale = np.maximum(np.abs(f).max(axis=1), 1e-300)
        miss = (poses.state.moment_of_f[rows] @ f[..., None])[..., 0] - poses.state.moment[rows]
        # Also False where there are none.
        good = np.abs(miss).max(axis=1) <= _EXACT * poses.mechanism.radius * scale
        answer.put_determined(rows[good], f[good], np.zeros_like(f[good]))
        answer.unjudged[rows[good]] = True
        return rows[~good]

    def judged(self, poses: PoseStack, row: int, f: FloatArray, g: FloatArray) -> Choice:
        """Optimality of tensions within their limits."""
        scale = float(np.abs(f).max(initial=0.0)) or 1.0
        z, low, high = (part / scale for part in (f, poses.limits.lower[row], poses.limits.upper[row]))
        radius = poses.mechanism.radius
        A, b = poses.state.moment_of_f[row] / radius, poses.state.moment[row] / (radius * scale)
        if poses.scales is not None:
            z, low, high, A = z / poses.scales, low / poses.scales, high / poses.scales, A * poses.scales
        n, free = len(z), (low + _ON_LIMIT < z) & (z < high - _ON_LIMIT)
        program = LeastSquares(np.eye(n), np.zeros(n), A, b, low, high, np.empty((0, n)), np.empty(0))
        multipliers = -np.linalg.lstsq(A[:, free].T, z[free], rcond=None)[0]
        solution = judged(program, z, multipliers, np.empty(0))
        return Choice(f, g, solution.kkt, solution.residual_gap * scale, solution.unique)


#: Ratio of singular values below which the unbounded forces do not produce every shoulder force.
_REACHES = 1e-9


def is_trivial(effect: FloatArray, lower: FloatArray, upper: FloatArray) -> bool:
    """Whether the unbounded forces produce every shoulder force, so that the least one is zero by construction.

    Parameters
    ----------
    effect : ndarray
        Shoulder force per N of each free force, shape (3, m).
    lower, upper : ndarray
        Bounds, shape (m,), N.
    """
    free = effect[:, np.isinf(lower) & np.isinf(upper)]
    if free.shape[1] < 3:
        return False
    values = np.linalg.svd(free, compute_uv=False)
    return bool(values[2] > _REACHES * values[0])


class Minimal(Split):
    """The f and g of least |F_s|: a lower bound over all side forces. A real device is above it."""

    name = "minimal"
    assumption = "the side forces within their bounds that make the shoulder force least"
    criterion = "least |F_s|; of several sets that of least sum of squares of tensions and side forces"
    options = frozenset({"constraint_bounds", "weights", "cone"})
    chooses_sides = True

    def caption(self, mechanism: Mechanism) -> str:
        """The assumption in a few words."""
        if not mechanism.is_upu.any():
            return "of the limb forces that hold the arm, those of least |F_s|"
        return "lower bound of |F_s| over the side forces within their limits"

    def program(self, poses: PoseStack, row: int) -> PoseProgram:
        """Least F_s, as weighted, within all limits."""
        weights, pose = poses.weights, Rotation.from_matrix(poses.matrices[row])
        low, high = poses.side_bounds.at(row, poses.tensions.f[row])
        return poses.program(
            row,
            g_low=low[poses.upu],
            g_high=high[poses.upu],
            upu=poses.upu,
            by_actuator=poses.side_bounds.by_tension,
            goal=np.eye(3) if weights is None else weights.root(poses.mechanism.side, pose),
            tension=0.0 if weights is None else weights.tension,
        )

    def choose(self, poses: PoseStack, rows: NDArray[np.intp], answer: Chosen) -> None:
        """Least |F_s| within the bounds of g."""
        free = np.full(poses.tensions.self_stress.shape[2], np.inf)
        # Tensions that actuators choose within limits cannot produce every force.
        known = np.zeros_like(free) if poses.limits.bound_forces else free
        for row in rows.tolist():
            low, high = (ends[poses.upu] for ends in poses.side_bounds.at(row, poses.tensions.f[row]))
            effect = poses.effect(row)
            answer.trivial[row] = is_trivial(effect, np.concatenate([-known, low]), np.concatenate([known, high]))
            answer.put_least_force(self, poses, row, np.concatenate([-free, low]), np.concatenate([free, high]))


class Standalone(Split):
    """A shoulder that carries nothing: tensions and side forces hold all six components of the arm.

    There is no shoulder centre: the device turns about its own centre, which the seat of the cuff determines.
    """

    name = "standalone"
    assumption = "a shoulder that carries nothing (F_s = 0)"
    criterion = "least sum of squares of tensions and side forces"
    refusals: ClassVar = {"cone": 'a glenoid cone bounds F_s, which split="standalone" sets to zero'}
    chooses_sides = True

    def caption(self, mechanism: Mechanism) -> str:
        """The assumption in a few words."""
        return "wrist without a shoulder joint"

    def check(self, mechanism: Mechanism) -> None:
        """Raise unless tensions (one a limb) and side forces (one a UPU limb) can hold six components."""
        sides = int(mechanism.is_upu.sum())
        if mechanism.limb_count + sides < 6:
            raise InvalidInput(
                f"without a shoulder the limbs must hold six components, and {mechanism.limb_count} tensions with "
                f"{sides} side forces of UPU limbs are too few: use more limbs or more UPU limbs"
            )

    def offsets(self, matrices: FloatArray, base: FloatArray, cuff: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Without a ball joint the two centres of the device stay together, and only the cuff's seat counts."""
        return np.einsum("kij,kj->ki", matrices, cuff), cuff

    def program(self, poses: PoseStack, row: int) -> PoseProgram:
        """The shortest forces with F_s = 0 within the limits of f."""
        free = np.full(poses.upu.size, np.inf)
        return poses.program(row, g_low=-free, g_high=free, upu=poses.upu, alone=True)

    def choose(self, poses: PoseStack, rows: NDArray[np.intp], answer: Chosen) -> None:
        """The shortest forces with F_s = 0."""
        free = np.full(poses.tensions.self_stress.shape[2] + poses.upu.size, np.inf)
        for row in rows.tolist():
            answer.put_least_force(self, poses, row, -free, free)

    def judge(self, poses: PoseStack, rows: NDArray[np.intp], answer: Chosen) -> None:
        """Mark poses that are singular, or nearly, for limbs without a shoulder.

        The measure is the smallest singular value of the effect of undetermined forces on the shoulder force:
        dimensionless, N of force at O per N of limb force. ``margin`` remains that of the moments.
        """
        for row in rows.tolist():
            effect = poses.effect(row)
            reach = float(np.linalg.svd(effect, compute_uv=False)[-1]) if effect.shape[1] >= 3 else 0.0
            if reach < SINGULAR_MARGIN:
                answer.status[row] = STATUS.index("singular")
            elif reach < NEAR_MARGIN:
                answer.status[row] = STATUS.index("near_singular")
