"""Results of dynamics: efforts, multipliers, and the reaction of any joint or closure with its certificate."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.records import Record
from ...core.validation import FloatArray, frozen
from ..kinematics.rank import digits_caution, rank_tolerance
from .equations.equations_of_motion import EquationsOfMotion
from .force_distribution import Bound, ForceDistribution, interval
from .nonsmooth.joint_friction import RestingFriction
from .wrenches import Certified, JointReaction, certified, expressed, on_body, own_frame, transmitting_part

__all__ = ["ClosedForces", "JointReaction"]

_NO_DIRECTION = frozen(np.zeros((6, 0)))
#: Forces are ill-conditioned where they are this many times the loads and a singular value this share of the largest.
_AMPLIFIED, _WEAK = 10.0, 1e-2


@checked
@dataclass(frozen=True, eq=False)
class ClosedForces(Record):
    """Forces in a closed chain at one state.

    Attributes
    ----------
    tau : ndarray
        Shape (nv,), efforts of the joints' actuators, N and N m; zero for joints without one.
    multipliers : ndarray
        λ, shape (rows,), N and N m, as :class:`exo_pin.ClosedChain` describes.
    residual : float
        Largest error of M a + h - passive - external = τ + Jᵀλ, N and N m.
    undetermined : int
        Dimension of the self-stresses, the sets of multipliers and efforts that make no motion.
    effort_is_unique : ndarray of bool
        Shape (nv,), which efforts are the same in every solution.
    self_stresses : ndarray
        Shape (rows, undetermined), a basis of the self-stresses: their multiples may be added to λ.
    cautions : tuple of str
        Doubts about the forces.

    Examples
    --------
    >>> exo = ep.load("four-cables")
    >>> forces = exo.chain.inverse_dynamics(exo.chain.close(exo.chain.neutral()))
    >>> forces.undetermined, bool(forces.residual < 1e-9)  # four cables for three freedoms; N, N m
    (1, True)
    """

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

    def __str__(self) -> str:
        state, lines = self.equations.state, list[str]()
        for name in list(state.model.names)[1:]:
            own = state.velocity_slice(name)
            units = np.where(state.topology.metres[own], "N", "N m")
            for value, unit, unique in zip(self.tau[own], units, self.effort_is_unique[own], strict=True):
                if value != 0.0 or not unique or name in state.roles.actuated:
                    lines.append(f"effort of {name:24} {value:14.6f} {unit:4} {'unique' if unique else 'undetermined'}")
        held = f"not all unique (self-stresses: {self.undetermined})" if self.undetermined else "unique"
        lines.append(f"forces in joints and closures are {held}; joint_reaction(name) returns each")
        lines += [f"Caution: {text}" for text in self.cautions]
        return "\n".join([*lines, f"equations of motion hold to {self.residual:.1e} (N, N m)"])

    @cached_property
    def cautions(self) -> tuple[str, ...]:
        """Doubts about the forces: whether small errors of the geometry change them by much."""
        equations = self.equations
        state, top = equations.state, equations.state.topology
        passive = np.arange(state.nv) if self._passive is None else self._passive
        efforts, loops = np.abs(self.tau * top.column), np.abs(self.multipliers / top.row_scale)
        load = max(equations.weights().max(initial=0.0), np.abs(equations.tau * top.column).max(initial=0.0))
        share = max(efforts.max(initial=0.0), loops.max(initial=0.0)) / load if load > 0.0 else 0.0
        if not (share > _AMPLIFIED or state.digits) or not len(passive) or not self.multipliers.size:
            return ()
        scaled = (equations.jacobian * top.row_scale[:, None] * top.column)[:, passive]
        values = np.linalg.svd(scaled, compute_uv=False)
        known = state.digits or equations.gap
        zero = rank_tolerance(scaled.shape, float(values[0]), state.model.njoints, known)
        least = float(values[values > zero].min(initial=values[0])) / float(values[0])
        if least > _WEAK or not share > _AMPLIFIED:
            return digits_caution(state.digits, values, zero)
        effort = self.tau[efforts.argmax()]
        worst = str(state.model.names[int(top.owners[efforts.argmax()])])
        return (
            f"the forces are ill-conditioned: the largest, with an effort of {effort:.4g} in {worst}, is {share:.0f} "
            "times the loads, because the loops hold one motion of the joints without actuator with "
            f"{least:.1e} of the strength of another (limit {_WEAK:g}); an error of 0.1 % in the geometry may change "
            f"these forces by up to about {min(0.1 / least, 100.0):.0f} %: move away from the singular configuration, "
            "or actuate a joint of this motion",
        )

    @property
    def friction(self) -> FloatArray:
        """Dry friction of the joints, shape (nv,), N and N m; at rest one of the values in ``friction_interval``."""
        return np.zeros(len(self.tau)) if self._friction is None else self._friction

    @property
    def equations(self) -> EquationsOfMotion:
        """The equations of motion that the forces solve."""
        return self._equations

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

    @cached_property
    def _all(self) -> Certified:
        """All joints and closures about their own points in world axes: computed together, at the first reaction."""
        columns = np.column_stack([self.multipliers, self._start - self.multipliers, self.self_stresses])
        return self._certified(self._equations.wrenches(columns).reshape(-1, 6, columns.shape[1]))

    def _certified(self, columns: FloatArray) -> Certified:
        """Values and certificates of several wrenches."""
        length = self._equations.state.characteristic_length
        return certified(columns, length, self._sharpness)

    def joint_reaction(
        self,
        joint: str,
        on: str | None = None,
        at: str | ArrayLike = "origin",
        in_frame: str = "world",
        intervals: bool = True,
    ) -> JointReaction:
        """Wrench that a tree joint or a closure transmits.

        Parameters
        ----------
        joint : str
            Name of a joint of the tree or of a closure.
        on : str, optional
            The body that receives it, by the name of one of its frames; by default the child link of a joint and the
            body of frame a of a closure.
        at : str or array_like
            Point about which the moment is taken: "origin" (the joint's, or the closure's point, which is frame b's
            origin), a frame's name for its origin, or shape (3,), m, world frame.
        in_frame : str
            Axes of the wrench: "world", "local" (the child link's, or those of the closure's frame a), or a frame's
            name.
        intervals : bool
            Whether to compute the intervals of undetermined components; otherwise they are infinite.

        Returns
        -------
        JointReaction

        Raises
        ------
        UnknownName
            If there is no such joint, closure or frame.
        InvalidInput
            If ``on`` is neither of the two bodies, a joint and a closure share the name, or the closure is a coupling.

        Examples
        --------
        >>> rod = '<joint name="hinge" axis="0 1 0"/><inertial mass="2" pos="0.5 0 0" diaginertia="1 1 1"/>'
        >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body name='rod'>{rod}</body></worldbody></mujoco>")
        >>> reaction = chain.inverse_dynamics([0.0], actuated=["hinge"]).joint_reaction("hinge", on="universe")
        >>> reaction.wrench.round(2) + 0.0  # N, N m: the weight and its moment, on the base
        array([  0.  ,   0.  , -19.62,   0.  ,   9.81,   0.  ])
        """
        state = self._equations.state
        part = transmitting_part(state, joint)
        bodies = part.receiver, part.other
        if on is None and isinstance(at, str) and at == "origin" and in_frame == "world":
            return self._reaction(joint, state.body_names[bodies[0]], self._all, part.place, intervals)
        own = own_frame(self._equations, part.place)
        columns = self._all.columns[part.place]
        columns, receiver = expressed(self._equations, joint, columns, own, bodies, on, at, in_frame)
        return self._reaction(joint, receiver, self._certified(columns[None]), 0, intervals)

    def wrench_on(
        self, body: str, at: str | ArrayLike = "origin", in_frame: str = "world", intervals: bool = True
    ) -> JointReaction:
        """Total wrench of all joints and closures on a body.

        With the weight and the external forces it accelerates the body. On the world it is the mechanism's whole load
        on its base, without the weight of links that are fixed to the world.

        Parameters
        ----------
        body : str
            Name of one of the body's frames, "universe" for the world.
        at, in_frame, intervals
            As for :meth:`joint_reaction`; "origin" and "local" are the body's first joint's, the world's for the
            world.

        Returns
        -------
        JointReaction
            Force on the body, N, and moment about ``at``, N m, in the axes of ``in_frame``.

        Examples
        --------
        >>> chain = ep.load("prototype").chain_with_masses()
        >>> forces = chain.inverse_dynamics(chain.close(chain.neutral()))
        >>> mass = sum(inertia.mass for inertia in chain.model.inertias.tolist()[1:])
        >>> base = forces.wrench_on("universe", intervals=False)
        >>> round(float(base.wrench[2] / (9.81 * mass)), 9)  # however the loops share it, the base bears the weight
        -1.0
        """
        state = self._equations.state
        index = state.body_index(body)
        pose = self._equations.poses[index]
        total = on_body(self._equations, index, 2 + self.undetermined, lambda place: self._all.columns[place])
        own, name = (pose[3], pose[:3]), "all joints and closures"
        columns, receiver = expressed(self._equations, name, total, own, (index, index), body, at, in_frame)
        return self._reaction(name, receiver, self._certified(columns[None]), 0, intervals)

    def _reaction(self, name: str, receiver: str, wrenches: Certified, k: int, intervals: bool) -> JointReaction:
        count, ranges = wrenches.counts[k], wrenches.ranges[k]
        directions = frozen(wrenches.basis[k, :, :count].copy()) if count else _NO_DIRECTION
        if intervals and self._bounds:
            columns = wrenches.columns[k]
            ranges = frozen(self._bounded(ranges.copy(), columns[:, 0] + columns[:, 1], columns[:, 2:]))
        return JointReaction(name, receiver, wrenches.value[k], wrenches.unique[k], directions, ranges)
