"""Motions of a device in one pose: those that turn the arm, and idle ones, which leave it where it is.

Equilibrium is a sum of zero over every motion that the loops allow. An idle motion on which a drive or brake acts has a
row of equilibrium beside the three of the arm's turns. One on which nothing acts must not be loaded, because nobody
holds it: the spin of a limb between two ball joints is not, a slide that stands upright is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.validation import FloatArray
from .least_loads import NONE

__all__ = []

#: Load of a motion that nothing holds, relative to the largest load in any coordinate (moments, and forces times the
#: characteristic length), up to which it is rounding: loops are closed to 1e-12 of that length.
UNBALANCED = 1e-9


class Freedoms(NamedTuple):
    """What equilibrium needs of a pose beside its three moments.

    Attributes
    ----------
    freedom : float
        Turn of the arm about its worst axis over the motion of all joints that it needs, from 0 to 1.
    self_stresses : int
        Reactions that equilibrium does not determine.
    held, free : int
        Idle motions on which drives or brakes act, and on which none does.
    unheld : ndarray
        Effort that is missing at each joint, N or N m, shape (njoints,): zero where the free ones are in balance.
    """

    freedom: float
    self_stresses: int
    held: int
    free: int
    unheld: FloatArray


def split_motions(
    motions: FloatArray, angular: NDArray[np.intp], R: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Motions that turn the arm about the base frame's axes, and idle ones.

    Parameters
    ----------
    motions : ndarray
        All that loops allow, scaled, orthonormal, shape (rest, k).
    angular : ndarray of int
        Rows of the arm's turn, in its own axes.
    R : ndarray
        Orientation of the arm, shape (3, 3).

    Returns
    -------
    turning : ndarray
        Shape (rest, 3): the least motion of all joints for a turn of 1 rad about each axis, as far as loops allow it.
    idle : ndarray
        Orthonormal, shape (rest, m).
    freedom : float
        Turn about the worst axis over the motion that it needs.
    """
    u, w, vt = np.linalg.svd(R @ motions[angular])
    turns = int((w > NONE).sum())
    turning = motions @ (vt[:turns].T / w[:turns]) @ u[:, :turns].T
    return turning, motions @ vt[turns:].T, float(w[-1]) if w.size == 3 else 0.0


def idle_rows(idle: FloatArray, efforts: FloatArray, turning: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Idle motions on which efforts act, shape (rest, d), and on which none does, shape (rest, m - d); orthonormal.

    Parameters
    ----------
    idle : ndarray
        Shape (rest, m).
    efforts : ndarray
        Generalised force of a unit of each effort, scaled, shape (rest, p).
    turning : ndarray
        Moments of the efforts, shape (3, p), beside which an effect may be rounding.
    """
    U, s, _ = np.linalg.svd(idle.T @ efforts)
    scale = max(float(np.abs(turning).max(initial=0.0)), float(s.max(initial=0.0)))
    count = int((s > NONE * scale).sum())
    return idle @ U[:, :count], idle @ U[:, count:]
