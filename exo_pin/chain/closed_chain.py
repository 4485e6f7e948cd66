"""A closed kinematic chain: a Pinocchio tree with loop closures.

Every method of :class:`ClosedChain` is one call of the function of the same name, which takes the chain's
:class:`~exo_pin.chain.structure.chain_state.ChainState` first. The functions carry the full docstrings, and the
methods show them, too.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from os import PathLike
from pathlib import Path
from typing import Literal

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ..core.validation import FloatArray
from .derivatives.dynamics_derivatives import Derivatives, inverse_dynamics_derivatives
from .dynamics.forward_dynamics import ClosedMotion, Method, forward_dynamics
from .dynamics.inverse_dynamics import Objective, Range, inverse_dynamics, joint_reaction
from .dynamics.reactions import ClosedForces, JointReaction
from .dynamics.simulation import Efforts, Simulation, simulate
from .dynamics.tree_forces import TreeForces, rnea
from .formats.chain_writing import to_mjcf, to_sdf, to_urdf
from .formats.mjcf.mjcf_reading import read_mjcf
from .formats.parallel_robots import read_parallel_robot
from .formats.sdf.sdf_reading import read_sdf
from .formats.urdf.urdf_loading import load_model
from .kinematics.closing import beyond_limits, close
from .kinematics.dependent_motion import dependent_motion, root_motion
from .kinematics.loops import constraint_drift, constraint_jacobian, placement, placements, residual
from .kinematics.mobility import Mobility, mobility
from .kinematics.paths import forward_kinematics, inverse_kinematics
from .kinematics.reduced_kinematics import (
    Split,
    frame_jacobian,
    project_acceleration,
    project_velocity,
    reduced_jacobian,
    reduced_jacobian_rate,
    split,
)
from .structure.chain_state import ChainState
from .structure.closures import Closure
from .structure.description import Closures, Roles
from .structure.passive import frictionless

__all__ = ["ClosedChain"]


def _with_full_docstrings(kind: type[ClosedChain]) -> type[ClosedChain]:
    """Give every method the docstring of the function of its name, without that function's first parameter."""
    for name, method in vars(kind).items():
        function = globals().get(name)
        if inspect.isfunction(method) and function is not None:
            text = inspect.getdoc(function) or ""
            method.__doc__ = text.replace("state : ChainState\n    The chain.\n", "")
    return kind


@_with_full_docstrings
class ClosedChain:
    """A kinematic tree with loop closures.

    Configurations q have shape (nq,), velocities and accelerations shape (nv,), as Pinocchio orders them; a
    spherical joint has a quaternion (x, y, z, w) in q and its body's angular velocity, in its own axes, in v.

    Constraint rows come closure by closure, rows in metres first. A closure between frame a and frame b is a
    projection of the pose of a relative to b, (R_aᵀ (p_a - p_b), log(R_bᵀ R_a)) in the axes of a, as
    :mod:`exo_pin.chain.kinematics.projection` lists; its Jacobian rows are the same projection of the twist of a
    against b, in the axes of a, at p_b. **Multipliers** λ belong to these rows: they are the force (and moment about
    the closure's point p_b) that **the body of frame a receives** from the body of frame b, along the rows'
    directions, N and N m. Jᵀλ is the generalised force that they make; the body of frame b receives the opposite.
    Pinocchio's closure forces have this sign, too.

    One chain may be used from several threads at once: each thread has its own Pinocchio Data, and every array
    that is returned is the caller's. The model must not be changed.

    Parameters
    ----------
    model : pinocchio.Model
        The tree, not copied.
    closures : Closures
        Its loops, roles and springs. The root joint, gravity and armatures that they name are not applied here;
        :meth:`from_urdf` does that.

    Attributes
    ----------
    state : ChainState
        Tree, loops, roles and each thread's scratch memory: the first argument of the functions behind the methods.

    Raises
    ------
    UnknownName
        If a frame or joint of the closures is not in the model.
    """

    def __init__(self, model: pin.Model, closures: Closures) -> None:
        self.state = ChainState(model, closures)

    # Reading and writing files

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
            How the root link hangs in the world, one of :data:`exo_pin.chain.ROOT_JOINTS`; by default that of the
            closures.

        Raises
        ------
        FileFormatError
            If the URDF or the closures file is not valid: an element or attribute is unknown, missing or given twice,
            a number is not one or out of its range, an inertia is not physical, or the links are not one tree. The
            message names the place and line; see :mod:`exo_pin.chain.formats.urdf.urdf_checking`. Mimic joints become
            closures, see :mod:`exo_pin.chain.formats.urdf.urdf_mimic`.
        UnknownName
            If a root joint, frame, joint or closure type is not known.
        InvalidInput
            If data of a joint in the closures have another unit or number of components than the joint.
        """
        return cls(*load_model(urdf, closures, root_joint))

    @classmethod
    def from_parallel_robot(
        cls, path: str | PathLike[str], urdf: str | PathLike[str] | None = None, root_joint: str | None = None
    ) -> ClosedChain:
        """Load a robot in the ``robot.yaml`` layout of toolbox-parallel-robots.

        See :mod:`exo_pin.chain.formats.parallel_robots` for the layout, and :func:`read_parallel_robot` there for the
        arguments and for what is raised.
        """
        return cls(*read_parallel_robot(path, urdf, root_joint))

    @classmethod
    def from_mjcf(cls, path: str | PathLike[str]) -> ClosedChain:
        """Load a MuJoCo model whose loops are connect and weld equalities, from a file or from the XML itself.

        See :mod:`exo_pin.chain.formats.mjcf.mjcf_reading` for what is read and how it is named, and
        :func:`read_mjcf` there for what is raised. Contact is not read.
        """
        return cls(*read_mjcf(path))

    @classmethod
    def from_sdf(cls, path: str | PathLike[str], root_joint: str | None = None) -> ClosedChain:
        """Load an SDF model, from a file or from the XML itself.

        See :mod:`exo_pin.chain.formats.sdf.sdf_reading` for what is read and which joints close the loops, and
        :func:`read_sdf` there for the arguments and for what is raised.
        """
        return cls(*read_sdf(path, root_joint))

    def without_friction(self) -> ClosedChain:
        """The same chain without dry friction in its joints, on a copy of the model."""
        return ClosedChain(frictionless(self.model), self.description)

    def to_urdf(self, folder: str | PathLike[str]) -> Path:
        """Write a URDF and its closures file."""
        return to_urdf(self.state, folder)

    def to_mjcf(self, folder: str | PathLike[str], q: ArrayLike | None = None) -> Path:
        """Write a MuJoCo model."""
        return to_mjcf(self.state, folder, q)

    def to_sdf(self, folder: str | PathLike[str], q: ArrayLike | None = None) -> Path:
        """Write an SDF model."""
        return to_sdf(self.state, folder, q)

    # Parts, sizes and units

    @property
    def model(self) -> pin.Model:
        """The tree."""
        return self.state.model

    @property
    def closures(self) -> tuple[Closure, ...]:
        """The loop closures, in the order of the constraint rows."""
        return self.state.closures

    @property
    def roles(self) -> Roles:
        """Roles of the parts."""
        return self.state.roles

    @property
    def description(self) -> Closures:
        """All data of the closures file."""
        return self.state.description

    @property
    def row_count(self) -> int:
        """Number of constraint rows."""
        return self.state.row_count

    @property
    def characteristic_length(self) -> float:
        """Length that weighs metres against radians, m.

        The root mean square of the distances between the joints and closures of each body, the world included. It
        depends neither on where the loops are cut nor on the root.
        """
        return self.state.characteristic_length

    @property
    def metres(self) -> np.ndarray:
        """Shape (nv,), bool: which coordinates of v are in m/s; the others are in rad/s."""
        return self.state.topology.metres.copy()

    @property
    def constraint_models(self) -> list[pin.RigidConstraintModel]:
        """New Pinocchio constraint models of the closures, one each, in the axes of frame a.

        Raises
        ------
        InvalidInput
            If a closure is neither rigid nor spherical: Pinocchio has no others.
        """
        return self.state.constraint_models

    # Indices by name

    def rows(self, closure: str) -> slice:
        """The constraint rows of a closure."""
        return self.state.rows(closure)

    def joint_index(self, joint: str) -> int:
        """Index of a joint in the model."""
        return self.state.joint_index(joint)

    def configuration_slice(self, joint: str) -> slice:
        """Indices of a joint's coordinates in q."""
        return self.state.configuration_slice(joint)

    def velocity_slice(self, joint: str) -> slice:
        """Indices of a joint's coordinates in v and a."""
        return self.state.velocity_slice(joint)

    def velocity_indices(self, joints: Iterable[str]) -> np.ndarray:
        """Indices in v of the coordinates of several joints, in the order of ``joints``."""
        return self.state.velocity_indices(joints)

    # Configurations, loops and poses

    def neutral(self) -> FloatArray:
        """The configuration with all joints at zero, shape (nq,)."""
        return self.state.neutral()

    def close(
        self,
        q: ArrayLike,
        hold: Iterable[str] = (),
        tolerance: float = 1e-12,
        max_iterations: int = 60,
        respect_limits: bool = False,
        restarts: int = 8,
    ) -> FloatArray:
        """Close the loops, moving as little as possible."""
        return close(self.state, q, hold, tolerance, max_iterations, respect_limits, restarts)

    def beyond_limits(self, q: ArrayLike) -> tuple[str, ...]:
        """Names of the joints that are outside their limits at q."""
        return beyond_limits(self.state, q)

    def residual(self, q: ArrayLike) -> FloatArray:
        """Residual of the loops."""
        return residual(self.state, q)

    def constraint_jacobian(self, q: ArrayLike) -> FloatArray:
        """Jacobian J of the closures."""
        return constraint_jacobian(self.state, q)

    def constraint_drift(self, q: ArrayLike, v: ArrayLike) -> FloatArray:
        """The part J̇ v of the closures' acceleration."""
        return constraint_drift(self.state, q, v)

    def placement(self, q: ArrayLike, frame: str) -> pin.SE3:
        """Pose of a frame in the world."""
        return placement(self.state, q, frame)

    def placements(self, q: ArrayLike) -> dict[str, pin.SE3]:
        """Poses of all frames in the world, by name."""
        return placements(self.state, q)

    def forward_kinematics(
        self, positions: ArrayLike, near: ArrayLike, joints: Iterable[str] | None = None
    ) -> FloatArray:
        """The configuration at given positions of some joints, on the branch of a known one."""
        return forward_kinematics(self.state, positions, near, joints)

    def inverse_kinematics(
        self, frame: str, target: pin.SE3, near: ArrayLike, kind: str = "rigid", hold: Iterable[str] = ()
    ) -> FloatArray:
        """The configuration that brings a frame to a pose, on the branch of a known one."""
        return inverse_kinematics(self.state, frame, target, near, kind, hold)

    # Velocities, accelerations and mobility

    def split(self, q: ArrayLike, independent: Iterable[str] | None = None) -> Split:
        """Independent and dependent coordinates."""
        return split(self.state, q, independent)

    def reduced_jacobian(self, q: ArrayLike, independent: Iterable[str] | None = None) -> FloatArray:
        """All velocities from the independent ones."""
        return reduced_jacobian(self.state, q, independent)

    def reduced_jacobian_rate(
        self, q: ArrayLike, v: ArrayLike, independent: Iterable[str] | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """The reduced Jacobian and its time derivative."""
        return reduced_jacobian_rate(self.state, q, v, independent)

    def frame_jacobian(self, q: ArrayLike, frame: str, independent: Iterable[str] | None = None) -> FloatArray:
        """Twist of a frame from the independent velocities."""
        return frame_jacobian(self.state, q, frame, independent)

    def project_velocity(self, q: ArrayLike, v: ArrayLike) -> FloatArray:
        """The velocity nearest to v that does not open the loops."""
        return project_velocity(self.state, q, v)

    def project_acceleration(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> FloatArray:
        """The acceleration nearest to a that does not open the loops."""
        return project_acceleration(self.state, q, v, a)

    def dependent_motion(
        self, q: ArrayLike, joints: Iterable[str], velocity: ArrayLike, acceleration: ArrayLike | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Velocity and acceleration of all joints from those of some."""
        return dependent_motion(self.state, q, joints, velocity, acceleration)

    def root_motion(
        self,
        q: ArrayLike,
        angular_velocity: ArrayLike,
        angular_acceleration: ArrayLike = (0.0, 0.0, 0.0),
        linear_velocity: ArrayLike = (0.0, 0.0, 0.0),
        linear_acceleration: ArrayLike = (0.0, 0.0, 0.0),
    ) -> tuple[FloatArray, FloatArray]:
        """Coordinates of the root joint's motion from a motion in world axes."""
        motion = (angular_velocity, angular_acceleration, linear_velocity, linear_acceleration)
        return root_motion(self.state, q, *motion)

    def mobility(
        self,
        q: ArrayLike,
        locked: Iterable[str] = (),
        actuated: Iterable[str] | None = None,
        frame: str | None = None,
        part: str = "pose",
    ) -> Mobility:
        """Freedoms, redundancy, singular kinds and margins."""
        return mobility(self.state, q, locked, actuated, frame, part)

    # Forces and motion in time

    def inverse_dynamics(
        self,
        q: ArrayLike,
        v: ArrayLike | None = None,
        a: ArrayLike | None = None,
        *,
        external: Mapping[str, ArrayLike] | None = None,
        actuated: Iterable[str] | None = None,
        effort_bounds: Mapping[str, Range] | Literal["model"] | None = None,
        reaction_bounds: Mapping[str, Range] | None = None,
        objective: Objective | None = None,
        metric: Literal["reactions", "closures"] = "reactions",
    ) -> ClosedForces:
        """Efforts of the actuators and multipliers of the closures that make a motion."""
        bounds = (effort_bounds, reaction_bounds)
        return inverse_dynamics(self.state, q, v, a, external, actuated, *bounds, objective, metric)

    def joint_reaction(
        self,
        joint: str,
        q: ArrayLike,
        v: ArrayLike | None = None,
        a: ArrayLike | None = None,
        *,
        on: str | None = None,
        at: str | ArrayLike = "origin",
        in_frame: str = "world",
        **problem: object,
    ) -> JointReaction:
        """Wrench that a joint or closure transmits in a motion, with its certificate."""
        return joint_reaction(self.state, joint, q, v, a, on, at, in_frame, **problem)

    def inverse_dynamics_derivatives(
        self,
        q: ArrayLike,
        v: ArrayLike | None = None,
        a: ArrayLike | None = None,
        *,
        independent: Iterable[str] | None = None,
        external: Mapping[str, ArrayLike] | None = None,
        actuated: Iterable[str] | None = None,
    ) -> Derivatives:
        """Derivatives of efforts, multipliers and reactions along the closed loops."""
        return inverse_dynamics_derivatives(self.state, q, v, a, independent, external, actuated)

    def rnea(
        self,
        q: ArrayLike,
        v: ArrayLike | None = None,
        a: ArrayLike | None = None,
        multipliers: ArrayLike | None = None,
        external: Mapping[str, ArrayLike] | None = None,
    ) -> TreeForces:
        """Generalised forces of the tree, and the wrench that every joint transmits."""
        return rnea(self.state, q, v, a, multipliers, external)

    def forward_dynamics(
        self,
        q: ArrayLike,
        v: ArrayLike | None = None,
        tau: ArrayLike | Mapping[str, ArrayLike] | None = None,
        *,
        external: Mapping[str, ArrayLike] | None = None,
        method: Method = "auto",
        stabilisation: float = 0.0,
    ) -> ClosedMotion:
        """Acceleration that efforts make."""
        return forward_dynamics(self.state, q, v, tau, external, method, stabilisation)

    def simulate(
        self,
        q: ArrayLike,
        v: ArrayLike,
        times: ArrayLike,
        tau: Efforts | Callable[[float, FloatArray, FloatArray], Efforts] = None,
        *,
        external: Mapping[str, ArrayLike] | None = None,
        method: Method = "auto",
        projection: bool = True,
        stabilisation: float = 0.0,
        rtol: float = 1e-9,
        atol: float = 1e-11,
        progress: bool = False,
    ) -> Simulation:
        """Integrate the motion under given efforts, weight, springs and damping."""
        options = (external, method, projection, stabilisation, rtol, atol, progress)
        return simulate(self.state, q, v, times, tau, *options)

    def __repr__(self) -> str:
        return (
            f"<ClosedChain {self.description.name!r}: {self.model.nv} coordinates, "
            f"{len(self.closures)} closures with {self.row_count} rows>"
        )
