"""Minima of a smooth function on the closed loops, within joint limits.

Sequential quadratic programming in the motions that keep the loops closed. The quadratic model of a step is exact: its
matrix is that of the Lagrangian, f - λᵀc for loops c(q) = 0, by central differences of its gradient, so that steps
converge as Newton's do even where f stays large (Nocedal and Wright, Numerical Optimization, 2006, chapter 18). Each
trial closes its loops again, within the limits. A step must reduce f; steps follow negative curvature, so that they do
not end at a saddle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pinocchio as pin
import scipy

from ...core.errors import BeyondLimits, LoopNotClosed
from ...core.errors.chains import few
from ...core.records import Record
from ...core.validation import FloatArray
from ...numerics import LeastSquares, solve
from ..kinematics.loops import scaled_jacobian
from .posture_problem import PostureProblem

#: Largest KKT residual of an answer without a caution.
STATIONARY = 1e-8
_EXACT, _STEPS = 1e-13, 100
#: First and largest step, and the one below which no step helps, rad and characteristic lengths.
_FIRST, _LARGEST, _LEAST = 0.1, 0.4, 1e-13
#: Step of central differences; its error is 1e-10 of the matrix.
_DIFFERENCE = 1e-5
#: Curvature that counts as none, as a share of the largest; a joint is at its limit within rad or m.
_FLAT, _AT_LIMIT = 1e-7, 1e-9
#: Share of the objective's scale below which the largest curvature is none.
_LEAST_SCALE = 1e-3


@dataclass(frozen=True, eq=False)
class Minimum(Record):
    """A minimum on the closed loops.

    Attributes
    ----------
    q : ndarray
        Shape (nq,), closed and within the limits.
    value : float
        Of the objective.
    kkt : float
        Largest component of the gradient that neither loops nor limits balance, over the objective's scale.
    curvature : float
        Least curvature along motions that limits do not stop, over the largest one; infinite if there are none.
    at_limits : tuple of str
        Joints at their limits.
    idle : tuple of str
        Joints that move in motions along which the objective has no curvature.
    unsettled : tuple of str
        Joints that the next step would move most; none at a minimum.
    """

    q: FloatArray
    value: float
    kkt: float
    curvature: float
    at_limits: tuple[str, ...]
    idle: tuple[str, ...]
    unsettled: tuple[str, ...]

    @property
    def doubts(self) -> tuple[str, ...]:
        """Cautions: where the steps stopped before a minimum."""
        found = []
        if not self.kkt <= STATIONARY:
            found.append(
                f"the optimality conditions hold to {self.kkt:.1e} only, not to {STATIONARY:.0e}: "
                f"{few(self.unsettled)} could still move, as at a singular configuration or where nothing carries a "
                "body; start from another configuration, or hold what falls"
            )
        elif self.curvature < -_FLAT:
            found.append(
                f"this is no minimum but a saddle (least curvature {self.curvature:.1e} of the largest): start from "
                "another configuration"
            )
        return tuple(found)


class _Stops(NamedTuple):
    """Limits as rows @ y <= room."""

    rows: FloatArray  # (k, dof)
    room: FloatArray
    ends: np.ndarray  # of each row the index in v
    sign: FloatArray  # 1 of an upper limit, -1 of a lower one

    @property
    def active(self) -> np.ndarray:
        """Which limits are reached."""
        return np.asarray(self.room <= _AT_LIMIT)


class _Point(NamedTuple):
    """An objective at a closed configuration, in the motions y that keep the loops closed."""

    value: float
    motions: FloatArray  # (nv, dof): the step in v is motions @ y
    gradient: FloatArray  # (dof,)
    matrix: FloatArray  # (dof, dof), of the Lagrangian
    stops: _Stops
    kkt: float
    scale: float


def minimum(problem: PostureProblem, start: FloatArray) -> Minimum:
    """The minimum that descends from a closed configuration within the limits."""
    q, radius, here = start, _FIRST, _point(problem, start)
    for _ in range(_STEPS):
        if here.kkt <= _EXACT and not _falls(here):
            break
        y = _step(here, radius)
        gain = -float(here.gradient @ y + 0.5 * y @ here.matrix @ y)
        there = _moved(problem, q, here, y)
        fall = -math.inf if there is None else here.value - problem.objective.value(there)
        # Near the minimum differences of the objective are rounding; the gradient decides there.
        rounding = 1e-13 * max(abs(here.value), here.scale * radius)
        exact = gain <= rounding
        if there is None or fall < (-rounding if exact else 1e-4 * gain):
            radius = 0.25 * min(radius, float(np.abs(y).max(initial=0.0)))
            if radius < _LEAST:
                break
            continue
        if fall > 0.75 * gain and np.abs(y).max(initial=0.0) > 0.9 * radius:
            radius = min(2.0 * radius, _LARGEST)
        # Errors fall on to zero where the tasks are reached, in motions that they determine weakly.
        settled = exact and fall <= 0.1 * abs(here.value)
        found, before = _point(problem, there), here.kkt
        if settled and found.kkt >= before:
            break
        q, here = there, found
        if settled and here.kkt > 0.5 * before:
            break
    return _described(problem, q, here)


def _moved(problem: PostureProblem, q: FloatArray, point: _Point, y: FloatArray) -> FloatArray | None:
    """The closed configuration after a step, or None. Joints that the step takes to their limits stay there."""
    there = np.asarray(pin.integrate(problem.state.model, q, point.motions @ y))
    if problem.limits is not None:
        there = problem.limits.clipped(there, np.ones(problem.state.nv))
    stopped = point.stops.ends[point.stops.rows @ y >= point.stops.room - _AT_LIMIT]
    for held in ([np.union1d(problem.held, stopped)] if len(stopped) else []) + [problem.held]:
        try:
            return problem.closed(there, held)
        except (LoopNotClosed, BeyondLimits):
            continue
    return None


def _point(problem: PostureProblem, q: FloatArray) -> _Point:
    state, objective = problem.state, problem.objective
    column = state.topology.column
    J, tolerance = scaled_jacobian(state, q)
    free = np.setdiff1d(np.arange(state.nv), problem.held)
    _, values, Vt = np.linalg.svd(J[:, free])
    rank = int(np.count_nonzero(values > tolerance))
    motions = np.zeros((state.nv, len(free) - rank))
    motions[free] = column[free, None] * Vt[rank:].T
    slope, scale = objective.gradient(q), objective.scale(q) or 1.0
    gradient, stops = motions.T @ slope, _stops(problem, q, motions)
    rows = stops.rows[stops.active]
    pushed = slope.copy()
    if len(rows) and len(gradient):
        push = scipy.optimize.nnls(rows.T, -gradient)[0]
        np.add.at(pushed, stops.ends[stops.active], stops.sign[stops.active] * push)
    # What the loops balance of the gradient; with redundant loops any choice gives the same matrix.
    multipliers = np.zeros(len(J))
    if J.size:
        multipliers = np.linalg.lstsq(J[:, free].T, (column * pushed)[free], rcond=1e-10)[0]
    kkt = float(np.abs(motions.T @ pushed).max(initial=0.0)) / scale
    matrix = _lagrangian_matrix(problem, q, motions, state.topology.row_scale * multipliers)
    return _Point(objective.value(q), motions, gradient, matrix, stops, kkt, scale)


def _stops(problem: PostureProblem, q: FloatArray, motions: FloatArray) -> _Stops:
    limits = problem.limits
    if limits is None:
        return _Stops(np.zeros((0, motions.shape[1])), np.array([]), np.array([], dtype=np.int64), np.array([]))
    along, here = motions[limits.v_index], q[limits.q_index]
    rows, room = np.vstack([along, -along]), np.concatenate([limits.upper - here, here - limits.lower])
    kept = np.isfinite(room) & (np.abs(rows).max(axis=1, initial=0.0) > 1e-12)
    ends, sign = np.tile(limits.v_index, 2), np.repeat([1.0, -1.0], len(limits.v_index))
    return _Stops(rows[kept], np.maximum(room[kept], 0.0), ends[kept], sign[kept])


def _lagrangian_matrix(
    problem: PostureProblem, q: FloatArray, motions: FloatArray, multipliers: FloatArray
) -> FloatArray:
    """Second derivatives of f - λᵀc along the motions, shape (dof, dof).

    A step along a motion leaves the loops by its square; the closing correction that follows changes f by as much as
    -λᵀc does.
    """
    state = problem.state
    matrix = np.empty((motions.shape[1], motions.shape[1]))
    for k in range(len(matrix)):
        sides = []
        for step in (_DIFFERENCE, -_DIFFERENCE):
            moved = pin.integrate(state.model, q, step * motions[:, k])
            state.buffers.linearise(moved)
            pull = state.buffers.jacobian.T @ multipliers
            sides.append(motions.T @ (problem.objective.gradient(moved) - pull))
        matrix[k] = (sides[0] - sides[1]) / (2.0 * _DIFFERENCE)
    return 0.5 * (matrix + matrix.T)


def _free_curvature(point: _Point) -> tuple[FloatArray, FloatArray]:
    """Curvatures along motions that active limits do not stop, over the scale, and these motions."""
    rows = point.stops.rows[point.stops.active]
    return _curvatures(point, scipy.linalg.null_space(rows, rcond=1e-9) if len(rows) else np.eye(len(point.matrix)))


def _curvatures(point: _Point, motions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Principal curvatures in the span of orthonormal motions, over the scale, and their motions."""
    values, ways = np.linalg.eigh(motions.T @ point.matrix @ motions)
    return values / point.scale, motions @ ways


def _largest(values: FloatArray) -> float:
    """The largest curvature, over the scale; where all are rounding, a small one."""
    return max(float(np.abs(values).max(initial=0.0)), _LEAST_SCALE)


def _falls(point: _Point) -> bool:
    """Whether a stationary point is a saddle."""
    values, _ = _free_curvature(point)
    return bool((values < -_FLAT * _largest(values)).any())


def _step(point: _Point, radius: float) -> FloatArray:
    """The best step of the quadratic model, its curvatures made positive, within limits and radius.

    Those along the active limits are apart from those against them: made positive together, the curvatures of a step
    along the limits would be others than the objective's.
    """
    values, ways = _free_curvature(point)
    stopped, against = _curvatures(point, scipy.linalg.null_space(ways.T) if ways.size else np.eye(len(point.matrix)))
    values, ways = np.concatenate([values, stopped]), np.hstack([ways, against])
    floor = _FLAT * _largest(values)
    slope = ways.T @ (point.gradient / point.scale)
    # Along idle motions, which the matrix knows to its rounding, what is left of the slope is rounding.
    noise = max(_EXACT, _FLAT * float(np.abs(slope).max(initial=0.0)))
    idle = (np.abs(values) < floor) & (np.abs(slope) < noise)
    slope[idle] = 0.0
    # A saddle has no slope along its falling ways: some is put in, so that the step leaves it.
    saddle = (values < -floor) & (np.abs(slope) < 1e-3 * radius * np.abs(values)) & (point.kkt <= STATIONARY)
    slope[saddle] = 1e-3 * radius * values[saddle]
    bent = np.sqrt(np.where(idle, _largest(values), np.maximum(np.abs(values), floor)))
    y = np.asarray(ways @ (-slope / bent**2))
    size = min(float(np.abs(y).max(initial=0.0)), radius)
    rows, room = point.stops.rows, point.stops.room
    if size == 0.0 or (rows @ (y := y * size / np.abs(y).max()) <= room).all():
        return y
    # In units of the step, so that the program is of order one.
    E, d = bent[:, None] * ways.T, -slope / bent / size
    stretch, unit = float(np.abs(E).max()), np.full(len(y), radius / size)
    near = room < radius * np.abs(rows).sum(axis=1)
    none = np.zeros((0, len(y)))
    program = LeastSquares(E / stretch, d / stretch, none, np.array([]), -unit, unit, rows[near], room[near] / size)
    return size * np.asarray(solve(program, shortest=False).z)


def _described(problem: PostureProblem, q: FloatArray, point: _Point) -> Minimum:
    limits = problem.limits
    values, ways = _free_curvature(point)
    largest = _largest(values)
    flat = ways[:, np.abs(values) <= _FLAT * largest]
    # The next step is nearly all in what falls, where something does.
    next_step = np.zeros(len(point.matrix)) if point.kkt <= STATIONARY else _step(point, _LARGEST)
    largest_step = float(np.abs(next_step).max(initial=0.0))
    stopped: tuple[str, ...] = ()
    if limits is not None:
        here = q[limits.q_index]
        near = np.minimum(limits.upper - here, here - limits.lower) <= _AT_LIMIT
        stopped = tuple(dict.fromkeys(limits.joints[k] for k in np.flatnonzero(near)))
    curvature = float(values.min()) / largest if len(values) else math.inf
    idle = _moving(problem, point, flat, 1e-6)
    unsettled = _moving(problem, point, next_step[:, None], 0.1 * largest_step)
    return Minimum(q, point.value, point.kkt, curvature, stopped, idle, unsettled)


def _moving(problem: PostureProblem, point: _Point, ways: FloatArray, least: float) -> tuple[str, ...]:
    """Joints that move in some of the ways by more than ``least``, rad and characteristic lengths."""
    top = problem.state.topology
    moving = np.abs(point.motions @ ways / top.column[:, None]).max(axis=1, initial=0.0) > least
    return tuple(str(problem.state.model.names[int(joint)]) for joint in np.unique(top.owners[moving]))
