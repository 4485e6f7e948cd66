"""Poses and offsets of the device's centre with which a search judges its designs.

A frame on the torso has the shoulder's centre at its own only in some poses, and no donning is exact. A search may be
given several offsets, each of them one for all poses or a centre path: then every pose counts once with each.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.conventions import shoulder_rotation
from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import FloatArray, ReadOnly, as_finite, as_positive
from ...load_case import CentreOffset, CentrePath
from ...load_case.ranges_of_motion import ADL_BOX, RangeOfMotion
from ..pose_offsets import PoseOffsets

#: An offset that holds for any pose; None: the centres are one.
Centre = CentreOffset | CentrePath | None


def as_centres(given: Centre | ArrayLike | Sequence[Centre]) -> tuple[Centre, ...]:
    """Offsets from what a user passes: one, or a sequence of records and None.

    Raises
    ------
    InvalidInput
        If one of them is a stack: a search has other poses than the check of what it finds.
    """
    if isinstance(given, (tuple, list)) and all(isinstance(each, Centre) for each in given):
        if not given:
            raise InvalidInput("expected at least one centre_offset, got an empty sequence")
        return tuple(_single(cast(Centre, each)) for each in given)
    if given is None or isinstance(given, (CentreOffset, CentrePath)):
        return (_single(given),)
    return (_single(CentreOffset.together(as_finite("centre_offset", cast(ArrayLike, given), (3,), stack=True))),)


def _single(centre: Centre) -> Centre:
    if isinstance(centre, CentreOffset) and (centre.base.ndim > 1 or centre.cuff.ndim > 1):
        raise InvalidInput(
            f"expected centre_offset as one offset or a CentrePath, got stacks of {centre.base.shape}, "
            f"{centre.cuff.shape}: designs are judged in other poses, too"
        )
    return centre


def shifted(centre: Centre, shift: FloatArray) -> CentreOffset | CentrePath:
    """The offset of a device that sits elsewhere besides, base and cuff alike, by ``shift``, shape (3,), m."""
    if isinstance(centre, CentrePath):
        return replace(centre, fit=np.asarray(centre.fit) + shift)
    if centre is None:
        return CentreOffset.together(shift)
    return CentreOffset(centre.base + shift, centre.cuff + shift)


def described(centre: Centre) -> dict[str, Any] | None:
    """The numbers of an offset, by which a stored study knows it again."""
    return None if centre is None else {name: np.asarray(value).tolist() for name, value in vars(centre).items()}


def centre_text(centre: Centre) -> str:
    """One line on an offset, for a report."""
    if centre is None:
        return "The device's centre is the shoulder's."
    if isinstance(centre, CentrePath):
        most, fit = 1e3 * np.linalg.norm(centre.displacement, axis=1).max(), 1e3 * np.asarray(centre.fit)
        where = "" if not fit.any() else f", and is off by ({', '.join(f'{x:g}' for x in fit)}) mm at rest"
        return f"The shoulder's centre moves with the arm, by at most {most:.0f} mm on its path{where}."
    base, cuff = (", ".join(f"{1e3 * x:g}" for x in side) for side in (centre.base, centre.cuff))
    return f"The device's centre is off the shoulder's by ({base}) mm at the base and ({cuff}) mm at the cuff."


@checked
@dataclass(frozen=True, eq=False)
class SearchPoses(ReadOnly):
    """A stack of N poses with weights of sum 1.

    Attributes
    ----------
    poses : Rotation
        Shape (N,).
    weights : ndarray
        Shape (N,).
    offsets : PoseOffsets
        Of the device's centre in these poses; none if left out.
    """

    poses: Rotation
    weights: FloatArray
    offsets: PoseOffsets = field(default_factory=PoseOffsets.none)

    def __post_init__(self) -> None:
        weights = as_finite("weights", self.weights, (None,))
        if self.poses.shape != weights.shape or (weights < 0.0).any() or not weights.sum() > 0.0:
            raise InvalidInput(
                f"expected one weight of zero or more a pose, got shapes {self.poses.shape}, {weights.shape}"
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
        return cls(flat, np.ones(len(flat)))

    def at_centres(self, centres: Sequence[Centre]) -> SearchPoses:
        """These poses with every one of the offsets of the device's centre, one stack after the other."""
        quaternions, count = self.poses.as_quat(), len(self.weights)
        offsets = PoseOffsets.joined([PoseOffsets.of(each, self.poses) for each in centres], count)
        return SearchPoses(
            Rotation.from_quat(np.tile(quaternions, (len(centres), 1))), np.tile(self.weights, len(centres)), offsets
        )


@checked
def lifting_poses(
    side: str = "left",
    box: RangeOfMotion = ADL_BOX,
    counts: tuple[int, int, int] = (7, 6, 6),
    lifting_weight: float = 0.3,
) -> SearchPoses:
    """A coarse grid of a box of shoulder angles, and :func:`lifting_lines` in steps of 10°.

    Parameters
    ----------
    side : {"left", "right"}
        Side of the body.
    box : RangeOfMotion
        The box; that of daily activities if left out.
    counts : (int, int, int)
        Nodes in flexion, abduction and internal rotation, both ends included.
    lifting_weight : float
        Share of the weight that the two lines have together.

    Returns
    -------
    SearchPoses

    Examples
    --------
    >>> from exo_pin.workspace import lifting_poses
    >>> lifting_poses(counts=(3, 3, 2)).poses.shape
    (38,)
    """
    angles = [np.linspace(low, high, count) for (low, high), count in zip(box.intervals, counts, strict=True)]
    flexion, abduction, internal = (nodes.ravel() for nodes in np.meshgrid(*angles, indexing="ij"))
    grid = shoulder_rotation(flexion, abduction, internal, side, degrees=True)
    lines = Rotation.concatenate(lifting_lines(side, 10.0))
    shares = ((grid, 1.0 - lifting_weight), (lines, lifting_weight))
    weights = np.concatenate([np.full(len(poses), share / len(poses)) for poses, share in shares])
    return SearchPoses(Rotation.concatenate([grid, lines]), weights)


@checked
def lifting_lines(side: str, step: float = 5.0) -> tuple[Rotation, Rotation]:
    """Lifting forward and sideways from 0 to 90° in steps, degrees, as two stacks."""
    angles = np.linspace(0.0, 90.0, int(np.ceil(90.0 / as_positive("step", step))) + 1)
    return (
        shoulder_rotation(angles, 0.0, 0.0, side, degrees=True),
        shoulder_rotation(0.0, angles, 0.0, side, degrees=True),
    )
