"""Results of dynamics: efforts, multipliers, and the reaction of any joint or closure with its certificate."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.errors import InvalidInput, UnknownName
from ...core.records import Record
from ...core.validation import FloatArray, as_finite, frozen
from ..structure.couplings import refuse_coupling
from .equations_of_motion import EquationsOfMotion, Wrench
from .force_distribution import Bound, ForceDistribution, interval

__all__ = ["ClosedForces", "JointReaction", "wrench_of"]

_COMPONENTS = ("F_x", "F_y", "F_z", "M_x", "M_y", "M_z")


@dataclass(frozen=True, eq=False)
class JointReaction(Record):
    """Wrench that a joint or closure transmits, and which components equilibrium determines; prints as a table.

    Attributes
    ----------
    name : str
        Of the joint or closure.
    on : str
        The body that receives it.
    wrench : ndarray
        Shape (6,), force and moment, N and N m.
    unique : ndarray of bool
        Shape (6,): which components are the same in every solution of the equations of motion (Wojtyra's criterion:
        no self-stress of the chain changes them).
    directions : ndarray
        Shape (6, r), the directions in which the wrench may change without any motion: the image of the
        chain's self-stresses, orthonormal with moments divided by the characteristic length. r = 0 if it is unique.
    interval : ndarray
        Shape (6, 2), least and largest value of each component within the bounds; infinite where it is not bounded,
        twice the value where it is unique.
    """

    name: str
    on: str
    wrench: FloatArray
    unique: NDArray[np.bool_]
    directions: FloatArray
    interval: FloatArray

    @property
    def force(self) -> FloatArray:
        """Shape (3,), N."""
        return self.wrench[:3]

    @property
    def moment(self) -> FloatArray:
        """Shape (3,), N m, about the point given as ``at``."""
        return self.wrench[3:]

    @property
    def undetermined(self) -> int:
        """Number of independent directions in which the wrench is undetermined."""
        return self.directions.shape[1]

    def __str__(self) -> str:
        lines = [f"{self.name} on {self.on}"]
        for k, name in enumerate(_COMPONENTS):
            low, high = self.interval[k]
            note = "unique" if self.unique[k] else f"undetermined, from {low:.6g} to {high:.6g}"
            lines.append(f"{name} {self.wrench[k]:14.6f} {'N' if k < 3 else 'N m':4} {note}")
        return "\n".join(lines)


@dataclass(frozen=True, eq=False)
class ClosedForces(Record):
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

    @cached_property
    def _distribution(self) -> ForceDistribution:
        metric = self._equations.metric(self._start, self.self_stresses, self._metric)
        return ForceDistribution(metric, self._bounds, self._sharpness)

    def effort(self, joint: str) -> FloatArray:
        """Effort of a joint's actuator, shape (nv of the joint,), N or N m."""
        return self.tau[self._equations.state.velocity_slice(joint)].copy()

    def effort_interval(self, joint: str) -> FloatArray:
        """Least and largest effort within the bounds, shape (nv of the joint, 2); infinite where it is not bounded."""
        own = self._equations.state.velocity_slice(joint)
        effect = -self._equations.jacobian[:, own].T
        return self._intervals(self._equations.tau[own], effect, self.effort_is_unique[own], self.tau[own])

    def coupling(self, name: str) -> dict[str, float]:
        """Generalised force that a coupling makes in each of its joints, by joint, N or N m.

        It acts as motors in the joints would, between the two bodies of each; the joint's reaction contains it.
        ``self_stresses`` has zeros in the coupling's row where it is the same in every solution.

        Raises
        ------
        UnknownName
            If there is no such closure.
        InvalidInput
            If the closure is no coupling.
        """
        state = self._equations.state
        row = state.rows(name).start
        closure = next(item for item in state.closures if item.name == name)
        if closure.polynomial is None:
            raise InvalidInput(f"closure {name!r} is no coupling but {closure.type}: see joint_reaction")
        effect = self._equations.jacobian[row] * self.multipliers[row]
        joints = [joint for joint in (closure.frame_a, closure.frame_b) if joint != "universe"]
        return {joint: float(effect[state.velocity_slice(joint)][0]) for joint in joints}

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

        Raises
        ------
        UnknownName
            If there is no such joint, closure or frame.
        InvalidInput
            If ``on`` is neither of the two bodies, a joint and a closure share the name, or the closure is a coupling.
        """
        wrench, own, bodies = wrench_of(self._equations, joint)
        return self._answer(joint, wrench, own, bodies, on, at, in_frame, intervals)

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
        """
        equations = self._equations
        state, model = equations.state, equations.state.model
        index = _body(equations, body)
        parts = [equations.joint(index)] if index else []
        parts += [
            equations.joint(child).reversed() for child in range(1, model.njoints) if model.parents[child] == index
        ]
        for c, (body_a, body_b) in enumerate(state.topology.joints):
            if body_a != body_b and index in (body_a, body_b):
                parts.append(equations.closure(c) if index == body_a else equations.closure(c).reversed())
        total = Wrench(
            np.sum([part.constant for part in parts], axis=0) + np.zeros(6),
            np.sum([part.effect for part in parts], axis=0) + np.zeros((6, len(self.multipliers))),
        )
        pose = equations.poses[index]
        own = pose[3], pose[:3]
        return self._answer("all joints and closures", total, own, (index, index), body, at, in_frame, intervals)

    def _answer(
        self,
        name: str,
        wrench: Wrench,
        own: tuple[FloatArray, FloatArray],
        bodies: tuple[int, int],
        on: str | None,
        at: str | ArrayLike,
        in_frame: str,
        intervals: bool,
    ) -> JointReaction:
        equations = self._equations
        receiver = bodies[0]
        if on is not None:
            receiver = _body(equations, on)
            if receiver not in bodies:
                one, other = (equations.state.body_names[body] for body in bodies)
                raise InvalidInput(f"on={on!r} is not a body of {name!r}: expected {one!r} or {other!r}")
            if receiver != bodies[0]:
                wrench = wrench.reversed()
        expressed = wrench.expressed_in(*_axes_and_point(equations, own, at, in_frame))
        value = expressed.constant + expressed.effect @ self.multipliers
        free_part = expressed.effect @ self.self_stresses
        unit = np.array([1.0] * 3 + [1.0 / equations.state.characteristic_length] * 3)[:, None]
        basis, sizes, _ = np.linalg.svd(free_part * unit, full_matrices=False)
        directions = (basis / unit)[:, sizes > self._sharpness]
        unique = np.abs(free_part * unit).max(axis=1, initial=0.0) <= self._sharpness
        ranges = np.column_stack([value, value])
        ranges[~unique] = -np.inf, np.inf
        if intervals:
            ranges = self._intervals(expressed.constant, expressed.effect, unique, value)
        label = on if on is not None else equations.state.body_names[receiver]
        return JointReaction(
            name, label, frozen(value), frozen(unique), frozen(np.ascontiguousarray(directions)), frozen(ranges)
        )

    def _intervals(
        self, constant: FloatArray, effect: FloatArray, unique: NDArray[np.bool_], value: FloatArray
    ) -> FloatArray:
        """Shape (count, 2), of components constant + effect λ."""
        ranges = np.column_stack([value, value])
        if not self._bounds:
            ranges[~unique] = -np.inf, np.inf
            return ranges
        start, slope = constant + effect @ self._start, effect @ self.self_stresses
        for k in np.flatnonzero(~unique):
            ranges[k] = interval(self._distribution, float(start[k]), slope[k])
        return ranges


def wrench_of(equations: EquationsOfMotion, name: str) -> tuple[Wrench, tuple[FloatArray, FloatArray], tuple[int, int]]:
    """Wrench of a joint or closure about the world's origin; its own point and axes; the bodies, receiver first."""
    state = equations.state
    closures = [closure.name for closure in state.closures]
    joints = list(state.model.names)[1:]
    if name in joints and name in closures:
        raise InvalidInput(f"{name!r} is a joint as well as a closure: rename the closure")
    if name in closures:
        c = closures.index(name)
        refuse_coupling(state.closures[c])
        body_a, body_b = state.topology.joints[c]
        return equations.closure(c), equations.closure_frame(c), (int(body_a), int(body_b))
    if name not in joints:
        raise UnknownName("joint or closure", name, [*joints, *closures])
    index = state.joint_index(name)
    pose = equations.poses[index]
    return equations.joint(index), (pose[3], pose[:3]), (index, int(state.model.parents[index]))


def _body(equations: EquationsOfMotion, frame: str) -> int:
    frames = equations.state.frames
    if not isinstance(frame, str) or frame not in frames:
        raise UnknownName("body", frame, frames)
    return int(equations.state.model.frames[frames[frame]].parentJoint)


def _axes_and_point(
    equations: EquationsOfMotion, own: tuple[FloatArray, FloatArray], at: str | ArrayLike, in_frame: str
) -> tuple[FloatArray, FloatArray]:
    """Point and axes in which a wrench is to be expressed.

    Parameters
    ----------
    own : tuple of ndarray
        Point (3,) and axes (3, 3), as rows.
    at : str or array_like
        "origin" for the own point, a frame's name for its origin, or a point (3,), m, world frame.
    in_frame : str
        "world", "local" for the own axes, or a frame's name.

    Raises
    ------
    UnknownName
        If a frame is not known.
    """
    names: tuple[Literal["origin", "world", "local"], ...] = ("origin", "world", "local")
    point, axes = own
    if isinstance(at, str):
        if at != "origin":
            point = _frame_pose(equations, at, "point or frame", names[:1])[0]
    else:
        point = as_finite("at", at, (3,))
    if in_frame == "world":
        return point, np.eye(3)
    return point, axes if in_frame == "local" else _frame_pose(equations, in_frame, "frame", names[1:])[1]


def _frame_pose(
    equations: EquationsOfMotion, name: str, what: str, others: tuple[str, ...]
) -> tuple[FloatArray, FloatArray]:
    frames = equations.state.frames
    if not isinstance(name, str) or name not in frames:
        raise UnknownName(what, name, (*others, *frames))
    frame = equations.state.model.frames[frames[name]]
    pose = equations.poses[frame.parentJoint]
    return frame.placement.translation @ pose[:3] + pose[3], frame.placement.rotation.T @ pose[:3]
