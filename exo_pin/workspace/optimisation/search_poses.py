"""Poses on which a search judges a design, with their weights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.conventions import shoulder_rotation
from ...core.errors import InvalidInput
from ...core.validation import FloatArray, ReadOnly, as_finite
from ...load_case.ranges_of_motion import ADL_BOX, RangeOfMotion
from ..pose_offsets import PoseOffsets
from .centres import Centre

__all__ = ["SearchPoses", "lifting_lines", "lifting_poses"]


@dataclass(frozen=True, eq=False)
class SearchPoses(ReadOnly):
    """A stack of N poses with weights of sum 1.

    Attributes
    ----------
    orientations : Rotation
        Shape (N,).
    weights : ndarray
        Shape (N,).
    offsets : PoseOffsets
        Of the device's centre in these poses; none if left out.
    """

    orientations: Rotation
    weights: FloatArray
    offsets: PoseOffsets = field(default_factory=PoseOffsets.none)

    def __post_init__(self) -> None:
        weights = as_finite("weights", self.weights, (None,))
        if self.orientations.shape != weights.shape or (weights < 0.0).any() or not weights.sum() > 0.0:
            raise InvalidInput(
                f"expected one weight of zero or more a pose, got shapes {self.orientations.shape}, {weights.shape}"
            )
        object.__setattr__(self, "weights", weights / weights.sum())

    @classmethod
    def of(cls, value: SearchPoses | Rotation) -> SearchPoses:
        """Poses of equal weight, if ``value`` has none."""
        if isinstance(value, SearchPoses):
            return value
        if not isinstance(value, Rotation) or value.as_quat().size == 0:
            raise InvalidInput(f"expected poses as a stack of rotations or SearchPoses, got {type(value).__name__}")
        flat = Rotation.from_quat(value.as_quat().reshape(-1, 4))
        return cls(flat, np.full(len(flat), 1.0 / len(flat)))

    def at_centres(self, centres: Sequence[Centre]) -> SearchPoses:
        """These poses with every one of the offsets of the device's centre, one stack after the other."""
        quaternions, count = self.orientations.as_quat(), len(self.weights)
        offsets = PoseOffsets.joined([PoseOffsets.of(each, self.orientations) for each in centres], count)
        return SearchPoses(
            Rotation.from_quat(np.tile(quaternions, (len(centres), 1))), np.tile(self.weights, len(centres)), offsets
        )


def lifting_poses(
    side: str = "left",
    box: RangeOfMotion = ADL_BOX,
    counts: tuple[int, int, int] = (7, 6, 6),
    highest_deg: float = 90.0,
    lifting_weight: float = 0.3,
) -> SearchPoses:
    """A coarse grid of a box of shoulder angles, and lifting forward and sideways as two lines of poses.

    Parameters
    ----------
    side : {"left", "right"}
        Side of the body.
    box : RangeOfMotion
        The box; that of daily activities if left out.
    counts : (int, int, int)
        Nodes in flexion, abduction and internal rotation, both ends included.
    highest_deg : float
        To where the arm is lifted in the lines, degrees; they have a pose every 10° or less.
    lifting_weight : float
        Share of the weight that the two lines have together.
    """
    angles = [np.linspace(low, high, count) for (low, high), count in zip(box.intervals, counts, strict=True)]
    grid = np.stack(np.meshgrid(*angles, indexing="ij"), axis=-1).reshape(-1, 3)
    line = np.linspace(0.0, highest_deg, int(np.ceil(highest_deg / 10.0)) + 1)
    zero = np.zeros_like(line)
    lines = np.concatenate([np.stack([line, zero, zero], axis=-1), np.stack([zero, line, zero], axis=-1)])
    rows = np.concatenate([grid, lines])
    weights = np.concatenate(
        [np.full(len(grid), (1.0 - lifting_weight) / len(grid)), np.full(len(lines), lifting_weight / len(lines))]
    )
    flexion, abduction, internal = rows.T
    return SearchPoses(shoulder_rotation(flexion, abduction, internal, side, degrees=True), weights)


def lifting_lines(side: str, highest: float = 90.0, step: float = 5.0) -> tuple[Rotation, Rotation]:
    """Lifting forward and sideways from 0 to ``highest``, degrees, as two stacks."""
    angles = np.linspace(0.0, highest, int(np.ceil(highest / step)) + 1)
    return (
        shoulder_rotation(angles, 0.0, 0.0, side, degrees=True),
        shoulder_rotation(0.0, angles, 0.0, side, degrees=True),
    )
