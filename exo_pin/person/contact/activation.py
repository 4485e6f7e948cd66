"""Choice of the activations: static optimisation of one pose.

Of all activations a that balance the arm, with 0 <= a <= 1, the ones of least effort are chosen:

    min Σ_j w_j a_j^p,   p = 2 or 3,

with equal weights or the volumes of the muscles. Three conditions may be added:

* The contact force stays in the socket: with compression N and shear S, P towards superior and anterior,
  (S / superior)² + (P / anterior)² <= N², N >= 0. This is an elliptic cone, so the program is a second-order cone
  program (Clarabel).
* Limb forces of the device are chosen in the same program, within their bounds; those that effort leaves open are the
  shortest (:mod:`.conic`).
* At the end of its extension the elbow has a stop: it can carry a moment that would extend it further.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...core.validation import FloatArray
from .conic import ActiveSet, ConicAnswer, ConicProgram, EffortProgram, polished, shortest_choice

#: Unit of force, N, and of moment, N m, of the scaled programs.
_FORCE, _MOMENT = 500.0, 10.0
#: Lever arm of a muscle, m.
_LEVER = 0.02
#: Row of the elbow in the moment balance.
_ELBOW = 3
#: Missing moment below which a pose counts as balanced, N m.
BALANCED = 1e-6


@dataclass(frozen=True, eq=False)
class MusclePose:
    """Everything about one pose that the choice depends on; m activations and n limb forces.

    Attributes
    ----------
    rows, constant : ndarray
        Moment balance ``rows @ z + constant = 0``, shapes (5, m + n) and (5,), N m.
    pull, rest : ndarray
        Contact force ``pull @ z + rest``, shapes (3, m + n) and (3,), N, {O_A}.
    low, high : ndarray
        Shape (m + n,), bounds; limb forces in N, may be infinite.
    weights : ndarray
        Shape (m,).
    power : int
        2 or 3.
    socket : ndarray or None
        Shape (3, 3): axes of the glenoid, superior and anterior row divided by the ratios of its rim.
    stopped : bool
        Whether the elbow is straight, so that its stop can carry what would extend it.
    least : {"effort", "contact"}
        What is made small. "contact": the contact force, with muscles and device alike.
    """

    rows: FloatArray
    constant: FloatArray
    pull: FloatArray
    rest: FloatArray
    low: FloatArray
    high: FloatArray
    weights: FloatArray
    power: int
    socket: FloatArray | None
    stopped: bool
    least: str = "effort"

    @cached_property
    def content(self) -> tuple[bytes | int | str, ...]:
        """What tells this pose from others, bit by bit."""
        socket = np.zeros(0) if self.socket is None else self.socket
        arrays = (self.rows, self.constant, self.pull, self.rest, self.low, self.high, self.weights, socket)
        return *(each.tobytes() for each in arrays), self.power, bool(self.stopped), self.least

    def __eq__(self, other: object) -> bool:
        return isinstance(other, MusclePose) and self.content == other.content

    def __hash__(self) -> int:
        return hash(self.content)

    @property
    def muscles(self) -> int:
        """Number of muscles m."""
        return len(self.weights)

    @property
    def unit(self) -> FloatArray:
        """Units of the variables, shape (m + n,): 1 and N."""
        return np.where(np.arange(len(self.low)) < self.muscles, 1.0, _FORCE)


@dataclass(frozen=True, eq=False)
class MuscleChoice:
    """The choice.

    Attributes
    ----------
    z : ndarray
        Shape (m + n,).
    kkt, gap : float
        Violation of the optimality conditions and duality gap of the scaled program.
    is_optimal : bool
        Whether they prove it optimal.
    """

    z: FloatArray
    kkt: float
    gap: float
    is_optimal: bool


def least_effort(pose: MusclePose) -> MuscleChoice:
    """Choose activations and limb forces; of choices that are equally good the shortest."""
    found, fixed = _found(pose)
    size = len(pose.low)
    if not found.is_optimal or (pose.least == "effort" and size == pose.muscles):
        return found
    held = np.eye(pose.muscles, size) if pose.least == "effort" else pose.pull * pose.unit / _FORCE
    x = shortest_choice(_scaled(pose), found.z / pose.unit, held, fixed)
    return replace(found, z=x * pose.unit)


def _found(pose: MusclePose) -> tuple[MuscleChoice, NDArray[np.bool_]]:
    """Activations and limb forces, any of those that are equally good; shape (m + n,): which are fixed by a bound."""
    size = len(pose.low)
    extra = pose.muscles if pose.power == 3 and pose.least == "effort" else 0
    P, q = np.zeros((size + extra, size + extra)), np.zeros(size + extra)
    if extra:
        q[size:] = pose.weights
    elif pose.least == "effort":
        P[np.arange(pose.muscles), np.arange(pose.muscles)] = pose.weights
    else:
        towards = pose.pull * pose.unit / _FORCE
        P[:size, :size], q[:size] = towards.T @ towards, towards.T @ pose.rest / _FORCE
    effort = _scaled(pose)
    program = _constrained(P, q, effort, np.zeros((5, extra)))
    for muscle in range(extra):
        cube = np.zeros((3, size + extra))
        cube[0, size + muscle] = cube[2, muscle] = -1.0
        program.add("cube", cube, np.array([0.0, 1.0, 0.0]))
    answer = program.solve()
    x, kkt, gap = np.clip(answer.x[:size], effort.low, effort.high), answer.kkt, answer.gap
    active = _active_set(effort, answer)
    if answer.is_optimal and pose.least == "effort":
        exact = polished(effort, x, active)
        if exact is not None:
            (x, kkt), gap = exact, 0.0
    return MuscleChoice(x * pose.unit, kkt, gap, answer.is_optimal), active.is_fixed


def _scaled(pose: MusclePose) -> EffortProgram:
    """The program in numbers of order 1."""
    A, b = pose.rows * pose.unit / _MOMENT, -pose.constant / _MOMENT
    held = np.arange(5) != _ELBOW if pose.stopped else np.ones(5, dtype=bool)
    socket = np.zeros((0, 3)) if pose.socket is None else pose.socket
    size = max(_FORCE, float(np.linalg.norm(pose.rest)))
    B, d = socket @ pose.pull * pose.unit / size, socket @ pose.rest / size
    low, high = pose.low / pose.unit, pose.high / pose.unit
    return EffortProgram(pose.weights, pose.power, A[held], b[held], A[~held], b[~held], low, high, B, d)


def _active_set(effort: EffortProgram, answer: ConicAnswer) -> ActiveSet:
    """Active constraints of the solver's answer; the blocks are those of :func:`least_effort`, in its order."""
    blocks = iter(answer.active[1:])
    rows = next(blocks) if len(effort.c) else np.zeros(0, dtype=bool)
    at_bound, below, above = next(blocks), np.isfinite(effort.low), np.isfinite(effort.high)
    lower, upper = np.zeros_like(below), np.zeros_like(above)
    count = int(below.sum())
    lower[below], upper[above] = at_bound[:count], at_bound[count:]
    return ActiveSet(lower, upper, rows, len(effort.d) > 0 and bool(next(blocks)[0]))


def least_missing(pose: MusclePose, in_socket: bool) -> tuple[FloatArray, bool]:
    """The least moment that something else would have to add for the pose to be held.

    Parameters
    ----------
    pose : MusclePose
        A pose that cannot be balanced.
    in_socket : bool
        Whether the contact force has to stay in the socket.

    Returns
    -------
    ndarray
        Shape (5,), N m: three about the glenohumeral centre, elbow flexion, forearm. NaN if no moment would do,
        because the muscles cannot bring the contact force into the socket.
    bool
        Whether the solver has proved it.
    """
    size = len(pose.low)
    P = np.zeros((size + 5, size + 5))
    P[size:, size:] = np.eye(5)
    effort = _scaled(pose)
    # A moment far above what muscles can make is measured in a unit of its own.
    unit = max(_MOMENT, float(np.linalg.norm(pose.rest)) * _LEVER)
    # Moments from outside in the rows of the scaled balance: equalities first, then the elbow that may be stopped.
    outside = np.eye(5)[[0, 1, 2, 4, _ELBOW]] if pose.stopped else np.eye(5)
    answer = _constrained(P, np.zeros(size + 5), effort, outside * unit / _MOMENT, in_socket).solve()
    if answer.is_infeasible:
        return np.full(5, np.nan), True
    return answer.x[size:] * unit, answer.is_optimal


def _constrained(
    P: FloatArray, q: FloatArray, effort: EffortProgram, outside: FloatArray, in_socket: bool = True
) -> ConicProgram:
    """A program with the constraints of an effort; ``outside``, shape (5, extra), is further variables' moment."""
    program, count, extra = ConicProgram(P, q), len(effort.b), outside.shape[1]
    program.add("zero", np.hstack([effort.A, outside[:count]]), effort.b)
    if len(effort.c):
        program.add("positive", np.hstack([effort.C, outside[count:]]), effort.c)
    below, above = np.isfinite(effort.low), np.isfinite(effort.high)
    one = np.eye(len(effort.low), len(effort.low) + extra)
    room = np.concatenate([-effort.low[below], effort.high[above]])
    program.add("positive", np.vstack([-one[below], one[above]]), room)
    if in_socket and len(effort.d):
        program.add("second_order", -np.hstack([effort.B, np.zeros((3, extra))]), effort.d)
    return program
