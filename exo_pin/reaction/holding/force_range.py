"""Least and greatest shoulder force of all sets of forces that a split allows within the limits.

The sets that balance the arm within linear limits are a polytope, and F_s is affine on it. |F_s| is convex, so it is
least at the solution of a convex program and greatest at a vertex. Up to :data:`MOST` candidates for vertices are
enumerated, which is exact; beyond them linear programs along many directions bound the greatest from both sides. F_s is
unbounded where a direction in which no limit ends changes it.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from ...core.errors import SolverFailed
from ...core.results import Result
from ...core.tables import three_digits
from ...core.validation import FloatArray, ReadOnly
from ...numerics import LeastSquares
from ...numerics import solve as solve_program
from ..evidence import AnswerSource
from ..splits.limb_and_side_forces import PoseProgram, force_scale

#: Most candidate vertices: eight limbs without side forces have 4,368.
MOST = 60_000
#: Effect on F_s per N, and length of a row of limits, below which there is none.
_NO_EFFECT = 1e-9
#: Limits broken by so much, over the largest force, still hold: rounding.
_ROUNDING = 1e-9
#: Directions along which the greatest force is bounded where vertices are too many.
_DIRECTIONS = 64


@dataclass(frozen=True, eq=False)
class ForceRange(Result, ReadOnly):
    """|F_s| over the sets of forces that a split allows within the limits, for a pose or a stack of shape (...).

    Attributes
    ----------
    least, greatest : ndarray
        Shape (...), N: no allowed set has a smaller or a larger |F_s|. ``greatest`` is infinite where nothing bounds
        it. Both are NaN where no set is allowed, and equal where the law of the split determines the forces.
    found : ndarray
        Shape (...), N: the largest |F_s| of a set that was found: ``greatest`` itself where that is exact.

    Examples
    --------
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> found = exo.reaction(exo.pose(60, 30)).range()
    >>> round(float(found.least), 1), round(float(found.greatest), 1)  # N
    (50.6, 436.0)
    """

    least: FloatArray
    greatest: FloatArray
    found: FloatArray

    @property
    def is_single(self) -> NDArray[np.bool_]:
        """Shape (...): whether all allowed sets have the same |F_s|, to rounding."""
        return np.asarray(self.least >= self.greatest * (1.0 - 1e-6) - 1e-9)

    def __str__(self) -> str:
        if self.least.ndim:
            shown = np.isfinite(self.greatest)
            wide = f"; unbounded in {int(np.isinf(self.greatest).sum())}" if np.isinf(self.greatest).any() else ""
            top = f"{three_digits(float(self.greatest[shown].max()))} N" if shown.any() else "-"
            return f"{self.least.size} poses, largest |F_s| of the allowed forces {top}{wide}"
        if np.isnan(self.least):
            return "no set of forces is allowed"
        if np.isinf(self.greatest):
            return f"{three_digits(float(self.least))} N to unbounded"
        if self.is_single:
            return f"{three_digits(float(self.least))} N, the only value"
        top = f"{three_digits(float(self.greatest))} N"
        if self.greatest - self.found > 1e-6 * self.greatest:
            top = f"at most {top} (at least {three_digits(float(self.found))} N)"
        return f"{three_digits(float(self.least))} to {top}"


def force_range(source: AnswerSource, magnitude: FloatArray) -> ForceRange:
    """The range of all poses of an answer; see :class:`ForceRange`.

    Parameters
    ----------
    source : AnswerSource
        The answer.
    magnitude : ndarray
        Its |F_s|, shape (...), N.

    Raises
    ------
    SolverFailed
        If a program was not solved to its accuracy.
    """
    held = source.held & ~np.isnan(source.values).any(axis=1)
    ends = np.full((3, len(held)), np.nan)
    size = magnitude.ravel()
    for row in np.flatnonzero(held).tolist():
        if not source.split.chooses_tensions:
            ends[:, row] = size[row]
            continue
        ends[:, row] = _of_pose(source.split.program(source.poses, row), float(size[row]))
    return ForceRange(*(part.reshape(source.shape) for part in ends))


class _ForceSets(NamedTuple):
    """Sets of forces y, in units of ``scale``: those with ``rows @ y <= ends``; F_s is ``force + effect @ y``."""

    rows: FloatArray
    ends: FloatArray
    force: FloatArray
    effect: FloatArray
    scale: float


def _of_pose(pose: PoseProgram, chosen: float) -> tuple[float, float, float]:
    """Least, greatest and greatest found |F_s| of a pose, N; ``chosen`` is the |F_s| of its answer."""
    if pose.alone:
        return 0.0, 0.0, 0.0
    sets = _force_sets(pose)
    if sets.effect.shape[1] == 0 or np.abs(sets.effect).max() <= _NO_EFFECT:
        return chosen, chosen, chosen
    least = min(chosen, _least(sets))
    if _is_unbounded(sets):
        return least, np.inf, np.inf
    m, d = sets.rows.shape
    sizes = _at_vertices(sets) if math.comb(m, d) <= MOST else np.empty(0)
    if sizes.size:
        greatest = max(chosen, float(sizes.max()) * sets.scale)
        return least, greatest, greatest
    found, greatest = _along_directions(sets)
    return least, max(chosen, greatest), max(chosen, found)


def _force_sets(pose: PoseProgram) -> _ForceSets:
    """The sets that balance the moments of the arm within the limits."""
    scale = force_scale(pose)
    M, target = pose.moment_effect, pose.state.moment / (pose.radius * scale)
    start = np.linalg.lstsq(M, target, rcond=None)[0]
    free = np.linalg.svd(M)[2][len(M) :].T
    low, high = pose.low / scale, pose.high / scale
    rows, ends = [free, -free], [high - start, start - low]
    sides = pose.side_rows()
    rows.append(sides @ free)
    ends.append(-sides @ start)
    force = pose.state.shoulder / scale + pose.shoulder_effect @ start
    effect = pose.shoulder_effect @ free
    if pose.socket is not None and pose.socket.is_hard:
        rows.append(pose.socket.N @ effect)
        ends.append(pose.socket.h / scale - pose.socket.N @ force)
    G, h = np.vstack(rows), np.concatenate(ends)
    size = np.linalg.norm(G, axis=1)
    acts = np.isfinite(h) & (size > _NO_EFFECT)
    return _ForceSets(G[acts] / size[acts, None], h[acts] / size[acts], force, effect, scale)


def _least(sets: _ForceSets) -> float:
    """Least |F_s|, N."""
    d = sets.effect.shape[1]
    free = np.full(d, np.inf)
    none = np.empty((0, d)), np.empty(0)
    answer = solve_program(LeastSquares(sets.effect, -sets.force, *none, -free, free, sets.rows, sets.ends))
    if not answer.is_optimal:
        raise SolverFailed("ProxQP", answer.kkt, "least shoulder force within limits")
    return float(np.linalg.norm(answer.residual)) * sets.scale


def _is_unbounded(sets: _ForceSets) -> bool:
    """Whether a direction that no limit ends changes F_s."""
    d = sets.effect.shape[1]
    if len(sets.rows) == 0:
        return True
    for axis in np.vstack([np.eye(3), -np.eye(3)]):
        answer = scipy.optimize.linprog(
            -axis @ sets.effect, A_ub=sets.rows, b_ub=np.zeros(len(sets.rows)), bounds=[(-1.0, 1.0)] * d, method="highs"
        )
        if answer.status != 0:
            raise SolverFailed("HiGHS", np.inf, "directions without limits")
        if -answer.fun > 1e3 * _NO_EFFECT:
            return True
    return False


def _at_vertices(sets: _ForceSets) -> FloatArray:
    """|F_s| at the vertices, over the scale, shape (k,); empty where no d limits meet in a point."""
    m, d = sets.rows.shape
    if m < d:
        return np.empty(0)
    active = np.array(list(itertools.combinations(range(m), d)))
    corners = sets.rows[active]
    sure = np.abs(np.linalg.det(corners)) > 1e-10
    active, corners = active[sure], corners[sure]
    points = np.linalg.solve(corners, sets.ends[active][..., None])[..., 0]
    broken = (points @ sets.rows.T - sets.ends).max(axis=1)
    points = points[broken <= _ROUNDING * np.maximum(1.0, np.abs(points).max(axis=1))]
    return np.asarray(np.linalg.norm(sets.force + points @ sets.effect.T, axis=1))


def _along_directions(sets: _ForceSets) -> tuple[float, float]:
    """The largest |F_s| found, and a bound on it, N.

    The bound is the greatest component along any of the directions, over the cosine of the angle to the nearest one.
    """
    directions, cosine = _sphere()
    found = bound = 0.0
    for direction in directions:
        answer = scipy.optimize.linprog(
            -direction @ sets.effect, A_ub=sets.rows, b_ub=sets.ends, bounds=(None, None), method="highs"
        )
        if answer.status != 0:
            raise SolverFailed("HiGHS", np.inf, "greatest shoulder force within limits")
        force = sets.force + sets.effect @ answer.x
        found, bound = max(found, float(np.linalg.norm(force))), max(bound, float(direction @ force))
    return found * sets.scale, bound / cosine * sets.scale


def spread_directions(count: int) -> FloatArray:
    """Unit vectors spread evenly over the sphere (a Fibonacci lattice), shape (count, 3)."""
    k = np.arange(count) + 0.5
    z, azimuth = 1.0 - 2.0 * k / count, np.pi * (1.0 + np.sqrt(5.0)) * k
    radius = np.sqrt(1.0 - z**2)
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z], axis=1)


@cache
def _sphere() -> tuple[FloatArray, float]:
    """Directions of Fibonacci's spiral on the sphere, and the cosine of the largest angle to the nearest of them."""
    directions = spread_directions(_DIRECTIONS)
    cells = scipy.spatial.SphericalVoronoi(directions)
    return directions, float((cells.vertices @ directions.T).max(axis=1).min())
