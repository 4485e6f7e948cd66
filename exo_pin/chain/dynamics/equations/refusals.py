"""When a motion or its forces are refused: loops that open, efforts that nothing makes, singular configurations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ....core.errors import NearSingularConfiguration, OpeningMotion, SingularConfiguration, UndrivenMotion
from ....core.validation import FloatArray
from ...kinematics.rank import RESOLVED, configuration_error, rank_tolerance
from ...kinematics.structural_rank import structural_rank
from ...structure.chain_state import CLOSED, ChainState
from .solution_kernels import largest_of_loops, solutions

if TYPE_CHECKING:
    from .equations_of_motion import EquationsOfMotion

#: Largest opening of the loops by a motion, as a share of its size: rounding of dependent_motion, of projections and
#: of typed numbers.
OPENING = 1e-6
#: Least size of a motion in that comparison, characteristic lengths and rad a second (and squared), so that rounding
#: at rest does not count as a motion that opens the loops.
REST = 1e-3
#: Opening below which every motion keeps the loops closed.
STILL = OPENING * REST
#: Largest error of the equations of motion, as a share of the forces of the coordinate's joint and loops.
EXACT = 1e-7
#: A singular value above this is certain in an exact geometry.
CERTAIN = float(np.sqrt(CLOSED / RESOLVED))


def refuse_opening(state: ChainState, opening: float, size: float, what: str = "velocity") -> None:
    """Raise OpeningMotion if a velocity or acceleration opens the loops; both numbers are scaled."""
    if not (opening <= STILL or opening <= max(OPENING, state.contradiction) * max(size, REST)):
        raise OpeningMotion(what, opening)


def refuse_missing(state: ChainState, q: FloatArray, v: FloatArray, opening: float, size: float) -> None:
    """Raise SingularConfiguration if the scaled error of an acceleration in the closures' rows is large.

    ``size`` is that of the motion: the acceleration plus the square of the velocity, scaled.
    """
    if not opening <= max(OPENING, state.contradiction) * max(size, REST):
        raise SingularConfiguration(q, v, opening)


def refuse_near_singular(
    state: ChainState,
    q: FloatArray,
    jacobian: FloatArray,
    gap: float,
    weakest: float = 0.0,
    passive: NDArray[np.int64] | None = None,
) -> None:
    """Raise if forces or accelerations depend on the rounding and the residual of the loops.

    Parameters
    ----------
    state : ChainState
        The chain.
    q, jacobian : ndarray
        Shapes (nq,) and (rows, nv), a closed configuration and the constraint Jacobian there.
    gap : float
        Largest scaled residual of the loops; of no effect in a rounded geometry.
    weakest : float
        A lower bound of the smallest singular value that is not zero of the equations that were solved, metres divided
        by the characteristic length.
    passive : ndarray of int, optional
        The coordinates of these equations; all of them if left out.

    Raises
    ------
    NearSingularConfiguration
        If the error of that singular value is more than a thousandth of it; in a rounded geometry, if the smallest one
        that is not zero away from singular poses is between a tenth of the tolerance of the rank and ten times it, so
        that it may be zero.
    """
    top, joints = state.topology, state.model.njoints
    # The constraints' singular values are no smaller than those of the equations, which are some of their columns.
    if not jacobian.size or (weakest > CERTAIN and not state.tolerance):
        return
    gap = state.uncertainty(gap)
    scaled = jacobian * top.row_scale[:, None] * top.column
    values = np.asarray(np.linalg.svd(scaled, compute_uv=False), dtype=np.float64)
    tolerance = rank_tolerance(scaled.shape, float(values[0]), joints, gap)
    error = configuration_error(values, tolerance, joints, gap) * float(values[0])
    if passive is not None:
        values = np.asarray(np.linalg.svd(scaled[:, passive], compute_uv=False), dtype=np.float64)
        tolerance = rank_tolerance(scaled[:, passive].shape, float(values.max(initial=0.0)), joints, gap)
    if state.tolerance:
        rank = structural_rank(state, q, passive)
        undetermined = [value for value in values[rank - 1 : rank] if 0.1 * tolerance < value <= 10.0 * tolerance]
        if rank and undetermined:
            raise NearSingularConfiguration(q, float(undetermined[0]), tolerance)
        return
    least = float(values[values > tolerance].min(initial=np.inf))
    if error > RESOLVED * least:
        raise NearSingularConfiguration(q, least, error)


def check_solution(
    equations: EquationsOfMotion, passive: NDArray[np.int64], share: float, weakest: float, resolved: bool = True
) -> None:
    """Raise where no efforts make the motion, or near a singular configuration, by numbers of :func:`solutions`."""
    state, top = equations.state, equations.state.topology
    if not share <= max(EXACT, state.contradiction):
        _, _, _, missing, sizes, _, _ = solutions(
            equations.jacobian, equations.tau, equations.tree, top.owners, passive, top.scales, top.length,
            equations.gap,
        )  # fmt: skip
        _refuse_undriven(equations, passive, missing, sizes)
    if resolved and (weakest <= CERTAIN or state.tolerance):
        refuse_near_singular(state, equations.q, equations.jacobian, equations.gap, weakest, passive)


def _refuse_undriven(
    equations: EquationsOfMotion, passive: NDArray[np.int64], left: FloatArray, sizes: FloatArray
) -> None:
    """Raise UndrivenMotion, unless what is missing is rounding of weights and inertia forces that cancel (a fall)."""
    state, top = equations.state, equations.state.topology
    weights = equations.weights()
    largest_of_loops(weights, top.blocks[1], top.blocks[3])
    if (np.abs(left) <= max(EXACT, equations.state.contradiction) * np.maximum(sizes, weights[passive])).all():
        return
    scaled = np.zeros(state.model.nv)
    scaled[passive] = left
    names = [str(name) for name in list(state.model.names)[1:]]
    # Forces of slides at the characteristic length, so that no unit decides which joint is first.
    largest_in = {name: float(np.abs(scaled[state.velocity_slice(name)]).max(initial=0.0)) for name in names}
    largest = max(largest_in.values())
    worst = sorted((name for name in names if largest_in[name] > 1e-3 * largest), key=lambda name: -largest_in[name])
    raise UndrivenMotion(equations.q, scaled / top.column, worst)
