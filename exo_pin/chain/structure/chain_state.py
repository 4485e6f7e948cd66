"""The state object of a closed chain: its tree, loops, roles and scratch memory. It holds data and no physics.

Scratch memory, which every call overwrites, is each thread's own.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput, UnknownName
from ...core.validation import LARGEST, FloatArray, as_finite, frozen
from .description import Closures, require_parts
from .frames import FrameTable, body_names, refuse_model
from .memory.chain_buffers import ChainBuffers
from .motion_axes import ActuatedCoordinates, joint_names, q_slice, v_slice
from .passive import PassiveForces
from .topology import Part, make_topology

#: Largest residual of a closed loop where a function needs closed loops, m and rad.
CLOSED = 1e-8
#: Below this sum of squares no number is larger than an input may be.
_ALL_FIT = LARGEST**2
_FLOAT = np.dtype(np.float64)


class ChainState:
    """Everything that the functions of this room read of a chain: ``inverse_dynamics(state, q, v, a)``.

    Parameters
    ----------
    model : pinocchio.Model
        The tree, not copied. It must not be changed.
    description : Closures
        Its loops, roles and springs.

    Attributes
    ----------
    nq, nv, row_count : int
        Sizes of q and v, and number of constraint rows.
    characteristic_length : float
        Length that weighs metres against radians, m.
    closures, roles
        Those of the description.
    gravity : ndarray
        Shape (3,), m/s², a window on the model's.
    frames, joints : mapping of str to int
        Index in the model by name.
    topology : Topology
        The loops as arrays for the kernels.
    passive : PassiveForces
        Springs and dampers.
    tolerance : float
        How well the geometry is known, characteristic lengths and rad; 0 for an exact one. Ranks are decided as if the
        loops were open by it.
    digits : float
        The tolerance, or where that makes no difference to the loops the rounding of the file's numbers, the same
        scaled: what ranks are judged by.
    contradiction : float
        How much rows that should agree may contradict each other, as a share of the motion or force: ten times the
        tolerance of every joint, each of which adds its own; 0 for an exact geometry.
    closed : float
        Residual up to which steps may take loops of a rounded geometry for closed, m and rad: :data:`CLOSED` for an
        exact one. Whether they are says :meth:`is_closed`.
    structural_ranks : dict
        Ranks away from singular poses of a rounded geometry, once they are known.

    Raises
    ------
    UnknownName
        If a frame or joint of the description is not in the model.
    InvalidInput
        If Pinocchio's algorithms do not hold for the model.
    """

    def __init__(self, model: pin.Model, description: Closures) -> None:
        self.model, self.description = model, description
        self.frames = FrameTable(model)
        self.joints = {str(name): index for index, name in enumerate(model.names)}
        refuse_model(model)
        self.nq, self.nv = int(model.nq), int(model.nv)
        self.gravity = np.asarray(model.gravity.vector)[:3]
        self.topology = make_topology(model, description, self.frames)
        self.row_count, self.characteristic_length = self.topology.row_count, self.topology.length
        self.passive = PassiveForces(model, description.joints)
        scale = max(1.0, 1.0 / self.topology.length)
        self.tolerance = float(description.tolerance) * scale
        self.digits = self.tolerance or float(description.rounding) * scale
        self.contradiction = 10.0 * model.njoints * self.tolerance
        self.closed = max(CLOSED, self.contradiction * max(self.topology.length, 1.0))
        self.closures, self.roles = description.closures, description.roles
        require_parts(self.roles, self.joints, [closure.name for closure in self.closures], self.frames)
        self._local = threading.local()
        self.structural_ranks: dict[bytes | None, int] = {}
        self._drives: dict[tuple[str, ...], ActuatedCoordinates] = {}

    def __reduce__(self) -> tuple[type[ChainState], tuple[pin.Model, Closures]]:
        return ChainState, (self.model, self.description)

    @property
    def buffers(self) -> ChainBuffers:
        """This thread's Pinocchio Data and buffers."""
        work = getattr(self._local, "buffers", None)
        if work is None:
            work = self._local.buffers = ChainBuffers(self.model, self.topology)
        return work

    def is_closed(self, worst: float, scaled: float) -> bool:
        """Whether loops are closed, by their largest residual, m and rad, and by the same in characteristic lengths."""
        return worst <= CLOSED or scaled <= self.contradiction

    def scaled_gap(self) -> float:
        """The largest residual where this thread's buffers stand, characteristic lengths and rad."""
        return float(np.abs(self.buffers.gap * self.topology.row_scale).max(initial=0.0))

    def uncertainty(self, gap: float) -> float:
        """The error of the constraint Jacobian's entries, scaled, where the largest scaled residual is ``gap``."""
        return self.tolerance or gap

    @cached_property
    def body_names(self) -> tuple[str, ...]:
        """Of every body the first link's name, else its joint's."""
        return body_names(self.model)

    @cached_property
    def all_parts(self) -> tuple[Part, ...]:
        """All joints but the world's, then all closures."""
        pairs = [*enumerate(list(self.model.parents)[1:], 1), *self.topology.joints.tolist()]
        return tuple(Part(place, receiver, other) for place, (receiver, other) in enumerate(pairs))

    @cached_property
    def parts(self) -> dict[str, Part]:
        """Joints and closures by name."""
        names = [*(str(name) for name in list(self.model.names)[1:]), *(closure.name for closure in self.closures)]
        return dict(zip(names, self.all_parts, strict=True))

    # Indices by name

    def part(self, name: str) -> Part:
        """A joint or closure."""
        if not isinstance(name, str) or name not in self.parts:
            raise UnknownName("joint or closure", name, self.parts)
        found = self.parts[name]
        if name in self.joints and found.place >= self.model.njoints - 1:
            raise InvalidInput(f"{name!r} is a joint as well as a closure: rename the closure")
        return found

    def body_index(self, frame: str) -> int:
        """Index of the joint that carries the body of a frame, 0 for the world."""
        return int(self.model.frames[self.frames.find("body", frame)].parentJoint)

    def rows(self, closure: str) -> slice:
        """The constraint rows of a closure.

        Parameters
        ----------
        closure : str
            Its name.

        Returns
        -------
        slice
            Into the constraint rows of all closures.

        Examples
        --------
        >>> chain = ep.load("optimised-table-c-2").chain
        >>> chain.rows("limb_3_base")  # six of each rigid closure
        slice(12, 18, None)
        """
        names = [item.name for item in self.closures]
        if closure not in names:
            raise UnknownName("closure", closure, names)
        index = names.index(closure)
        return slice(int(self.topology.rows[index]), int(self.topology.rows[index + 1]))

    def joint_index(self, joint: str) -> int:
        """Index of a joint in the model."""
        if joint not in self.joints:
            raise UnknownName("joint", joint, self.joints)
        return self.joints[joint]

    def frame_index(self, frame: str) -> int:
        """Index of a frame in the model."""
        return self.frames.find("frame", frame)

    def configuration_slice(self, joint: str) -> slice:
        """Indices of a joint's coordinates in q.

        Parameters
        ----------
        joint : str
            Its name in the model.

        Returns
        -------
        slice
            Into q, of nq of the joint.

        Examples
        --------
        >>> chain = ep.load("appendix-d").chain
        >>> chain.configuration_slice("root_joint")  # the shoulder's quaternion
        slice(0, 4, None)
        """
        return q_slice(self.model, self.joint_index(joint))

    def velocity_slice(self, joint: str) -> slice:
        """Indices of a joint's coordinates in v and a.

        Parameters
        ----------
        joint : str
            Its name in the model.

        Returns
        -------
        slice
            Into v and a, of nv of the joint.

        Examples
        --------
        >>> chain = ep.load("appendix-d").chain
        >>> chain.velocity_slice("root_joint")  # its angular velocity
        slice(0, 3, None)
        """
        return v_slice(self.model, self.joint_index(joint))

    def velocity_indices(self, joints: Iterable[str]) -> np.ndarray:
        """Indices in v of the coordinates of several joints, in the order of ``joints``.

        Parameters
        ----------
        joints : iterable of str
            Names of joints.

        Returns
        -------
        numpy.ndarray
            Integers, one a coordinate of v.

        Examples
        --------
        >>> chain = ep.load("optimised-table-5-3").chain
        >>> chain.velocity_indices(chain.roles.actuated)  # where the three limbs' speeds stand
        array([ 5, 10, 15])
        """
        pieces = [np.arange(self.nv)[self.velocity_slice(joint)] for joint in joint_names(joints)]
        return np.concatenate([np.array([], dtype=np.int64), *pieces])

    def drive(self, joints: Iterable[str] | None) -> ActuatedCoordinates:
        """Coordinates with and without actuator, given the actuated joints; those of the roles for None."""
        names = self.roles.actuated if joints is None else joint_names(joints)
        known = self._drives.get(names)
        if known is None:
            driven = self.velocity_indices(names)
            passive = np.setdiff1d(np.arange(self.nv), driven)
            known = self._drives[names] = ActuatedCoordinates(frozen(driven), frozen(passive))
        return known

    # Checked input

    def neutral(self) -> FloatArray:
        """The configuration with all joints at zero, shape (nq,).

        Returns
        -------
        numpy.ndarray
            Shape (nq,), rad and m; unit quaternions and (cos, sin) where joints have them. Loops may be open.

        Examples
        --------
        >>> chain = ep.load("scenario-one").chain
        >>> len(chain.neutral()), chain.model.nv  # a ball has four numbers in q and three in v
        (19, 18)
        """
        return np.asarray(pin.neutral(self.model))

    def configuration(self, q: ArrayLike) -> FloatArray:
        """q as an array of shape (nq,), finite and with unit quaternions."""
        array = self.vector("q", q, self.nq)
        if not self.has_unit_turns(array):
            raise InvalidInput(
                "a quaternion (or cosine-sine pair) in q is not of length 1: expected unit length to 1e-9, normalise "
                "q, for example by pinocchio.normalize"
            )
        return array

    def has_unit_turns(self, q: FloatArray) -> bool:
        """Whether quaternions and cosine-sine pairs of q are of length 1."""
        return self.nq == self.nv or pin.isNormalized(self.model, q, 1e-9)

    def tangent(self, name: str, value: ArrayLike) -> FloatArray:
        """A velocity, acceleration or generalised force as a finite array of shape (nv,)."""
        return self.vector(name, value, self.nv)

    def vector(self, name: str, value: ArrayLike, size: int) -> FloatArray:
        """The fast path of :func:`as_finite`: no copy, and one pass over the numbers."""
        array = self.sized(name, value, size)
        return array if array.dot(array) <= _ALL_FIT else as_finite(name, array, (size,))

    def sized(self, name: str, value: ArrayLike, size: int) -> FloatArray:
        """An array of floats as it is, its numbers not looked at; anything else through :func:`as_finite`."""
        if type(value) is np.ndarray and value.dtype is _FLOAT and value.shape == (size,):
            return value
        return as_finite(name, value, (size,))
