"""Recursive Newton-Euler on the tree, with the wrenches of the closures and of every joint."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_choice, as_finite
from ..kinematics.kernels.closure_wrench_kernels import closure_wrenches
from ..structure.chain_state import ChainState
from ..structure.couplings import coupling_forces, refuse_coupling
from .equations.equations_of_motion import put_on
from .nonsmooth.joint_friction import friction_of, refuse_rest
from .wrenches import closure_frame, shifted, turned


@dataclass(frozen=True, eq=False)
class TreeForces:
    """Forces in a tree at one configuration and motion.

    Attributes
    ----------
    tau : ndarray
        Shape (nv,), generalised forces of the joints, N and N m.

    Examples
    --------
    >>> rod = '<joint name="hinge" axis="0 1 0"/><inertial mass="2" pos="0 0 -0.5" diaginertia="0.1 0.1 0.1"/>'
    >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
    >>> forces = chain.rnea([0.0], v=[3.0])  # swings through the lowest point
    >>> float(forces.joint_wrench("hinge")[2].round(3))  # N: weight and m ω² r
    28.62
    """

    tau: FloatArray
    _state: ChainState = field(repr=False)
    _joint_wrenches: FloatArray = field(repr=False)  # (njoints, 6), local axes and origin
    _closure_wrenches: FloatArray = field(repr=False)  # (m, 6) on a, world axes, about the world's origin
    _poses: FloatArray = field(repr=False)  # (njoints, 4, 3)

    def joint_wrench(
        self, joint: str, at: Literal["origin"] | ArrayLike = "origin", frame: Literal["world", "local"] = "world"
    ) -> FloatArray:
        """Wrench that a joint transmits from its parent to its child.

        Parameters
        ----------
        joint : str
            Name of the joint.
        at : "origin" or array_like
            Point about which the moment is taken: the joint's origin, or shape (3,), m, world frame.
        frame : {"world", "local"}
            Axes of the wrench: the world's or those of the joint's child link.

        Returns
        -------
        ndarray
            Shape (6,), force then moment, N and N m.

        Examples
        --------
        >>> rod = '<joint name="hinge" axis="0 1 0"/><inertial mass="2" pos="0.3 0 0" diaginertia="0.1 0.1 0.1"/>'
        >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
        >>> wrench = chain.rnea([0.0]).joint_wrench("hinge")
        >>> [round(float(each), 3) for each in wrench[[2, 4]]]  # N, N m: the weight, and its moment about the hinge
        [19.62, -5.886]
        """
        index = self._state.joint_index(joint)
        if index == 0:
            raise InvalidInput(f"{joint!r} is the world, which has no joint: expected the name of a joint of the tree")
        pose = self._poses[index]
        wrench = self._joint_wrenches[index].reshape(2, 3) @ pose[:3]  # R f, because pose[:3] is Rᵀ
        return _expressed(wrench, pose[3], (pose[3], pose[:3]), at, frame)

    def closure_wrench(
        self, closure: str, at: Literal["origin"] | ArrayLike = "origin", frame: Literal["world", "local"] = "world"
    ) -> FloatArray:
        """Wrench that a closure transmits from the body of frame b to the body of frame a.

        Parameters
        ----------
        closure : str
            Name of the closure.
        at : "origin" or array_like
            Point about which the moment is taken: the closure's point, frame b's origin, or shape (3,), m, world
            frame.
        frame : {"world", "local"}
            Axes of the wrench: the world's or those of the closure's frame a.

        Returns
        -------
        ndarray
            Shape (6,), force then moment, N and N m.

        Raises
        ------
        InvalidInput
            If the closure is a coupling, which joins no bodies.

        Examples
        --------
        >>> chain = ep.load("four-cables").chain
        >>> force = np.zeros(chain.row_count)
        >>> force[chain.rows("limb_1_base")] = 3.0, 0.0, 4.0
        >>> wrench = chain.rnea(chain.close(chain.neutral()), multipliers=force).closure_wrench("limb_1_base")
        >>> float(np.linalg.norm(wrench[:3]).round(9))  # N, of three rows in perpendicular axes
        5.0
        """
        names = [item.name for item in self._state.closures]
        index = names.index(as_choice("closure", closure, names))
        refuse_coupling(self._state.closures[index])
        own = closure_frame(self._state.topology, self._poses, index)
        return _expressed(self._closure_wrenches[index], np.zeros(3), own, at, frame)


def _expressed(
    wrench: FloatArray, about: FloatArray, own: tuple[FloatArray, FloatArray], at: str | ArrayLike, frame: str
) -> FloatArray:
    """A wrench in world axes about one point, about another, by default the own one, in world or own axes."""
    as_choice("frame", frame, ("world", "local"))
    point, axes = own
    if isinstance(at, str):
        as_choice("point", at, ("origin",))
    else:
        point = as_finite("at", at, (3,))
    columns = shifted(wrench.reshape(6, 1), point - about)
    return (turned(columns, axes) if frame == "local" else columns).reshape(6)


def rnea(
    state: ChainState,
    q: ArrayLike,
    v: ArrayLike | None = None,
    a: ArrayLike | None = None,
    multipliers: ArrayLike | None = None,
    external: Mapping[str, ArrayLike] | None = None,
) -> TreeForces:
    """Generalised forces of the tree, and the wrench that every joint transmits.

    τ = M a + h - passive - Jᵀλ - external: the efforts of the actuators that balance the multipliers λ and the
    passive forces of springs, damping and dry friction in joints that move or start to move.

    Parameters
    ----------
    q : array_like
        Shape (nq,).
    v, a : array_like, optional
        Shape (nv,); zero if left out.
    multipliers : array_like, optional
        λ, shape (rows,), as the class describes; zero if left out.
    external : mapping, optional
        Frame name to wrench (force, moment), shape (6,), on the body of that frame, moment about the frame's
        origin, world axes, N and N m.

    Returns
    -------
    TreeForces
        With ``tau`` and the joints' wrenches; a wrench is the sum of bearing, actuator, spring, damper and couplings.

    Raises
    ------
    UnsupportedDynamics
        If a joint with dry friction neither moves nor accelerates, so that its friction is a range.

    Examples
    --------
    >>> rod = '<joint name="hinge" axis="0 1 0"/><inertial mass="2" pos="0 0 -0.5" diaginertia="0.1 0.1 0.1"/>'
    >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
    >>> chain.rnea([0.0], a=[1.0]).tau.round(3)  # N m: inertia about the hinge, 0.1 + 2 · 0.5²
    array([0.6])
    """
    work, top, model = state.buffers, state.topology, state.model
    data, q = work.data, state.configuration(q)
    v = work.still if v is None else state.tangent("v", v)
    a = work.still if a is None else state.tangent("a", a)
    pin.forwardKinematics(model, data, q)
    work.external[:] = 0.0
    work.wrenches[:] = 0.0
    if multipliers is not None:
        multipliers = state.vector("multipliers", multipliers, state.row_count)
        closure_wrenches(
            work.poses, multipliers, work.unit_wrenches(), top.joints, top.rows, work.wrenches, work.external
        )
    put_on(state, external)
    tau = np.array(pin.rnea(model, data, q, v, a, work.external_vector))
    if state.passive.rubs:
        rubbing = friction_of(state, v, a)
        refuse_rest(state, rubbing, "use inverse_dynamics, or without_friction() for the chain without it")
        tau -= rubbing.force
    if state.passive.act:
        tau -= state.passive.force(q, v)
    if multipliers is not None and len(top.coupled):
        tau -= coupling_forces(top.coupled, top.polynomials, q, multipliers, model.nv)
    return TreeForces(tau, state, work.forces.copy(), work.wrenches.copy(), work.poses.copy())
