"""Results of dynamics: efforts, multipliers, and the reaction of any joint or closure with its certificate."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors.checked import checked
from ...core.validation import FloatArray, frozen
from ..kinematics.rank import rank_tolerance
from .joint_efforts import JointEfforts
from .stacks.certificates import Certified, certified
from .wrenches import JointReaction, expressed, on_body, own_frame, transmitting_part

__all__ = ["ClosedForces", "JointReaction"]

_NO_DIRECTION = frozen(np.zeros((6, 0)))
#: Forces are ill-conditioned where they are this many times the loads and a singular value this share of the largest.
_AMPLIFIED, _WEAK = 10.0, 1e-2


@checked
@dataclass(frozen=True, eq=False)
class ClosedForces(JointEfforts):
    """Forces in a closed chain at one state.

    Attributes
    ----------
    tau : ndarray
        Shape (nv,), efforts of the joints' actuators, N and N m; zero for joints without one.
    multipliers : ndarray
        λ, shape (rows,), as :class:`exo_pin.chain.ClosedChain` describes.
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
        if not share > _AMPLIFIED or not len(passive) or not self.multipliers.size:
            return ()
        scaled = (equations.jacobian * top.row_scale[:, None] * top.column)[:, passive]
        values = np.linalg.svd(scaled, compute_uv=False)
        zero = rank_tolerance(scaled.shape, float(values[0]), state.model.njoints, equations.gap)
        least = float(values[values > zero].min(initial=values[0])) / float(values[0])
        if least > _WEAK:
            return ()
        effort = self.tau[efforts.argmax()]
        worst = str(state.model.names[int(top.owners[efforts.argmax()])])
        return (
            f"the forces are ill-conditioned: the largest, with an effort of {effort:.4g} in {worst}, is {share:.0f} "
            "times the loads, because the loops hold one motion of the joints without actuator with "
            f"{least:.1e} of the strength of another (limit {_WEAK:g}); an error of 0.1 % in the geometry may change "
            f"these forces by up to about {min(0.1 / least, 100.0):.0f} %: move away from the singular configuration, "
            "or actuate a joint of this motion",
        )

    @cached_property
    def _all(self) -> Certified:
        """All joints and closures about their own points in world axes: computed together, at the first reaction."""
        columns = np.column_stack([self.multipliers, self._start - self.multipliers, self.self_stresses])
        return self._certified(self._equations.wrenches(columns).reshape(-1, 6, columns.shape[1]))

    def _certified(self, columns: FloatArray) -> Certified:
        """Values and certificates of several wrenches."""
        length = self._equations.state.characteristic_length
        return certified(columns, length, np.full(len(columns), self._sharpness))

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
