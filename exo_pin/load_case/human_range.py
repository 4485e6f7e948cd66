"""The range of a human shoulder, and warnings of poses and angles that are none of a person's."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.errors import OutsideHumanRange
from ..core.errors.base import warn
from ..core.validation import FloatArray

#: Backward component of the arm's direction beyond which it is extended too far: sin 65°.
_EXTENSION = float(np.sin(np.radians(65.0)))
#: Component into the body beyond which the arm passes through it (sin 50°), unless this far forward (sin 20°).
_ADDUCTION, _IN_FRONT = float(np.sin(np.radians(50.0))), float(np.sin(np.radians(20.0)))


def outside_human_range(matrices: FloatArray, side: str) -> NDArray[np.bool_]:
    """Whether the arm points where no human shoulder brings it.

    Parameters
    ----------
    matrices : ndarray
        Orientations, shape (N, 3, 3), {O_B} to {O_A}.
    side : {"left", "right"}
        Side of the body, as a design has it.

    Returns
    -------
    ndarray of bool
        Shape (N,).
    """
    forward = -matrices[:, 0, 2]
    outward = -matrices[:, 1, 2] if side == "left" else matrices[:, 1, 2]
    through_body = (outward < -_ADDUCTION) & (forward < _IN_FRONT)
    return np.asarray((forward < -_EXTENSION) | through_body)


def warn_outside_human_range(matrices: FloatArray, side: str) -> None:
    """Warn of poses outside a human's range, with the likely cause."""
    outside = outside_human_range(matrices, side)
    if not outside.any():
        return
    mirrored = matrices * np.array([[1.0, -1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, 1.0]])
    other = "right" if side == "left" else "left"
    swapped = not outside_human_range(mirrored[outside], side).any()
    which = "this pose" if len(outside) == 1 else f"{int(outside.sum())} of {len(outside)} poses"
    cause = (
        f'a {other} shoulder does: load the design with side="{other}", or mirror the pose'
        if swapped
        else "check the signs, the unit of the angles and their order"
    )
    warn(f"{which} cannot be reached by a human {side} shoulder; {cause}", OutsideHumanRange)


#: 30, 45, 60, 90 and 120° in radians, with two and three digits behind the point.
_ROUNDED = (0.52, 0.524, 0.79, 0.785, 1.05, 1.047, 1.57, 1.571, 2.09, 2.094)
#: So many angles are a stack of poses.
_MANY = 4


def warn_suspicious_angles(angles: Mapping[str, ArrayLike]) -> None:
    """Warn of angles beyond 180°, and of what looks like radians.

    That is whole degrees in radians, such as 1.0471975511965976 for 60°; the common angles with two or three digits,
    such as 1.05; and many angles none of which is above half a turn in radians, such as ``linspace(0, 1.57, 50)``.
    """
    suspects = {}
    for name, value in angles.items():
        values = np.asarray(value, dtype=np.float64).reshape(-1)
        if (np.abs(values) > 180.0).any():
            worst = float(values[np.abs(values).argmax()])
            warn(f"{name} = {worst:g}° is beyond half a turn", OutsideHumanRange)
        whole = np.degrees(values)
        likely = (np.abs(values) > 1e-3) & (np.abs(values) <= np.pi) & (np.abs(whole - np.rint(whole)) < 1e-9)
        # A whole number of degrees is what it says.
        likely &= values != np.rint(values)
        likely |= np.isin(np.abs(values), _ROUNDED)
        largest = float(np.abs(values).max(initial=0.0))
        if len(values) >= _MANY and 0.5 < largest <= np.pi and not largest.is_integer():
            likely |= np.abs(values) == largest
        if likely.any():
            suspects[name] = float(values[likely][0])
    if suspects:
        name, first = next(iter(suspects.items()))
        warn(
            f"{name} = {first:.6g}° is {np.degrees(first):.0f}° in radians; this function takes degrees",
            OutsideHumanRange,
        )
