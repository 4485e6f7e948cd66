"""Motions that keep the loops closed: the dependent joints' velocity and acceleration from the independent ones'."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from scipy.linalg.lapack import dgelsy, dgelsy_lwork

from ..errors import ExoPinError, InvalidInput
from ..validation import FloatArray
from .mobility import rank_tolerance

if TYPE_CHECKING:
    from .model import ClosedChain

__all__ = ["UndeterminedMotion", "dependent_motion", "root_motion"]


class UndeterminedMotion(ExoPinError, RuntimeError):
    """The motion of the given joints leaves others free.

    Attributes
    ----------
    q : ndarray
        Shape (nq,), the configuration.
    free : int
        How many freedoms are left.
    """

    def __init__(self, q: FloatArray, free: int) -> None:
        self.q = q
        self.free = int(free)
        super().__init__(
            f"the given joints leave {self.free} freedom{'s' if self.free > 1 else ''} of the chain open at this "
            "configuration: give more joints, or keep away from the singularity"
        )


def dependent_motion(
    chain: ClosedChain, q: FloatArray, chosen: np.ndarray, velocity: FloatArray, acceleration: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """See :meth:`ClosedChain.dependent_motion`."""
    work, top, model = chain._workspace, chain._topology, chain.model
    if len(set(chosen.tolist())) != len(chosen):
        raise InvalidInput("a joint is given twice")
    given = np.zeros(model.nv, dtype=bool)
    given[chosen] = True
    others = np.flatnonzero(~given)
    v, a = np.zeros(model.nv), np.zeros(model.nv)
    v[chosen], a[chosen] = velocity, acceleration
    if not top.row_count:
        if others.size:
            raise UndeterminedMotion(q.copy(), others.size)
        return v, a
    work.linearise(q)
    # Metres are divided by the characteristic length in rows and columns; the drift's units follow the rows.
    column_scale = np.where(top.metres, top.length, 1.0)
    scaled = work.jacobian * top.row_scale[:, None]
    dependent = scaled[:, others] * column_scale[others]
    gap = float(np.abs(work.gap * top.row_scale).max(initial=0.0))
    v[others] = column_scale[others] * _solve(chain, q, dependent, -scaled @ v, gap)
    drift = work.drift_of(q, v)
    a[others] = column_scale[others] * _solve(chain, q, dependent, -scaled @ a - top.row_scale * drift, gap)
    return v, a


def _solve(chain: ClosedChain, q: FloatArray, matrix: FloatArray, right: FloatArray, gap: float) -> FloatArray:
    """Solve the redundant but consistent equations for all columns."""
    rows, columns = matrix.shape
    if columns == 0:
        solution = np.zeros(0)
    else:
        # Relative to the largest singular value; 1 bounds it from below for links as long as the scale.
        condition = rank_tolerance(matrix.shape, 1.0, chain.model.njoints, gap)
        padded = np.zeros(max(rows, columns))
        padded[:rows] = right
        pivots = np.zeros(columns, dtype=np.int32)
        lwork = int(dgelsy_lwork(rows, columns, 1, condition)[0])
        _, answer, _, rank, _ = dgelsy(matrix, padded, pivots, condition, lwork)
        if rank < columns:
            raise UndeterminedMotion(q.copy(), columns - rank)
        solution = answer[:columns].reshape(-1)
    # Consistent equations leave rounding and the loops' residual (at most 1e-8) times the condition; contradictory
    # ones leave what was given.
    left = matrix @ solution - right
    size = float(np.abs(right).max(initial=0.0)) + float(np.abs(solution).max(initial=0.0))
    if not np.abs(left).max(initial=0.0) <= 1e-6 * size:
        raise InvalidInput("the given motion opens the loops: give fewer joints")
    return solution


def root_motion(
    chain: ClosedChain,
    q: FloatArray,
    omega: FloatArray,
    eta: FloatArray,
    linear_velocity: FloatArray,
    linear_acceleration: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """See :meth:`ClosedChain.root_motion`."""
    model = chain.model
    kind = model.joints[1].shortname() if model.njoints > 1 else "none"
    work = chain._workspace
    pin.forwardKinematics(model, work.data, q)
    to_local = work.poses[1, :3].copy()
    turned = to_local @ omega, to_local @ eta
    if kind == "JointModelSpherical":
        if linear_velocity.any() or linear_acceleration.any():
            raise InvalidInput("a spherical root does not move its centre")
        # R d/dt(Rᵀ ω) = η - ω × ω.
        return turned
    if kind == "JointModelFreeFlyer":
        v = np.concatenate([to_local @ linear_velocity, turned[0]])
        # d/dt (Rᵀ v_O) = Rᵀ (a_O - ω × v_O).
        a = np.concatenate([to_local @ (linear_acceleration - np.cross(omega, linear_velocity)), turned[1]])
        return v, a
    raise InvalidInput(f"expected a spherical or free-flyer root, got {kind}")
