"""Forces in a closed chain: efforts, multipliers, and any joint's or closure's reaction with its certificate."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.errors import InvalidInput, UnknownName
from ...core.records import Record
from ...core.validation import FloatArray, frozen
from .equations_of_motion import Balance, Wrench, axes_and_point
from .force_distribution import Bound, Space, interval

__all__ = ["ClosedForces", "JointReaction", "wrench_of"]

_COMPONENTS = ("F_x", "F_y", "F_z", "M_x", "M_y", "M_z")


@dataclass(frozen=True, eq=False)
class JointReaction(Record):
    """What a joint or closure transmits, and what of it equilibrium determines; prints as a table.

    Attributes
    ----------
    name : str
        Of the joint or closure.
    on : str
        The body that receives it.
    wrench : ndarray
        Shape (6,), force and moment, N and N m.
    unique : ndarray of bool
        Shape (6,): which components every solution of the equations of motion shares (Wojtyra's criterion: no
        self-stress of the chain shows in them).
    directions : ndarray
        Shape (6, r), the ways in which the wrench may change without any motion: the image of the chain's
        self-stresses, orthonormal with moments divided by the characteristic length. r = 0 if it is unique.
    interval : ndarray
        Shape (6, 2), least and largest value of each component that the bounds allow; infinite where they leave it
        free, twice the value where it is unique.
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
        """Shape (3,), N m, about the point that was asked for."""
        return self.wrench[3:]

    @property
    def undetermined(self) -> int:
        """In how many independent directions the wrench is undetermined."""
        return self.directions.shape[1]

    def __str__(self) -> str:
        lines = [f"{self.name} on {self.on}"]
        for k, name in enumerate(_COMPONENTS):
            low, high = self.interval[k]
            told = "unique" if self.unique[k] else f"undetermined, from {low:.6g} to {high:.6g}"
            lines.append(f"{name} {self.wrench[k]:14.6f} {'N' if k < 3 else 'N m':4} {told}")
        return "\n".join(lines)


@dataclass(frozen=True, eq=False)
class ClosedForces(Record):
    """Forces in a closed chain at one state.

    Attributes
    ----------
    tau : ndarray
        Shape (nv,), what the joints' actuators give, N and N m; zero for joints without one, to rounding.
    multipliers : ndarray
        λ, shape (rows,), as :class:`exo_pin.chain.ClosedChain` describes.
    residual : float
        Largest generalised force by which M a + h - external = τ + Jᵀλ is missed, N and N m.
    undetermined : int
        Dimension of the self-stresses: how many independent sets of multipliers and efforts make no motion.
    effort_is_unique : ndarray of bool
        Shape (nv,), which efforts every solution shares.
    self_stresses : ndarray
        Shape (rows, undetermined), a basis of what may be added to λ.
    """

    tau: FloatArray
    multipliers: FloatArray
    residual: float
    undetermined: int
    effort_is_unique: NDArray[np.bool_]
    self_stresses: FloatArray
    _balance: Balance = field(repr=False)
    _start: FloatArray = field(repr=False)  # λ at z = 0
    _sharpness: float = field(repr=False)  # share of a self-stress that is rounding
    _metric: str = field(repr=False)
    _bounds: tuple[Bound, ...] = field(repr=False, default=())

    @cached_property
    def _space(self) -> Space:
        metric = self._balance.metric(self._start, self.self_stresses, self._metric)
        return Space(metric, self._bounds, self._sharpness)

    def effort(self, joint: str) -> FloatArray:
        """What a joint's actuator gives, shape (nv of the joint,), N or N m."""
        return self.tau[self._balance.chain.velocity_slice(joint)].copy()

    def effort_interval(self, joint: str) -> FloatArray:
        """Least and largest effort that the bounds allow, shape (nv of the joint, 2); infinite where they leave it."""
        own = self._balance.chain.velocity_slice(joint)
        effect = -self._balance.jacobian[:, own].T
        return self._intervals(self._balance.tau[own], effect, self.effort_is_unique[own], self.tau[own])

    def joint_reaction(
        self,
        joint: str,
        on: str | None = None,
        at: str | ArrayLike = "origin",
        in_frame: str = "world",
        intervals: bool = True,
    ) -> JointReaction:
        """What a tree joint or a closure transmits.

        Parameters
        ----------
        joint : str
            Name of a joint of the tree or of a closure.
        on : str, optional
            The body that receives it, by the name of one of its frames; by default the child link of a joint and the
            body of frame a of a closure.
        at : str or array_like
            Point about which the moment is told: "origin" (the joint's, or the closure's point, which is frame b's
            origin), a frame's name for its origin, or shape (3,), m, world frame.
        in_frame : str
            Axes of the answer: "world", "local" (the child link's, or those of the closure's frame a), or a frame's
            name.
        intervals : bool
            Whether to work out the intervals of undetermined components; without, they are infinite.

        Raises
        ------
        UnknownName
            If there is no such joint, closure or frame.
        InvalidInput
            If ``on`` is neither of the two bodies, or a joint and a closure share the name.
        """
        wrench, own, bodies = wrench_of(self._balance, joint)
        return self._answer(joint, wrench, own, bodies, on, at, in_frame, intervals)

    def wrench_on(
        self, body: str, at: str | ArrayLike = "origin", in_frame: str = "world", intervals: bool = True
    ) -> JointReaction:
        """Total wrench that all joints and closures put on a body.

        It is what carries and accelerates the body against weight and external forces. On the world it is the
        mechanism's whole load on its base, without the weight of links that are fixed to the world.

        Parameters
        ----------
        body : str
            Name of one of the body's frames, "universe" for the world.
        at, in_frame, intervals
            As for :meth:`joint_reaction`; "origin" and "local" are the body's first joint's, the world's for the
            world.
        """
        balance = self._balance
        chain, model = balance.chain, balance.chain.model
        index = _body(balance, body)
        parts = [balance.joint(index)] if index else []
        parts += [balance.joint(child).reversed() for child in range(1, model.njoints) if model.parents[child] == index]
        for c, (body_a, body_b) in enumerate(chain._topology.joints):
            if index in (body_a, body_b):
                parts.append(balance.closure(c) if index == body_a else balance.closure(c).reversed())
        total = Wrench(
            np.sum([part.constant for part in parts], axis=0) + np.zeros(6),
            np.sum([part.effect for part in parts], axis=0) + np.zeros((6, len(self.multipliers))),
        )
        pose = balance.poses[index]
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
        balance = self._balance
        receiver = bodies[0]
        if on is not None:
            receiver = _body(balance, on)
            if receiver not in bodies:
                one, other = (balance.chain._body_names[body] for body in bodies)
                raise InvalidInput(f"{name!r} joins {one!r} and {other!r}, not {on!r}")
            if receiver != bodies[0]:
                wrench = wrench.reversed()
        told = wrench.told(*axes_and_point(balance, own, at, in_frame))
        value = told.constant + told.effect @ self.multipliers
        open_part = told.effect @ self.self_stresses
        unit = np.array([1.0] * 3 + [1.0 / balance.chain.characteristic_length] * 3)[:, None]
        basis, sizes, _ = np.linalg.svd(open_part * unit, full_matrices=False)
        directions = (basis / unit)[:, sizes > self._sharpness]
        unique = np.abs(open_part * unit).max(axis=1, initial=0.0) <= self._sharpness
        ranges = np.column_stack([value, value])
        ranges[~unique] = -np.inf, np.inf
        if intervals:
            ranges = self._intervals(told.constant, told.effect, unique, value)
        label = on if on is not None else balance.chain._body_names[receiver]
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
            ranges[k] = interval(self._space, float(start[k]), slope[k])
        return ranges


def wrench_of(balance: Balance, name: str) -> tuple[Wrench, tuple[FloatArray, FloatArray], tuple[int, int]]:
    """Wrench of a joint or closure about the world's origin; its own point and axes; the bodies, receiver first."""
    chain = balance.chain
    closures = [closure.name for closure in chain.closures]
    joints = list(chain.model.names)[1:]
    if name in joints and name in closures:
        raise InvalidInput(f"{name!r} is a joint as well as a closure: rename the closure")
    if name in closures:
        c = closures.index(name)
        body_a, body_b = chain._topology.joints[c]
        return balance.closure(c), balance.closure_frame(c), (int(body_a), int(body_b))
    if name not in joints:
        raise UnknownName("joint or closure", name, [*joints, *closures])
    index = chain.joint_index(name)
    pose = balance.poses[index]
    return balance.joint(index), (pose[3], pose[:3]), (index, int(chain.model.parents[index]))


def _body(balance: Balance, frame: str) -> int:
    frames = balance.chain._frames
    if not isinstance(frame, str) or frame not in frames:
        raise UnknownName("body", frame, frames)
    return int(balance.chain.model.frames[frames[frame]].parentJoint)
