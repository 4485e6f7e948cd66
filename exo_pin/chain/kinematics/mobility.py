"""Mobility of a closed chain at a pose: degrees of freedom, redundant constraints and kinds of singularity."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.records import Record
from ...core.validation import FloatArray, as_choice, frozen
from ..structure.chain_state import ChainState
from .closing import NEAR, neighbours
from .loops import closed_configuration, scaled_jacobian, tree_frame_jacobian
from .margins import PARTS_OF_POSE, Margins, Output, margins
from .rank import digits_caution, rank_tolerance, self_consistent_error

#: Step to the bend of a constraint, characteristic lengths and rad.
_BEND = 1e-3


@dataclass(frozen=True, eq=False)
class Mobility(Record):
    """Freedoms, redundancy and singularity of a closed chain at one configuration; prints as a table.

    Attributes
    ----------
    rows : int
        Constraint rows, those of the closures and one per locked coordinate.
    coordinates : int
        Velocity coordinates of the tree, nv.
    rank : int
        Rank of the constraint Jacobian.
    regular_rank : int
        The largest rank of this pose and three random ones beside it: the rank but for singular poses.
    singular_values : ndarray
        Of the Jacobian, descending, shape (min(rows, coordinates),), no unit: metres over ``characteristic_length``.
    tolerance : float
        Singular values at or below it count as zero, see :func:`exo_pin.chain.kinematics.rank.rank_tolerance`.
    characteristic_length : float
        Length that weighs metres against radians, m.
    redundant_closures : mapping of str to int
        Number of redundant rows, of each closure that has some. As many of their multipliers, and of those of the
        closures they are redundant with, are statically undetermined.
    kinds : tuple of str
        The singular kinds of the pose, from these; empty for a regular one:

        * "constraint": the rank of the closures is lower than in neighbouring poses, the chain has gained a freedom;
        * "output": with the actuators locked the output can move, so the actuators do not resist some load;
        * "input": with the output locked the actuators can move, so the output cannot move in some direction.
    locked : Mobility or None
        The same with the actuators locked as well; None if there are none. With a redundant joint such as the
        shoulder's, only its rank is lower in a singular pose, not that of the closures.
    idle : int or None
        Freedoms that move neither the actuators nor the output, as a rod's spin between ball joints.
    margins : Margins or None
        Margins to a singularity; None without actuators and output frame.
    geometry : float
        How well the geometry is known, characteristic lengths and rad, which makes ``tolerance``; 0 for an exact one.
    freedoms : tuple of int
        The least and the greatest number of freedoms that the digits of the geometry allow.
    known : float
        A singular value up to this may be made or hidden by the digits; 0 for an exact geometry.

    Examples
    --------
    >>> chain = ep.load("prototype").chain
    >>> mobility = chain.mobility(chain.close(chain.neutral()))
    >>> dict(mobility.redundant_closures), mobility.kinds  # one row of each limb adds nothing; the pose is regular
    ({'limb_1_base': 1, 'limb_2_base': 1, 'limb_3_base': 1}, ())
    """

    rows: int
    coordinates: int
    rank: int
    regular_rank: int
    singular_values: FloatArray
    tolerance: float
    characteristic_length: float
    redundant_closures: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    kinds: tuple[str, ...] = ()
    locked: Mobility | None = None
    idle: int | None = None
    margins: Margins | None = None
    geometry: float = 0.0
    freedoms: tuple[int, int] = (0, 0)
    known: float = 0.0

    @property
    def degrees_of_freedom(self) -> int:
        """Freedoms that the constraints leave, to first order."""
        return self.coordinates - self.rank

    @property
    def redundant(self) -> int:
        """Number of redundant constraint rows, equal to that of statically undetermined multipliers."""
        return self.rows - self.rank

    @property
    def smallest(self) -> float:
        """The smallest singular value above the tolerance; 0 for none. It goes to zero towards a singularity."""
        return float(self.singular_values[self.rank - 1]) if self.rank else 0.0

    @property
    def verdict(self) -> str:
        """Of the pose, with actuators locked or not: "regular", "singular" or "undetermined within the digits"."""
        if any(one.freedoms[0] != one.freedoms[1] for one in (self, self.locked) if one is not None):
            return "undetermined within the digits"
        return "singular" if self.kinds else "regular"

    @property
    def cautions(self) -> tuple[str, ...]:
        """What the digits of the geometry leave open, in words; none for an exact geometry."""
        parts = {"": self} if self.locked is None else {"": self, " with the actuators locked": self.locked}
        found = [
            f"the rank{where} is undetermined within the digits, for {one.freedoms[0]} to {one.freedoms[1]} degrees of "
            f"freedom: the smallest singular value is {one.singular_values[one.regular_rank - 1]:.2g}, and the rounded "
            f"geometry may make or hide one of {one.known:.2g}; give the geometry with more digits"
            for where, one in parts.items()
            if one.freedoms[0] != one.freedoms[1]
        ]
        last = self if self.locked is None else self.locked
        return tuple(found) or digits_caution(self.geometry, last.singular_values[: last.rank], last.tolerance)

    def __str__(self) -> str:
        lines = [
            f"degrees of freedom   {self.degrees_of_freedom}",
            f"constraints          rank {self.rank} of {self.rows} rows on {self.coordinates} coordinates, "
            f"smallest singular value {self.smallest:.3g}",
        ]
        lines.extend(f"Caution: {text}" for text in self.cautions)
        if self.locked is not None:
            lines.append(
                f"actuators locked     rank {self.locked.rank} of {self.locked.rows} rows, "
                f"{self.locked.degrees_of_freedom} degrees of freedom, "
                f"smallest singular value {self.locked.smallest:.3g}"
            )
        repeated = ", ".join(f"{name} ({count})" for name, count in self.redundant_closures.items())
        lines.append(f"redundant rows       {self.redundant}{': ' + repeated if repeated else ''}")
        kinds = ", ".join(self.kinds) or "no"
        lines.append(f"singular             {kinds if self.verdict in ('regular', 'singular') else self.verdict}")
        if self.idle:
            lines.append(f"idle freedoms        {self.idle}")
        if self.geometry and self.rank < len(self.singular_values):
            lines.append(
                f"rounded geometry     {self.redundant} rows agree with others to "
                f"{self.singular_values[self.rank]:.1e}; it is known to {self.geometry:.1e}"
            )
        if self.margins is not None:
            lines.append(str(self.margins))
        lines.append(
            f"metres and radians   weighed by {self.characteristic_length:.4g} m; "
            f"singular values up to {self.tolerance:.1e} count as zero"
        )
        return "\n".join(lines)


def mobility(
    state: ChainState,
    q: ArrayLike,
    locked: Iterable[str] = (),
    actuated: Iterable[str] | None = None,
    frame: str | None = None,
    part: str = "pose",
) -> Mobility:
    """Freedoms, redundancy, singular kinds and margins at a closed configuration.

    Ranks and kinds are those of q itself, to rounding and the residual of the loops. Where two branches meet,
    :meth:`ClosedChain.close` comes no nearer to the singular pose than the square root of its tolerance. Such a pose
    may count as regular; its large margins show that it is near a singularity.

    Parameters
    ----------
    q : array_like
        Shape (nq,), closed.
    locked : iterable of str
        Joints that are locked, too; each of their coordinates adds a constraint row.
    actuated : iterable of str, optional
        The actuated joints; those of the roles if left out.
    frame : str, optional
        The output, the frame that the chain has to move; the roles' arm if left out. Without one, "output" means
        any freedom with locked actuators, and "input" is never reported.
    part : {"pose", "position", "orientation"}
        Part of the frame's pose that is the output: all of it, its origin, or its orientation.

    Returns
    -------
    Mobility
        Counts, ranks, kinds and margins; singular values have no unit.

    Raises
    ------
    LoopNotClosed
        If the residual of the loops exceeds 1e-8.
    InvalidInput
        If a locked joint is an actuated one.

    Examples
    --------
    >>> chain = ep.load("scenario-one").chain
    >>> found = chain.mobility(chain.close(chain.neutral()))
    >>> found.degrees_of_freedom, found.rank  # 18 coordinates, 18 rows of which three are redundant
    (3, 15)
    """
    q = closed_configuration(state, q).copy()
    rows = PARTS_OF_POSE[as_choice("part of the output", part, PARTS_OF_POSE)]
    held = state.velocity_indices(locked)
    driven = state.velocity_indices(state.roles.actuated if actuated is None else actuated)
    if np.intersect1d(held, driven).size and actuated is not None:
        raise InvalidInput("expected locked joints that are not actuated: name each joint in one of the two")
    driven = np.setdiff1d(driven, held)
    name = frame if frame is not None else state.roles.arm
    output = None if name is None else (name, rows)
    here = _analysed(state, q, held, driven, output)
    beside = tuple(neighbours(state, q, here.free.null_space, held, here.locked.tolerance))
    near = [_analysed(state, there, held, driven, output) for there in beside]
    singular = {
        "constraint": any(other.free.rank > here.free.rank for other in near) or _comes_back(state, q, beside, here),
        "output": any(other.output_lost < here.output_lost for other in near),
        "input": any(other.input_lost < here.input_lost for other in near),
    }
    regular = [
        max(ranks.rank for ranks in kind) for kind in zip(*((o.free, o.locked) for o in (here, *near)), strict=True)
    ]
    found = replace(
        _constrained(state, q, here.free, regular[0]), kinds=tuple(kind for kind, so in singular.items() if so)
    )
    if not driven.size:
        return found
    found = replace(found, locked=_constrained(state, q, here.locked, regular[1]))
    if output is None:
        return found
    lost = here.output_lost, here.input_lost, here.idle
    margin = margins(state, q, here.free.null_space, driven, output, lost)
    return replace(found, idle=here.idle, margins=margin)


def _comes_back(state: ChainState, q: FloatArray, beside: tuple[FloatArray, ...], here: _Ranks) -> bool:
    """Whether a freedom is one of first order alone, as of links in one line: what was moved by it closes at q."""
    close = NEAR * min(0.3, 1e-3 + 100.0 * np.sqrt(here.locked.tolerance)) * state.topology.column
    return bool(beside) and all((np.abs(pin.difference(state.model, q, there)) <= close).all() for there in beside)


def _analysed(state: ChainState, q: FloatArray, held: np.ndarray, driven: np.ndarray, output: Output | None) -> _Ranks:
    """Ranks of the constraints alone, with the actuators locked, with the output locked, and with both."""
    J, _ = scaled_jacobian(state, q)
    top, nv = state.topology, state.model.nv
    gap = state.digits or state.scaled_gap()
    # The configuration of a rounded geometry is the nearest one, and known as well as the geometry.
    error = state.digits or self_consistent_error(J, state.model.njoints, gap)
    unit = np.eye(nv)
    free = np.concatenate([J, unit[held]])
    locked = np.concatenate([free, unit[driven]])

    def ranked(matrix: FloatArray) -> _Ranked:
        if not matrix.size:
            return _Ranked(matrix, 0, np.array([]), 0.0, np.eye(nv))
        _, values, Vt = np.linalg.svd(matrix)
        tolerance = rank_tolerance(matrix.shape, float(values[0]), state.model.njoints, gap)
        tolerance = max(tolerance, error * float(values[0]))
        rank = int(np.count_nonzero(values > tolerance))
        return _Ranked(matrix, rank, values, tolerance, Vt)

    of_free, of_locked = ranked(free), ranked(locked)
    left = nv - of_locked.rank
    if output is None:
        return _Ranks(of_free, of_locked, left, 0, 0)
    motion = tree_frame_jacobian(state, q, output[0]) * top.column
    motion[:3] /= top.length
    motion = motion[output[1]]
    idle = nv - ranked(np.concatenate([locked, motion])).rank
    input_lost = nv - ranked(np.concatenate([free, motion])).rank - idle
    return _Ranks(of_free, of_locked, left - idle, input_lost, idle)


def _redundant(state: ChainState, matrix: FloatArray, rank: int) -> dict[str, int]:
    """Redundant closures, with the number of their redundant rows.

    A self-stress is a combination of rows that vanishes. A closure's share in the space of all self-stresses has
    the dimension by which the rank falls short of the closure's rows when it is added to all others.
    """
    if rank == matrix.shape[0]:
        return {}
    stress = np.linalg.svd(matrix)[0][:, rank:]
    found = {}
    for closure in state.closures:
        # The basis is orthonormal: its entries are exact to rounding over the gap below the last singular value.
        share = np.linalg.svd(stress[state.rows(closure.name)], compute_uv=False)
        if count := int(np.count_nonzero(share > 1e-6)):
            found[closure.name] = count
    return found


def _constrained(state: ChainState, q: FloatArray, here: _Ranked, regular_rank: int) -> Mobility:
    """Freedoms and redundancy alone."""
    matrix, rank, values, tolerance, _ = here
    redundant = MappingProxyType(_redundant(state, matrix, rank))
    sizes = len(matrix), state.nv, rank, regular_rank, frozen(values.copy()), tolerance, state.topology.length
    doubtful, known = _doubtful(state, q, here)
    certain = int(np.count_nonzero(values[:regular_rank] > 0.1 * tolerance)) if state.digits else rank
    freedoms = state.nv - max(certain, rank), state.nv - rank + doubtful
    return Mobility(*sizes, redundant, geometry=state.digits, freedoms=freedoms, known=known)


def _doubtful(state: ChainState, q: FloatArray, here: _Ranked) -> tuple[int, float]:
    """How many singular values that count the digits may have made, and the size of the largest such one.

    The digits open a loop by some ``opening``. In a singular pose that is of second order in the motion x that it does
    not resist, opening = bend x² / 2, and there the singular value is bend x: the loops of other digits may be in that
    pose where it is up to sqrt(2 bend opening).
    """
    if not state.digits or not here.rank:
        return 0, 0.0
    opening, column, count = state.digits * np.sqrt(state.model.njoints), state.topology.column, 0
    known = 10.0 * here.tolerance
    while count < here.rank:
        motion = here.motions[here.rank - 1 - count]
        there, back = (
            scaled_jacobian(state, pin.integrate(state.model, q, side * _BEND * column * motion))[0] @ motion
            for side in (1.0, -1.0)
        )
        bend = float(np.linalg.norm(there - back)) / (2.0 * _BEND)
        known = max(known, np.sqrt(2.0 * bend * opening))
        if here.values[here.rank - 1 - count] > known:
            break
        count += 1
    return count, float(known)


class _Ranked(NamedTuple):
    """Scaled constraints with their rank, singular values and the tolerance of these, and motions, one a row."""

    matrix: FloatArray
    rank: int
    values: FloatArray
    tolerance: float
    motions: FloatArray

    @property
    def null_space(self) -> FloatArray:
        """The motions they leave, one a column."""
        return self.motions[self.rank :].T


class _Ranks(NamedTuple):
    """Constraints of a pose, those with locked actuators, and how many motions actuators and output lose."""

    free: _Ranked
    locked: _Ranked
    output_lost: int
    input_lost: int
    idle: int
