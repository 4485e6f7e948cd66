"""A closed kinematic chain: a Pinocchio tree with loop closures.

:class:`ClosedChain` holds a :class:`~exo_pin.chain.structure.chain_state.ChainState`, and its methods are the functions
of the rooms of this folder, which take that state as their first argument.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import wraps
from inspect import Parameter, signature
from typing import Any, Concatenate, ParamSpec, TypeVar

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ..core.errors.base import ExoPinError
from ..core.errors.checked import checked
from ..core.validation import require_type
from . import variants
from .derivatives import dynamics_derivatives, forward_derivatives
from .dynamics import forward_dynamics as forward
from .dynamics import inverse_dynamics as inverse
from .dynamics import simulation
from .formats import caspr, chain_writing, parallel_robots
from .formats.mjcf import mjcf_reading
from .formats.sdf import sdf_reading
from .formats.urdf import urdf_loading
from .kinematics import assemblies, branches, closing, loops, reduced_kinematics
from .kinematics import mobility as freedoms
from .structure.chain_state import ChainState
from .structure.closures import Closure
from .structure.description import Closures
from .structure.passive import frictionless

_Given = ParamSpec("_Given")
_Answer = TypeVar("_Answer")


def _method_of_state(
    function: Callable[Concatenate[ChainState, _Given], _Answer],
) -> Callable[Concatenate[Any, _Given], _Answer]:
    """The method that hands the ``_state`` of its object to a function."""

    @wraps(function)
    def method(self: Any, *given: _Given.args, **named: _Given.kwargs) -> _Answer:
        try:
            return function(self._state, *given, **named)
        except ExoPinError as error:
            for text in self._state.description.doubts:
                if text not in getattr(error, "__notes__", ()):
                    error.add_note(text)
            raise

    return _called_on("self", method, 1)


def _class_method_of(read: Callable[_Given, tuple[pin.Model, Closures]]) -> classmethod[Any, _Given, ClosedChain]:
    """The class method that makes an object of the tree and the closures that a function returns."""

    @wraps(read)
    def method(cls: Any, *given: _Given.args, **named: _Given.kwargs) -> ClosedChain:
        return cls(*read(*given, **named))

    return classmethod(_called_on("cls", method, 0, return_annotation="ClosedChain"))


def _called_on(owner: str, method: Any, first: int, **returned: Any) -> Any:
    """A method whose signature has its owner in place of the first parameters of its function."""
    known = signature(method)
    own = Parameter(owner, Parameter.POSITIONAL_OR_KEYWORD)
    method.__signature__ = known.replace(parameters=[own, *list(known.parameters.values())[first:]], **returned)
    return method


@checked
class ClosedChain:
    """A kinematic tree with loop closures.

    Configurations q have shape (nq,), velocities and accelerations shape (nv,), as Pinocchio orders them; a
    spherical joint has a quaternion (x, y, z, w) in q and its body's angular velocity, in its own axes, in v.

    Constraint rows come closure by closure, rows in metres first. A closure between frame a and frame b is a
    projection of the pose of a relative to b, (R_aᵀ (p_a - p_b), log(R_bᵀ R_a)) in the axes of a, as
    :mod:`exo_pin.chain.structure.projection` lists; its Jacobian rows are the same projection of the twist of a
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
    model : pinocchio.Model
        The tree.
    description : Closures
        Its loops, roles and springs.
    closures : tuple of Closure
        The loop closures, in the order of the constraint rows.
    roles : Roles
        Roles of the parts.

    Raises
    ------
    UnknownName
        If a frame or joint of the closures is not in the model.

    Examples
    --------
    >>> chain = ep.load("six-cables").chain
    >>> chain.model.nv, chain.row_count, chain.roles.shoulder  # three of the arm and three a limb; three rows a limb
    (21, 18, 'root_joint')
    """

    def __init__(self, model: pin.Model, closures: Closures) -> None:
        self._state = ChainState(model, closures)
        self.model, self.description = model, closures
        self.closures, self.roles = closures.closures, closures.roles

    def with_tolerance(self, tolerance: float) -> ClosedChain:
        """The same chain with a geometry known to a tolerance, for files whose numbers are rounded.

        Rows of closures that agree within it are one row, in ranks, motions and forces. Loops that cannot close are
        left open by the least squares. A singular value that the digits may make or hide is said by :meth:`mobility`,
        and forces are refused where it is within ten times the tolerance of a rank. A closures file keeps it.

        Parameters
        ----------
        tolerance : float
            Half a unit of the last decimal of the file, m and rad: 5e-7 for six decimals. From 0, an exact geometry, to
            1e-3.

        Returns
        -------
        ClosedChain

        Examples
        --------
        >>> chain = ep.load("appendix-d").chain.with_tolerance(5e-7)  # of a file with six decimals
        >>> chain.mobility(chain.close(chain.neutral())).geometry > 0.0
        True
        """
        return ClosedChain(self.model, replace(self._state.description, tolerance=tolerance, rounding=0.0))

    def without_friction(self) -> ClosedChain:
        """The same chain without dry friction in its joints, on a copy of the model.

        Returns
        -------
        ClosedChain

        Examples
        --------
        >>> rod = '<joint axis="0 1 0" frictionloss="3"/><inertial mass="2" pos="0.5 0 0" diaginertia="1 1 1"/>'
        >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
        >>> faster = chain.without_friction().forward_dynamics([0.0]).a - chain.forward_dynamics([0.0]).a
        >>> faster.round(9)  # rad/s²: 3 N m on 1.5 kg m²
        array([2.])
        """
        return ClosedChain(frictionless(self.model), self.description)

    def with_closure(self, closure: Closure) -> ClosedChain:
        """The same tree with one more closure, whose constraint rows come last.

        Parameters
        ----------
        closure : Closure
            Between two frames of the tree.

        Returns
        -------
        ClosedChain

        Examples
        --------
        >>> from exo_pin.chain import Closure
        >>> chain = ep.load("four-cables").chain
        >>> held = chain.with_closure(Closure("orthosis", "rigid", "arm", "universe"))
        >>> [each.mobility(each.close(each.neutral())).degrees_of_freedom for each in (chain, held)]
        [3, 0]
        """
        require_type("closure", closure, Closure)
        return ClosedChain(self.model, replace(self.description, closures=(*self.closures, closure)))

    def locked(self, joints: Iterable[str], q: ArrayLike | None = None) -> ClosedChain:
        """The chain with joints locked: their links are parts of the links that carry them.

        The joints are gone from q, v and the model; their frames stay, fixed. Springs, friction and actuators of theirs
        go with them, and a limb with a locked joint is no limb. A coupling with a locked joint holds the other one.
        What the lock bears is a reaction of the chain before, with the joint among the actuated ones.

        Parameters
        ----------
        joints : iterable of str
            Joints of the tree.
        q : array_like, optional
            Shape (nq,), where they are locked; :meth:`reference_configuration` if left out. The others' coordinates
            do not count. The loops need not be closed, and may not be able to close with the joints locked there.

        Returns
        -------
        ClosedChain

        Raises
        ------
        UnknownName
            If there is no such joint.
        InvalidInput
            If a coupling cannot hold with its joints locked there.

        Examples
        --------
        >>> chain = ep.load("three-linear-actuators").chain
        >>> held = chain.locked(chain.roles.actuated, chain.close(chain.neutral()))
        >>> held.model.nv, held.mobility(held.close(held.neutral())).degrees_of_freedom  # three actuators hold the arm
        (9, 0)
        """
        at = self.reference_configuration() if q is None else q
        return ClosedChain(*variants.locked(self._state, joints, at))

    def mirrored(self) -> ClosedChain:
        """The mirror image of the chain in the x-z plane (y -> -y) of its world, such as for the other shoulder.

        Loops, roles, masses, springs, limits, shapes, gravity and reference configurations go with it, and all names
        stay. A frame at p with the axes R is at S p with the axes S R S, S = diag(1, -1, 1), so that a vector in the
        axes of any link has the other y. Joints of one coordinate keep its value, its limits and the sign of its
        effort: a slide is along S a, a hinge turns about -S a. Of other joints some numbers have the other sign, as
        :meth:`mirror_signs` says: q of the image is ``signs.configuration * q``, v and efforts ``signs.motion * v``.
        Mirrored twice it is the same chain.

        Returns
        -------
        ClosedChain

        Raises
        ------
        InvalidInput
            If a joint is of a kind whose mirror image is not known.

        Examples
        --------
        >>> rod = '<joint axis="1 0 0"/><inertial mass="2" pos="0 0.5 0" diaginertia="1 1 1"/>'
        >>> left = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
        >>> right = left.mirrored()  # the rod points to the right, and the same turn lifts it
        >>> tau = [each.inverse_dynamics([0.1], actuated=each.model.names[1:]).tau[0] for each in (left, right)]
        >>> np.round(tau, 3)  # N m
        array([9.761, 9.761])
        """
        return ClosedChain(*variants.mirrored(self._state))

    from_urdf = _class_method_of(urdf_loading.load_model)
    from_parallel_robot = _class_method_of(parallel_robots.read_parallel_robot)
    from_caspr = _class_method_of(caspr.read_caspr)
    from_mjcf = _class_method_of(mjcf_reading.read_mjcf)
    from_sdf = _class_method_of(sdf_reading.read_sdf)
    mirror_signs = _method_of_state(variants.mirror_signs)

    to_urdf = _method_of_state(chain_writing.to_urdf)
    to_mjcf = _method_of_state(chain_writing.to_mjcf)
    to_sdf = _method_of_state(chain_writing.to_sdf)

    # Configurations, loops and poses

    reference_configuration = _method_of_state(closing.reference_configuration)
    close = _method_of_state(closing.close)
    assemblies = _method_of_state(assemblies.assemblies)
    beyond_limits = _method_of_state(closing.beyond_limits)
    residual = _method_of_state(loops.residual)
    constraint_jacobian = _method_of_state(loops.constraint_jacobian)
    constraint_drift = _method_of_state(loops.constraint_drift)
    placement = _method_of_state(loops.placement)
    placements = _method_of_state(loops.placements)
    forward_kinematics = _method_of_state(branches.forward_kinematics)
    inverse_kinematics = _method_of_state(branches.inverse_kinematics)

    # Velocities, accelerations and mobility

    split = _method_of_state(reduced_kinematics.split)
    reduced_jacobian = _method_of_state(reduced_kinematics.reduced_jacobian)
    frame_jacobian = _method_of_state(reduced_kinematics.frame_jacobian)
    project_velocity = _method_of_state(loops.project_velocity)
    project_acceleration = _method_of_state(loops.project_acceleration)
    dependent_motion = _method_of_state(reduced_kinematics.dependent_motion)
    mobility = _method_of_state(freedoms.mobility)

    # Forces and motion in time

    inverse_dynamics = _method_of_state(inverse.inverse_dynamics)
    joint_reaction = _method_of_state(inverse.joint_reaction)
    inverse_dynamics_derivatives = _method_of_state(dynamics_derivatives.inverse_dynamics_derivatives)
    forward_dynamics = _method_of_state(forward.forward_dynamics)
    forward_dynamics_derivatives = _method_of_state(forward_derivatives.forward_dynamics_derivatives)
    simulate = _method_of_state(simulation.simulate)

    # Its parts

    @property
    def constraint_models(self) -> list[pin.RigidConstraintModel]:
        """New Pinocchio constraint models of the closures, in the axes of frame a: rigid and spherical ones alone."""
        kinds = {("xyz", "xyz"): pin.ContactType.CONTACT_6D, ("xyz", ""): pin.ContactType.CONTACT_3D}
        top, axes, found = self._state.topology, pin.ReferenceFrame.LOCAL, []
        for c, closure in enumerate(self.closures):
            kind, (one, other) = closure.form_in(kinds, "Pinocchio has no constraint"), top.joints[c].tolist()
            places = top.frame(c, 0), top.frame(c, 1)
            found.append(pin.RigidConstraintModel(kind, self.model, one, places[0], other, places[1], axes))
            found[-1].name = closure.name
        return found

    # Sizes, units and indices

    @property
    def row_count(self) -> int:
        """Number of constraint rows."""
        return self._state.row_count

    @property
    def metres(self) -> np.ndarray:
        """Shape (nv,), bool: which coordinates of v are in m/s; the others are in rad/s."""
        return self._state.topology.metres.copy()

    @property
    def characteristic_length(self) -> float:
        """Length that weighs metres against radians, m."""
        return self._state.characteristic_length

    rows = _method_of_state(ChainState.rows)
    configuration_slice = _method_of_state(ChainState.configuration_slice)
    velocity_slice = _method_of_state(ChainState.velocity_slice)
    velocity_indices = _method_of_state(ChainState.velocity_indices)
    neutral = _method_of_state(ChainState.neutral)

    def __repr__(self) -> str:
        return (
            f"<ClosedChain {self.description.name!r}: {self.model.nv} coordinates, "
            f"{len(self.closures)} closures with {self.row_count} rows>"
        )
