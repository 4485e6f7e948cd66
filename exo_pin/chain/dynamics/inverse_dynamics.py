"""Inverse dynamics of a closed chain: efforts and closure forces that make a motion."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import UndrivenMotion
from ...core.validation import FloatArray, as_choice, frozen
from ..structure.chain_state import ActuatedCoordinates, ChainState
from .equations_of_motion import EquationsOfMotion, equations_of_motion, refuse_near_singular
from .force_distribution import METRICS, Bound, ForceDistribution, self_stress_within
from .nonsmooth.joint_friction import Rubbing, friction_of, slip_directions
from .nonsmooth.resting_friction import bearing_drive, friction_bounds, resting_friction
from .objectives import Objective, Range, effort_bounds_of, effort_ranges, objective_of, reaction_bounds_of
from .reactions import ClosedForces, JointReaction
from .solution_kernels import efforts_and_residual, largest_of_loops, least, solutions

__all__ = ["PULL", "PUSH", "Objective", "Range", "inverse_dynamics", "joint_reaction", "solved"]

#: Effort bounds of a slide that can only pull: its effort shortens the limb.
PULL: Range = (-np.inf, 0.0)
#: Effort bounds of a slide that can only push.
PUSH: Range = (0.0, np.inf)

#: Largest error of the equations of motion, as a share of the forces of the coordinate's joint and loops.
_MISSING = 1e-7


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
    slip: Mapping[str, ArrayLike] | None = None,
) -> ClosedForces:
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
        Shape (nq,), closed.
    v, a : array_like, optional
        Shape (nv,), a motion that does not open the loops; zero if left out.
    external : mapping, optional
        Frame name to wrench (force, moment), shape (6,), on the body of that frame, moment about the frame's
        origin, world axes, N and N m.
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
    slip : mapping, optional
        Joint to direction, -1 or 1 (0 for none), one or one for each coordinate, in which a joint at rest is about to
        slip: its friction is that of motion in this direction.

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
    """
    v, a = (None if value is None else state.tangent(name, value) for name, value in (("v", v), ("a", a)))
    equations = equations_of_motion(state, state.configuration(q).copy(), v, a, external)
    drive = state.drive(actuated)
    if not state.passive.rubs:
        slip_directions(state, slip)  # to check them
        return solved(equations, drive, effort_bounds, reaction_bounds, objective, metric)
    still = np.zeros(state.nv)
    rubbing = friction_of(state, still if v is None else v, a, slip_directions(state, slip))
    equations = replace(equations, tau=equations.tau - rubbing.force)
    return solved(equations, drive, effort_bounds, reaction_bounds, objective, metric, rubbing=rubbing)


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
    **problem: object,
) -> JointReaction:
    """Wrench that a joint or closure transmits in a motion, with its certificate.

    Parameters
    ----------
    joint, on, at, in_frame
        As for :meth:`exo_pin.chain.ClosedForces.joint_reaction`.
    q, v, a, **problem
        As for :meth:`ClosedChain.inverse_dynamics`, which also lists what is raised.
    """
    forces = inverse_dynamics(state, q, v, a, **problem)  # type: ignore[arg-type]
    return forces.joint_reaction(joint, on, at, in_frame)


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
        Whether to raise too near a singular configuration; not for loops that are open in a stabilised motion.
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
    rests = rubbing is not None and bool(len(rubbing.rest))
    if rubbing is not None and rests:
        drive = bearing_drive(drive, rubbing)
    start, stresses, sharpness, missing, sizes, share, weakest = solutions(
        J, equations.tau, equations.tree, top.owners, drive.passive, top.scales, top.length, equations.gap
    )
    if not share <= max(_MISSING, state.contradiction):
        _refuse_undriven(equations, drive.passive, missing, sizes)
    if resolved:
        refuse_near_singular(state, equations.q, J, equations.gap, weakest, drive.passive)
    bounds: tuple[Bound, ...] = ()
    if effort_bounds is None and reaction_bounds is None and objective is None and not rests:
        multipliers = start
        if metric == "reactions" and stresses.shape[1]:
            multipliers = least(
                start, stresses, equations.poses, equations.tree, equations.unit, top.carried, top.loops, top.length
            )
    else:
        self_stress = start, stresses, sharpness
        bounds, multipliers = _bounds_and_multipliers(
            equations, (drive, actuators), self_stress, (effort_bounds, reaction_bounds), objective, metric, rubbing
        )
    tau, residual, unique = efforts_and_residual(
        J, equations.tau, multipliers, stresses, drive.passive, top.per_newton, sharpness
    )
    if applied is not None:
        tau += applied
    friction, rest = None if rubbing is None else rubbing.force, None
    if rubbing is not None and rests:
        ranges = effort_ranges(state, actuators.driven, effort_bounds)
        rest = resting_friction(actuators, rubbing, ranges, frozen(tau), frozen(unique))
        tau, resting = rest.split()
        friction, unique = rubbing.force + resting, (unique & ~rest.actuated) | rest.alone
    return ClosedForces(
        frozen(tau),
        frozen(multipliers),
        residual,
        stresses.shape[1],
        frozen(unique),
        frozen(stresses),
        equations,
        start,
        sharpness,
        metric,
        bounds,
        None if friction is None else frozen(friction),
        rest,
        drive.passive,
    )


def _bounds_and_multipliers(
    equations: EquationsOfMotion,
    drives: tuple[ActuatedCoordinates, ActuatedCoordinates],
    self_stress: tuple[FloatArray, FloatArray, float],
    given: tuple[Mapping[str, Range] | Literal["model"] | None, Mapping[str, Range] | None],
    objective: Objective | None,
    metric: str,
    rubbing: Rubbing | None,
) -> tuple[tuple[Bound, ...], FloatArray]:
    """Bounds, and the λ within them that is least in the objective, and then in the metric.

    ``drives`` are that of actuators and friction at rest, and that of actuators alone.
    """
    state, (drive, actuators) = equations.state, drives
    start, stresses, sharpness = self_stress
    # Efforts are tau - Jᵀ λ. Rounding of a self-stress must not change determined efforts, however large z becomes.
    effort, slope = equations.tau - equations.jacobian.T @ start, -equations.jacobian.T @ stresses
    slope[np.abs(slope * state.topology.per_newton[:, None]).max(axis=1, initial=0.0) <= sharpness] = 0.0
    slope[drive.passive] = 0.0
    friction = None
    if rubbing is not None:
        rests = np.isin(np.arange(state.nv), rubbing.rest)
        friction = np.where(rests, rubbing.low, 0.0), np.where(rests, rubbing.high, 0.0)
    bounds = effort_bounds_of(state, actuators.driven, effort, slope, given[0], friction)
    if rubbing is not None:
        bounds += friction_bounds(state, actuators, rubbing, effort, slope)
    bounds += reaction_bounds_of(equations, start, (stresses, sharpness), given[1])
    least_first = objective_of(equations, actuators.driven, (effort, slope), self_stress, objective)
    distribution = ForceDistribution(equations.metric(start, stresses, metric), bounds, sharpness)
    return tuple(bounds), start + stresses @ self_stress_within(distribution, least_first)


def _refuse_undriven(equations: EquationsOfMotion, passive: np.ndarray, left: FloatArray, sizes: FloatArray) -> None:
    """Raise UndrivenMotion, unless what is missing is rounding of weights and inertia forces that cancel (a fall)."""
    state, top = equations.state, equations.state.topology
    weights = equations.weights()
    largest_of_loops(weights, top.blocks[1], top.blocks[3])
    if (np.abs(left) <= max(_MISSING, equations.state.contradiction) * np.maximum(sizes, weights[passive])).all():
        return
    missing = np.zeros(state.model.nv)
    missing[passive] = left / top.column[passive]
    names = [str(name) for name in list(state.model.names)[1:]]
    largest_in = {name: float(np.abs(missing[state.velocity_slice(name)]).max(initial=0.0)) for name in names}
    largest = max(largest_in.values())
    worst = sorted((name for name in names if largest_in[name] > 1e-3 * largest), key=lambda name: -largest_in[name])
    raise UndrivenMotion(equations.q, missing, worst)
