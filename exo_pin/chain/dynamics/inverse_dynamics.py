"""Inverse dynamics of a closed chain: efforts and closure forces that make a motion, the least, or within bounds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from ...core.errors import LoopNotClosed
from ...core.validation import FloatArray, as_choice, frozen
from ..kinematics import closing
from ..structure.chain_state import ActuatedCoordinates, ChainState
from ..structure.motion_axes import joint_names
from .equations.equations_of_motion import EquationsOfMotion, check_solution, open_tree, refuse_opening
from .equations.motion_kernels import NUMBERS, forces_of_state, forces_size, split_forces
from .equations.solution_kernels import fill_efforts
from .force_distribution import METRICS, Objective, Range, bounds_and_multipliers, effort_ranges
from .force_stacks import projected, stack_of_forces
from .nonsmooth.joint_friction import Rubbing, bearing_drive, friction_of, resting_friction
from .reactions import ClosedForces, JointReaction

__all__ = ["PULL", "PUSH", "Objective", "Range", "inverse_dynamics", "joint_reaction"]
#: Effort bounds of a slide that can only pull: its effort shortens the limb.
PULL: Range = (-np.inf, 0.0)
#: Effort bounds of a slide that can only push.
PUSH: Range = (0.0, np.inf)


def least_forces(
    state: ChainState,
    motion: tuple[FloatArray, FloatArray | None, FloatArray | None],
    external: Mapping[str, ArrayLike] | None,
    drive: ActuatedCoordinates,
    metric: str,
    applied: FloatArray | None = None,
    checked: bool = True,
) -> ClosedForces:
    """The forces without bounds, in one call of a kernel.

    Parameters
    ----------
    motion : tuple of ndarray
        q, checked, and v and a of shape (nv,), zero for None.
    drive : ActuatedCoordinates
        Coordinates with and without actuator.
    applied : ndarray, optional
        Shape (nv,), generalised forces that are known.
    checked : bool
        Whether to raise if the loops are open, the motion opens them, or the configuration is near a singular one.

    Raises
    ------
    LoopNotClosed, InvalidInput, UndrivenMotion, NearSingularConfiguration, UnknownName
        As for :meth:`ClosedChain.inverse_dynamics`.
    """
    work, q, moves = state.buffers, motion[0], checked and not (motion[1] is None and motion[2] is None)
    # Arrays of one kind: kernels are compiled anew for those that can be written.
    v, a = (work.still if rates is None else frozen(rates.view()) for rates in motion[1:])
    if moves:
        work.jacobian_rates(q, v)
    else:
        pin.computeJointJacobians(state.model, work.data, q)
        np.copyto(work.q, q)
    tau = open_tree(state, q, v, a, external)
    if applied is not None:
        tau -= applied
    nv, shape = state.nv, (state.row_count, state.nv, state.model.njoints)
    flat, unique, numbers = np.empty(forces_size.plain(*shape)), np.empty(nv, dtype=np.bool_), np.empty(NUMBERS)
    certain = forces_of_state.run(
        work.poses, work.J, work.dJ, work.forces, v, a, moves, tau, work.q, work.constants, drive.passive,
        state.tolerance, metric == "reactions", work.jacobian_rate, flat, unique, numbers,
    )  # fmt: skip
    found: list[float] = numbers.tolist()
    if not certain:
        refuse_motion(state, (q, v, a, tau), drive, found, flat, checked)
    return unbounded_forces(state, (q, tau), drive, found, flat, unique, metric)


def refuse_motion(
    state: ChainState,
    motion: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    drive: ActuatedCoordinates,
    numbers: Sequence[float],
    flat: FloatArray,
    checked: bool = True,
) -> None:
    """Raise where a motion or its forces are refused, by what :func:`.motion_kernels.forces_of_state` fills.

    The motion is q, v, a and the generalised forces of the open tree.
    """
    q, v, a, tau = motion
    state.configuration(q)
    # What is not checked was computed, and may be large, as of a body that weighs nothing.
    for name, rates in (("v", v), ("a", a)) if checked else ():
        state.tangent(name, rates)
    worst, gap, speed, size, opening_v, opening_a, _, _, share, weakest, _ = numbers
    if checked:
        if not state.is_closed(worst, gap):
            raise LoopNotClosed(q.copy(), worst, 0)
        refuse_opening(state, opening_v, speed)
        refuse_opening(state, opening_a, size, "acceleration")
    known = state.uncertainty(gap)
    equations = EquationsOfMotion.made_of(state=state, q=q, tau=tau, gap=known, motion=size, flat=flat)
    check_solution(equations, drive.passive, share, weakest, checked)


def unbounded_forces(
    state: ChainState,
    at: tuple[FloatArray, FloatArray],
    drive: ActuatedCoordinates,
    numbers: Sequence[float],
    flat: FloatArray,
    unique: NDArray[np.bool_],
    metric: str,
    friction: FloatArray | None = None,
) -> ClosedForces:
    """The result, from q, the generalised forces of the open tree, and what the kernel fills."""
    q, tau = at
    _, gap, _, size, _, _, free, sharpness, _, _, residual = numbers
    gap, shape = state.uncertainty(gap), (state.row_count, state.nv, state.model.njoints)
    equations = EquationsOfMotion.made_of(state=state, q=q, tau=tau, gap=gap, motion=size, flat=flat)
    efforts, multipliers, start, stresses = split_forces.plain(flat, shape, int(free))
    return ClosedForces.made_of(
        tau=frozen(efforts),
        multipliers=frozen(multipliers),
        residual=residual,
        undetermined=stresses.shape[1],
        effort_is_unique=frozen(unique),
        self_stresses=frozen(stresses),
        _equations=equations,
        _start=start,
        _sharpness=sharpness,
        _metric=metric,
        _bounds=(),
        _friction=None if friction is None else frozen(friction),
        _rest=None,
        _passive=drive.passive,
    )


def _bounded_forces(
    least: ClosedForces,
    drives: tuple[ActuatedCoordinates, ActuatedCoordinates],
    effort_bounds: Mapping[str, Range] | Literal["model"] | None,
    reaction_bounds: Mapping[str, Range] | None,
    objective: Objective | None,
    rubbing: Rubbing | None,
) -> ClosedForces:
    """The forces within bounds, or of another objective, from those without.

    ``drives`` are that of actuators and friction at rest, and that of actuators alone.
    """
    equations, (drive, actuators), stresses = least.equations, drives, least.self_stresses
    state, self_stress = equations.state, (least._start, stresses, least._sharpness)
    bounds, multipliers = bounds_and_multipliers(
        equations, drives, self_stress, (effort_bounds, reaction_bounds), objective, least._metric, rubbing
    )
    tau, unique = np.empty(state.nv), np.empty(state.nv, dtype=np.bool_)
    residual = fill_efforts(
        equations.jacobian, equations.tau, multipliers, stresses, drive.passive, state.topology.per_newton,
        least._sharpness, tau, unique,
    )  # fmt: skip
    friction, rest = None if rubbing is None else rubbing.force, None
    if rubbing is not None and len(rubbing.rest):
        ranges = effort_ranges(state, actuators.driven, effort_bounds)
        rest = resting_friction(actuators, rubbing, ranges, frozen(tau), frozen(unique))
        tau, held = rest.split()
        friction, unique = rubbing.force + held, (unique & ~rest.actuated) | rest.alone
    changed = {
        "tau": frozen(tau), "multipliers": frozen(multipliers), "residual": residual, "_bounds": bounds, "_rest": rest,
        "effort_is_unique": frozen(unique), "_friction": None if friction is None else frozen(friction),
    }  # fmt: skip
    return ClosedForces.made_of(**vars(least) | changed)


def inverse_dynamics(
    state: ChainState,
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
    close: bool = False,
    progress: bool = False,
) -> ClosedForces | Any:
    """Efforts of the actuators and multipliers of the closures that make a motion.

    All solutions of M a + h - passive - external = τ + Jᵀλ with τ = 0 in the joints without actuator are computed,
    passive being the forces of springs and damping. They determine τ and λ up to the chain's self-stresses. The result
    is the solution of least objective within the bounds, by ProxSuite, and among equals the one of least norm in the
    metric. Without objective and bounds that is a linear least-squares problem and is solved as one.

    Dry friction is known in joints that move, or start to move with a. At rest it is an unknown within its range: a
    joint without actuator may be held by it, and ``effort_interval`` and ``friction_interval`` of the result have what
    remains undetermined. ``tau`` then has the least friction in actuated joints for which efforts are within bounds.

    Parameters
    ----------
    q : array_like
        Shape (nq,), closed; or (n, nq), n samples such as those of a trajectory, in compiled code where nothing but
        the motion is given.
    v, a : array_like, optional
        Shape (nv,), a motion that does not open the loops; zero if left out. Of samples (n, nv), or the same for all.
    external : mapping, optional
        Frame name to wrench (force, moment), shape (6,), on the body of that frame, moment about the frame's
        origin, world axes, N and N m. Of samples (n, 6), or the same for all.
    actuated : iterable of str, optional
        Joints that carry an actuator, or a brake; those of the roles if left out.
    effort_bounds : mapping or "model", optional
        Joint to (lower, upper), N or N m, numbers or one for each of its coordinates, for example :data:`PULL`;
        "model" takes the effort limits of the URDF.
    reaction_bounds : mapping, optional
        Joint or closure to (lower, upper) of its wrench, each a number or shape (6,), about its own origin in
        its own axes, on the child link or the body of frame a.
    objective : "efforts" or mapping, optional
        Minimised first: the sum of squares of all efforts, or of the wrenches of the named joints and closures. The
        value is a weight, a number for all of the wrench, or shape (6,) for its components about its own origin in
        its own axes. Moments are divided by the characteristic length.
    metric : {"reactions", "closures"}
        Minimised among the remaining solutions: the sum of squares of the wrenches of all joints and
        closures, each about its own origin, moments divided by the characteristic length, which depends
        neither on where the loops are cut nor on the root; or that of the multipliers alone.
    close : bool
        Whether to close the loops first, as :meth:`ClosedChain.close` does, and to take the nearest v and a that keep
        them closed.
    progress : bool
        Whether to show a bar over samples.

    Returns
    -------
    ClosedForces or ClosedForcesStack
        The second for samples: what is raised below for one state marks the sample there and affects no other.

    Raises
    ------
    LoopNotClosed
        If the residual of the loops exceeds 1e-8.
    InvalidInput
        If the motion opens the loops, or a bound or weight has a wrong shape.
    UnknownName
        If a joint, closure or frame is not known, or a bounded joint is not actuated.
    UndrivenMotion
        If no efforts of the actuators make the motion.
    InfeasibleForces
        If no efforts within the bounds do.
    SolverFailed
        If the optimality conditions hold to no better than 1e-8.
    NearSingularConfiguration
        If q is so near a singular configuration that the forces depend on rounding.

    Examples
    --------
    >>> chain = ep.load("prototype").chain_with_masses()
    >>> forces = chain.inverse_dynamics(chain.close(chain.neutral()))
    >>> forces.undetermined  # side forces and shoulder force, in three directions
    3
    """
    drive = state.drive(None if actuated is None else joint_names(actuated))
    as_choice("metric", metric, METRICS)
    is_free = effort_bounds is None and reaction_bounds is None and objective is None

    def one(q: ArrayLike, v: ArrayLike | None, a: ArrayLike | None, under: Any) -> ClosedForces:
        v = None if v is None else state.sized("v", v, state.nv)
        a = None if a is None else state.sized("a", a, state.nv)
        q, rubbing, bearing = state.configuration(q).copy(), None, drive
        if state.passive.rubs:
            rubbing = friction_of(state, np.zeros(state.nv) if v is None else v, a)
            bearing = bearing_drive(drive, rubbing)
        known = None if rubbing is None else frozen(rubbing.force)
        least = least_forces(state, (q, v, a), under, bearing, metric, known)
        if is_free and bearing is drive:
            return least if rubbing is None else ClosedForces.made_of(**vars(least) | {"_friction": known})
        return _bounded_forces(least, (bearing, drive), effort_bounds, reaction_bounds, objective, rubbing)

    if np.ndim(q) == 2:
        return stack_of_forces(state, (q, v, a), external, one, close, progress)
    if close:
        q = closing.close(state, q)
        v, a = projected(state, q, v, a)
    return one(q, v, a, external)


def joint_reaction(
    state: ChainState,
    joint: str,
    q: ArrayLike,
    v: ArrayLike | None = None,
    a: ArrayLike | None = None,
    *,
    on: str | None = None,
    at: str | ArrayLike = "origin",
    in_frame: str = "world",
    **problem: Any,
) -> JointReaction:
    """Wrench that a joint or closure transmits in a motion, or in samples of one, with its certificate.

    Parameters
    ----------
    joint, on, at, in_frame
        As for :meth:`exo_pin.chain.ClosedForces.joint_reaction`.
    q, v, a, **problem
        As for :meth:`ClosedChain.inverse_dynamics`, which also lists what is raised.

    Returns
    -------
    JointReaction

    Examples
    --------
    >>> chain = ep.load("prototype").chain_with_masses()
    >>> q = chain.close(chain.neutral())
    >>> shoulder = chain.joint_reaction("root_joint", q)
    >>> int(np.sum(~np.asarray(shoulder.unique)))  # components of the force that equilibrium leaves undetermined
    3
    """
    forces = inverse_dynamics(state, q, v, a, **problem)
    return forces.joint_reaction(joint, on, at, in_frame)
