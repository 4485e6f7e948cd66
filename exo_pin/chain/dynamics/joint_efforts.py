"""Forces along the coordinates of joints: efforts, dry friction and couplings, with their ranges."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...core.records import Record
from ...core.validation import FloatArray
from .equations.equations_of_motion import EquationsOfMotion
from .force_distribution import Bound, ForceDistribution, interval
from .nonsmooth.resting_friction import RestingFriction


@dataclass(frozen=True, eq=False)
class JointEfforts(Record):
    """The data of :class:`.ClosedForces`, which describes them, and what concerns single joints."""

    tau: FloatArray
    multipliers: FloatArray
    residual: float
    undetermined: int
    effort_is_unique: NDArray[np.bool_]
    self_stresses: FloatArray
    _equations: EquationsOfMotion = field(repr=False)
    _start: FloatArray = field(repr=False)  # λ at z = 0
    _sharpness: float = field(repr=False)  # share of a self-stress that is rounding
    _metric: str = field(repr=False)
    _bounds: tuple[Bound, ...] = field(repr=False, default=())
    _friction: FloatArray | None = field(repr=False, default=None)
    _rest: RestingFriction | None = field(repr=False, default=None)
    _passive: NDArray[np.int64] | None = field(repr=False, default=None)  # coordinates without actuator

    @property
    def friction(self) -> FloatArray:
        """Dry friction of the joints, shape (nv,), N and N m; at rest one of the values in ``friction_interval``."""
        return np.zeros(len(self.tau)) if self._friction is None else self._friction

    @property
    def equations(self) -> EquationsOfMotion:
        """The equations of motion that the forces solve."""
        return self._equations

    @property
    def is_bounded(self) -> bool:
        """Whether bounds may narrow the intervals of undetermined forces."""
        return bool(self._bounds)

    @cached_property
    def _distribution(self) -> ForceDistribution:
        metric = self._equations.metric(self._start, self.self_stresses, self._metric)
        return ForceDistribution(metric, self._bounds, self._sharpness)

    def effort(self, joint: str) -> FloatArray:
        """Effort of a joint's actuator, shape (nv of the joint,), N or N m.

        Parameters
        ----------
        joint : str
            Its name in the model.

        Returns
        -------
        numpy.ndarray
            Shape (nv of the joint,), N m about a hinge and N along a slide, positive along the joint's axis.

        Examples
        --------
        >>> chain = ep.load("four-linear-actuators").chain_with_masses()
        >>> forces = chain.inverse_dynamics(chain.close(chain.neutral()))
        >>> round(float(forces.effort("limb_1_slide")[0]), 2)  # N; a slide that pulls has a negative effort
        7.5
        """
        return self.tau[self._equations.state.velocity_slice(joint)].copy()

    def effort_interval(self, joint: str) -> FloatArray:
        """Least and largest effort within the bounds, shape (nv of the joint, 2); infinite where it is not bounded.

        Dry friction at rest is one of the undetermined forces.

        Parameters
        ----------
        joint : str
            Its name in the model.

        Returns
        -------
        numpy.ndarray
            Shape (nv of the joint, 2), N m or N, signed as :meth:`effort`: least, greatest.

        Examples
        --------
        >>> chain = ep.load("four-linear-actuators").chain_with_masses()
        >>> bounds = {slide: (-50.0, 50.0) for slide in chain.roles.actuated}  # N
        >>> forces = chain.inverse_dynamics(chain.close(chain.neutral()), effort_bounds=bounds)
        >>> forces.effort_interval("limb_2_slide").round(1)  # N, over all ways to hold the arm within them
        array([[-10.4,   8.7]])
        """
        own = self._equations.state.velocity_slice(joint)
        if self._rest is not None:
            return self._rest.efforts(own, self._joint_forces(own, self._rest.total_is_unique))
        return self._joint_forces(own, self.effort_is_unique)

    def friction_interval(self, joint: str) -> FloatArray:
        """Least and largest dry friction within the bounds, shape (nv of the joint, 2), N or N m.

        Parameters
        ----------
        joint : str
            Its name in the model.

        Returns
        -------
        numpy.ndarray
            Shape (nv of the joint, 2), N m or N, signed as :meth:`effort`: least, greatest.

        Examples
        --------
        >>> rod = '<joint name="hinge" axis="0 1 0" frictionloss="3"/><geom size="0.1" mass="2" pos="0 0 -0.5"/>'
        >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
        >>> chain.inverse_dynamics([0.2], actuated=["hinge"]).friction_interval("hinge")  # N m, of the hinge at rest
        array([[-3.,  3.]])
        """
        own = self._equations.state.velocity_slice(joint)
        if self._rest is None:
            return np.column_stack([self.friction[own], self.friction[own]])
        return self._rest.frictions(own, self.friction, self._joint_forces(own, self._rest.total_is_unique))

    def _joint_forces(self, own: slice, unique: NDArray[np.bool_]) -> FloatArray:
        """Ranges of effort and friction at rest together."""
        total = self.tau[own] if self._rest is None else self._rest.total[own]
        ranges = np.column_stack([total, total])
        ranges[~unique[own]] = -np.inf, np.inf
        effect = -self._equations.jacobian[:, own].T
        return self._bounded(ranges, self._equations.tau[own] + effect @ self._start, effect @ self.self_stresses)

    def coupling(self, name: str) -> dict[str, float]:
        """Generalised force that a coupling makes in each of its joints, by joint, N or N m.

        It acts as motors in the joints would, between the two bodies of each; the joint's reaction contains it.
        ``self_stresses`` has zeros in the coupling's row where it is the same in every solution.

        Parameters
        ----------
        name : str
            Name of the closure, a coupling.

        Returns
        -------
        dict of str to float
            By joint, N m for a hinge and N for a slide, positive along the joint's axis.

        Raises
        ------
        UnknownName
            If there is no such closure.
        InvalidInput
            If the closure is no coupling.

        Examples
        --------
        >>> arm = '<body><joint name="{}" axis="0 1 0"/><inertial mass="1" pos="{} 0 0" diaginertia="1 1 1"/></body>'
        >>> gears = '<equality><joint name="gears" joint1="small" joint2="large" polycoef="0 -2 0 0 0"/></equality>'
        >>> arms = arm.format("large", 0.0) + arm.format("small", 0.3)
        >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody>{arms}</worldbody>{gears}</mujoco>")
        >>> torques = chain.inverse_dynamics([0.0, 0.0], actuated=["large"]).coupling("gears")
        >>> {joint: round(value, 3) for joint, value in torques.items()}  # N m: 1 kg at 0.3 m, and twice that
        {'large': -5.886, 'small': -2.943}
        """
        state = self._equations.state
        row = state.rows(name).start
        closure = next(item for item in state.closures if item.name == name)
        if closure.polynomial is None:
            raise InvalidInput(f"closure {name!r} is no coupling but {closure.type}: see joint_reaction")
        effect = self._equations.jacobian[row] * self.multipliers[row]
        joints = [joint for joint in (closure.frame_a, closure.frame_b) if joint != "universe"]
        return {joint: float(effect[state.velocity_slice(joint)][0]) for joint in joints}

    def _bounded(self, ranges: FloatArray, start: FloatArray, slope: FloatArray) -> FloatArray:
        """Ranges of components start + slope z, shape (count, 2), narrowed by the bounds where they are infinite."""
        for k in np.flatnonzero(np.isinf(ranges[:, 0])) if self._bounds else ():
            ranges[k] = interval(self._distribution, float(start[k]), slope[k])
        return ranges
