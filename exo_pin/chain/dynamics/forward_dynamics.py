"""Forward dynamics of a closed chain: the acceleration that efforts make, by Pinocchio or on the loops' own motions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput, MasslessMotion, SolverFailed, UnknownName
from ...core.records import Record
from ...core.validation import FloatArray, as_finite, as_real, frozen
from ..kinematics.rank import rank_tolerance
from ..structure.chain_state import CLOSED, PINOCCHIO_TYPES, Structure
from .equations_of_motion import Balance, balance_of, put_on, refuse_missing, refuse_near_singular, refuse_opening
from .inverse_dynamics import solved
from .reactions import ClosedForces

__all__ = ["METHODS", "ClosedMotion", "ForwardDynamics", "inertia_matrix"]

Method = Literal["auto", "proximal", "projected"]
#: How the constrained equations of motion are solved.
METHODS = ("auto", "proximal", "projected")
#: Pinocchio's proximal iteration: it stops when forces change by so little, and never needs so many steps.
_PROXIMAL = (1e-14, 1e-10, 40)
#: A motion whose inertia is below this share of the largest counts as moving no mass.
_MASSLESS = 1e-13


@dataclass(frozen=True, eq=False)
class ClosedMotion(Record):
    """What efforts make of a closed chain at one state.

    Attributes
    ----------
    a : ndarray
        Shape (nv,), the acceleration, m/s² and rad/s².
    tau : ndarray
        Shape (nv,), the efforts that made it, N and N m.
    method : {"proximal", "projected"}
        How it was found.
    residual : float
        Largest acceleration by which the closures' rows are missed, m/s² and rad/s².
    """

    a: FloatArray
    tau: FloatArray
    method: str
    residual: float
    _balance: Balance = field(repr=False)

    @cached_property
    def forces(self) -> ClosedForces:
        """Multipliers and joint reactions of the motion, with their certificate.

        Where closures are redundant the multipliers are those of least norm in the metric "reactions" of
        :meth:`exo_pin.chain.ClosedChain.inverse_dynamics`.
        """
        # Nearness to a singular configuration was checked with the acceleration.
        return solved(self._balance, self._balance.chain._drive(()), applied=self.tau, resolved=False)


class ForwardDynamics(Structure):
    """Forward dynamics of a closed chain."""

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
        """Acceleration that efforts make.

        M a + h - passive - external = τ + Jᵀλ with J a + J̇ v = 0, where passive are the forces of springs and damping.
        "proximal" is Pinocchio's constrained dynamics, for rigid and
        spherical closures and chains whose links all have inertia. "projected" solves the equations on the motions
        that the closures leave, a = a_0 + Z z with J Z = 0: it takes every closure type, redundant closures, and
        links without mass as long as no motion of the chain is without inertia. "auto" takes Pinocchio's where it fits.

        Parameters
        ----------
        q, v : array_like
            Shapes (nq,) and (nv,), a state with closed loops; v is zero if left out.
        tau : array_like or mapping, optional
            Efforts, shape (nv,), or by joint; zero where left out.
        external : mapping, optional
            As for :meth:`exo_pin.chain.ClosedChain.inverse_dynamics`.
        method : {"auto", "proximal", "projected"}
            How to solve.
        stabilisation : float
            Rate ω, 1/s, of Baumgarte's terms: J a + J̇ v = -2 ω J v - ω² residual, which lets open loops close as a
            critically damped oscillator. Zero leaves them out. Above zero the state may stand open, and "projected" is
            used.

        Raises
        ------
        LoopNotClosed
            If the loops stand open by more than 1e-8, without stabilisation.
        MasslessMotion
            If some motion moves no mass.
        SingularConfiguration
            If no acceleration keeps the loops closed, without stabilisation.
        NearSingularConfiguration
            If q is so near a singular configuration that the acceleration would depend on rounding, without
            stabilisation.
        InvalidInput
            If v opens the loops, without stabilisation, or "proximal" does not fit the closures.
        UnknownName
            If a joint, frame or method is not known.
        UnsupportedDynamics
            If a joint has dry friction.
        """
        if method not in METHODS:
            raise UnknownName("method", method, METHODS)
        stabilisation = float(as_finite("stabilisation", stabilisation, ()))
        if stabilisation < 0.0:
            raise InvalidInput(f"expected a stabilisation of zero or more, 1/s, got {stabilisation}")
        q = (self._configuration(q) if stabilisation else self._closed(q)).copy()
        v = np.zeros(self._model.nv) if v is None else self._tangent("v", v).copy()
        if not stabilisation:
            self._workspace.linearise(q)
            refuse_opening(self, v)
        efforts = efforts_of(self, tau)
        chosen = chosen_method(self, method, stabilisation)
        if chosen == "proximal" and not _has_inertia(self, q):
            if method == "proximal":
                raise MasslessMotion(_massless(self, q, np.eye(self._model.nv)))
            chosen = "projected"
        try:
            a = acceleration(self, q, v, efforts, external, chosen, stabilisation)
        except SolverFailed:
            if chosen != "proximal" or method != "auto":
                raise
            return self.forward_dynamics(q, v, efforts, external=external, method="projected")
        # At once, not when forces are asked for: gravity and the caller's arrays may be others by then.
        balance = balance_of(self, q, v, a, external, keeps_closed=False)
        # Loops that stand open on purpose say nothing about rounding: the same rank as in the acceleration.
        balance = replace(balance, gap=min(balance.gap, CLOSED))
        missed = balance.jacobian @ a + self._workspace.drift_of(q, v)
        if stabilisation:
            self._workspace.linearise(q)
            missed += _stabilising(self, v, stabilisation)
        else:
            if chosen == "proximal" and method == "auto" and not _keeps(self, a, v, missed):
                # Pinocchio's tolerances have units, so that very small or light robots miss them.
                return self.forward_dynamics(q, v, efforts, external=external, method="projected")
            refuse_missing(self, q, v, a, missed)
            refuse_near_singular(balance)
        return ClosedMotion(frozen(a), frozen(efforts), chosen, float(np.abs(missed).max(initial=0.0)), balance)


def efforts_of(chain: Structure, tau: ArrayLike | Mapping[str, ArrayLike] | None) -> FloatArray:
    """Efforts as an array of shape (nv,)."""
    if tau is None:
        return np.zeros(chain.model.nv)
    if not isinstance(tau, Mapping):
        return chain._tangent("tau", tau).copy()
    efforts = np.zeros(chain.model.nv)
    for joint, value in tau.items():
        own = chain.velocity_slice(joint)
        given = as_real(f"tau[{joint!r}]", value)
        if given.shape not in ((), (own.stop - own.start,)) or not np.isfinite(given).all():
            raise InvalidInput(f"expected tau[{joint!r}] as {own.stop - own.start} finite numbers, got {value!r}")
        efforts[own] = given
    return efforts


def chosen_method(chain: Structure, method: Method, stabilisation: float) -> str:
    """The method that is to be used, "proximal" or "projected".

    Raises
    ------
    InvalidInput
        If "proximal" is asked for and does not fit.
    """
    others = [closure.name for closure in chain.closures if closure.type not in PINOCCHIO_TYPES]
    fits = bool(chain.closures) and not others and not stabilisation
    if method == "proximal" and not fits:
        reason = "stabilisation" if stabilisation else f"closures {', '.join(others)}" if others else "no closure"
        raise InvalidInput(
            f"method 'proximal' takes rigid and spherical closures without stabilisation, and there is {reason}: use "
            "'projected'"
        )
    return "proximal" if fits and method != "projected" else "projected"


def acceleration(
    chain: Structure,
    q: FloatArray,
    v: FloatArray,
    efforts: FloatArray,
    external: Mapping[str, ArrayLike] | None,
    method: str,
    stabilisation: float,
) -> FloatArray:
    """:meth:`ForwardDynamics.forward_dynamics` after its checks.

    Raises
    ------
    MasslessMotion
        If some motion moves no mass.
    SolverFailed
        If Pinocchio's answer is not finite.
    """
    if method == "proximal":
        return _proximal(chain, q, v, efforts, external)
    work, top, model = chain._workspace, chain._topology, chain.model
    work.linearise(q)
    J, gap = work.jacobian, min(float(np.abs(work.gap * top.row_scale).max(initial=0.0)), CLOSED)
    right = -_stabilising(chain, v, stabilisation) - work.drift_of(q, v)
    column = top.column
    forces = column * (efforts - _bias(chain, q, v, external))
    M = inertia_matrix(chain, q) * column[:, None] * column
    # a = column x: metres in characteristic lengths, as the rows.
    start, basis = np.zeros(model.nv), np.eye(model.nv)
    if J.size:
        U, values, Vt = np.linalg.svd(J * top.row_scale[:, None] * column)
        rank = int(np.count_nonzero(values > rank_tolerance(J.shape, float(values[0]), model.njoints, gap)))
        start = Vt[:rank].T @ ((U[:, :rank].T @ (top.row_scale * right)) / values[:rank])
        basis = Vt[rank:].T
    if not basis.shape[1]:
        return column * start
    reduced = basis.T @ M @ basis
    sizes, ways = np.linalg.eigh(reduced)
    if not sizes[0] > _MASSLESS * max(float(sizes[-1]), _heaviest(M)):
        raise MasslessMotion(_massless(chain, q, basis))
    push = ways.T @ (basis.T @ (forces - M @ start))
    return column * (start + basis @ (ways @ (push / sizes)))


def _keeps(chain: Structure, a: FloatArray, v: FloatArray, missed: FloatArray) -> bool:
    """Whether an acceleration misses the closures' rows by no more than rounding and a proximal step leave."""
    top = chain._topology
    size = float(np.abs(a / top.column).max(initial=0.0)) + float(np.square(v / top.column).max(initial=0.0))
    return bool(np.abs(top.row_scale * missed).max(initial=0.0) <= 1e-9 * size)


def _stabilising(chain: Structure, v: FloatArray, rate: float) -> FloatArray:
    """Baumgarte's terms; the chain must be linearised."""
    work = chain._workspace
    if not rate:
        return np.zeros(len(work.gap))
    return 2.0 * rate * (work.jacobian @ v) + rate**2 * work.gap


def _bias(chain: Structure, q: FloatArray, v: FloatArray, external: Mapping[str, ArrayLike] | None) -> FloatArray:
    """h - passive - external; the poses must be there."""
    work = chain._workspace
    work.external[:] = 0.0
    put_on(chain, external)
    chain._passive.refuse_friction()
    bare = np.array(pin.rnea(chain.model, work.data, q, v, np.zeros(len(v)), work.external_vector))
    return bare - chain._passive.force(q, v) if chain._passive.act else bare


def inertia_matrix(chain: Structure, q: FloatArray) -> FloatArray:
    """M, symmetric: Pinocchio fills the upper half."""
    nv = chain.model.nv
    upper = np.triu(np.reshape(pin.crba(chain.model, chain._workspace.data, q), (nv, nv)))
    return np.asarray(upper + np.triu(upper, 1).T)


def _heaviest(M: FloatArray) -> float:
    return float(np.abs(np.diag(M)).max(initial=0.0))


def _has_inertia(chain: Structure, q: FloatArray) -> bool:
    """Whether every motion of the open tree has inertia, as Pinocchio needs it."""
    column = chain._topology.column
    sizes = np.linalg.eigvalsh(inertia_matrix(chain, q) * column[:, None] * column)
    return bool(sizes[0] > _MASSLESS * sizes[-1])


def _massless(chain: Structure, q: FloatArray, basis: FloatArray) -> list[str]:
    """Joints that move in the motion of least inertia among those of a basis, the most moved first."""
    column = chain._topology.column
    M = inertia_matrix(chain, q) * column[:, None] * column
    way = np.abs(basis @ np.linalg.eigh(basis.T @ M @ basis)[1][:, 0])
    names = [str(name) for name in list(chain.model.names)[1:]]
    moved = {name: float(way[chain.velocity_slice(name)].max(initial=0.0)) for name in names}
    largest = max(moved.values())
    return sorted((name for name in names if moved[name] > 0.1 * largest), key=lambda name: -moved[name])


def _proximal(
    chain: Structure,
    q: FloatArray,
    v: FloatArray,
    efforts: FloatArray,
    external: Mapping[str, ArrayLike] | None,
) -> FloatArray:
    """Pinocchio's constrained dynamics."""
    work, model = chain._workspace, chain.model
    problem = chain._proximal_problem
    if external:
        work.linearise(q)
        still = np.zeros(model.nv)
        bare = _bias(chain, q, still, None)
        efforts = efforts + bare - _bias(chain, q, still, external)
    chain._passive.refuse_friction()
    if chain._passive.act:
        efforts = efforts + chain._passive.force(q, v)
    settings = pin.ProximalSettings(*_PROXIMAL)
    a = np.array(pin.constraintDynamics(model, problem.data, q, v, efforts, problem.models, problem.datas, settings))
    if not np.isfinite(a).all():
        raise SolverFailed("Pinocchio's constrained dynamics", np.inf, "the acceleration is not finite")
    return a
