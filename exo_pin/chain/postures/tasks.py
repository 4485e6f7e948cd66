"""Tasks of inverse kinematics: what a posture should reach, and what each error costs.

The names and costs are those of Pink, Mink and PlaCo. A task's error e is m and rad, its cost the number of equal
units that one metre or radian is worth; inverse kinematics minimises the sum of squares of all costs times errors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.records import Record
from ...core.validation import FloatArray, as_finite, require_type
from ..kinematics.loops import tree_frame_jacobian
from ..structure.chain_state import ChainState

#: Error and Jacobian of a task at a configuration.
Linear = tuple[FloatArray, FloatArray]


def _cost(name: str, value: ArrayLike, size: int) -> FloatArray:
    """Costs of the components of an error, shape (size,), from one number or one each."""
    cost = as_finite(name, value, (size,) if np.ndim(value) else ())
    if (cost < 0.0).any():
        raise InvalidInput(f"expected a {name} of zero or more, got {value!r}")
    return np.broadcast_to(cost, (size,))


@checked
@dataclass(frozen=True, eq=False)
class FrameTask(Record):
    """A frame at a pose.

    The error is the frame's position against the target's, m, above the rotation vector from the target's orientation
    to the frame's, rad, both in the target's axes. So with ``position_cost=(1, 1, 0)`` the origin may be anywhere on
    the target's z axis, and with ``orientation_cost=(1, 1, 0)`` the frame may turn about it.

    Parameters
    ----------
    frame : str
        A frame of the model.
    target : pinocchio.SE3
        Its pose, world frame.
    position_cost, orientation_cost : float or array_like
        Shape (3,), of the components; 1/m and 1/rad, zero or more. With zero that part is left free.

    Examples
    --------
    >>> from exo_pin.chain import FrameTask
    >>> exo = ep.load("four-cables")
    >>> chain, goal = exo.chain, exo.chain.placement(exo.chain.close(exo.chain.neutral()), "arm")
    >>> goal.rotation = exo.pose(flexion=20).as_matrix()
    >>> q = chain.inverse_kinematics(FrameTask("arm", goal), chain.close(chain.neutral())).q
    >>> round(float(np.rad2deg(2.0 * np.arccos(q[3]))), 6)  # degrees, of the arm
    20.0
    """

    frame: str
    target: pin.SE3
    position_cost: ArrayLike = 1.0
    orientation_cost: ArrayLike = 1.0

    def __post_init__(self) -> None:
        require_type("target", self.target, pin.SE3)
        as_finite("target", self.target.homogeneous, (4, 4))
        _cost("position_cost", self.position_cost, 3)
        _cost("orientation_cost", self.orientation_cost, 3)

    def costs(self, state: ChainState) -> FloatArray:
        """Shape (6,)."""
        state.frame_index(self.frame)
        return np.concatenate(
            [_cost("position_cost", self.position_cost, 3), _cost("orientation_cost", self.orientation_cost, 3)]
        )

    def linearised(self, state: ChainState, q: FloatArray) -> Linear:
        """The error, shape (6,), and its Jacobian, shape (6, nv)."""
        J = tree_frame_jacobian(state, q, self.frame)
        found, data = state.model.frames[state.frame_index(self.frame)], state.buffers.data
        place = data.oMi[found.parentJoint] * found.placement
        off = self.target.actInv(place)
        back = self.target.rotation.T
        turning = pin.Jlog3(off.rotation) @ off.rotation.T @ back
        return np.concatenate([off.translation, pin.log3(off.rotation)]), np.vstack([back @ J[:3], turning @ J[3:]])


@checked
@dataclass(frozen=True, eq=False)
class PostureTask(Record):
    """Joints at given positions.

    The error is the difference from the target to the joints' configuration, :func:`pinocchio.difference`.

    Parameters
    ----------
    target : mapping or array_like
        Joint name to its coordinates in q; or shape (nq,), a whole configuration.
    cost : float
        1/m for slides, 1/rad for hinges, zero or more.

    Examples
    --------
    >>> from exo_pin.chain import PostureTask
    >>> arms = '<body><joint name="{}" axis="0 1 0"/><inertial mass="1" pos="0 0 1" diaginertia="1 1 1"/></body>'
    >>> mirror = '<equality><joint name="mirror" joint1="right" joint2="left" polycoef="0 -1 0 0 0"/></equality>'
    >>> bodies = arms.format("left") + arms.format("right")
    >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody>{bodies}</worldbody>{mirror}</mujoco>")
    >>> chain.inverse_kinematics(PostureTask({"left": 0.3, "right": -0.5}), [0.0, 0.0]).q.round(6)  # rad, the mean
    array([ 0.4, -0.4])
    """

    target: Mapping[str, ArrayLike] | ArrayLike
    cost: float = 1.0

    def __post_init__(self) -> None:
        _cost("cost", as_finite("cost", self.cost, ()), 1)

    def costs(self, state: ChainState) -> FloatArray:
        """Shape (k,), of the joints' coordinates in v."""
        return np.full(len(self._goal(state)[1]), float(self.cost))

    def _goal(self, state: ChainState) -> tuple[FloatArray, np.ndarray]:
        if not isinstance(self.target, Mapping):
            return state.configuration(self.target), np.arange(state.nv)
        goal = state.neutral()
        for joint, value in self.target.items():
            own = state.configuration_slice(joint)
            goal[own] = as_finite(f"position of joint {joint!r}", np.atleast_1d(value), (own.stop - own.start,))
        return state.configuration(goal), state.velocity_indices(self.target)

    def linearised(self, state: ChainState, q: FloatArray) -> Linear:
        """The error, shape (k,), and its Jacobian, shape (k, nv)."""
        goal, own = self._goal(state)
        off = np.asarray(pin.difference(state.model, goal, q))
        J = np.asarray(pin.dDifference(state.model, goal, q, pin.ArgumentPosition.ARG1))
        return off[own], np.reshape(J, (state.nv, state.nv))[own]


@checked
@dataclass(frozen=True, eq=False)
class ComTask(Record):
    """The centre of mass of all bodies at a point.

    Parameters
    ----------
    target : array_like
        Shape (3,), m, world frame.
    cost : float or array_like
        Shape (3,), of the components along the world's axes, 1/m, zero or more.

    Examples
    --------
    >>> from exo_pin.chain import ComTask
    >>> slide = '<joint name="x" type="slide" axis="1 0 0"/><inertial mass="1" pos="0.2 0 0" diaginertia="1 1 1"/>'
    >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{slide}</body></worldbody></mujoco>")
    >>> chain.inverse_kinematics(ComTask([0.5, 0.0, 0.0]), [0.0]).q.round(6)  # m; the centre of mass is 0.2 m ahead
    array([0.3])
    """

    target: ArrayLike
    cost: ArrayLike = 1.0

    def __post_init__(self) -> None:
        as_finite("target", self.target, (3,))
        _cost("cost", self.cost, 3)

    def costs(self, state: ChainState) -> FloatArray:
        """Shape (3,)."""
        if not sum(float(body.mass) for body in list(state.model.inertias)[1:]) > 0.0:
            raise InvalidInput("the chain has no mass, and so no centre of mass: leave the ComTask out")
        return _cost("cost", self.cost, 3)

    def linearised(self, state: ChainState, q: FloatArray) -> Linear:
        """The error, shape (3,), and its Jacobian, shape (3, nv)."""
        data = state.buffers.data
        J = np.reshape(pin.jacobianCenterOfMass(state.model, data, q), (3, state.nv))
        return np.array(data.com[0]) - np.asarray(self.target, dtype=float), np.array(J)


Task = FrameTask | PostureTask | ComTask
