"""Inverse dynamics of a closed chain: efforts and closure forces that make a motion."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ..errors import UndrivenMotion, UnknownName
from ..validation import FloatArray, frozen
from .balance import Balance, balance_of
from .demands import Objective, Range, effort_bounds_of, metric_of, objective_of, reaction_bounds_of
from .rank import rank_tolerance
from .reactions import ClosedForces, JointReaction
from .sharing import METRICS, Space, share
from .structure import Structure

__all__ = ["PULL", "PUSH", "InverseDynamics", "Objective", "Range"]

#: A slide that can only pull: its effort shortens the limb.
PULL: Range = (-np.inf, 0.0)
#: A slide that can only push.
PUSH: Range = (0.0, np.inf)

#: The equations of motion may be missed by so much of the largest force in them.
_MISSING = 1e-7
#: No component is called undetermined for less than this share of a self-stress, nor unique for more.
_SHARPEST, _BLUNTEST = 1e-10, 1e-6


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

        All solutions of M a + h - external = τ + Jᵀλ with τ = 0 in the joints without actuator are known: τ and λ are
        determined up to the chain's self-stresses. Of these solutions the one with the least objective within the
        bounds is given, by ProxSuite, and among equals the one of least norm in the metric. Without bounds that is a
        linear least-squares problem and is solved as one.

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
        """
        balance = balance_of(
            self,
            self._closed(q).copy(),
            None if v is None else self._tangent("v", v),
            None if a is None else self._tangent("a", a),
            external,
        )
        driven = self.velocity_indices(self.roles.actuated if actuated is None else actuated)
        return solved(balance, driven, effort_bounds, reaction_bounds, objective, metric)

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
    driven: np.ndarray,
    effort_bounds: Mapping[str, Range] | Literal["model"] | None = None,
    reaction_bounds: Mapping[str, Range] | None = None,
    objective: Objective | None = None,
    metric: Literal["reactions", "closures"] = "reactions",
    applied: FloatArray | None = None,
) -> ClosedForces:
    """:meth:`InverseDynamics.inverse_dynamics` from the equations of motion.

    Parameters
    ----------
    balance : Balance
        At the state.
    driven : ndarray of int
        Indices in v of the coordinates that carry an actuator.
    applied : ndarray, optional
        Shape (nv,), generalised forces that are known to act.
    """
    if metric not in METRICS:
        raise UnknownName("metric", metric, METRICS)
    chain = balance.chain
    passive = np.ones(chain.model.nv, dtype=bool)
    passive[driven] = False
    if applied is not None:
        balance = replace(balance, tau=balance.tau - applied)
    start, stresses, sharpness = solutions(balance, passive)
    # Efforts are tau - Jᵀ λ.
    effort, slope = balance.tau - balance.jacobian.T @ start, -balance.jacobian.T @ stresses
    # What is determined must not be moved by the rounding of a self-stress, however far the program goes along it.
    unit = np.where(chain._topology.metres, 1.0, 1.0 / chain.characteristic_length)
    unique = passive | (np.abs(slope * unit[:, None]).max(axis=1, initial=0.0) <= sharpness)
    slope[unique] = 0.0
    bounds = effort_bounds_of(chain, driven, effort, slope, effort_bounds)
    bounds += reaction_bounds_of(balance, start, (stresses, sharpness), reaction_bounds)
    aims = objective_of(balance, driven, (effort, slope), (start, stresses, sharpness), objective)
    space = Space(metric_of(balance, start, stresses, metric), bounds, sharpness)
    z = share(space, aims)
    multipliers = start + stresses @ z
    tau = balance.tau - balance.jacobian.T @ multipliers
    residual = float(np.abs(tau[passive]).max(initial=0.0))
    tau[passive] = 0.0
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
        space,
        frozen(start),
        sharpness,
    )


def solutions(balance: Balance, passive: np.ndarray) -> tuple[FloatArray, FloatArray, float]:
    """All λ with (tau - Jᵀλ) = 0 in the passive coordinates: one, a basis of the self-stresses, and its sharpness.

    The one has the least sum of squares of closure forces and of moments over the characteristic length; the basis
    is orthonormal in the same metric.

    Raises
    ------
    UndrivenMotion
        If there is none.
    """
    chain = balance.chain
    top = chain._topology
    column = np.where(top.metres, top.length, 1.0)[passive]
    matrix = (balance.jacobian[:, passive] * top.row_scale[:, None] * column).T
    right = column * balance.tau[passive]
    # In N: rows in metres have row_scale 1/length, so λ over row_scale is length times a force.
    to_rows = top.row_scale * top.length
    if not matrix.size:
        left, found, null, sharpness = right, np.zeros(len(to_rows)), np.eye(len(to_rows)), _SHARPEST
    else:
        U, values, Vt = np.linalg.svd(matrix)
        tolerance = rank_tolerance(matrix.shape, float(values[0]), chain.model.njoints, balance.gap)
        rank = int(np.count_nonzero(values > tolerance))
        found = Vt[:rank].T @ ((U[:, :rank].T @ right) / values[:rank])
        left = right - matrix @ found
        # Once more, for the rounding of an ill-conditioned solution.
        found += Vt[:rank].T @ ((U[:, :rank].T @ left) / values[:rank])
        left = right - matrix @ found
        null = Vt[rank:].T
        sharpness = min(max(10.0 * tolerance / values[rank - 1] if rank else 0.0, _SHARPEST), _BLUNTEST)
    size = float(np.abs(column * np.abs(balance.tau[passive])).max(initial=0.0))
    size = max(size, float(np.abs(matrix @ found).max(initial=0.0)), _weight(balance))
    if np.abs(left).max(initial=0.0) > _MISSING * size:
        _refuse_undriven(balance, passive, left / column)
    return top.row_scale * found, to_rows[:, None] * null, sharpness


def _weight(balance: Balance) -> float:
    """The largest wrench in the open tree, N m, against which a generalised force counts as rounding."""
    length = balance.chain.characteristic_length
    return float(np.abs(balance.tree[1:] * ([length] * 3 + [1.0] * 3)).max(initial=0.0))


def _refuse_undriven(balance: Balance, passive: np.ndarray, left: FloatArray) -> None:
    chain = balance.chain
    missing = np.zeros(len(passive))
    missing[passive] = left
    names = [str(name) for name in list(chain.model.names)[1:]]
    sizes = {name: float(np.abs(missing[chain.velocity_slice(name)]).max(initial=0.0)) for name in names}
    largest = max(sizes.values())
    worst = sorted((name for name in names if sizes[name] > 1e-3 * largest), key=lambda name: -sizes[name])
    raise UndrivenMotion(balance.q, missing, worst)
