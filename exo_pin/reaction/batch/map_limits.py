"""Limits in maps: which poses of a block meet them, and the forces of those that have to be chosen anew.

The kernels answer without limits. A pose whose forces meet them keeps its answer, which is then the best within the
limits as well. Of three limbs equilibrium determines the forces, and there is nothing to choose. With more, the other
poses are chosen as :func:`exo_pin.reaction.answer.chosen_forces` does, from the same equilibrium in closed form.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.validation import FloatArray, as_pair
from ...design import Mechanism
from ...load_case.pose_stacks import Query, applied_stack, arm_loads
from ...wrist.forces.displaced import Displaced
from ...wrist.forces.wrench_feasibility import force_bounds
from ..answer import QUERY_STATUS, chosen_forces
from ..constraints.actuator_limits import LimbLimits, closed_length_limits, depend_on_length, pull_laws
from ..constraints.given_limits import UNBOUNDED, Limits, SideForceBounds, as_limb_limits
from ..holding.hold_check import estimated_limbs, hold_check
from ..splits.pose_stack import PoseStack, limb_lengths
from ..splits.split import Spherical, Split
from .limit_kernels import CompiledLimits, check_limits
from .map_kernels import GIVEN, INFEASIBLE, SPHERICAL, LimbPoints, Outputs, Terms, map_any

_SINGULAR, _OUT_OF_STROKE, _BEYOND = (
    QUERY_STATUS.index(name) for name in ("singular", "out_of_stroke", "beyond_limits")
)


class MapLimits:
    """Limits of the limbs over a map, and what they change.

    Parameters
    ----------
    limits : Limits
        As in :meth:`exo_pin.ShoulderExo.reaction`.
    mechanism : Mechanism
        The design.
    shape : tuple of int
        The map's stack (...).
    law : Split
        Of the map.

    Attributes
    ----------
    bind : bool
        Whether anything is limited.
    one_signed : bool
        Whether the limits fix the sign of every f_i.
    """

    def __init__(self, limits: Limits, mechanism: Mechanism, shape: tuple[int, ...], law: Split) -> None:
        self._mechanism, self._given = mechanism, as_pair("limits", limits)
        self._pair: tuple[FloatArray, FloatArray] | None = None
        #: Limits that kernels check: the same in all poses, or of three limbs, which leave nothing to choose.
        self._compiled: CompiledLimits | None = None
        n, self.bind, self.one_signed = mechanism.limb_count, True, False
        nowhere = np.full((1, n), np.nan)
        if isinstance(self._given, tuple) and not any(hasattr(end, "force_limits") for end in self._given):
            # Checks the pair, whatever it is, and narrows the limits of the design.
            probe = as_limb_limits(self._given, mechanism, shape, lambda: np.full((math.prod(shape), n), np.nan))
            lower, upper = self._given
            self._pair, self.one_signed = force_bounds("limits", lower, upper, shape, n), probe.one_signed
        elif isinstance(self._given, str) or self._given is None:
            probe = as_limb_limits(limits, mechanism, (1,), lambda: nowhere)
            self.one_signed = probe.one_signed
            ends = closed_length_limits(mechanism)
            self.bind = probe.asked and bool(probe.bound_forces or np.isfinite(ends[0]).any())
            if self.bind and (n == 3 or (type(law) is Spherical and not depend_on_length(mechanism))):
                # The probe cannot tell a least tension that the law does not give anywhere.
                lower = np.fmax(probe.lower[0], [limb.effort_range[0] for limb in mechanism.limbs])
                upper, below, above = (part[0].copy() for part in (probe.upper, probe.open_below, probe.open_above))
                strokes = ends[0].copy(), ends[1].copy(), estimated_limbs(mechanism)
                self._compiled = CompiledLimits(lower, upper, below, above, *strokes, pull_laws(mechanism))

    @property
    def forces(self) -> tuple[FloatArray, FloatArray]:
        """Limits of f that are the same in all poses, shape (1, n) each, N; (0, n) where others count, or none."""
        if self._compiled is None:
            return (np.empty((0, self._mechanism.limb_count)),) * 2
        return self._compiled.lower[None], self._compiled.upper[None]

    @property
    def choose(self) -> bool:
        """Whether forces have to be chosen within limits, or limits differ from pose to pose."""
        return self.bind and self._compiled is None

    def check(self, law: Split, q: FloatArray, terms: Terms, device: LimbPoints, out: Outputs) -> NDArray[np.bool_]:
        """Mark the poses of a block that do not meet limits that compiled code checks.

        Returns where the outcome is not known; :meth:`enforce` is for all other limits.
        """
        assert self._compiled is not None
        unknown, chosen = np.empty(len(q), dtype=bool), self._mechanism.limb_count > 3
        points = (device.base, device.platform, self._compiled)
        check_limits(q, *points, out.f, out.status, unknown)
        beyond = np.flatnonzero(out.status > INFEASIBLE)
        if beyond.size and (chosen or law.chooses_sides):
            self._plain(q, beyond, terms, device, out)
        if not (beyond.size and chosen):
            return unknown
        # Lengths are sure only with the forces of plain equilibrium, which stand there now.
        long = beyond[out.status[beyond] == _OUT_OF_STROKE]
        part, again = np.zeros(len(long), dtype=np.int8), np.empty(len(long), dtype=bool)
        check_limits(np.ascontiguousarray(q[long]), *points, out.f[long], part, again)
        unknown[long] = again
        # The kernel left these to the program, because rounding decides.
        rows = beyond[out.status[beyond] == _BEYOND]
        if rows.size:
            limits, turned = self.at(0, q[rows]), np.ascontiguousarray(Rotation.from_quat(q[rows]).as_matrix())
            self._choose(law, UNBOUNDED, q[rows], turned, limits, _part(terms, rows), rows, out)
            every = np.ones(len(rows), dtype=bool)
            unmet = out.status[rows] >= _SINGULAR
            unknown[rows] = hold_check(self._mechanism, limits, out.f[rows], every, unmet).unknown
        return unknown

    def at(self, start: int, q: FloatArray) -> LimbLimits:
        """Limits of the poses from ``start`` on; ``q`` are their unit quaternions, shape (k, 4), scalar last."""
        lengths = limb_lengths(self._mechanism, Rotation.from_quat(q).as_matrix(), None)
        k, given = len(lengths), self._given
        if self._pair is not None:
            given = tuple(ends[start : start + k] for ends in self._pair)
        return as_limb_limits(given, self._mechanism, (k,), lambda: lengths)

    def enforce(
        self,
        law: Split,
        bounds: SideForceBounds,
        limits: LimbLimits,
        start: int,
        q: FloatArray,
        terms: Terms,
        device: LimbPoints,
        out: Outputs,
    ) -> NDArray[np.bool_]:
        """Change the poses of a block that do not meet their limits, in place; return where the outcome is not known.

        Parameters
        ----------
        law, bounds : Split, SideForceBounds
            Of the map.
        limits : LimbLimits
            Of the block's poses, from :meth:`at`.
        start : int
            Number of the block's first pose in the map.
        q : ndarray
            Unit quaternions, shape (k, 4), scalar last.
        terms, device, out : NamedTuple
            Of the block, all outputs with a row a pose.
        """
        mechanism = self._mechanism
        every = np.arange(len(q))
        answered = (out.status < _SINGULAR) | (out.status == INFEASIBLE)
        unmet = answered & ~limits.reachable
        open_ = answered & (out.status != INFEASIBLE) & ~(limits.met(out.f, every) & limits.reachable)
        rows = np.flatnonzero(answered if bounds.by_tension else open_)
        if rows.size and (mechanism.limb_count == 3 or unmet[rows].all()):
            # Equilibrium determines these forces: they stay as they are, those of plain equilibrium.
            out.status[rows] = np.where(unmet[rows], _OUT_OF_STROKE, _BEYOND)
            self._plain(q, rows, terms, device, out)
        elif rows.size:
            turned = np.ascontiguousarray(Rotation.from_quat(q[rows]).as_matrix())
            part = (q[rows], turned, limits.rows(rows), _part(terms, rows))
            self._choose(law, bounds.of_rows(start + rows), *part, rows, out)
        return hold_check(mechanism, limits, out.f, answered, answered & (out.status >= _SINGULAR)).unknown

    def _plain(self, q: FloatArray, rows: NDArray[np.intp], terms: Terms, device: LimbPoints, out: Outputs) -> None:
        """Replace the forces of some poses by those of limbs that carry no side force."""
        k, n = len(rows), self._mechanism.limb_count
        own = Outputs(*(np.empty((k, *array.shape[1:]), dtype=array.dtype) for array in out))
        none = np.empty((0, n))
        part = _part(terms, rows)
        map_any(np.ascontiguousarray(q[rows]), device, part, SPHERICAL, GIVEN, none, none, none, none, own)
        for name in ("shoulder", "f", "g", "magnitude"):
            getattr(out, name)[rows] = getattr(own, name)

    def _choose(
        self,
        law: Split,
        bounds: SideForceBounds,
        q: FloatArray,
        matrices: FloatArray,
        limits: LimbLimits,
        terms: Terms,
        rows: NDArray[np.intp],
        out: Outputs,
    ) -> None:
        """Choose the forces of k poses within their limits, and write them to their rows of ``out``."""
        mechanism, k = self._mechanism, len(rows)
        velocity, acceleration, force, couple, at = (np.array(np.broadcast_to(v, (k, 3))) for v in terms[-5:])
        load, moment, none = np.empty((k, 3)), np.empty((k, 3)), np.zeros((k, 3))
        applied_stack(matrices, force, couple, at, terms.in_arm, load, moment)
        query = Query((k,), matrices, velocity, acceleration, load, moment, q)
        carried = arm_loads(mechanism.require_arm("weight"), mechanism.gravity, query)[:2]
        own = Displaced(mechanism, query, none, none, *carried)
        chosen = chosen_forces(law, PoseStack(mechanism, matrices, None, *own.parts, limits, bounds, None, None))
        out.f[rows], out.g[rows] = chosen.f, chosen.g
        out.shoulder[rows] = own.state.shoulder_force(chosen.f, chosen.g)
        out.magnitude[rows] = np.linalg.norm(out.shoulder[rows], axis=-1)
        out.status[rows] = np.where(chosen.unmet > 0, chosen.unmet, chosen.status)
        failed = rows[chosen.status >= _SINGULAR]
        for forces in (out.f, out.g, out.shoulder, out.magnitude):
            forces[failed] = np.nan


def _part(terms: Terms, rows: NDArray[np.intp]) -> Terms:
    """Motion and load of some poses."""
    vectors = (v if len(v) == 1 else np.ascontiguousarray(v[rows]) for v in terms[-5:])
    return Terms(*terms[:-5], *vectors)
