"""A closed kinematic chain: a Pinocchio tree and what closes its loops."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterable, Mapping
from os import PathLike
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ..errors import InvalidInput, LoopNotClosed, UnknownName
from ..validation import FloatArray, as_finite, as_positive
from . import closing, forces, mobility, motion
from .closures import Closure, Closures, Roles
from .forces import TreeForces
from .loading import load_model
from .mobility import Mobility
from .topology import frame_table, make_topology
from .workspace import Workspace

__all__ = ["CLOSED", "ClosedChain"]

#: The closure types that Pinocchio has a constraint for.
_PINOCCHIO_TYPES = {"rigid": pin.ContactType.CONTACT_6D, "spherical": pin.ContactType.CONTACT_3D}
#: Largest residual, m and rad, at which a question about a closed chain is still answered.
CLOSED = 1e-8


class ClosedChain:
    """A kinematic tree with loop closures.

    Configurations q have shape (nq,), velocities and accelerations shape (nv,), as Pinocchio orders them; a
    spherical joint has a quaternion (x, y, z, w) in q and its body's angular velocity, in its own axes, in v.

    Constraint rows come closure by closure, rows in metres first. A closure between frame a and frame b is a
    projection of how a stands from b, (R_aᵀ (p_a - p_b), log(R_bᵀ R_a)) in the axes of a, as
    :mod:`exo_pin.chain.projection` lists; its Jacobian rows are the same projection of the twist of a against b, in
    the axes of a, at p_b. **Multipliers** λ belong to these rows: they are the force (and moment about the closure's
    point p_b) that **the body of frame a receives** from the body of frame b, along the rows' directions, N and N m.
    Jᵀλ is the generalised force that they make; the body of frame b receives the opposite. Pinocchio's closure forces
    have this sign, too.

    One chain may be used from several threads at once: each thread has its own Pinocchio Data, and every array
    that is returned is the caller's. The model must not be changed.

    Parameters
    ----------
    model : pinocchio.Model
        The tree. It is kept, not copied.
    closures : Closures
        Its loops and roles. The root joint and gravity that they name are not applied here;
        :meth:`from_urdf` does that.

    Raises
    ------
    UnknownName
        If a frame or joint of the closures is not in the model.
    """

    def __init__(self, model: pin.Model, closures: Closures) -> None:
        self._model = model
        self._data_of_file = closures
        self._frames = frame_table(model)
        self._joints = {name: index for index, name in enumerate(model.names)}
        self._topology = make_topology(model, closures, self._frames)
        self._check_roles(closures.roles)
        self._local = threading.local()

    @classmethod
    def from_urdf(
        cls,
        urdf: str | PathLike[str],
        closures: Closures | str | PathLike[str] | None = None,
        root_joint: str | None = None,
    ) -> ClosedChain:
        """Load a chain.

        Parameters
        ----------
        urdf : path-like or str
            The file, or the XML itself.
        closures : Closures or path-like, optional
            What closes the loops; by default the file beside the URDF, ``robot.closures.toml`` for
            ``robot.urdf``.
        root_joint : str, optional
            How the root link hangs in the world, one of :data:`exo_pin.chain.ROOT_JOINTS`; by default what the
            closures say.

        Raises
        ------
        FileFormatError
            If a file cannot be read as what it should be, or the URDF has mimic joints (state them as closures).
        UnknownName
            If a root joint, frame, joint or closure type is not known.
        """
        return cls(*load_model(urdf, closures, root_joint))

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

        The root mean square of the distances between neighbouring joints and closures on their links.
        """
        return self._topology.length

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
            if closure.type not in _PINOCCHIO_TYPES:
                raise InvalidInput(f"Pinocchio has no constraint for the {closure.type} closure {closure.name!r}")
            kind = _PINOCCHIO_TYPES[closure.type]
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

    def velocity_indices(self, joints: Iterable[str]) -> np.ndarray:
        """Where the coordinates of several joints stand in v, in the order of ``joints``."""
        if isinstance(joints, str):
            joints = (joints,)
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

    def close(
        self, q: ArrayLike, hold: Iterable[str] = (), tolerance: float = 1e-12, max_iterations: int = 60
    ) -> FloatArray:
        """Close the loops, moving as little as possible.

        Damped Gauss-Newton on the configuration manifold. Every step is the least one, with metres divided by
        :attr:`characteristic_length`; the answer is near the nearest closed configuration, and is q itself if q
        is closed.

        Parameters
        ----------
        q : array_like
            Shape (nq,), where to start.
        hold : iterable of str
            Joints that must not move.
        tolerance : float
            Largest residual of a closed loop, m and rad.
        max_iterations : int
            At most so many steps.

        Returns
        -------
        ndarray
            Shape (nq,), with the residual within ``tolerance``.

        Raises
        ------
        LoopNotClosed
            If the loops do not close; the error carries the best configuration, its residual and the number of
            steps. An open loop is never returned.
        """
        start = self._configuration(q)
        held = self.velocity_indices(hold) if hold else None
        if self._workspace.residual(start) <= tolerance:
            return start.copy()
        tolerance = as_positive("tolerance", tolerance)
        weight = np.where(self._topology.metres, self._topology.length**2, 1.0)
        if held is not None:
            weight[held] = 0.0
        return closing.close(self, start, weight, tolerance, max(int(max_iterations), 0))[0].copy()

    def mobility(self, q: ArrayLike, locked: Iterable[str] = ()) -> Mobility:
        """Rank, redundancy and degrees of freedom at a closed configuration.

        Parameters
        ----------
        q : array_like
            Shape (nq,), closed.
        locked : iterable of str
            Joints that are held; each of their coordinates adds a constraint row.

        Raises
        ------
        LoopNotClosed
            If the loops stand open by more than 1e-8.
        """
        return mobility.mobility(self, self._closed(q), self.velocity_indices(locked))

    def dependent_motion(
        self,
        q: ArrayLike,
        joints: Iterable[str],
        velocity: ArrayLike,
        acceleration: ArrayLike | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """Velocity and acceleration of all joints from those of some.

        Parameters
        ----------
        q : array_like
            Shape (nq,), closed.
        joints : iterable of str
            Joints whose motion is given; it has to determine all others.
        velocity, acceleration : array_like
            Shape (k,), the coordinates of ``joints`` in v and a, in the order of ``joints``; the acceleration is
            zero if left out. :meth:`root_motion` makes them for the root.

        Returns
        -------
        v, a : ndarray
            Shape (nv,), with J v = 0 and J a + J̇ v = 0.

        Raises
        ------
        LoopNotClosed
            If the loops stand open by more than 1e-8.
        UndeterminedMotion
            If the given joints leave others free, as at a singularity.
        InvalidInput
            If the given motion would open the loops.
        """
        chosen = self.velocity_indices(joints)
        v = as_finite("velocity", velocity, (len(chosen),))
        a = np.zeros(len(chosen)) if acceleration is None else as_finite("acceleration", acceleration, v.shape)
        return motion.dependent_motion(self, self._closed(q), chosen, v, a)

    def root_motion(
        self,
        q: ArrayLike,
        angular_velocity: ArrayLike,
        angular_acceleration: ArrayLike = (0.0, 0.0, 0.0),
        linear_velocity: ArrayLike = (0.0, 0.0, 0.0),
        linear_acceleration: ArrayLike = (0.0, 0.0, 0.0),
    ) -> tuple[FloatArray, FloatArray]:
        """Coordinates of the root joint's velocity and acceleration from a motion told in world axes.

        Parameters
        ----------
        q : array_like
            Shape (nq,).
        angular_velocity, angular_acceleration : array_like
            Shape (3,), of the root link, rad/s and rad/s².
        linear_velocity, linear_acceleration : array_like
            Shape (3,), of the root link's origin, m/s and m/s²; of a spherical root they must be zero.

        Returns
        -------
        v, a : ndarray
            Shape (3,) for a spherical root, (6,) for a free-flyer.

        Raises
        ------
        InvalidInput
            If the root is neither, or a spherical root is asked to move its centre.
        """
        return motion.root_motion(
            self,
            self._configuration(q),
            as_finite("angular_velocity", angular_velocity, (3,)),
            as_finite("angular_acceleration", angular_acceleration, (3,)),
            as_finite("linear_velocity", linear_velocity, (3,)),
            as_finite("linear_acceleration", linear_acceleration, (3,)),
        )

    def rnea(
        self,
        q: ArrayLike,
        v: ArrayLike | None = None,
        a: ArrayLike | None = None,
        multipliers: ArrayLike | None = None,
        external: Mapping[str, ArrayLike] | None = None,
    ) -> TreeForces:
        """Generalised forces of the tree, and the wrench that every joint transmits.

        τ = M a + h - Jᵀλ - external: what the joints' actuators have to give when the closures give λ.

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
            With ``tau`` and the joints' wrenches.
        """
        zero = np.zeros(self._model.nv)
        return forces.rnea(
            self,
            self._configuration(q),
            zero if v is None else self._tangent("v", v),
            zero if a is None else self._tangent("a", a),
            None if multipliers is None else self._vector("multipliers", multipliers, self.row_count),
            external,
        )

    def __getstate__(self) -> dict[str, Any]:
        return {"model": self._model, "closures": self._data_of_file}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["model"], state["closures"])  # type: ignore[misc]

    def __repr__(self) -> str:
        return (
            f"<ClosedChain {self.description.name!r}: {self._model.nv} coordinates, "
            f"{len(self.closures)} closures with {self.row_count} rows>"
        )

    @property
    def _workspace(self) -> Workspace:
        work = getattr(self._local, "workspace", None)
        if work is None:
            work = self._local.workspace = Workspace(self._model, self._topology)
        return work

    def _vector(self, name: str, value: ArrayLike, size: int) -> FloatArray:
        """The fast path of :func:`as_finite`: no copy, and one pass over the numbers."""
        array = np.asarray(value)
        if array.dtype != np.float64 or array.shape != (size,) or not math.isfinite(array @ array):
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
