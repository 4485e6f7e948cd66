"""From the equilibrium of a stack of poses to an answer: forces chosen by a split within all limits, and checked."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.compiled import kernel
from ..core.errors import SolverFailed
from ..core.progress import track
from ..core.validation import FloatArray
from ..wrist.limbs import STATUS
from .indeterminacy.component_assumptions import ComponentSource
from .indeterminacy.infeasibility import Infeasibility, Shortfall
from .indeterminacy.infeasible_poses import shortfall
from .result import Optimum, Reaction
from .splits.limb_and_side_forces import choose
from .splits.split import Chosen, PoseStack, Split

__all__ = ["QUERY_STATUS", "STANDARD_GRAVITY", "answer", "answered"]

#: Status codes of the closed form, then those of queries with limits and of elastic devices.
QUERY_STATUS = (*STATUS, "infeasible", "out_of_stroke", "no_equilibrium", "guide_overloaded")
_NAMES = np.array(QUERY_STATUS)
_SINGULAR, _NOT_SOLVED, _INFEASIBLE = (QUERY_STATUS.index(name) for name in ("singular", "not_solved", "infeasible"))

#: Standard gravity for the weight of a person, m/s²; it does not depend on the gravity of the design.
STANDARD_GRAVITY = 9.81


def answered(status: NDArray[np.int8]) -> NDArray[np.intp]:
    """Rows that have an answer."""
    return (status < _SINGULAR).nonzero()[0]


def answer(
    split: Split,
    poses: PoseStack,
    shape: tuple[int, ...],
    arm: tuple[FloatArray, FloatArray, FloatArray],
    progress: bool = False,
) -> Reaction:
    """Choose f and g of all poses and return what follows from them.

    Parameters
    ----------
    split : Split
        Chooses what equilibrium does not determine.
    poses : PoseStack
        Equilibrium and limits of N poses; their status is changed where a pose has no answer.
    shape : tuple of int
        The caller's stack.
    arm : tuple of ndarray
        What :func:`exo_pin.load_case.pose_stacks.arm_loads` returns.
    progress : bool
        Whether to show a progress bar.
    """
    chosen, rows = Chosen(poses.status, poses.tensions.f.shape[1]), answered(poses.status)
    if poses.limits is not None and poses.socket is None:
        rows = split.choose_within(poses, rows, chosen)
    missing = _choose(split, poses, rows, chosen, progress) if rows.size else {}
    _mark_non_finite(chosen)
    f, g, state, status, owner = chosen.f, chosen.g, poses.state, poses.status, poses.mechanism.arm
    closure = state.closures(f, g)
    shoulder, on_arm = state.shoulder_force(f, g), closure - state.limb_share
    spherical, rows = poses.spherical_force, answered(status)
    if len(rows) < len(status):
        spherical = np.where((status < _SINGULAR)[:, None], spherical, np.nan)
    limbs = on_arm.sum(axis=1)
    residual = np.empty(len(status))
    _balance_residual(shoulder, on_arm, *arm[:2], poses.radius, residual)

    def stacked(array: np.ndarray) -> np.ndarray:
        return array.reshape((*shape, *array.shape[1:]))

    return Reaction(
        shoulder_force=stacked(shoulder),
        actuator_forces=stacked(f),
        constraint_forces=stacked(g),
        limb_wrenches=stacked(on_arm),
        cuff_wrench=stacked(limbs + arm[2]),
        harness_wrenches=stacked(-closure),
        spherical_force=stacked(spherical),
        split=split.name,
        equilibrium_status=stacked(_NAMES[status]),
        margin=stacked(poses.margin),
        determinant=stacked(poses.determinant),
        residual=stacked(residual),
        source=ComponentSource(split, poses, shape, np.concatenate([f, g, shoulder], axis=1)),
        body_weight=None if owner is None or owner.body_mass is None else owner.body_mass * STANDARD_GRAVITY,
        trivial=bool(rows.size and chosen.trivial[rows].all()),
        optimum=Optimum(stacked(chosen.kkt), stacked(chosen.gap), stacked(chosen.unique)),
        infeasibility=Infeasibility.from_rows(shape, missing) if missing else None,
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


def _choose(
    split: Split, poses: PoseStack, rows: NDArray[np.intp], chosen: Chosen, progress: bool
) -> dict[int, Shortfall]:
    """Fill some poses; return what is missing in those that cannot be held."""
    status, missing = chosen.status, dict[int, Shortfall]()
    hard = poses.socket is not None and poses.socket.is_hard
    if hard or poses.limits is not None:
        missing = _shortfalls(split, poses, rows, status, progress)
    split.judge(poses, rows[status[rows] < _SINGULAR], chosen)
    rows = rows[status[rows] < _SINGULAR]
    if poses.socket is None and poses.weights is None and _is_determined(split, poses):
        split.choose(poses, rows, chosen)
        return missing
    for row in track(rows.tolist(), "limits", progress):
        try:
            chosen.put(row, choose(split.program(poses, row)))
        except SolverFailed:
            status[row] = _NOT_SOLVED
    return missing


def _is_determined(split: Split, poses: PoseStack) -> bool:
    """Whether nothing is to be chosen: there are no limits of f, or only one f balances the arm."""
    if poses.limits is None:
        return True
    loaded = split.chooses_sides and bool(poses.state.moment_of_g[..., poses.upu].any())
    return poses.mechanism.limb_count == 3 and not loaded and not poses.side_bounds.by_tension


def _shortfalls(
    split: Split, poses: PoseStack, rows: NDArray[np.intp], status: NDArray[np.int8], progress: bool
) -> dict[int, Shortfall]:
    """What is missing in the poses that cannot be held; marks them."""
    found: dict[int, Shortfall] = {}
    for row in track(rows.tolist(), "feasibility", progress):
        try:
            missing = shortfall(split.program(poses, row))
        except SolverFailed:
            status[row] = _NOT_SOLVED
            continue
        if missing is not None:
            found[row] = missing
            status[row] = _INFEASIBLE
    return found


def _mark_non_finite(chosen: Chosen) -> None:
    """Mark rows that overflowed as not solved, and set rows without an answer to NaN."""
    if np.isfinite(chosen.f.sum() + chosen.g.sum()):
        return
    finite = np.isfinite(chosen.f).all(axis=1) & np.isfinite(chosen.g).all(axis=1)
    chosen.status[~finite & (chosen.status < _SINGULAR)] = _NOT_SOLVED
    empty = chosen.status >= _SINGULAR
    for array in (chosen.f, chosen.g, chosen.kkt, chosen.gap):
        array[empty] = np.nan
    chosen.unique[empty] = False
