"""What a camera has to show."""

from __future__ import annotations

import numpy as np

from ...core.validation import FloatArray

#: Free space around what is shown, as a share of it.
_ROOM = 1.06


def seen_along(towards: FloatArray) -> tuple[FloatArray, FloatArray]:
    """To the right and up in a picture, shape (3,) each, of a camera that is in a direction, with z upright."""
    right = np.cross([0.0, 0.0, 1.0], towards)
    right /= np.linalg.norm(right)
    up = np.cross(towards, right)
    return right, up / np.linalg.norm(up)


def widened(
    points: FloatArray, target: FloatArray, away: FloatArray, extent: tuple[float, float]
) -> tuple[FloatArray, list[float]]:
    """The target and the extent of a view, moved and widened so far that points are in it.

    Parameters
    ----------
    points : ndarray
        Shape (k, 3), m; all before the camera.
    target, away : ndarray
        Shape (3,), m: where the camera looks, and where it is from there.
    extent : tuple of float
        Half the width and half the height of the view at the target, m.

    Returns
    -------
    target : ndarray
        Shape (3,), m.
    extent : list of float
        As given, if all points were in it.
    """
    distance = float(np.linalg.norm(away))
    axes = np.stack(seen_along(away / distance))
    seen = points - target
    # What is nearer to the camera looks larger.
    size = distance / (distance - seen @ (away / distance))
    across = (seen @ axes.T) * size[:, None] * _ROOM
    low, high = np.minimum(across.min(axis=0), np.negative(extent)), np.maximum(across.max(axis=0), extent)
    return target + (low + high) / 2 @ axes, ((high - low) / 2).tolist()
