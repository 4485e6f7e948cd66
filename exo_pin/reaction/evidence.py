"""What is made of a reaction on demand: what equilibrium determines, optimality, and proof that a pose is not held."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.results import Result
from ..core.validation import FloatArray, ReadOnly

if TYPE_CHECKING:
    from .result import Reaction
    from .splits.pose_stack import PoseStack
    from .splits.split import Chosen, Split


#: Effect of a self-stress on a quantity, relative to the largest, below which the quantity does not change with it.
_NO_EFFECT = 1e-9


@dataclass(frozen=True, eq=False)
class AnswerSource(ReadOnly):
    """An answer and its query, from which certificate, ranges and evidence are computed.

    Attributes
    ----------
    split : Split
        Assumption of the answer.
    poses : PoseStack
        N poses.
    shape : tuple of int
        The stack's shape (...).
    values : ndarray
        f, g and F_s in one row, shape (N, 2 n + 3), N; NaN without an answer.
    chosen : Chosen
        How they were chosen.
    """

    split: Split
    poses: PoseStack
    shape: tuple[int, ...]
    values: FloatArray
    chosen: Chosen

    @property
    def held(self) -> NDArray[np.bool_]:
        """Whether the forces are within the limits of the query, shape (N,); else they are of plain equilibrium."""
        return self.chosen.unmet == 0


@checked
@dataclass(frozen=True, eq=False)
class Certificate(Result, ReadOnly):
    """Which reactions of an answer equilibrium determines, for a pose or a stack of shape (...).

    A reaction is unique if no self-stress of the mechanism (a set of closure and joint forces that balances
    itself) changes it; J. Wojtyra's criterion, Multibody Syst. Dyn. 14 (2005) 23, evaluated on the closure Jacobian of
    the pose.

    Attributes
    ----------
    undetermined : ndarray of int
        Shape (...): number of independent reactions that equilibrium alone does not determine; -1 without an answer.
    redundant_closures : ndarray of int
        Shape (...): rows of the loop closures that repeat others, so that only the sum of their forces is determined.
    actuator_forces : ndarray of bool
        Shape (..., n): whether f_i is unique.
    constraint_forces : ndarray of bool
        Shape (..., n): whether g_i is unique (always true for an SPS limb, which has none).
    shoulder_force : ndarray of bool
        Shape (..., 3): whether each base-frame component of F_s is unique.
    torso_wrench : ndarray of bool
        Shape (...,): whether the total wrench of limbs and shoulder on the torso is unique.
    chosen_by : str
        Assumption by which the others were chosen.
    source : AnswerSource or None
        The answer.
    words : tuple of str
        What f and g are.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> certificate = exo.reaction(exo.pose(30, 30), limits="none").certificate
    >>> int(certificate.undetermined)  # of nine reactions: three side forces and F_s for three equations
    3
    """

    undetermined: NDArray[np.int64]
    redundant_closures: NDArray[np.int64]
    actuator_forces: NDArray[np.bool_]
    constraint_forces: NDArray[np.bool_]
    shoulder_force: NDArray[np.bool_]
    torso_wrench: NDArray[np.bool_]
    chosen_by: str
    source: AnswerSource | None = field(default=None, repr=False)
    words: tuple[str, str] = ("limb forces f", "side forces g")

    def __str__(self) -> str:
        open_ends = bool((self.undetermined > 0).any())
        return f"{self.statement} Assumed: {self.chosen_by}." if open_ends else self.statement

    @property
    def statement(self) -> str:
        """Which reactions equilibrium alone determines, in words."""
        counts = np.unique(self.undetermined[self.undetermined >= 0])
        if counts.size == 0:
            if self.source is not None and any(self.source.poses.lacking):
                return "Data of the device do not cover these poses: nothing is known of the forces."
            return "The arm cannot be held in this pose." if self.undetermined.ndim == 0 else "No pose has a solution."
        if counts.max() == 0:
            return "Equilibrium determines every reaction."
        span = str(counts[0]) if counts.size == 1 else f"{counts[0]} to {counts[-1]}"
        sure: list[str] = []
        open_: list[str] = []
        for name, flags in (
            (self.words[0], self.actuator_forces),
            (self.words[1], self.constraint_forces),
            ("shoulder force F_s", self.shoulder_force),
            ("total wrench on the torso", self.torso_wrench),
        ):
            (sure if flags[self.undetermined >= 0].all() else open_).append(name)
        return (
            f"Equilibrium alone does not determine {span} of the reactions. Determined: {', '.join(sure) or 'none'}. "
            f"Not determined: {', '.join(open_) or 'none'}."
        )


def certificate_of(source: AnswerSource) -> Certificate:
    """Which reactions of an answer change with a self-stress, Wojtyra's criterion."""
    poses, good = source.poses, np.asarray(~np.isnan(source.values).any(axis=1))
    n, stresses = poses.tensions.self_stress.shape[1:]
    moved = None if poses.placed is None else poses.placed.moved
    if moved is None:
        effects = np.concatenate(poses.open_effects, axis=1)
        determined = np.linalg.norm(effects, axis=-1) <= _NO_EFFECT
        undetermined, sides = (
            np.full(len(good), stresses + poses.upu.size),
            np.tile(poses.mechanism.is_upu, (len(good), 1)),
        )
    else:
        # The springs decide these, not equilibrium.
        undetermined, determined = moved.undetermined, moved.determined
        sides = np.arange(n) < (undetermined - stresses)[:, None]

    def stacked(array: np.ndarray) -> np.ndarray:
        return array.reshape((*source.shape, *array.shape[1:]))

    return Certificate(
        stacked(np.where(good, undetermined, -1)),
        stacked(np.where(good, sides.sum(axis=1), -1)),
        stacked(determined[:, :n] & good[:, None]),
        stacked(~sides & good[:, None]),
        stacked(determined[:, n:] & good[:, None]),
        # Arm and torso are a closed system: what limbs and shoulder together put on the torso is fixed by the arm.
        stacked(good),
        source.split.assumed(poses.mechanism)
        + (", within the limits of the limbs" if poses.limits.bound_forces and source.held.any() else "")
        + ("" if poses.socket is None or not source.held.any() else ", with regard to the socket"),
        source,
        poses.mechanism.force_words,
    )


@dataclass(frozen=True, eq=False)
class Optimum(Result, ReadOnly):
    """Optimality of the chosen forces, for a pose or a stack of shape (...).

    Attributes
    ----------
    kkt : ndarray
        Shape (...): largest violation of the optimality conditions, relative to the largest force of the problem;
        0 where there was nothing to choose, NaN without an answer.
    gap : ndarray
        Shape (...), N: duality gap, the most by which the minimised quantity (|F_s| for "minimal" without weights) can
        exceed its least value.
    unique : ndarray of bool
        Shape (...): whether f and g are the only optimal ones. F_s always is for "minimal": its cost is strictly
        convex in it. True is sure, False may be cautious where limits coincide.

    Examples
    --------
    >>> exo = ep.load("four-linear-actuators")
    >>> best = exo.reaction(exo.pose(60, 30), split="minimal").optimum
    >>> bool(best.kkt < 1e-8), bool(best.unique)
    (True, True)
    """

    kkt: FloatArray
    gap: FloatArray
    unique: NDArray[np.bool_]


class Shortfall(NamedTuple):
    """One row of :class:`Infeasibility`, whose attributes after the first are the same, in the same order."""

    f: FloatArray
    g: FloatArray
    shoulder: FloatArray
    missing: FloatArray
    direction: FloatArray
    required: float
    available: float
    valid_up_to: float
    blocking: NDArray[np.int8]
    relief: FloatArray


@checked
@dataclass(frozen=True, eq=False)
class Infeasibility(Result, ReadOnly):
    """Evidence for the poses of a stack of shape (...) that cannot be held; NaN, False or 0 for the others.

    Attributes
    ----------
    infeasible : ndarray of bool
        Shape (...): poses that cannot be held.
    closest_actuator_forces, closest_constraint_forces : ndarray
        Shape (..., n), N: forces within all limits that come closest to equilibrium, in the root of sum of squares
        of what is missing (moments over the largest |B_i|); of several, the shortest.
    closest_shoulder_force : ndarray
        F_s with them, shape (..., 3), N, inside the socket's cone if that is a constraint; then it misses the
        balance of forces by ``missing_wrench``.
    missing_wrench : ndarray
        Shape (..., 6): force (N) and moment about O (N m) on the arm, base frame, that are missing.
        Unique. The force part is zero unless F_s is bound, by the cone or by "standalone".
    direction : ndarray
        Farkas direction y, shape (..., 6), pairing with (force, moment): y · (what limbs and shoulder supply) is at
        most ``available`` within all limits, and balance needs ``required``. The force part
        is dimensionless, the moment part 1/m; scaled to length 1 with moments over the largest |B_i|.
    required, available : ndarray
        Shape (...), N. The first exceeds the second: that is the proof.
    valid_up_to : ndarray
        Shape (...), N. Where a force has no limit, y must not gain by it; rounding may leave 1e-17 N of gain a
        newton, and the proof then covers all forces up to this one. Infinite if there is no such gain.
    blocking : ndarray of int
        Shape (..., n): -1 where the lower limit of f_i blocks, +1 where the upper one does, else 0.
    relief : ndarray
        Shape (..., n), N: by how much this blocking limit alone would have to be relaxed for the pose to be held.
        Infinite where that does not make the pose feasible, or the limit does not block.
    drive_units : tuple of (str, str)
        Name and unit of each effort.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> proof = exo.reaction(exo.pose(30, 30), limits="pull").infeasibility
    >>> bool(proof.required > proof.available)  # N, of Farkas' lemma: no pull of the limbs balances the arm
    True
    >>> proof.blocking.tolist()  # lower limits: these limbs would have to push
    [-1, 0, 0]
    """

    infeasible: NDArray[np.bool_]
    closest_actuator_forces: FloatArray
    closest_constraint_forces: FloatArray
    closest_shoulder_force: FloatArray
    missing_wrench: FloatArray
    direction: FloatArray
    required: FloatArray
    available: FloatArray
    valid_up_to: FloatArray
    blocking: NDArray[np.int8]
    relief: FloatArray
    drive_units: tuple[tuple[str, str], ...]

    def explain(self, index: int | tuple[int, ...] = ()) -> str:
        """Reason in words why a pose cannot be held: what is missing, and which limits block.

        Parameters
        ----------
        index : int or tuple of int
            Of the pose in the stack; empty for a single pose.

        Returns
        -------
        str

        Raises
        ------
        InvalidInput
            If it is the index of more than one pose.

        Examples
        --------
        >>> exo = ep.load("four-cables")
        >>> proof = exo.reaction(exo.pose(60), load=ep.Load([0, 0, -400], at=[0, 0, -0.5])).infeasibility
        >>> print(proof.explain().split(". ")[0] + ".")
        With the best forces within the limits, 73.07 N m about (-0.15, -0.96, 0.24) is missing.
        """
        try:
            pose = self.infeasible[index]
        except IndexError:
            pose = self.infeasible[None]
        if np.ndim(pose):
            raise InvalidInput(
                f"expected the index of one pose of the stack of shape {self.infeasible.shape}, got {index}"
            )
        return " ".join([self._missing(index), *self._blocking(index)]) if pose else "This pose can be held."

    def _missing(self, index: int | tuple[int, ...]) -> str:
        force, moment = self.missing_wrench[index][:3], self.missing_wrench[index][3:]
        lacks = []
        if np.linalg.norm(moment) > 1e-9:
            axis = ", ".join(f"{x:.2f}" for x in moment / np.linalg.norm(moment))
            lacks.append(f"{np.linalg.norm(moment):.2f} N m about ({axis})")
        if np.linalg.norm(force) > 1e-9:
            lacks.append(f"{np.linalg.norm(force):.1f} N of force")
        return f"With the best forces within the limits, {' and '.join(lacks)} is missing."

    def _blocking(self, index: int | tuple[int, ...]) -> list[str]:
        parts, alone = [], 0
        for i in np.flatnonzero(self.blocking[index]):
            which = "least" if self.blocking[index][i] < 0 else "greatest"
            limit = round(float(self.closest_actuator_forces[index][i]), 1) + 0.0  # no "-0.0"
            relief = self.relief[index][i]
            alone += not np.isfinite(relief)
            name, unit = self.drive_units[i]
            name = name.replace("limb ", "Limb ")
            what = "force" if unit == "N" else "moment"
            more = f" (a limit {relief:.1f} {unit} wider would make the pose feasible)" if np.isfinite(relief) else ""
            parts.append(f"{name} is at its {which} {what}, {limit:.1f} {unit}{more}.")
        if alone:
            one = "one of these limits" if alone == len(parts) else "one of the others"
            parts.append(f"Widening {'this limit' if len(parts) == 1 else one} alone does not make the pose feasible.")
        return parts


def infeasibility_of(
    shape: tuple[int, ...], rows: dict[int, Shortfall], drive_units: tuple[tuple[str, str], ...]
) -> Infeasibility:
    """The evidence of a stack, from rows of it, flat, one or more."""
    infeasible = np.zeros(math.prod(shape), dtype=bool)
    infeasible[list(rows)] = True
    arrays = []
    for column in map(np.array, zip(*rows.values(), strict=True)):
        fill = 0 if column.dtype == np.int8 else np.nan
        array = np.full((len(infeasible), *column.shape[1:]), fill, dtype=column.dtype)
        array[list(rows)] = column
        arrays.append(array.reshape((*shape, *column.shape[1:])))
    return Infeasibility(infeasible.reshape(shape), *arrays, drive_units)  # type: ignore[call-arg, arg-type]


class ClosestForces(NamedTuple):
    """Forces within all limits, for a pose or a stack of shape (...).

    Attributes
    ----------
    actuator_forces, constraint_forces : ndarray
        f and g, shape (..., n), N.
    cuff_wrench : ndarray
        Shape (..., 6): force, N, and moment about O, N m, of the cuff on the person's arm, base frame.
    """

    actuator_forces: FloatArray
    constraint_forces: FloatArray
    cuff_wrench: FloatArray


def closest_forces(answer: Reaction) -> ClosestForces:
    """See :attr:`exo_pin.Reaction.closest`."""
    f, g, cuff = (np.array(a) for a in (answer.actuator_forces, answer.constraint_forces, answer.cuff_wrench))
    if answer.infeasibility is not None:
        rows = answer.infeasibility.infeasible
        near = answer.infeasibility
        change_f = np.where(rows[..., None], near.closest_actuator_forces - f, 0.0)
        change_g = np.where(rows[..., None], near.closest_constraint_forces - g, 0.0)
        f, g = f + change_f, g + change_g
        flat = (a.reshape(-1, a.shape[-1]) for a in (change_f, change_g))
        cuff = cuff + answer.source.poses.state.on_arm_of(*flat).sum(axis=-2).reshape(cuff.shape)
    # Where nothing was found within the limits there is nothing to give.
    evidence = False if answer.infeasibility is None else answer.infeasibility.infeasible
    lost = ~answer.held & (np.nan_to_num(answer.limits.force_error) != 0.0).any(axis=-1) & ~np.asarray(evidence)
    for force in (f, g, cuff):
        force[lost] = np.nan
    return ClosestForces(f, g, cuff)
