"""Inverse dynamics of a closed chain: efforts and closure forces that make a motion.

Efforts and multipliers from the equations of motion: the least, or the least within bounds.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.validation import FloatArray, as_choice, frozen
from ..kinematics import closing
from ..structure.chain_state import ActuatedCoordinates, ChainState
from ..structure.motion_axes import joint_names
from .equations.equations_of_motion import (
    EquationsOfMotion,
    check_solution,
    checked_equations,
    equations_of_motion,
    tree_terms,
)
from .equations.motion_kernels import NUMBERS, forces_of_state, forces_size, split_forces
from .equations.solution_kernels import efforts_and_residual, least, solutions
from .force_distribution import METRICS, Bound, Objective, Range, bounds_and_multipliers, effort_ranges
from .force_stacks import projected, stack_of_forces
from .nonsmooth.joint_friction import RestingFriction, Rubbing, bearing_drive, friction_of, resting_friction
from .reactions import ClosedForces, JointReaction

__all__ = ["PULL", "PUSH", "Objective", "Range", "inverse_dynamics", "joint_reaction"]
#: Effort bounds of a slide that can only pull: its effort shortens the limb.
PULL: Range = (-np.inf, 0.0)
#: Effort bounds of a slide that can only push.
PUSH: Range = (0.0, np.inf)


def least_forces(
    state: ChainState,
    q: FloatArray,
    v: FloatArray | None,
    a: FloatArray | None,
    external: Mapping[str, ArrayLike] | None,
    drive: ActuatedCoordinates,
    metric: str,
) -> ClosedForces:
    """:func:`solved` without bounds and dry friction, in one call of a kernel.

    q is checked, v and a have their shapes.
    """
    as_choice("metric", metric, METRICS)
    work = state.buffers
    v, a, moves, tau = tree_terms(state, q, v, a, external)
    nv, shape = state.nv, (state.row_count, state.nv, state.model.njoints)
    flat, unique, numbers = np.empty(forces_size.plain(*shape)), np.empty(nv, dtype=np.bool_), np.empty(NUMBERS)
    certain = forces_of_state.run(
        work.poses, work.J, work.dJ, work.forces, v, a, moves, tau, work.q, work.constants, drive.passive,
        state.tolerance, metric == "reactions", work.jacobian_rate, flat, unique, numbers,
    )  # fmt: skip
    found: list[float] = numbers.tolist()
    if not certain:
        refuse_motion(state, (q, v, a, tau), drive, found, flat)
    return unbounded_forces(state, (q, tau), drive, found, flat, unique, metric)


def refuse_motion(
    state: ChainState,
    motion: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    drive: ActuatedCoordinates,
    numbers: Sequence[float],
    flat: FloatArray,
) -> None:
    """Raise where a motion or its forces are refused, by what :func:`.motion_kernels.forces_of_state` fills.

    The motion is q, v, a and the generalised forces of the open tree.
    """
    q, v, a, tau = motion
    state.configuration(q)
    for name, rates in (("v", v), ("a", a)):
        state.tangent(name, rates)
    equations = checked_equations(state, q, tau, numbers[:6], flat, True)
    share, weakest = numbers[8:10]
    check_solution(equations, drive.passive, share, weakest)


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
    answer, self_stress = (efforts, residual, unique), (start, stresses, sharpness)
    return _closed_forces(equations, drive, self_stress, multipliers, answer, metric, friction=friction)


def solved(
    equations: EquationsOfMotion,
    drive: ActuatedCoordinates,
    effort_bounds: Mapping[str, Range] | Literal["model"] | None = None,
    reaction_bounds: Mapping[str, Range] | None = None,
    objective: Objective | None = None,
    metric: Literal["reactions", "closures"] = "reactions",
    applied: FloatArray | None = None,
    resolved: bool = True,
    rubbing: Rubbing | None = None,
) -> ClosedForces:
    """:meth:`ClosedChain.inverse_dynamics` from the equations of motion.

    Parameters
    ----------
    equations : EquationsOfMotion
        At the state.
    drive : ActuatedCoordinates
        Coordinates with and without actuator.
    applied : ndarray, optional
        Shape (nv,), given generalised forces.
    resolved : bool
        Whether to raise too near a singular configuration; not where that was checked with the acceleration.
    rubbing : Rubbing, optional
        Dry friction; the equations contain that of motion already.

    Raises
    ------
    UndrivenMotion, InfeasibleForces, SolverFailed, UnknownName
        As for :meth:`ClosedChain.inverse_dynamics`.
    """
    as_choice("metric", metric, METRICS)
    state, top, J = equations.state, equations.state.topology, equations.jacobian
    if applied is not None:
        equations = replace(equations, tau=equations.tau - applied)
    actuators = drive
    resting = rubbing if rubbing is not None and len(rubbing.rest) else None
    if resting is not None:
        drive = bearing_drive(drive, resting)
    solution = solutions(
        J, equations.tau, equations.tree, top.owners, drive.passive, top.scales, top.length, equations.gap
    )
    start, stresses, sharpness = self_stress = solution[:3]
    check_solution(equations, drive.passive, solution[5], solution[6], resolved)
    bounds: tuple[Bound, ...] = ()
    if effort_bounds is None and reaction_bounds is None and objective is None and resting is None:
        multipliers = start
        if metric == "reactions" and stresses.shape[1]:
            multipliers = least(
                start, stresses, equations.poses, equations.tree, equations.unit, top.carried, top.loops, top.length
            )
    else:
        bounds, multipliers = bounds_and_multipliers(
            equations, (drive, actuators), self_stress, (effort_bounds, reaction_bounds), objective, metric, rubbing
        )
    efforts = efforts_and_residual(J, equations.tau, multipliers, stresses, drive.passive, top.per_newton, sharpness)
    tau, residual, unique = efforts
    if applied is not None:
        tau += applied
    friction, rest = None if rubbing is None else rubbing.force, None
    if resting is not None:
        ranges = effort_ranges(state, actuators.driven, effort_bounds)
        rest = resting_friction(actuators, resting, ranges, frozen(tau), frozen(unique))
        tau, held = rest.split()
        friction, unique = resting.force + held, (unique & ~rest.actuated) | rest.alone
    return _closed_forces(
        equations, drive, self_stress, multipliers, (tau, residual, unique), metric, bounds, friction, rest
    )


def _closed_forces(
    equations: EquationsOfMotion,
    drive: ActuatedCoordinates,
    self_stress: tuple[FloatArray, FloatArray, float],
    multipliers: FloatArray,
    efforts: tuple[FloatArray, float, NDArray[np.bool_]],
    metric: str,
    bounds: tuple[Bound, ...] = (),
    friction: FloatArray | None = None,
    rest: RestingFriction | None = None,
) -> ClosedForces:
    """The result, from what the kernels return."""
    start, stresses, sharpness = self_stress
    tau, residual, unique = efforts
    return ClosedForces.made_of(
        tau=frozen(tau),
        multipliers=frozen(multipliers),
        residual=residual,
        undetermined=stresses.shape[1],
        effort_is_unique=frozen(unique),
        self_stresses=frozen(stresses),
        _equations=equations,
        _start=start,
        _sharpness=sharpness,
        _metric=metric,
        _bounds=bounds,
        _friction=None if friction is None else frozen(friction),
        _rest=rest,
        _passive=drive.passive,
    )


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
    actuated = None if actuated is None else joint_names(actuated)
    problem = {
        "effort_bounds": effort_bounds, "reaction_bounds": reaction_bounds, "objective": objective, "metric": metric,
    }  # fmt: skip
    as_choice("metric", metric, METRICS)
    drive, least = state.drive(actuated), effort_bounds is None and reaction_bounds is None and objective is None

    def one(q: ArrayLike, v: ArrayLike | None, a: ArrayLike | None, under: Any) -> ClosedForces:
        return _forces_at(state, (q, v, a), under, drive, least, problem)

    if np.ndim(q) == 2:
        return stack_of_forces(state, (q, v, a), external, one, close, progress)
    if close:
        q = closing.close(state, q)
        v, a = projected(state, q, v, a)
    return one(q, v, a, external)


def _forces_at(
    state: ChainState,
    motion: tuple[ArrayLike, ArrayLike | None, ArrayLike | None],
    external: Mapping[str, ArrayLike] | None,
    drive: ActuatedCoordinates,
    least: bool,
    problem: dict[str, Any],
) -> ClosedForces:
    """:func:`inverse_dynamics` of one state."""
    q, v, a = motion
    v = None if v is None else state.sized("v", v, state.nv)
    a = None if a is None else state.sized("a", a, state.nv)
    q = state.configuration(q).copy()
    if least and not state.passive.rubs:
        return least_forces(state, q, v, a, external, drive, problem["metric"])
    for name, rates in (("v", v), ("a", a)):
        if rates is not None:
            state.tangent(name, rates)
    equations, rubbing = equations_of_motion(state, q, v, a, external), None
    if state.passive.rubs:
        rubbing = friction_of(state, np.zeros(state.nv) if v is None else v, a)
        equations = replace(equations, tau=equations.tau - rubbing.force)
    return solved(equations, drive, **problem, rubbing=rubbing)


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
