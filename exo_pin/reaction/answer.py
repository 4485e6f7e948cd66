"""From the equilibrium of a stack of poses to an answer."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.compiled import kernel
from ..core.validation import FloatArray
from .chosen_forces import chosen_forces
from .indeterminacy.component_assumptions import ComponentSource
from .query_status import QUERY_STATUS, answered
from .result import Optimum, Reaction
from .splits.split import PoseStack, Split

__all__ = ["STANDARD_GRAVITY", "answer"]

_NAMES = np.array(QUERY_STATUS)
_SINGULAR = QUERY_STATUS.index("singular")

#: Standard gravity for the weight of a person, m/s²; it does not depend on the gravity of the design.
STANDARD_GRAVITY = 9.81


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
    chosen = chosen_forces(split, poses, progress)
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
        status=stacked(_NAMES[np.where(chosen.unmet > 0, chosen.unmet, status)]),
        source=ComponentSource(split, poses, shape, np.concatenate([f, g, shoulder], axis=1), chosen.unmet == 0),
        body_weight=None if owner is None or owner.body_mass is None else owner.body_mass * STANDARD_GRAVITY,
        trivial=bool(rows.size and chosen.trivial[rows].all()),
        optimum=Optimum(stacked(chosen.kkt), stacked(chosen.gap), stacked(chosen.unique)),
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
