"""From the equilibrium of a stack of poses to the forces that a split chooses, within all limits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..core.errors import SolverFailed
from ..core.progress import track
from ..wrist.forces.closed_form import STATUS
from .indeterminacy.infeasibility import Shortfall
from .indeterminacy.infeasible_poses import shortfall
from .splits.limb_and_side_forces import choose
from .splits.split import Chosen, PoseStack, Split

__all__ = ["QUERY_STATUS", "STANDARD_GRAVITY", "answered", "distribute"]

#: The closed form's status codes and what only a query with limits can find.
QUERY_STATUS = (*STATUS, "infeasible", "out_of_stroke", "no_equilibrium", "guide_overloaded")

#: Gravity by which a person's weight is counted, m/s², whatever the design's gravity is.
STANDARD_GRAVITY = 9.81


def answered(status: NDArray[np.int8]) -> NDArray[np.intp]:
    """Rows that have an answer."""
    return np.flatnonzero(status < STATUS.index("singular"))


def distribute(
    split: Split, poses: PoseStack, status: NDArray[np.int8], progress: bool = False
) -> tuple[Chosen, dict[int, Shortfall]]:
    """Choose f and g of all poses.

    Parameters
    ----------
    split : Split
        How.
    poses : PoseStack
        Equilibrium and limits.
    status : ndarray of int8
        Shape (N,), index into :data:`QUERY_STATUS`, changed where a pose turns out to have no answer.
    progress : bool
        Whether to show a progress bar.

    Returns
    -------
    Chosen
        The forces.
    dict of int to Shortfall
        What is missing, of rows that cannot be held.
    """
    chosen = Chosen(status, poses.mechanism.limb_count)
    missing: dict[int, Shortfall] = {}
    hard = poses.socket is not None and poses.socket.is_hard
    if hard or not poses.limits.is_free:
        missing = _shortfalls(split, poses, answered(status), status, progress)
    split.judge(poses, answered(status), chosen)
    rows = answered(status)
    if poses.socket is not None or poses.weights is not None or not _is_determined(split, poses):
        for row in track(rows.tolist(), "limits", progress):
            try:
                chosen.put(row, choose(split.program(poses, row)))
            except SolverFailed:
                status[row] = STATUS.index("not_solved")
    else:
        split.choose(poses, rows, chosen)
    _mark_non_finite(chosen)
    return chosen, missing


def _is_determined(split: Split, poses: PoseStack) -> bool:
    """Whether limits of f leave nothing to choose, because there are none or f is the only one that balances."""
    if poses.limits.is_free:
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
            status[row] = STATUS.index("not_solved")
            continue
        if missing is not None:
            found[row] = missing
            status[row] = QUERY_STATUS.index("infeasible")
    return found


def _mark_non_finite(chosen: Chosen) -> None:
    """A row that overflowed has no answer, and says so; rows without one are NaN."""
    if np.isfinite(chosen.f.sum() + chosen.g.sum()):
        return
    finite = np.isfinite(chosen.f).all(axis=1) & np.isfinite(chosen.g).all(axis=1)
    chosen.status[~finite & (chosen.status < STATUS.index("singular"))] = STATUS.index("not_solved")
    empty = chosen.status >= STATUS.index("singular")
    for array in (chosen.f, chosen.g, chosen.kkt, chosen.gap):
        array[empty] = np.nan
    chosen.unique[empty] = False
