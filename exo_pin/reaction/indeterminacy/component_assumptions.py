"""Assumptions behind each component of a result, and its interval under equilibrium and bounds.

All answers that balance in a pose differ by self-stresses: tensions that balance themselves, and side forces. f and F_s
are affine in those, so a component is unique if no self-stress changes it; and its interval under bounds on g is exact
interval arithmetic, because the bounds form a box. Bounds on tensions cut that box obliquely, and then each end of an
interval is a linear program.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from ...core.errors import SolverFailed, UnknownName
from ...core.validation import FloatArray, ReadOnly
from .certificate import KINDS, Components, is_determined

if TYPE_CHECKING:
    from ..splits.pose_stack import PoseStack
    from ..splits.split import Chosen, Split

#: Effect on a force, per newton of another, below which there is none.
_NO_EFFECT = 1e-9
#: Width of an interval, relative to the largest force, below which it is a point.
_POINT = 1e-6


class Freedom(NamedTuple):
    """Forces that balance themselves in one pose, and their effects.

    Attributes
    ----------
    own : int
        Number of tensions among them; side forces follow.
    of_f, of_g, of_shoulder : ndarray
        Effects on f, g and F_s, shapes (n, m), (n, m) and (3, m).
    elastic : callable
        Takes effects of tensions on F_s, shape (3, k), and returns the changes of f, g and F_s that follow from the
        displacement of limbs and shoulder, shape (2 n + 3, k), beside the change of f itself.
    fixed : callable
        Takes directions within the freedom, shape (m, k), and returns which of f, g and F_s are the same for all of
        them within the bounds, shape (2 n + 3,).
    """

    own: int
    of_f: FloatArray
    of_g: FloatArray
    of_shoulder: FloatArray
    elastic: Callable[[FloatArray], FloatArray]
    fixed: Callable[[FloatArray], NDArray[np.bool_]]

    @property
    def all(self) -> FloatArray:
        """Effects on f, g and F_s one below the other, shape (2 n + 3, m)."""
        return np.concatenate([self.of_f, self.of_g, self.of_shoulder])

    @property
    def of_tensions(self) -> FloatArray:
        """Effects of the tensions that balance themselves, shape (2 n + 3, own)."""
        return self.all[:, : self.own]

    def without_shoulder(self) -> FloatArray:
        """Directions that leave F_s as it is, shape (m, k)."""
        if self.of_shoulder.shape[1] == 0:
            return np.empty((0, 0))
        _, values, Vt = np.linalg.svd(self.of_shoulder)
        return Vt[int((values > _NO_EFFECT * values[0]).sum()) :].T

    def is_fixed(self, effect: FloatArray) -> NDArray[np.bool_]:
        """Whether each row of an effect is zero."""
        return is_determined(effect)


@dataclass(frozen=True, eq=False)
class ComponentSource(ReadOnly):
    """An answer and its query, from which the components of the certificate are computed.

    Attributes
    ----------
    split : Split
        Assumption of the answer.
    poses : PoseStack
        N poses.
    shape : tuple of int
        The stack's shape (...).
    values : ndarray
        f, g and F_s in one row, shape (N, 2 n + 3), N; NaN without an answer.
    chosen : Chosen
        How they were chosen.
    """

    split: Split
    poses: PoseStack
    shape: tuple[int, ...]
    values: FloatArray
    chosen: Chosen

    @property
    def held(self) -> NDArray[np.bool_]:
        """Whether the forces are within the limits of the query, shape (N,); else they are of plain equilibrium."""
        return self.chosen.unmet == 0

    def components(self) -> Components:
        """Kinds and intervals; see :attr:`exo_pin.reaction.Certificate.components`."""
        shape, n, upu = self.shape, self.poses.mechanism.limb_count, self.poses.upu
        bounds, tensions = self.poses.side_bounds, self._tension_bounds()
        kinds = np.full(self.values.shape, "none", dtype="<U9")
        intervals = np.full((*self.values.shape, 2), np.nan)
        for row in np.flatnonzero(~np.isnan(self.values).any(axis=1)).tolist():
            now = self.values[row, n : 2 * n]
            at_zero = self.values[row, :n] - self.poses.tensions.f_of_g[row] @ now
            lower, upper = (side[upu] - now[upu] for side in bounds.at(row, at_zero))
            free = np.full(self.poses.tensions.self_stress.shape[2], np.inf)
            box = np.concatenate([-free, lower]), np.concatenate([free, upper])
            freedom = self._freedom(row, box)
            own = self.split.kinds(freedom)
            for kind in set(own.tolist()) - set(KINDS):
                raise UnknownName("kind of assumption", str(kind), KINDS, where=f"split {self.split.name!r}")
            kinds[row] = np.where(is_determined(freedom.all), "unique", own)
            cut = None if tensions is None else tuple(side[row] - self.values[row, :n] for side in tensions)
            intervals[row] = self.values[row][:, None] + _ranges(freedom, box, cut)
        f, g, shoulder = slice(0, n), slice(n, 2 * n), slice(2 * n, None)
        return Components(
            actuator_forces=kinds[:, f].reshape(*shape, n),
            constraint_forces=kinds[:, g].reshape(*shape, n),
            shoulder_force=kinds[:, shoulder].reshape(*shape, 3),
            actuator_intervals=intervals[:, f].reshape(*shape, n, 2),
            constraint_intervals=intervals[:, g].reshape(*shape, n, 2),
            shoulder_intervals=intervals[:, shoulder].reshape(*shape, 3, 2),
            needed=self._needed(),
        )

    def _tension_bounds(self) -> tuple[FloatArray, FloatArray] | None:
        """Limits of f, shape (N, n) each; None if there are none."""
        limits, held = self.poses.limits, self.held[:, None]
        if not limits.bound_forces or not held.any():
            return None
        # The answer is within the limits of its query, but for rounding.
        f = self.values[:, : self.poses.mechanism.limb_count]
        return np.where(held, np.minimum(limits.lower, f), -np.inf), np.where(held, np.maximum(limits.upper, f), np.inf)

    def _freedom(self, row: int, box: tuple[FloatArray, FloatArray]) -> Freedom:
        """What equilibrium does not determine in one pose."""
        own, upu = self.poses.tensions, self.poses.upu
        n, stresses = own.self_stress.shape[1:]
        of_g = np.zeros((n, stresses + upu.size))
        of_g[upu, stresses + np.arange(upu.size)] = 1.0
        of_f = np.hstack([own.self_stress[row], own.f_of_g[row][:, upu]])
        effects = (of_f, of_g, self.poses.effect(row))
        every = np.concatenate(effects)
        return Freedom(stresses, *effects, partial(self._elastic, row), partial(self._fixed, row, every, box))

    def _elastic(self, row: int, tensions: FloatArray) -> FloatArray:
        """Effect of self-stresses of tensions, with the displacement of limbs and shoulder that they cause."""
        n, poses = self.poses.mechanism.limb_count, self.poses
        delta = -poses.flexibility(np.array([row]))[0] @ tensions[2 * n :]
        g = poses.stiffness[row][:, None] * (poses.sides[row].T @ delta)
        own = poses.tensions
        return np.concatenate([tensions[:n] + own.f_of_g[row] @ g, g, tensions[2 * n :] + own.shoulder_of_g[row] @ g])

    def _fixed(
        self, row: int, every: FloatArray, box: tuple[FloatArray, FloatArray], rest: FloatArray
    ) -> NDArray[np.bool_]:
        """Which components are the same along all directions of ``rest`` within the bounds."""
        effect = every @ rest
        fixed = is_determined(effect)
        if rest.shape[1] == 0:
            return fixed
        size = np.abs(self.values[row]).max()
        for component in np.flatnonzero(~fixed):
            low, high = (_end(effect[component], rest, box[0], box[1], sign) for sign in (1.0, -1.0))
            fixed[component] = high - low <= _POINT * size
        return fixed

    def _needed(self) -> tuple[str, ...]:
        """What would have to be known to determine the other components."""
        if self.poses.mechanism.drive_units:
            return self._needed_of_device()
        upu, n = np.flatnonzero(self.poses.mechanism.is_upu), self.poses.mechanism.limb_count
        needed: list[str] = []
        if n > 3:
            needed.append(f"{n - 3} of the {n} limb tensions, measured, or a law by which the actuators share them")
        if upu.size == 0 or self.split.determines_sides:
            return tuple(needed)
        missing = []
        if self.poses.mechanism.shoulder.stiffness is None:
            missing.append("the stiffness of the shoulder")
        bare = [str(i + 1) for i in upu if self.poses.mechanism.limbs[i].guide is None]
        if bare:
            missing.append(
                f"what resists sideways in limb{'s' * (len(bare) > 1)} {', '.join(bare)} "
                "(EI and GJ of a guide, or that there is none)"
            )
        if missing:
            needed.append(" and ".join(missing))
        else:
            needed.append('nothing more than is known: split="elastic" determines them')
        readings = "side force" if upu.size == 1 else f"{upu.size} side forces"
        needed.append(f"or the {readings} g, measured as couples in the platform joints")
        return tuple(needed)

    def _needed_of_device(self) -> tuple[str, ...]:
        """The same for a device that is not a wrist."""
        device: Any = self.poses.mechanism
        needed, extra, efforts = [], self.poses.tensions.self_stress.shape[2], len(device.efforts)
        if extra > 0:
            needed.append(f"{extra} of the {efforts} efforts of the drives, measured, or a law by which they share")
        if device.structure.open_directions and not self.split.determines_sides:
            soft = device.soft_links or not device.interfaces.are_rigid or device.shoulder.stiffness is not None
            soft = soft or any(limb.resists for limb in device.guided_slides)
            known = 'nothing more than is known: split="elastic" determines them'
            needed.append(known if soft else "what gives way: stiffness of the cuff, the harness or links")
            needed.append("or the force and couple at the cuff, measured")
        return tuple(needed)


def _ranges(freedom: Freedom, box: tuple[FloatArray, FloatArray], cut: tuple[FloatArray, ...] | None) -> FloatArray:
    """Change of each component that the bounds allow, shape (2 n + 3, 2)."""
    effect = freedom.all
    effect = np.where(np.abs(effect) <= _NO_EFFECT, 0.0, effect)
    if cut is None:
        with np.errstate(invalid="ignore"):
            ends = np.stack([effect * box[0], effect * box[1]])
        ends = np.where(effect == 0.0, 0.0, ends)
        return np.stack([ends.min(axis=0).sum(axis=1), ends.max(axis=0).sum(axis=1)], axis=1)
    eye = np.eye(effect.shape[1])
    rows, lower, upper = np.concatenate([eye, freedom.of_f]), *(np.concatenate(p) for p in zip(box, cut, strict=True))
    return np.array([[_end(row, rows, lower, upper, sign) for sign in (1.0, -1.0)] for row in effect])


def _end(effect: FloatArray, rows: FloatArray, lower: FloatArray, upper: FloatArray, sign: float) -> float:
    """Least (sign 1) or largest (sign -1) effect · y with lower <= rows y <= upper; NaN if nothing fits."""
    count = rows.shape[1]
    if count <= 1:
        return _end_of_one(effect, rows, lower, upper, sign)
    above, below = np.isfinite(upper), np.isfinite(lower)
    A = np.concatenate([rows[above], -rows[below]])
    b = np.concatenate([upper[above], -lower[below]])

    def solved(target: FloatArray, unit: float = 1.0) -> scipy.optimize.OptimizeResult:
        return scipy.optimize.linprog(target, A_ub=A, b_ub=b / unit, bounds=[(None, None)] * count, method="highs")

    answer, unit = solved(sign * effect), 1.0
    if answer.status == 4:  # HiGHS does not take bounds of 1e9 N
        unit = float(np.abs(b).max(initial=1.0))
        answer = solved(sign * effect, unit)
    if answer.status == 4:  # HiGHS may not decide whether a program is unbounded or infeasible
        answer.status = 2 if solved(np.zeros(count)).status == 2 else 3
    if answer.status in (2, 3):
        return np.nan if answer.status == 2 else -sign * np.inf
    if answer.status != 0:
        raise SolverFailed("HiGHS", np.inf, str(answer.message))
    return sign * unit * float(answer.fun)


def _end_of_one(effect: FloatArray, rows: FloatArray, lower: FloatArray, upper: FloatArray, sign: float) -> float:
    """The same for one variable or none, without a program."""
    along = rows.sum(axis=1)
    moves = np.abs(along) > _NO_EFFECT
    fits = ((lower <= _POINT) & (upper >= -_POINT))[~moves].all()
    ends = np.sort([lower[moves] / along[moves], upper[moves] / along[moves]], axis=0)
    low, high = ends[0].max(initial=-np.inf), ends[1].min(initial=np.inf)
    if not fits or low > high + _POINT:
        return np.nan
    slope = float(effect.sum())
    return slope * float(low if sign * slope > 0.0 else high) if slope != 0.0 else 0.0
