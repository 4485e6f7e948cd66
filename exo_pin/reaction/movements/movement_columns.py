"""Histories of a movement as columns of a table."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...core.conventions import CLINICAL_ANGLES, shoulder_angles
from ...core.validation import FloatArray
from ..columns import force_columns, vector_columns

if TYPE_CHECKING:
    from .along import MovementReaction


def movement_columns(answer: MovementReaction, side: str) -> dict[str, FloatArray]:
    """Time, clinical angles of a side of the body, velocity, acceleration and forces, shape (N,) each."""
    movement = answer.movement
    angles = shoulder_angles(movement.poses, side, degrees=True)
    return (
        {"time_s": movement.times}
        | vector_columns("{}", angles, CLINICAL_ANGLES)
        | vector_columns("omega_{}_rad_s", movement.motion.angular_velocity, "xyz")
        | vector_columns("eta_{}_rad_s2", movement.motion.angular_acceleration, "xyz")
        | force_columns(answer.reaction)
        | answer.reaction.cuff_columns()
    )
