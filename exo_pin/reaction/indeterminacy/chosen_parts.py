"""Parts of a reaction that are made on demand: the closest forces within limits, and optimality."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.results import Result
from ...core.validation import FloatArray, ReadOnly


class ClosestForces(NamedTuple):
    """Forces within all limits, for a pose or a stack of shape (...).

    Attributes
    ----------
    actuator_forces, constraint_forces : ndarray
        f and g, shape (..., n), N.
    cuff_wrench : ndarray
        Shape (..., 6): force, N, and moment about O, N m, of the cuff on the person's arm, base frame.
    """

    actuator_forces: FloatArray
    constraint_forces: FloatArray
    cuff_wrench: FloatArray


@dataclass(frozen=True, eq=False)
class Optimum(Result, ReadOnly):
    """Optimality of the chosen forces, for a pose or a stack of shape (...).

    Attributes
    ----------
    kkt : ndarray
        Shape (...): largest violation of the optimality conditions, relative to the largest force of the problem;
        0 where there was nothing to choose, NaN without an answer.
    gap : ndarray
        Shape (...), N: duality gap, the most by which the minimised quantity (|F_s| for "minimal" without weights) can
        exceed its least value.
    unique : ndarray of bool
        Shape (...): whether f and g are the only optimal ones. F_s always is for "minimal": its cost is strictly
        convex in it. True is sure, False may be cautious where limits coincide.
    """

    kkt: FloatArray
    gap: FloatArray
    unique: NDArray[np.bool_]
