"""Inverse dynamics of a closed chain: efforts and closure forces that make a motion."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import UndrivenMotion, UnknownName
from ...core.validation import FloatArray, frozen
from ..structure.chain_state import Drive, Structure
from .equations_of_motion import Balance, balance_of, refuse_near_singular
from .force_distribution import METRICS, Bound, Space, share
from .objectives import Objective, Range, effort_bounds_of, objective_of, reaction_bounds_of
from .reactions import ClosedForces, JointReaction
from .solution_kernels import efforts_and_residual, least, solutions

__all__ = ["PULL", "PUSH", "InverseDynamics", "Objective", "Range"]

#: A slide that can only pull: its effort shortens the limb.
PULL: Range = (-np.inf, 0.0)
#: A slide that can only push.
PUSH: Range = (0.0, np.inf)

#: The equations of motion may be missed by so much of the largest force in them.
_MISSING = 1e-7


class InverseDynamics(Structure):
    """Inverse dynamics of a closed chain."""

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
        """Efforts of the actuators and multipliers of the closures that make a motion.

        All solutions of M a + h - passive - external = τ + Jᵀλ with τ = 0 in the joints without actuator are known,
        passive being the forces of springs and damping: τ and λ are
        determined up to the chain's self-stresses. Of these solutions the one with the least objective within the
        bounds is given, by ProxSuite, and among equals the one of least norm in the metric. Without objective and
        bounds that is a linear least-squares problem and is solved as one.

        Parameters
        ----------
        q : array_like
            Shape (nq,), closed.
        v, a : array_like, optional
            Shape (nv,), a motion that keeps the loops closed; zero if left out.
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
            What is to be small before the metric decides: the sum of squares of all efforts, or of the wrenches of
            the named joints and closures. The value is a weight, a number for all of the wrench, or shape (6,) for
            its components about its own origin in its own axes. Moments are divided by the characteristic length.
        metric : {"reactions", "closures"}
            What is least among the solutions that are left: the sum of squares of the wrenches of all joints and
            closures, each about its own origin, moments divided by the characteristic length, which depends
            neither on where the loops are cut nor on the root; or that of the multipliers alone.

        Raises
        ------
        LoopNotClosed
            If the loops stand open by more than 1e-8.
        InvalidInput
            If the motion opens the loops, or a bound or weight does not fit.
        UnknownName
            If a joint, closure or frame is not known, or a bounded joint is not actuated.
        UndrivenMotion
            If no efforts of the actuators make the motion.
        InfeasibleForces
            If none do within the bounds.
        SolverFailed
            If the optimality conditions hold to no better than 1e-8.
        UnsupportedDynamics
            If a joint has dry friction.
        NearSingularConfiguration
            If q is so near a singular configuration that the forces would depend on rounding.
        """
        balance = balance_of(
            self,
            self._configuration(q).copy(),
            None if v is None else self._tangent("v", v),
            None if a is None else self._tangent("a", a),
            external,
        )
        return solved(balance, self._drive(actuated), effort_bounds, reaction_bounds, objective, metric)

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
        """What a joint or closure transmits in a motion, with its certificate.

        Parameters
        ----------
        joint, on, at, in_frame
            As for :meth:`exo_pin.chain.ClosedForces.joint_reaction`.
        q, v, a, **problem
            As for :meth:`inverse_dynamics`, which also says what is raised.
        """
        forces = self.inverse_dynamics(q, v, a, **problem)  # type: ignore[arg-type]
        return forces.joint_reaction(joint, on, at, in_frame)


def solved(
    balance: Balance,
    drive: Drive,
    effort_bounds: Mapping[str, Range] | Literal["model"] | None = None,
    reaction_bounds: Mapping[str, Range] | None = None,
    objective: Objective | None = None,
    metric: Literal["reactions", "closures"] = "reactions",
    applied: FloatArray | None = None,
    resolved: bool = True,
) -> ClosedForces:
    """:meth:`InverseDynamics.inverse_dynamics` from the equations of motion.

    Parameters
    ----------
    balance : Balance
        At the state.
    drive : Drive
        Coordinates with and without actuator.
    applied : ndarray, optional
        Shape (nv,), generalised forces that are known to act.
    resolved : bool
        Whether to refuse configurations too near a singular one; not for those that stand open on purpose.

    Raises
    ------
    UndrivenMotion, InfeasibleForces, SolverFailed, UnknownName
        As for :meth:`InverseDynamics.inverse_dynamics`.
    """
    if metric not in METRICS:
        raise UnknownName("metric", metric, METRICS)
    top = balance.chain._topology
    if applied is not None:
        balance = replace(balance, tau=balance.tau - applied)
    start, stresses, sharpness, missing, share_of_largest, weakest = solutions(
        balance.jacobian,
        balance.tau,
        balance.tree,
        drive.passive,
        top.row_scale,
        top.column,
        top.length,
        balance.chain.model.njoints,
        balance.gap,
    )
    if not share_of_largest <= _MISSING:
        _refuse_undriven(balance, drive.passive, missing)
    if resolved:
        refuse_near_singular(balance, weakest)
    bounds: tuple[Bound, ...] = ()
    if effort_bounds is None and reaction_bounds is None and objective is None:
        multipliers = start
        if metric == "reactions" and stresses.shape[1]:
            multipliers = least(
                start,
                stresses,
                balance.poses,
                balance.tree,
                balance.unit,
                top.carried,
                top.joints,
                top.local,
                top.rows,
                top.length,
            )
    else:
        open_part = start, stresses, sharpness
        bounds, multipliers = _chosen(balance, drive, open_part, (effort_bounds, reaction_bounds), objective, metric)
    tau, residual, unique = efforts_and_residual(
        balance.jacobian, balance.tau, multipliers, stresses, drive.passive, top.per_newton, sharpness
    )
    if applied is not None:
        tau += applied
    return ClosedForces(
        frozen(tau),
        frozen(multipliers),
        residual,
        stresses.shape[1],
        frozen(unique),
        frozen(stresses),
        balance,
        start,
        sharpness,
        metric,
        bounds,
    )


def _chosen(
    balance: Balance,
    drive: Drive,
    open_part: tuple[FloatArray, FloatArray, float],
    given: tuple[Mapping[str, Range] | Literal["model"] | None, Mapping[str, Range] | None],
    objective: Objective | None,
    metric: str,
) -> tuple[tuple[Bound, ...], FloatArray]:
    """Bounds, and the λ that keeps them, is best in the objective, and then least in the metric."""
    chain = balance.chain
    start, stresses, sharpness = open_part
    # Efforts are tau - Jᵀ λ. What is determined must not be moved by the rounding of a self-stress, however far the
    # program goes along it.
    effort, slope = balance.tau - balance.jacobian.T @ start, -balance.jacobian.T @ stresses
    slope[np.abs(slope * chain._topology.per_newton[:, None]).max(axis=1, initial=0.0) <= sharpness] = 0.0
    slope[drive.passive] = 0.0
    bounds = effort_bounds_of(chain, drive.driven, effort, slope, given[0])
    bounds += reaction_bounds_of(balance, start, (stresses, sharpness), given[1])
    aims = objective_of(balance, drive.driven, (effort, slope), open_part, objective)
    space = Space(balance.metric(start, stresses, metric), bounds, sharpness)
    return tuple(bounds), start + stresses @ share(space, aims)


def _refuse_undriven(balance: Balance, passive: np.ndarray, left: FloatArray) -> None:
    chain = balance.chain
    missing = np.zeros(chain.model.nv)
    missing[passive] = left
    names = [str(name) for name in list(chain.model.names)[1:]]
    sizes = {name: float(np.abs(missing[chain.velocity_slice(name)]).max(initial=0.0)) for name in names}
    largest = max(sizes.values())
    worst = sorted((name for name in names if sizes[name] > 1e-3 * largest), key=lambda name: -sizes[name])
    raise UndrivenMotion(balance.q, missing, worst)
