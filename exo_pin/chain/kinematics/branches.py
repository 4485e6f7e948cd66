"""Assembly branches: forward and inverse kinematics along paths that stay on one."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput, LoopNotClosed
from ...core.validation import FloatArray, as_choice, as_finite, require_type
from ..structure.chain_state import ChainState
from ..structure.closures import Closure
from ..structure.frames import placement_of
from ..structure.motion_axes import joint_names, limits_of
from .closing import CLOSED_TO, STEPS, close, follow, followed, nearest_closed, reference_configuration
from .loops import closed_configuration, placement


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
    names = list(state.roles.actuated if joints is None else joint_names(joints))
    if not names:
        raise InvalidInput(
            "expected joints=, the names of the joints that positions are of: the roles name no actuated joints"
        )
    start = closed_configuration(state, near)
    goal = start.copy()
    index = np.concatenate([np.arange(state.nq)[state.configuration_slice(name)] for name in names])
    goal[index] = as_finite("positions", positions, (len(index),))
    return followed(state, start, state.configuration(goal), names)


def inverse_kinematics(
    state: ChainState,
    frame: str,
    target: pin.SE3,
    near: ArrayLike | None = None,
    part: str = "pose",
    hold: Iterable[str] = (),
    respect_limits: bool = True,
) -> FloatArray:
    """The configuration with a frame at a pose, on closed loops: the target is one more loop, see :func:`close`.

    From a closed configuration the frame goes to the target along a straight line, so that the branch stays. Where that
    does not lead there, the nearest configuration is taken, on whatever branch.

    Parameters
    ----------
    frame : str
        Frame of the tree.
    target : pinocchio.SE3
        Its pose in the world.
    near : array_like, optional
        Shape (nq,), where to start; :meth:`ClosedChain.reference_configuration` if left out.
    part : {"pose", "position"}
        What has to be reached.
    hold, respect_limits
        As for :meth:`ClosedChain.close`.

    Returns
    -------
    ndarray
        Shape (nq,).

    Raises
    ------
    LoopNotClosed
        If the target is not reached from there; it has the nearest configuration.
    BeyondLimits
        If it is reached beyond the limits only.

    Examples
    --------
    >>> import pinocchio as pin
    >>> chain = ep.load("three-linear-actuators").chain
    >>> raised = chain.placement(chain.close(chain.neutral()), "arm") * pin.exp6(np.array([0, 0, 0, 0, -0.5, 0]))
    >>> chain.placement(chain.inverse_kinematics("arm", raised), "arm").isApprox(raised)
    True
    """
    require_type("target", target, pin.SE3)
    kind = "rigid" if as_choice("part of the pose", part, ("pose", "position")) == "pose" else "spherical"
    name = max((own.name for own in state.closures), key=len, default="") + " target"

    def reaching(pose: pin.SE3) -> ChainState:
        goal = Closure(name, kind, frame, "universe", placement_b=placement_of(pose))
        return ChainState(state.model, replace(state.description, closures=(*state.closures, goal)))

    start = reference_configuration(state) if near is None else state.configuration(near)
    first, held = placement(state, start, frame), state.velocity_indices(hold)
    way, limits = pin.log6(first.actInv(target)), limits_of(state.model)
    reach = max(float(np.linalg.norm(way.linear)) / state.topology.length, float(np.linalg.norm(way.angular)))

    def correct(fraction: float, q: FloatArray) -> FloatArray:
        return nearest_closed(reaching(first * pin.exp6(fraction * way)), q, held, CLOSED_TO, STEPS)[0]

    try:
        if state.is_closed(state.buffers.residual(start), state.scaled_gap()):
            q = follow(state, start, reach, correct)
            if not respect_limits or limits.holds(q):
                return q
    except LoopNotClosed:
        pass
    try:
        return close(reaching(target), start, hold, respect_limits=respect_limits)
    except LoopNotClosed as error:
        raise LoopNotClosed(error.q, error.residual, error.iterations, frame) from None
