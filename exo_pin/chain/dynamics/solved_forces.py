"""Efforts and multipliers from the equations of motion: the least, or the least within bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.validation import FloatArray, as_choice, frozen
from ..structure.chain_state import ActuatedCoordinates, ChainState
from .equations.equations_of_motion import EquationsOfMotion, checked_equations, tree_terms
from .equations.motion_kernels import NUMBERS, forces_of_state, forces_size, split_forces
from .equations.refusals import check_solution
from .equations.solution_kernels import efforts_and_residual, least, solutions
from .force_distribution import METRICS, Bound
from .nonsmooth.joint_friction import RestingFriction, Rubbing, bearing_drive, resting_friction
from .objectives import Objective, Range, bounds_and_multipliers, effort_ranges
from .reactions import ClosedForces


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
