"""Inverse kinematics: the posture of least weighted task error on the closed loops, within the joint limits."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ...core.errors import BeyondLimits, InvalidInput, LoopNotClosed
from ...core.records import Record
from ...core.validation import FloatArray, as_count
from ..structure.chain_state import ChainState
from ..structure.motion_axes import limits_of
from .constrained_minimum import minimum
from .posture_problem import PostureProblem, problem_of, start_of
from .tasks import Task

#: A weighted error that counts as none.
_REACHED = 1e-9
_TASK = "[FrameTask(frame, target, position_cost, orientation_cost)] as the first argument"


@dataclass(frozen=True, eq=False)
class TaskSolution(Record):
    """Answer of :meth:`exo_pin.chain.ClosedChain.inverse_kinematics`.

    Attributes
    ----------
    q : ndarray
        Shape (nq,), closed and within the joint limits.
    error : float
        The weighted error: root of the sum of squares of costs times errors. It is zero if all tasks are reached.
    errors : tuple of ndarray
        Error of each task, not weighted, m and rad.
    kkt : float
        Violation of the conditions of a minimum: largest component of the gradient of ½ error², along motions that
        neither loops nor limits stop, over the sum of squares of the tasks' weighted Jacobian; metres are divided by
        the characteristic length.
    at_limits : tuple of str
        Joints at their limits.
    idle : tuple of str
        Joints that move in motions which no task determines; they are left near where the search began.
    cautions : tuple of str
        Doubts about the answer.

    Examples
    --------
    >>> from exo_pin.chain import ComTask
    >>> rod = '<joint name="hinge" axis="0 1 0"/><inertial mass="1" pos="0 0 -0.5" diaginertia="1 1 1"/>'
    >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
    >>> answer = chain.inverse_kinematics(ComTask([-1.0, 0.0, 0.0]), [0.1])  # 0.5 m beyond the reach of the rod
    >>> answer.q.round(4), round(answer.error, 4)
    (array([1.5708]), 0.5)
    """

    q: FloatArray
    error: float
    errors: tuple[FloatArray, ...]
    kkt: float
    at_limits: tuple[str, ...]
    idle: tuple[str, ...]
    cautions: tuple[str, ...] = ()

    @property
    def reached(self) -> bool:
        """Whether all tasks are reached, to a weighted error of 1e-9."""
        return self.error <= _REACHED

    def __str__(self) -> str:
        verdict = (
            "all tasks are reached" if self.reached else "least error near the start; restarts= searches elsewhere"
        )
        lines = [f"weighted error {self.error:.6g}: {verdict}", *(f"Caution: {text}" for text in self.cautions)]
        lines.append(f"optimality conditions hold to {self.kkt:.1e}")
        named = ("at their limits", self.at_limits), ("not determined by the tasks", self.idle)
        return "\n".join([*lines, *(f"{what}: {', '.join(names)}" for what, names in named if names)])


class _Error:
    """½ |costs · errors|² of several tasks, as an objective."""

    def __init__(self, state: ChainState, tasks: Sequence[Task]) -> None:
        self._state, self._tasks = state, tasks
        self._costs = np.concatenate([task.costs(state) for task in tasks])
        if not self._costs.any():
            raise InvalidInput("all costs of the tasks are zero: expected one above zero")

    def _weighted(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        parts = [task.linearised(self._state, q) for task in self._tasks]
        e, J = np.concatenate([part[0] for part in parts]), np.vstack([part[1] for part in parts])
        return self._costs * e, self._costs[:, None] * J

    def value(self, q: FloatArray) -> float:
        e, _ = self._weighted(q)
        return 0.5 * float(e @ e)

    def gradient(self, q: FloatArray) -> FloatArray:
        e, J = self._weighted(q)
        return np.asarray(J.T @ e)

    def scale(self, q: FloatArray) -> float:
        return float(np.sum((self._weighted(q)[1] * self._state.topology.column) ** 2))


def inverse_kinematics(
    state: ChainState,
    tasks: Task | Iterable[Task],
    near: ArrayLike | None = None,
    hold: Iterable[str] = (),
    *,
    respect_limits: bool = True,
    restarts: int = 0,
    tolerance: float = 1e-12,
) -> TaskSolution:
    """The posture of least weighted task error, on closed loops and within the joint limits.

    The search descends from ``near``, in steps that the loops follow, to a local minimum. A target that cannot be
    reached gives the nearest posture, in the sum of squares of costs times errors.

    Parameters
    ----------
    tasks : Task or iterable of Task
        :class:`~exo_pin.chain.FrameTask`, :class:`~exo_pin.chain.PostureTask`, :class:`~exo_pin.chain.ComTask`.
    near : array_like, optional
        Shape (nq,), where to start; its loops are closed first. By default :meth:`ClosedChain.reference_configuration`.
    hold : iterable of str
        Joints that must not move.
    respect_limits : bool
        Whether joints are kept within their limits.
    restarts : int
        Number of further starts, from random postures with a fixed seed, while the tasks are not reached; the answer is
        the best minimum of all. With 0 it is the one that descends from ``near``. No number of starts proves that a
        minimum is the least one: where the tasks are not reached and that matters, give a hundred. Of the 39 cases in
        docs/evidence/accuracy.md two are in another minimum with 40, and none with 100.
    tolerance : float
        Largest residual of a closed loop, m and rad.

    Returns
    -------
    TaskSolution
        The posture with its errors and the violation of the optimality conditions.

    Raises
    ------
    LoopNotClosed
        If the loops do not close at the start.
    BeyondLimits
        If they close there only beyond joint limits.
    UnknownName
        If there is no such frame or joint.
    InvalidInput
        If there are no tasks, or their costs are all zero.

    Examples
    --------
    >>> from exo_pin.chain import PostureTask
    >>> chain = ep.load("prototype").chain
    >>> q = chain.close(chain.neutral())
    >>> answer = chain.inverse_kinematics([PostureTask(q)], q)
    >>> bool(answer.kkt < 1e-8)
    True
    """
    given = [tasks] if isinstance(tasks, Task) else list(tasks) if isinstance(tasks, Iterable) else [tasks]
    if not given or not all(isinstance(task, Task) for task in given):
        raise InvalidInput(f"expected tasks (FrameTask, PostureTask, ComTask), got {tasks!r}: give {_TASK}")
    problem = problem_of(state, _Error(state, given), hold, respect_limits, tolerance)
    start = start_of(problem, near)
    best = minimum(problem, start)
    for place in _random_postures(problem, start, as_count("restarts", restarts)):
        if best.value <= 0.5 * _REACHED**2:
            break
        try:
            found = minimum(problem, problem.closed(place, problem.held))
        except (LoopNotClosed, BeyondLimits):
            continue
        if found.value < best.value * (1.0 - 1e-9):
            best = found
    errors = tuple(task.linearised(state, best.q)[0] for task in given)
    return TaskSolution(
        best.q, float(np.sqrt(2.0 * best.value)), errors, best.kkt, best.at_limits, best.idle, best.doubts
    )


def _random_postures(problem: PostureProblem, q: FloatArray, count: int) -> Iterable[FloatArray]:
    """Postures with every joint anywhere within its limits, or within half a turn or a characteristic length of q."""
    state, held, limits = problem.state, problem.held, limits_of(problem.state.model)
    rng, reach = np.random.default_rng(0), np.where(state.topology.metres, state.topology.length, np.pi)
    ranged = np.isfinite(limits.lower) & np.isfinite(limits.upper) & ~np.isin(limits.v_index, held)
    for _ in range(count):
        away = rng.uniform(-1.0, 1.0, state.nv) * reach
        away[held] = 0.0
        place = np.asarray(pin.integrate(state.model, q, away))
        place[limits.q_index[ranged]] = rng.uniform(limits.lower[ranged], limits.upper[ranged])
        yield place
