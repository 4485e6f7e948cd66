"""The choice of forces in every pose: once, within all limits where that is possible.

A pose keeps the forces that its split takes without limits if these meet the limits. Otherwise other tensions are
chosen where the split leaves a choice. A pose in which nothing meets the limits gets the forces of plain equilibrium,
those that would be needed, and the reason: "out_of_stroke", "beyond_limits" (equilibrium determines the forces) or
"infeasible" (they can be chosen, and no choice will do).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..core.errors import SolverFailed
from ..core.progress import track
from .holding.infeasible_poses import is_held
from .query_status import QUERY_STATUS, answered
from .splits.limb_and_side_forces import choose
from .splits.split import Chosen, PoseStack, Split

__all__ = ["chosen_forces"]

_SINGULAR, _NOT_SOLVED, _INFEASIBLE, _OUT_OF_STROKE, _BEYOND = (
    QUERY_STATUS.index(name) for name in ("singular", "not_solved", "infeasible", "out_of_stroke", "beyond_limits")
)


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
        chosen.unmet[rows[~limits.reachable[rows]]] = _OUT_OF_STROKE
        if poses.infeasible is not None:
            chosen.unmet[rows[poses.infeasible[rows]]] = _INFEASIBLE
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
    for row in track(rows.tolist(), "limits", progress):
        try:
            program = split.program(poses, row)
            if is_held(program):
                chosen.put(row, choose(program))
            else:
                chosen.unmet[row] = _INFEASIBLE
        except SolverFailed:
            chosen.status[row] = _NOT_SOLVED


def _is_determined(split: Split, poses: PoseStack) -> bool:
    """Whether only one f balances the arm."""
    loaded = split.chooses_sides and bool(poses.state.moment_of_g[..., poses.upu].any())
    return poses.mechanism.limb_count == 3 and not loaded


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
    chosen.unmet[empty] = 0
