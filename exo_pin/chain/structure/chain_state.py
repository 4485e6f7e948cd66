"""What a closed chain is made of: its tree, closures and roles, and the residual and Jacobian of its loops."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterable
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput, LoopNotClosed, UnknownName
from ...core.records import reduced_tuple
from ...core.validation import FloatArray, as_finite, frozen
from ..dynamics.passive import PassiveForces
from .closures import Closure
from .constant_axes import ConstantAxes
from .description import Closures, Roles
from .topology import frame_table, make_topology, refuse_model
from .workspace import ProximalProblem, Workspace

__all__ = ["CLOSED", "PINOCCHIO_TYPES", "Drive", "Structure"]

#: The closure types that Pinocchio has a constraint for.
PINOCCHIO_TYPES = {"rigid": pin.ContactType.CONTACT_6D, "spherical": pin.ContactType.CONTACT_3D}
#: Largest residual, m and rad, at which a question about a closed chain is still answered.
CLOSED = 1e-8


class Drive(NamedTuple):
    """Indices in v.

    Attributes
    ----------
    driven, passive : ndarray of int
        Of the coordinates that carry an actuator, in the order of their joints, and of the others.
    """

    driven: np.ndarray
    passive: np.ndarray

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced_tuple(self)


class Structure:
    """Tree, closures and roles of a closed chain; see :class:`exo_pin.chain.ClosedChain`."""

    def __init__(self, model: pin.Model, closures: Closures) -> None:
        self._model = model
        self._data_of_file = closures
        self._frames = frame_table(model)
        self._joints = {name: index for index, name in enumerate(model.names)}
        refuse_model(model)
        self._topology = make_topology(model, closures, self._frames)
        self._axes = ConstantAxes(model)
        self._passive = PassiveForces(model, closures.joints)
        self._check_roles(closures.roles)
        self._local = threading.local()
        self._drives: dict[tuple[str, ...], Drive] = {}

    def __getstate__(self) -> dict[str, Any]:
        return {"model": self._model, "closures": self._data_of_file}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["model"], state["closures"])  # type: ignore[misc]

    @property
    def model(self) -> pin.Model:
        """The tree."""
        return self._model

    @property
    def closures(self) -> tuple[Closure, ...]:
        """The loop closures, in the order of the constraint rows."""
        return self._data_of_file.closures

    @property
    def roles(self) -> Roles:
        """What the parts are for."""
        return self._data_of_file.roles

    @property
    def description(self) -> Closures:
        """All that the closures file says."""
        return self._data_of_file

    @property
    def row_count(self) -> int:
        """Number of constraint rows."""
        return self._topology.row_count

    @property
    def characteristic_length(self) -> float:
        """Length that weighs metres against radians, m.

        The root mean square of the distances between the joints and closures of each body, the world included. It
        depends neither on where the loops are cut nor on the root.
        """
        return self._topology.length

    @property
    def metres(self) -> np.ndarray:
        """Shape (nv,), bool: which coordinates of v are in m/s; the others are in rad/s."""
        return self._topology.metres.copy()

    @property
    def constraint_models(self) -> list[pin.RigidConstraintModel]:
        """New Pinocchio constraint models of the closures, one each, in the axes of frame a.

        Raises
        ------
        InvalidInput
            If a closure is neither rigid nor spherical: Pinocchio has no others.
        """
        models = []
        for c, closure in enumerate(self.closures):
            places = [pin.SE3(local[:3].T.copy(), local[3].copy()) for local in self._topology.local[c]]
            joint_a, joint_b = (int(joint) for joint in self._topology.joints[c])
            if closure.type not in PINOCCHIO_TYPES:
                raise InvalidInput(f"Pinocchio has no constraint for the {closure.type} closure {closure.name!r}")
            kind = PINOCCHIO_TYPES[closure.type]
            constraint = pin.RigidConstraintModel(
                kind, self._model, joint_a, places[0], joint_b, places[1], pin.ReferenceFrame.LOCAL
            )
            constraint.name = closure.name
            models.append(constraint)
        return models

    def neutral(self) -> FloatArray:
        """The configuration with all joints at zero, shape (nq,)."""
        return np.asarray(pin.neutral(self._model))

    def rows(self, closure: str) -> slice:
        """The constraint rows of a closure."""
        names = [item.name for item in self.closures]
        if closure not in names:
            raise UnknownName("closure", closure, names)
        index = names.index(closure)
        return slice(int(self._topology.rows[index]), int(self._topology.rows[index + 1]))

    def joint_index(self, joint: str) -> int:
        """Index of a joint in the model."""
        index = self._joints.get(joint)
        if index is None:
            raise UnknownName("joint", joint, self._joints)
        return index

    def configuration_slice(self, joint: str) -> slice:
        """Where a joint's coordinates stand in q."""
        index = self.joint_index(joint)
        return slice(self._model.idx_qs[index], self._model.idx_qs[index] + self._model.nqs[index])

    def velocity_slice(self, joint: str) -> slice:
        """Where a joint's coordinates stand in v and a."""
        index = self.joint_index(joint)
        return slice(self._model.idx_vs[index], self._model.idx_vs[index] + self._model.nvs[index])

    @cached_property
    def _body_names(self) -> tuple[str, ...]:
        """Of every body the first link's name, else its joint's."""
        names = [str(name) for name in self._model.names]
        for frame in reversed(list(self._model.frames)):
            if frame.type == pin.FrameType.BODY and frame.parentJoint:
                names[frame.parentJoint] = frame.name
        return tuple(names)

    def _drive(self, joints: Iterable[str] | None) -> Drive:
        """Coordinates with and without actuator; the roles' where no joints are named."""
        if joints is not None and not isinstance(joints, Iterable):
            raise InvalidInput(f"expected names of joints, got {joints!r}")
        names = self.roles.actuated if joints is None else (joints,) if isinstance(joints, str) else tuple(joints)
        known = self._drives.get(names)
        if known is None:
            driven = self.velocity_indices(names)
            passive = np.setdiff1d(np.arange(self._model.nv), driven)
            known = self._drives[names] = Drive(frozen(driven), frozen(passive))
        return known

    def velocity_indices(self, joints: Iterable[str]) -> np.ndarray:
        """Where the coordinates of several joints stand in v, in the order of ``joints``."""
        if isinstance(joints, str):
            joints = (joints,)
        if not isinstance(joints, Iterable):
            raise InvalidInput(f"expected names of joints, got {joints!r}")
        pieces = [np.arange(self._model.nv)[self.velocity_slice(joint)] for joint in joints]
        return np.concatenate([np.zeros(0, dtype=np.int64), *pieces])

    def placement(self, q: ArrayLike, frame: str) -> pin.SE3:
        """Pose of a frame in the world.

        Raises
        ------
        UnknownName
            If there is no such frame.
        """
        if frame not in self._frames:
            raise UnknownName("frame", frame, self._frames)
        frame_model = self._model.frames[self._frames[frame]]
        work = self._workspace
        pin.forwardKinematics(self._model, work.data, self._configuration(q))
        return work.data.oMi[frame_model.parentJoint] * frame_model.placement

    def placements(self, q: ArrayLike) -> dict[str, pin.SE3]:
        """Poses of all frames (links, joints, "universe") in the world, by name."""
        work = self._workspace
        pin.forwardKinematics(self._model, work.data, self._configuration(q))
        frames = self._model.frames
        return {
            name: work.data.oMi[frames[index].parentJoint] * frames[index].placement
            for name, index in self._frames.items()
        }

    def residual(self, q: ArrayLike) -> FloatArray:
        """How far the loops stand open, shape (rows,), m and rad, as the class describes."""
        work = self._workspace
        work.residual(self._configuration(q))
        return work.gap.copy()

    def constraint_jacobian(self, q: ArrayLike) -> FloatArray:
        """Jacobian of the closures, shape (rows, nv): J v is the twist of frames a against frames b.

        On closed loops it is the derivative of :meth:`residual`. Off them the rows in metres still are; those in
        radians are the relative angular velocity, of which the rotation vector's rate is an invertible function.
        """
        work = self._workspace
        work.linearise(self._configuration(q))
        return work.jacobian.copy()

    def constraint_drift(self, q: ArrayLike, v: ArrayLike) -> FloatArray:
        """The part of the closures' acceleration that v makes, J̇ v, shape (rows,), m/s² and rad/s².

        A motion keeps the loops closed if J v = 0 and J a + J̇ v = 0.
        """
        return self._workspace.drift_of(self._configuration(q), self._tangent("v", v)).copy()

    @property
    def _workspace(self) -> Workspace:
        work = getattr(self._local, "workspace", None)
        if work is None:
            work = self._local.workspace = Workspace(self._model, self._topology, self._axes)
        return work

    @property
    def _freed_chains(self) -> dict[int, Any]:
        """This thread's chains with one joint set free, by joint; derivatives of reactions change their models."""
        chains = getattr(self._local, "freed", None)
        if chains is None:
            chains = self._local.freed = {}
        return chains

    @property
    def _proximal_problem(self) -> ProximalProblem:
        """This thread's memory for Pinocchio's constrained dynamics."""
        problem = getattr(self._local, "proximal", None)
        if problem is None:
            problem = self._local.proximal = ProximalProblem(self._model, self.constraint_models)
        return problem

    def _vector(self, name: str, value: ArrayLike, size: int) -> FloatArray:
        """The fast path of :func:`as_finite`: no copy, and one pass over the numbers."""
        array = np.asarray(value)
        plain = array.dtype == np.float64 and array.shape == (size,) and not isinstance(value, np.ma.MaskedArray)
        if not plain or not math.isfinite(array @ array):
            return as_finite(name, value, (size,))
        return array

    def _configuration(self, q: ArrayLike) -> FloatArray:
        array = self._vector("q", q, self._model.nq)
        if not pin.isNormalized(self._model, array, 1e-9):
            raise InvalidInput("expected q with unit quaternions (and cosine-sine pairs) for its rotating joints")
        return array

    def _tangent(self, name: str, value: ArrayLike) -> FloatArray:
        return self._vector(name, value, self._model.nv)

    def _closed(self, q: ArrayLike) -> FloatArray:
        """q if its loops are closed."""
        array = self._configuration(q)
        worst = self._workspace.residual(array)
        if not worst <= CLOSED:
            raise LoopNotClosed(array.copy(), worst, 0)
        return array

    def _check_roles(self, roles: Roles) -> None:
        for joint in (*roles.actuated, *(name for limb in roles.limbs for name in (limb.slide, limb.platform_joint))):
            self.joint_index(joint)
        joined = {*self._joints, *(closure.name for closure in self.closures)}
        if roles.shoulder is not None and roles.shoulder not in joined:
            raise UnknownName("joint or closure", roles.shoulder, joined, where="roles.shoulder")
        for frame in (roles.arm, roles.reference_point):
            if frame is not None and frame not in self._frames:
                raise UnknownName("frame", frame, self._frames, where="roles")
