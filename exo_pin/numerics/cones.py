"""Cones and forks that hold directions: what joints at the ends of a limb must allow."""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

from ..core.validation import FloatArray

#: By how much a direction may be outside of a cone that counts as the smallest, as a cosine.
_OUTSIDE = 1e-12
#: Axes of a fork that are tried, about 4° apart on half a sphere, and directions that are worked on at once.
_AXES, _BLOCK = 1500, 2000


def smallest_cone(directions: FloatArray) -> tuple[FloatArray, float]:
    """Axis and half opening of the smallest cone that holds all directions.

    The axis points to the point of their convex hull that is nearest to the origin, and the cosine of the half opening
    is its distance (a least distance problem; Lawson and Hanson, Solving Least Squares Problems, chapter 23).
    Directions join one by one, the one that is furthest outside first.

    Parameters
    ----------
    directions : ndarray
        Unit vectors, shape (N, 3).

    Returns
    -------
    axis : ndarray
        Shape (3,).
    half : float
        Rad; π where no half space holds all directions.
    """
    chosen = [0]
    while True:
        some = directions[chosen]
        weights, residual = nnls(np.vstack([some.T, np.ones(len(some))]), np.array([0.0, 0.0, 0.0, 1.0]))
        nearest = weights @ some
        if residual <= 1e-9:
            return np.full(3, np.nan), float(np.pi)
        axis = nearest / np.linalg.norm(nearest)
        cosines = directions @ axis
        furthest = int(cosines.argmin())
        if cosines[furthest] >= (some @ axis).min() - _OUTSIDE:
            return axis, float(np.arccos(min(1.0, cosines.min())))
        chosen.append(furthest)


def fork_tilt(directions: FloatArray) -> tuple[FloatArray, float]:
    """Axis of a fork and the tilt that it must allow, for a limb that takes all the directions.

    The fork turns freely about its axis, which is fixed in the part it sits on; the limb tilts in the fork, 0 across
    the axis. It cannot point along the axis.

    Parameters
    ----------
    directions : ndarray
        Unit vectors, shape (N, 3).

    Returns
    -------
    axis : ndarray
        Shape (3,), of those tried the one of least tilt.
    tilt : float
        Rad, at most some 4° more than with the very best axis.
    """
    # A spiral of even density over half a sphere.
    turns = np.arange(_AXES)
    height, around = 1.0 - (turns + 0.5) / _AXES, turns * np.pi * (3.0 - np.sqrt(5.0))
    level = np.sqrt(1.0 - height**2)
    axes = np.stack([level * np.cos(around), level * np.sin(around), height], axis=1)
    most = np.zeros(_AXES)
    for first in range(0, len(directions), _BLOCK):
        most = np.maximum(most, np.abs(directions[first : first + _BLOCK] @ axes.T).max(axis=0))
    best = int(most.argmin())
    return axes[best], float(np.arcsin(most[best]))
