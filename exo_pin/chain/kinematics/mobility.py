"""How a closed chain can move at a pose, what its constraints repeat, and which kind of singularity it stands in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput, LoopNotClosed, UnknownName
from ...core.records import Record
from ...core.validation import FloatArray, frozen
from .margins import PARTS_OF_POSE, Margins, Output, margins
from .rank import configuration_error, rank_tolerance
from .reduced_kinematics import Kinematics

__all__ = ["Mobility", "MobilityQueries"]

#: What is true of nearly all poses is taken from so many near this one, and how far away they are, rad and
#: characteristic lengths. Singular poses are a thin set: random neighbours are not on it.
_NEIGHBOURS, _NEAR = 3, 0.05


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
    singular_values : ndarray
        Shape (min(rows, coordinates),), descending, of the Jacobian with metres divided by
        ``characteristic_length``: they have no unit.
    tolerance : float
        Singular values at or below it count as zero, see :func:`exo_pin.chain.kinematics.rank.rank_tolerance`.
    characteristic_length : float
        Length that weighs metres against radians, m.
    redundant_closures : mapping of str to int
        Of the closures that repeat others: how many of their rows do. So many of their multipliers, and of those of
        the closures they are redundant with, are statically undetermined.
    kinds : tuple of str
        The singular kinds of the pose, from these; empty for a regular one:

        * "constraint": the closures have lost rank against neighbouring poses, the chain has gained a freedom;
        * "output": with the actuators locked the output can move, so the actuators do not hold some load;
        * "input": with the output locked the actuators can move, so the output cannot go some way.
    locked : Mobility or None
        The same with the actuators locked as well; None if there are none. With a redundant joint such as the
        shoulder's, the closures keep their rank in a singular pose and only the locked chain tells.
    idle : int or None
        Freedoms that move neither the actuators nor the output, as a rod's spin between ball joints.
    margins : Margins or None
        How far the pose is from singular; None without actuators and output frame.
    """

    rows: int
    coordinates: int
    rank: int
    singular_values: FloatArray
    tolerance: float
    characteristic_length: float
    redundant_closures: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    kinds: tuple[str, ...] = ()
    locked: Mobility | None = None
    idle: int | None = None
    margins: Margins | None = None

    @property
    def degrees_of_freedom(self) -> int:
        """Freedoms that the constraints leave, to first order."""
        return self.coordinates - self.rank

    @property
    def redundant(self) -> int:
        """Constraint rows that say nothing new: so many multipliers are statically undetermined."""
        return self.rows - self.rank

    @property
    def smallest(self) -> float:
        """The smallest singular value that counts; 0 for none. It goes to zero towards a singularity."""
        return float(self.singular_values[self.rank - 1]) if self.rank else 0.0

    def __str__(self) -> str:
        lines = [
            f"degrees of freedom   {self.degrees_of_freedom}",
            f"constraints          rank {self.rank} of {self.rows} rows on {self.coordinates} coordinates, "
            f"smallest singular value {self.smallest:.3g}",
        ]
        if self.locked is not None:
            lines.append(
                f"actuators locked     rank {self.locked.rank} of {self.locked.rows} rows, "
                f"{self.locked.degrees_of_freedom} degrees of freedom, "
                f"smallest singular value {self.locked.smallest:.3g}"
            )
        repeated = ", ".join(f"{name} ({count})" for name, count in self.redundant_closures.items())
        lines.append(f"redundant rows       {self.redundant}{': ' + repeated if repeated else ''}")
        lines.append(f"singular             {', '.join(self.kinds) or 'no'}")
        if self.idle:
            lines.append(f"idle freedoms        {self.idle}")
        if self.margins is not None:
            lines.append(str(self.margins))
        lines.append(
            f"metres and radians   weighed by {self.characteristic_length:.4g} m; "
            f"singular values up to {self.tolerance:.1e} count as zero"
        )
        return "\n".join(lines)


class MobilityQueries(Kinematics):
    """Mobility of a closed chain."""

    def mobility(
        self,
        q: ArrayLike,
        locked: Iterable[str] = (),
        actuated: Iterable[str] | None = None,
        frame: str | None = None,
        part: str = "pose",
    ) -> Mobility:
        """Freedoms, redundancy, singular kinds and margins at a closed configuration.

        Ranks and kinds are those of q itself, to rounding and to what the loops stand open. :meth:`close` comes no
        nearer to a singular pose than the square root of its tolerance where two branches meet, so a pose that was
        closed there may count as regular: its margins then are large, and tell.

        Parameters
        ----------
        q : array_like
            Shape (nq,), closed.
        locked : iterable of str
            Joints that are held besides; each of their coordinates adds a constraint row.
        actuated : iterable of str, optional
            The actuated joints; those of the roles if left out.
        frame : str, optional
            The output: the frame that the chain is there to move; the roles' arm if left out. Without one, "output"
            tells of any freedom that the locked actuators leave, and "input" is not told.
        part : {"pose", "position", "orientation"}
            What of the frame is the output: all of it, its origin, or how it is turned.

        Raises
        ------
        LoopNotClosed
            If the loops stand open by more than 1e-8.
        InvalidInput
            If a locked joint is an actuated one.
        """
        q = self._closed(q).copy()
        if part not in PARTS_OF_POSE:
            raise UnknownName("part of the output", part, PARTS_OF_POSE)
        held = self.velocity_indices(locked)
        names = self.roles.actuated if actuated is None else tuple(actuated)
        driven = self.velocity_indices(names)
        if np.intersect1d(held, driven).size and actuated is not None:
            raise InvalidInput("expected locked joints that are not actuated")
        driven = np.setdiff1d(driven, held)
        name = frame if frame is not None else self.roles.arm
        output = None if name is None else (name, PARTS_OF_POSE[part])
        here = self._analysed(q, held, driven, output)
        kinds: list[str] = []
        if driven.size or self.row_count:
            usual = self._neighbourhood(q, here, held, driven, output)
            pairs = (("constraint", usual.rank - here.rank), ("output", here.output_lost - usual.output_lost))
            kinds = [kind for kind, worse in (*pairs, ("input", here.input_lost - usual.input_lost)) if worse > 0]
        told = None
        if driven.size and output is not None:
            told = margins(
                self,
                q,
                here.null_space,
                here.locked_matrix,
                driven,
                output,
                (here.output_lost, here.input_lost, here.idle),
            )
        return Mobility(
            here.matrix.shape[0],
            self._model.nv,
            here.rank,
            frozen(here.values),
            here.tolerance,
            self._topology.length,
            MappingProxyType(self._redundant(here.matrix, here.rank)),
            tuple(kinds),
            self._with_locked(here) if driven.size else None,
            here.idle if driven.size and output is not None else None,
            told,
        )

    def _analysed(self, q: FloatArray, held: np.ndarray, driven: np.ndarray, output: Output | None) -> _Ranks:
        """Ranks of the constraints alone, with the actuators locked, with the output locked, and with both."""
        J, _ = self._scaled_jacobian(q)
        top, nv = self._topology, self._model.nv
        gap = float(np.abs(self._workspace.gap * top.row_scale).max(initial=0.0))
        columns = top.column
        error = self._configuration_error(J, gap)
        unit = np.eye(nv)
        free = np.concatenate([J, unit[held]])
        locked = np.concatenate([free, unit[driven]])

        def ranked(matrix: FloatArray) -> tuple[int, FloatArray, float, FloatArray]:
            if not matrix.size:
                return 0, np.zeros(0), 0.0, np.eye(nv)
            _, values, Vt = np.linalg.svd(matrix)
            tolerance = rank_tolerance(matrix.shape, float(values[0]), self._model.njoints, gap)
            tolerance = max(tolerance, error * float(values[0]))
            rank = int(np.count_nonzero(values > tolerance))
            return rank, values, tolerance, Vt[rank:].T

        rank, values, tolerance, null_space = ranked(free)
        left = nv - ranked(locked)[0]
        if output is None:
            return _Ranks(free, rank, values, tolerance, null_space, locked, left, 0, 0, error)
        motion = self._tree_frame_jacobian(q, output[0]) * columns
        motion[:3] /= top.length
        motion = motion[output[1]]
        still = np.concatenate([free, motion])
        idle = nv - ranked(np.concatenate([locked, motion]))[0]
        return _Ranks(
            free, rank, values, tolerance, null_space, locked, left - idle, nv - ranked(still)[0] - idle, idle, error
        )

    def _neighbourhood(
        self, q: FloatArray, here: _Ranks, held: np.ndarray, driven: np.ndarray, output: Output | None
    ) -> _Ranks:
        """The highest ranks of the pose and some neighbours: what is usual around here."""
        rng = np.random.default_rng(0)
        columns = self._topology.column
        usual = here
        for _ in range(_NEIGHBOURS if here.null_space.shape[1] else 0):
            away = here.null_space @ rng.normal(size=here.null_space.shape[1])
            start = pin.integrate(self._model, q, columns * away * (_NEAR / np.abs(away).max()))
            try:
                there = self._close(start, held, 1e-12, 30)[0]
            except LoopNotClosed:
                continue
            other = self._analysed(there, held, driven, output)
            usual = usual._replace(
                rank=max(usual.rank, other.rank),
                output_lost=min(usual.output_lost, other.output_lost),
                input_lost=min(usual.input_lost, other.input_lost),
            )
        return usual

    def _redundant(self, matrix: FloatArray, rank: int) -> dict[str, int]:
        """Closures that repeat others, with the number of their rows that do.

        A self-stress is a combination of rows that vanishes. A closure's share in the space of all self-stresses has
        the dimension by which the rank falls short of the closure's rows when it is added to all others.
        """
        if rank == matrix.shape[0]:
            return {}
        stress = np.linalg.svd(matrix)[0][:, rank:]
        found = {}
        for closure in self.closures:
            # The basis is orthonormal: its entries are exact to rounding over the gap below the last singular value.
            share = np.linalg.svd(stress[self.rows(closure.name)], compute_uv=False)
            if count := int(np.count_nonzero(share > 1e-6)):
                found[closure.name] = count
        return found

    def _configuration_error(self, J: FloatArray, gap: float) -> float:
        """How far the configuration may be off, where singular values no larger than their own error count as zero."""
        if not J.size:
            return 0.0
        values = np.asarray(np.linalg.svd(J, compute_uv=False), dtype=np.float64)
        joints, largest = self._model.njoints, float(values[0])
        tolerance = rank_tolerance(J.shape, largest, joints, gap)
        while error := configuration_error(values, tolerance, joints, gap):
            least = float(values[np.count_nonzero(values > tolerance) - 1])
            if least > error * largest:
                break
            tolerance = least
        return max(error, tolerance / largest)

    def _with_locked(self, here: _Ranks) -> Mobility:
        matrix = here.locked_matrix
        values = np.asarray(np.linalg.svd(matrix, compute_uv=False), dtype=np.float64)
        gap = float(np.abs(self._workspace.gap * self._topology.row_scale).max(initial=0.0))
        tolerance = rank_tolerance(matrix.shape, float(values[0]), self._model.njoints, gap)
        tolerance = max(tolerance, here.error * float(values[0]))
        rank = int(np.count_nonzero(values > tolerance))
        return Mobility(
            matrix.shape[0],
            self._model.nv,
            rank,
            frozen(np.asarray(values, dtype=np.float64)),
            tolerance,
            self._topology.length,
            MappingProxyType(self._redundant(matrix, rank)),
        )


class _Ranks(NamedTuple):
    """Constraints of a pose: matrices and null space scaled, and how many motions are lost to actuators and output."""

    matrix: FloatArray
    rank: int
    values: FloatArray
    tolerance: float
    null_space: FloatArray
    locked_matrix: FloatArray
    output_lost: int
    input_lost: int
    idle: int
    error: float
