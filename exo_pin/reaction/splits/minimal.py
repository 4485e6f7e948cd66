"""Split "minimal": the side forces within their bounds that make the shoulder force least."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.validation import FloatArray
from ...design import Mechanism
from .limb_and_side_forces import Pose
from .pose_stack import PoseStack
from .split import Chosen, Split

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

    def program(self, poses: PoseStack, row: int) -> Pose:
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
