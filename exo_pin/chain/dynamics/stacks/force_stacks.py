"""Forces of many samples at once: a trajectory's efforts, multipliers and reactions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ....core.errors import ExoPinError
from ....core.errors.checked import checked
from ....core.records import Record
from ....core.validation import FloatArray, frozen
from ...structure.chain_state import ChainState
from ..equations.motion_kernels import wrenches_of_stack
from ..reactions import ClosedForces
from ..wrenches import JointReaction, certified, expressed, on_body, own_frame, transmitting_part


@checked
@dataclass(frozen=True, eq=False)
class ClosedForcesStack(Record):
    """Forces in a closed chain in n samples, such as those of a trajectory.

    A sample without an answer has its reason in ``status`` and ``failures``; its numbers are NaN, and no other sample
    is affected. The others are as :meth:`ClosedChain.inverse_dynamics` has them one by one.

    Attributes
    ----------
    q, v, a : ndarray
        Shapes (n, nq), (n, nv), (n, nv), the motion to which the forces belong.
    tau, friction : ndarray
        Shape (n, nv), efforts and dry friction, N and N m.
    multipliers : ndarray
        λ, shape (n, rows).
    residual : ndarray
        Shape (n,), the largest error of the equations of motion, N and N m.
    undetermined : ndarray of int
        Shape (n,), dimension of the self-stresses; -1 without an answer.
    effort_is_unique : ndarray of bool
        Shape (n, nv), false without an answer.
    status : ndarray of str
        Shape (n,): "ok", or the error's name in words: "loop_not_closed", "undriven_motion", ...
    failures : mapping of int to ExoPinError
        The errors, by sample.

    Examples
    --------
    >>> rod = '<joint name="hinge" axis="0 1 0"/><inertial mass="2" pos="0 0 -0.5" diaginertia="1 1 1"/>'
    >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
    >>> forces = chain.inverse_dynamics(np.deg2rad([[0.0], [30.0], [90.0]]), actuated=["hinge"])
    >>> forces.tau[:, 0].round(3), forces.status.tolist()  # N m: m g r sin q
    (array([0.   , 4.905, 9.81 ]), ['ok', 'ok', 'ok'])
    """

    q: FloatArray
    v: FloatArray
    a: FloatArray
    tau: FloatArray
    friction: FloatArray
    multipliers: FloatArray
    residual: FloatArray
    undetermined: NDArray[np.int64]
    effort_is_unique: NDArray[np.bool_]
    status: NDArray[np.str_]
    failures: Mapping[int, ExoPinError]
    state: ChainState = field(repr=False)
    poses: FloatArray = field(repr=False)  # (n, njoints, 4, 3)
    _tree: FloatArray = field(repr=False)  # (n, njoints, 6), joints' wrenches at λ = 0, about the world's origin
    _unit: FloatArray = field(repr=False)  # (n, rows, 6), wrenches of multipliers of one
    _columns: FloatArray = field(repr=False)  # (n, rows, 2 + k): λ, what z = 0 adds to it, self-stresses
    _sharpness: FloatArray = field(repr=False)  # (n,), the share of a self-stress that is rounding
    _bounded: Mapping[int, ClosedForces] = field(repr=False)  # samples whose bounds narrow the intervals

    def __len__(self) -> int:
        return len(self.q)

    def __str__(self) -> str:
        lines = [f"forces of {len(self)} samples, {len(self) - len(self.failures)} with an answer"]
        for name in self.state.roles.actuated if len(self) > len(self.failures) else ():
            low, high = (np.round(of(self.effort(name), axis=0), 6) + 0.0 for of in (np.nanmin, np.nanmax))
            lines.append(f"effort of {name:24} from {low} to {high}")
        lines += [f"sample {k}: {error}" for k, error in list(self.failures.items())[:3]]
        return "\n".join([*lines, *(["..."] if len(self.failures) > 3 else [])])

    def effort(self, joint: str) -> FloatArray:
        """Effort of a joint's actuator, shape (n, nv of the joint), N or N m.

        Parameters
        ----------
        joint : str
            Name of a joint of the tree.

        Returns
        -------
        ndarray
            Shape (n, nv of the joint), N or N m.

        Examples
        --------
        >>> rod = '<joint name="hinge" axis="0 1 0"/><inertial mass="2" pos="0 0 -0.5" diaginertia="0.1 0.1 0.1"/>'
        >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
        >>> forces = chain.inverse_dynamics(np.zeros((2, 1)), a=[[1.0], [2.0]], actuated=["hinge"])
        >>> forces.effort("hinge").round(6).tolist()  # N m, of an inertia of 0.6 kg m²
        [[0.6], [1.2]]
        """
        return self.tau[:, self.state.velocity_slice(joint)].copy()

    def joint_reaction(
        self,
        joint: str,
        on: str | None = None,
        at: str | ArrayLike = "origin",
        in_frame: str = "world",
        intervals: bool = True,
    ) -> JointReaction:
        """Wrench that a tree joint or a closure transmits, in every sample.

        Parameters, and what is raised, are those of :meth:`exo_pin.chain.ClosedForces.joint_reaction`.

        Parameters
        ----------
        joint, on, at, in_frame, intervals
            As there.

        Returns
        -------
        JointReaction
            A stack of n.

        Examples
        --------
        >>> rod = '<joint name="hinge" axis="0 1 0"/><inertial mass="2" pos="0 0 -0.5" diaginertia="1 1 1"/>'
        >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
        >>> forces = chain.inverse_dynamics(np.zeros((3, 1)), [[0.0], [2.0], [4.0]], actuated=["hinge"])
        >>> forces.joint_reaction("hinge").wrench[:, 2].round(2)  # N: m (g + ω² r)
        array([19.62, 23.62, 35.62])
        """
        part = transmitting_part(self.state, joint)
        columns, receiver = expressed(
            self, joint, self._wrenches(part.place), own_frame(self, part.place), (part.receiver, part.other), on, at,
            in_frame,
        )  # fmt: skip
        narrowed = self._intervals(lambda forces: forces.joint_reaction(joint, on, at, in_frame), intervals)
        return self._reaction(joint, receiver, columns, narrowed)

    def wrench_on(
        self, body: str, at: str | ArrayLike = "origin", in_frame: str = "world", intervals: bool = True
    ) -> JointReaction:
        """Total wrench of all joints and closures on a body, in every sample.

        Parameters, and what is raised, are those of :meth:`exo_pin.chain.ClosedForces.wrench_on`.

        Parameters
        ----------
        body, at, in_frame, intervals
            As there.

        Returns
        -------
        JointReaction
            A stack of n.

        Examples
        --------
        >>> exo = ep.load("three-linear-actuators")
        >>> chain = exo.chain
        >>> q = chain.close(chain.neutral())
        >>> forces = chain.inverse_dynamics(np.stack([q, q]), external={"arm": [[0.0] * 6, [0, 0, -10, 0, 0, 0]]})  # N
        >>> on_arm = forces.wrench_on("arm", intervals=False).wrench[:, 2]
        >>> (on_arm - 9.81 * exo.arm.mass).round(9) + 0.0  # N: its weight, and in the second sample the load
        array([ 0., 10.])
        """
        index, name = self.state.body_index(body), "all joints and closures"
        own = self.poses[:, index, 3], self.poses[:, index, :3]
        total = on_body(self, index, self._columns.shape[2], self._wrenches)
        columns, receiver = expressed(self, name, total, own, (index, index), body, at, in_frame)
        narrowed = self._intervals(lambda forces: forces.wrench_on(body, at, in_frame), intervals)
        return self._reaction(name, receiver, columns, narrowed)

    def _wrenches(self, place: int) -> FloatArray:
        """Wrenches of a part about its own point, shape (n, 6, 2 + k)."""
        top, out = self.state.topology, np.empty((len(self), 6, self._columns.shape[2]))
        wrenches_of_stack(self.poses, self._tree, self._unit, top.carried, top.loops, self._columns, place, out)
        return out

    def _intervals(self, of: Callable[[ClosedForces], JointReaction], wanted: bool) -> dict[int, FloatArray]:
        return {k: of(forces).interval for k, forces in self._bounded.items()} if wanted else {}

    def _reaction(
        self, name: str, receiver: str, columns: FloatArray, narrowed: Mapping[int, FloatArray]
    ) -> JointReaction:
        found = certified(columns, self.state.characteristic_length, self._sharpness)
        unique, ranges = found.unique.copy(), found.ranges.copy()
        for k, interval in narrowed.items():
            ranges[k] = interval
        failed = self.status != "ok"
        unique[failed], ranges[failed] = False, np.nan
        directions = found.basis[:, :, : int(found.counts.max(initial=0))].copy()
        return JointReaction(name, receiver, found.value, frozen(unique), frozen(directions), frozen(ranges))
