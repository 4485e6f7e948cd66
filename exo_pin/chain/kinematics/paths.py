"""Closed-loop forward kinematics, along paths that stay on one assembly branch."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput, LoopNotClosed
from ...core.validation import FloatArray, as_finite
from ..structure.chain_state import ChainState
from .closing import nearest_closed
from .loops import closed_configuration

#: Largest step along a path, rad and characteristic lengths. Branches farther apart than that are not confused.
_PATH_STEP = 0.1
#: Most halvings of a step along which the loops do not close.
_HALVINGS = 12
#: Largest correction of a predicted step, rad and characteristic lengths; a larger one may have changed the branch.
_JUMP = 0.5
_CLOSED = 1e-12
_STEPS = 30


def forward_kinematics(
    state: ChainState, positions: ArrayLike, near: ArrayLike, joints: Iterable[str] | None = None
) -> FloatArray:
    """The configuration at given positions of some joints, on the branch of a known one.

    The joints move along a straight line, in steps that the loops follow, so the result is on the same assembly
    branch as ``near``. Freedoms that the joints do not determine move least. :meth:`ClosedChain.placement` of the
    result gives the pose of any frame.

    Parameters
    ----------
    positions : array_like
        Coordinates in q of ``joints``, in their order.
    near : array_like
        Shape (nq,), a closed configuration.
    joints : iterable of str, optional
        The actuated joints of the roles if left out.

    Returns
    -------
    ndarray
        Shape (nq,), closed.

    Raises
    ------
    LoopNotClosed
        If the branch ends before the goal: a limb is stretched or folded, or the path meets a singularity.
    InvalidInput
        If no joints are given and the roles name none.

    Examples
    --------
    >>> exo = ep.load("three-linear-actuators")
    >>> chain, near = exo.chain, exo.chain.close(exo.chain.neutral())
    >>> slides = [chain.configuration_slice(slide).start for slide in chain.roles.actuated]
    >>> q = chain.forward_kinematics(near[slides] + [0.01, 0.0, 0.0], near)  # one slide is pushed by 10 mm
    >>> round(float(np.rad2deg(2.0 * np.arccos(q[3]))), 1)  # degrees by which that turns the arm
    5.9
    """
    names = _actuated(state, joints)
    index = np.concatenate([np.arange(state.model.nq)[state.configuration_slice(name)] for name in names])
    held = state.velocity_indices(names)
    start = closed_configuration(state, near)
    goal = start.copy()
    goal[index] = as_finite("positions", positions, (len(index),))
    goal = state.configuration(goal)
    whole = pin.difference(state.model, start, goal)
    reach = float(np.abs(whole / state.topology.column)[held].max(initial=0.0))

    def at(fraction: float, q: FloatArray) -> FloatArray:
        """q with its given joints at a fraction of their path."""
        here = pin.integrate(state.model, start, fraction * whole)
        moved = q.copy()
        moved[index] = goal[index] if fraction == 1.0 else here[index]
        return moved

    def correct(fraction: float, q: FloatArray) -> FloatArray:
        return nearest_closed(state, at(fraction, q), held, _CLOSED, _STEPS)[0]

    return _follow(state, start, reach, correct)


def _follow(
    state: ChainState, start: FloatArray, reach: float, correct: Callable[[float, FloatArray], FloatArray]
) -> FloatArray:
    """Go from start to the end of a path in steps, halving those that the loops do not follow.

    The first guess of each step has the rate of the last one. A step that ends far from its guess may have
    changed its branch and is halved, too.
    """
    step = 1.0 / max(1, int(np.ceil(reach / _PATH_STEP)))
    smallest = step / 2**_HALVINGS
    column = state.topology.column
    fraction, q = 0.0, start
    rate = np.zeros(state.model.nv)
    while fraction < 1.0:
        target = fraction + step if fraction + step < 1.0 - 1e-9 else 1.0
        guess = pin.integrate(state.model, q, (target - fraction) * rate)
        try:
            found = correct(target, guess)
            moved = pin.difference(state.model, q, found)
            if np.abs(pin.difference(state.model, guess, found) / column).max(initial=0.0) > _JUMP:
                raise LoopNotClosed(guess, state.buffers.residual(guess), _STEPS)
        except LoopNotClosed:
            if step <= smallest:
                raise
            step /= 2
            continue
        rate = moved / (target - fraction)
        q, fraction = found, target
    return q


def _actuated(state: ChainState, joints: Iterable[str] | None) -> tuple[str, ...]:
    names = state.roles.actuated if joints is None else (joints,) if isinstance(joints, str) else tuple(joints)
    if not names:
        raise InvalidInput(
            "expected joints=, the names of the joints that positions are of: the roles name no actuated joints"
        )
    return names
