"""From the equilibrium of a stack of poses to an answer: forces chosen once a pose, within all limits.

A pose keeps the forces that its split takes without limits if these meet the limits. Otherwise other tensions are
chosen where the split leaves a choice. A pose in which nothing meets the limits gets the forces of plain equilibrium,
those that would be needed, and the reason: "out_of_stroke", "beyond_limits" (equilibrium determines the forces) or
"infeasible" (they can be chosen, and no choice will do).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..core.compiled import kernel
from ..core.errors import SolverFailed
from ..core.progress import track
from ..core.validation import FloatArray
from ..load_case.case import Case
from ..wrist.limbs import STATUS
from .evidence import AnswerSource
from .holding.infeasible_poses import clearly_infeasible, is_held
from .result import Reaction
from .splits.limb_and_side_forces import choose
from .splits.pose_stack import PoseStack
from .splits.split import Chosen, Split

if TYPE_CHECKING:
    from .assumptions import Assumptions

#: Status codes of the closed form, those of elastic devices, why limits are not met, and that data do not cover a pose.
QUERY_STATUS = (
    *STATUS, "no_equilibrium", "guide_overloaded", "infeasible", "out_of_stroke", "beyond_limits", "out_of_reach",
    "beyond_singular", "not_evaluated",
)  # fmt: skip

_NAMES = np.array(QUERY_STATUS)
#: Of these, why known limits are not met; equilibrium has an answer.
BEYOND = ("infeasible", "out_of_stroke", "beyond_limits")
_SINGULAR, _NOT_SOLVED, _INFEASIBLE, _OUT_OF_STROKE, _BEYOND = (
    QUERY_STATUS.index(name) for name in ("singular", "not_solved", "infeasible", "out_of_stroke", "beyond_limits")
)

#: Standard gravity for the weight of a person, m/s²; it does not depend on the gravity of the design.
STANDARD_GRAVITY = 9.81


def answered(status: NDArray[np.int8]) -> NDArray[np.intp]:
    """Rows that have an equilibrium."""
    return (status < _SINGULAR).nonzero()[0]


def answer(
    case: Case,
    assumptions: Assumptions,
    poses: PoseStack,
    arm: tuple[FloatArray, FloatArray, FloatArray],
    progress: bool = False,
) -> Reaction:
    """Choose f and g of all poses and return what follows from them.

    Parameters
    ----------
    case, assumptions : Case, Assumptions
        The question.
    poses : PoseStack
        Equilibrium and limits of N poses; their status is changed where a pose has no answer.
    arm : tuple of ndarray
        What :func:`exo_pin.load_case.pose_stacks.arm_loads` returns.
    progress : bool
        Whether to show a progress bar.
    """
    split, shape = assumptions.law, case.poses.shape
    chosen = chosen_forces(split, poses, progress)
    f, g, state, status, owner = chosen.f, chosen.g, poses.state, poses.status, poses.mechanism.arm
    shoulder, (on_arm, on_torso) = state.shoulder_force(f, g), state.wrenches(f, g)
    rows = answered(status)
    # Of limbs that carry no side force and of undisplaced parts.
    spherical = poses.tensions.shoulder if poses.moved is None else poses.moved.unmoved
    spherical = np.where((status < _SINGULAR)[:, None], spherical, np.nan)
    limbs = on_arm.sum(axis=1)
    residual = np.empty(len(status))
    moment = arm[1] + poses.mechanism.moment_of_wearer(f)  # type: ignore[attr-defined]
    _balance_residual(shoulder, on_arm, arm[0], moment, poses.mechanism.radius, residual)

    def stacked(array: np.ndarray) -> np.ndarray:
        return array.reshape((*shape, *array.shape[1:]))

    return Reaction(
        shoulder_force=stacked(shoulder),
        actuator_forces=stacked(f),
        constraint_forces=stacked(g),
        limb_wrenches=stacked(on_arm),
        cuff_wrench=stacked(limbs + arm[2]),
        harness_wrenches=stacked(on_torso),
        spherical_force=stacked(spherical),
        split=split.name,
        case=case,
        assumptions=assumptions,
        equilibrium_status=stacked(_NAMES[status]),
        margin=stacked(poses.margin),
        determinant=stacked(poses.determinant),
        residual=stacked(residual),
        status=stacked(_NAMES[np.where(chosen.unmet > 0, chosen.unmet, status)]),
        source=AnswerSource(split, poses, shape, np.concatenate([f, g, shoulder], axis=1), chosen),
        body_weight=None if owner is None or owner.body_mass is None else owner.body_mass * STANDARD_GRAVITY,
        trivial=bool(rows.size and chosen.trivial[rows].all()),
        **{name: stacked(value) for name, value in split.extras(poses, chosen).items()},
    )


@kernel(stack=True)
def _balance_residual(shoulder: Any, on_arm: Any, force: Any, moment: Any, radius: float, residual: Any) -> None:
    """Fill the error of the force and moment balance of the arm, relative to the largest force, shape (N,)."""
    for k in range(shoulder.shape[0]):
        largest = miss = 0.0
        for e in range(3):
            total, turning = shoulder[k, e] + force[k, e], moment[k, e]
            largest = max(largest, abs(shoulder[k, e]), abs(force[k, e]))
            for i in range(on_arm.shape[1]):
                total += on_arm[k, i, e]
                turning += on_arm[k, i, 3 + e]
                largest = max(largest, abs(on_arm[k, i, e]))
            # A sum that is NaN makes the residual NaN, which max() would drop.
            miss = miss + np.nan if total + turning != total + turning else max(miss, abs(total), abs(turning) / radius)
        residual[k] = miss / largest if largest > 0.0 else miss


def chosen_forces(split: Split, poses: PoseStack, progress: bool = False) -> Chosen:
    """Choose f and g of all poses.

    Parameters
    ----------
    split : Split
        Chooses what equilibrium does not determine.
    poses : PoseStack
        Equilibrium and limits of N poses; their status is changed where a pose has no answer.
    progress : bool
        Whether to show a progress bar.
    """
    chosen, limits = Chosen(poses.status, poses.tensions.f.shape[1]), poses.limits
    split.judge(poses, answered(poses.status), chosen)
    rows = answered(poses.status)
    if limits.asked:
        chosen.unmet[rows[~limits.slow_enough[rows]]] = _BEYOND
        chosen.unmet[rows[~limits.reachable[rows]]] = _OUT_OF_STROKE
        if poses.moved is not None:
            chosen.unmet[rows[poses.moved.infeasible[rows]]] = _INFEASIBLE
    held = rows[chosen.unmet[rows] == 0]
    if held.size:
        _choose(split, poses, held, chosen, progress)
    lost = rows[chosen.unmet[rows] != 0]
    if lost.size:
        chosen.put_determined(lost, *split.plain(poses, lost))
    _mark_non_finite(chosen)
    return chosen


def _choose(split: Split, poses: PoseStack, rows: NDArray[np.intp], chosen: Chosen, progress: bool) -> None:
    """Fill the poses that can be held, and mark the others."""
    if poses.socket is None and poses.weights is None and not poses.side_bounds.by_tension:
        split.choose(poses, rows, chosen)
        if not poses.limits.bound_forces:
            return
        # A pose without a solution is not finite and is marked later.
        rows = rows[~poses.limits.met(chosen.f[rows], rows) & (poses.status[rows] < _SINGULAR)]
        if not rows.size:
            return
        if not split.chooses_tensions or _is_determined(split, poses):
            chosen.unmet[rows] = _BEYOND
            return
        rows = split.choose_within(poses, rows, chosen)
        if rows.size and _moments_decide(split, poses, int(rows[0])):
            lost = clearly_infeasible(poses, rows)
            chosen.unmet[rows[lost]] = _INFEASIBLE
            rows = rows[~lost]
    for row in track(rows.tolist(), "limits", progress) if rows.size else ():
        try:
            program = split.program(poses, row)
            if is_held(program):
                chosen.put(row, choose(program))
            else:
                chosen.unmet[row] = _INFEASIBLE
        except SolverFailed:
            chosen.status[row] = _NOT_SOLVED


def _moments_decide(split: Split, poses: PoseStack, row: int) -> bool:
    """Whether a pose is held if and only if tensions within their limits make its moments."""
    program = split.program(poses, row)
    return not (program.alone or program.follower is not None or poses.state.moment_of_g[..., poses.upu].any())


def _is_determined(split: Split, poses: PoseStack) -> bool:
    """Whether only one f balances the arm."""
    loaded = split.chooses_sides and bool(poses.state.moment_of_g[..., poses.upu].any())
    return poses.tensions.f.shape[1] == poses.state.moment.shape[1] and not loaded


def _mark_non_finite(chosen: Chosen) -> None:
    """Mark rows that overflowed as not solved, and set rows without an answer to NaN."""
    if np.isfinite(chosen.f.sum() + chosen.g.sum()) and (chosen.status < _SINGULAR).all():
        return
    finite = np.isfinite(chosen.f).all(axis=1) & np.isfinite(chosen.g).all(axis=1)
    chosen.status[~finite & (chosen.status < _SINGULAR)] = _NOT_SOLVED
    empty = chosen.status >= _SINGULAR
    for array in (chosen.f, chosen.g, chosen.kkt, chosen.gap):
        array[empty] = np.nan
    chosen.unique[empty] = False
    chosen.unmet[empty] = 0
