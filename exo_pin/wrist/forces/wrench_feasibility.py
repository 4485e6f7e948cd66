"""Moments that limbs of limited force can supply, for stacks of poses, compiled.

The moments that limbs supply, {Σ f_i a_i : lower_i <= f_i <= upper_i} with a_i = b_i × s_i, are a sum of segments (and
rays, where a limit is missing). Its faces are parallel to two of the a_i, so that all their normals are
among ±a_i × a_j: the set is known exactly from n (n - 1) half-spaces, and a required moment M lies in it if and only if

    ν · M <= Σ_k max(lower_k ν · a_k, upper_k ν · a_k)        for every one of these ν.

A violated one is a Farkas direction: within their limits the limbs cannot supply the moment about ν. For pull-only
cables this is the wrench-feasible condition of cable robots; the least slack is called capacity margin.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...core.compiled import kernel
from ...core.errors import InfeasibleBounds, InvalidInput
from ...core.validation import LARGEST, FloatArray, as_real, broadcast_to
from ...numerics.vectors import SINGULAR, cross, dot, vector

#: Two limbs whose moments are closer than this (sine of the angle) span no face; a moment with a smaller part normal
#: to a face lies in it.
_PARALLEL = 1e-12


@kernel
def moment_margin(
    arms: Any, moment: Any, lower: Any, upper: Any, direction: Any, relief_lower: Any, relief_upper: Any
) -> float:
    """Margin of one pose, N m; fills ``direction`` and the reliefs.

    Where the pose is held the largest disturbing moment, of any direction, that is held as well (infinite if every
    moment is); else minus the moment that is missing about ``direction``, a lower bound of the missing moment.

    A relief is the relaxation of this limit alone that makes the pose feasible, N; infinite if no relaxation does, 0
    where the pose is held.

    Parameters
    ----------
    arms : ndarray
        a_i, shape (n, 3), m.
    moment : ndarray
        M, shape (3,), N m.
    lower, upper : ndarray
        Shape (n,), N, infinite where there is none.
    direction, relief_lower, relief_upper : ndarray
        Shapes (3,), (n,), (n,), written.
    """
    n = arms.shape[0]
    margin = np.inf
    relief_lower[:], relief_upper[:], direction[:] = 0.0, 0.0, np.nan
    normal, sizes, levers = np.empty(3), np.empty(n), np.empty(n)
    for i in range(n):
        sizes[i] = math.sqrt(dot(arms[i], arms[i]))
    for i in range(n):
        for j in range(i + 1, n):
            normal[0], normal[1], normal[2] = cross(vector(arms, i), vector(arms, j))
            size = math.sqrt(dot(normal, normal))
            if not size > _PARALLEL * sizes[i] * sizes[j]:
                continue
            normal /= size
            for sign in (1.0, -1.0):
                slack = -sign * dot(normal, moment)
                for k in range(n):
                    lever = sign * dot(normal, vector(arms, k))
                    # The two limbs that span the face, and others in it, have no moment normal to it.
                    levers[k] = 0.0 if k in (i, j) or abs(lever) <= _PARALLEL * sizes[k] else lever
                    if levers[k] != 0.0:
                        slack += lever * (upper[k] if lever > 0.0 else lower[k])
                if slack < margin:
                    margin = slack
                    for c in range(3):
                        direction[c] = sign * normal[c]
                if slack < 0.0:
                    for k in range(n):
                        need_upper = -slack / levers[k] if levers[k] > 0.0 else np.inf
                        need_lower = slack / levers[k] if levers[k] < 0.0 else np.inf
                        relief_upper[k] = max(relief_upper[k], need_upper)
                        relief_lower[k] = max(relief_lower[k], need_lower)
    return margin


@kernel(stack=True)
def margin_stack(
    arms: Any, moment: Any, lower: Any, upper: Any, status: Any, margin: Any, direction: Any, low: Any, high: Any
) -> None:
    """:func:`moment_margin` over a stack of poses, the first axis of every array; NaN where a pose is singular."""
    for row in range(arms.shape[0]):
        if status[row] >= SINGULAR:
            margin[row], direction[row], low[row], high[row] = np.nan, np.nan, np.nan, np.nan
            continue
        margin[row] = moment_margin(arms[row], moment[row], lower[row], upper[row], direction[row], low[row], high[row])


def force_bounds(
    name: str, lower: ArrayLike, upper: ArrayLike, shape: tuple[int, ...], limb_count: int
) -> tuple[FloatArray, FloatArray]:
    """Check limits of limb forces and spread them over a stack.

    Parameters
    ----------
    name : str
        Name of the argument, for the message.
    lower, upper : array_like
        N, broadcasting to (..., n).
    shape : tuple of int
        The stack's shape (...), N poses in all.
    limb_count : int
        n.

    Returns
    -------
    lower, upper : ndarray
        Shape (N, n) each, N.

    Raises
    ------
    InvalidInput
        If they are not numbers, hold NaN, or do not broadcast.
    InfeasibleBounds
        If a lower limit is above its upper one.
    """
    sides = as_real(name, lower), as_real(name, upper)
    if np.isnan(sides[0]).any() or np.isnan(sides[1]).any():
        raise InvalidInput(f"expected {name} without NaN")
    if np.isposinf(sides[0]).any() or np.isneginf(sides[1]).any():
        raise InvalidInput(f"expected {name} with a lower limit below +inf and an upper limit above -inf")
    if any((np.isfinite(side) & (np.abs(side) > LARGEST)).any() for side in sides):
        raise InvalidInput(f"expected {name} in N, infinite or at most {LARGEST:g} in size")
    size = (*shape, limb_count)
    low, high = (np.ascontiguousarray(broadcast_to(name, side, size).reshape(-1, limb_count)) for side in sides)
    crossed = np.flatnonzero((low > high).any(axis=0))
    if crossed.size:
        raise InfeasibleBounds(crossed)
    return low, high
