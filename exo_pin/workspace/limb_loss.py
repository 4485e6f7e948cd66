"""What is left of a workspace when one limb gives no force: a torn cable, an actuator that has gone limp."""

from __future__ import annotations

import numpy as np

from ..design import Mechanism
from ..study import StudyTable
from .evaluation import PoseValues
from .limb_table import rows_inside
from .pose_offsets import PoseOffsets
from .result import Workspace


def limb_loss(mechanism: Mechanism, found: Workspace) -> StudyTable:
    """Which of the poses inside are still held without each of the limbs, and how the arm goes in the others.

    Parameters
    ----------
    mechanism : Mechanism
        The design.
    found : Workspace
        Its workspace, with at least one pose inside.

    Returns
    -------
    StudyTable
        One row a limb: ``limb``, from 1; ``held``, the share of the poses inside in which the others hold every arm of
        the criteria within their limits, strokes left out; ``missing_Nm``, the largest moment that they lack, 0 where
        they hold all; ``missing_share``, the largest such moment over that of the arm's weight in the same pose: 1 is
        an arm that falls as if nothing held it, 0.1 one that sinks ten times as slowly; ``shoulder_force_N``, the
        largest |F_s| where the arm is held, NaN where it nowhere is. The arm is at rest, and the lost limb carries
        nothing: a drive that locks itself holds the arm in every pose.

    Raises
    ------
    InvalidInput
        If no pose is inside, or the workspace is that of another number of limbs.
    """
    rows = rows_inside(mechanism, found)
    matrices = np.ascontiguousarray(found.poses.as_matrix().reshape(-1, 3, 3)[rows])
    offsets = PoseOffsets.of(found.centre_offset, found.poses).rows(rows)
    values = PoseValues(mechanism, matrices, (len(rows),), found.criteria, ("forces",), offsets=offsets)
    weight = values.weight_moments()
    table = []
    for lost in range(mechanism.limb_count):
        margin, _, shoulder = values.held_by_arm(lost)
        least, force = margin.min(axis=0), np.linalg.norm(shoulder, axis=-1)
        held = least >= 0.0
        lacking = np.maximum(-np.nan_to_num(margin, nan=0.0), 0.0)
        table.append(
            {
                "limb": lost + 1,
                "held": float(held.mean()),
                "missing_Nm": float(lacking.max()),
                "missing_share": float((lacking / np.maximum(weight, 1e-9)).max()),
                "shoulder_force_N": float(force[:, held].max()) if held.any() else float("nan"),
            }
        )
    return StudyTable(table)
