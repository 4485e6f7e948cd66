"""What is made of a reaction on demand: which parts equilibrium alone determines, optimality, closest forces."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.errors.checked import checked
from ...core.results import Result
from ...core.validation import FloatArray, ReadOnly

if TYPE_CHECKING:
    from ..splits.pose_stack import PoseStack
    from ..splits.split import Chosen, Split

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
        determined = np.concatenate([is_determined(effect) for effect in poses.open_effects], axis=1)
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


def is_determined(effect: FloatArray) -> NDArray[np.bool_]:
    """Whether each row of ``effect`` (..., quantities, self-stresses) is zero, to rounding."""
    return np.asarray(np.abs(effect).max(axis=-1, initial=0.0) <= _NO_EFFECT)


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
