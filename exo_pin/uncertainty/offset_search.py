"""The least and the largest shoulder force over a ball of centre offsets, and whether the device loses its hold there.

The device's centre is known to a centimetre or two at best. Within that ball the displaced geometry may be singular:
tensions and shoulder force then grow without bound, and samples may miss such a surface. Across it the determinant of
the limbs' lever arms changes its sign, so that a change of sign is searched first. Only in a ball without one the
forces themselves are searched: among the offsets that were tried, and again and again where an interpolation of F_s
through all of these is least and largest. Devices without such a determinant are asked along 26 directions at first.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import scipy

from ..core.records import Record
from ..core.validation import FloatArray, frozen
from ..reaction import Reaction

#: Step of the central differences that guide the search, in radii.
_STEP = 1e-5
#: Where an answer is quick, the directions are asked within the ball, too: at these parts of its radius.
_WITHIN = (0.75, 0.5, 0.25)
#: Number of best points that a search starts from.
_STARTS = 3
#: Most rounds of a search by interpolation, and distance from an offset that was tried, in radii, that is none.
_ROUNDS, _SAME = 12, 1e-4
#: About the unit ball.
_CUBE = [(-1.0, 1.0)] * 3
#: Directions along the axes of the base frame and between them, unit vectors, shape (26, 3).
DIRECTIONS = frozen(
    np.array([np.array(d) / np.linalg.norm(d) for d in itertools.product((1.0, 0.0, -1.0), repeat=3) if any(d)])
)


@dataclass(frozen=True, eq=False)
class WorstOffset(Record):
    """The worst of all offsets of a device's centre within a ball.

    Attributes
    ----------
    radius : float
        Of the ball, m.
    offset : ndarray
        Shape (3,), m, base and cuff together, from what the question had: where |F_s| is largest; where it is infinite
        the nearest found without an answer.
    magnitude : float
        |F_s| there, N; infinite where the ball has a singular configuration, near which forces grow without bound, or
        an offset without an equilibrium. Best of a search.
    shoulder_force : ndarray
        F_s there, shape (3,), N; NaN where infinite.
    holds : bool
        Whether the device holds the pose, as far as its limits are known, at every offset that was tried.
    directions, magnitudes : ndarray
        Shapes (26, 3) and (26,): unit vectors along the axes of the base frame and between them, and |F_s| with the
        centre off by the radius that way, N; NaN where the pose has no answer.
    """

    radius: float
    offset: FloatArray
    magnitude: float
    shoulder_force: FloatArray
    holds: bool
    directions: FloatArray
    magnitudes: FloatArray


def worst_offset(answers: Callable[[FloatArray], Reaction], radius: float) -> tuple[WorstOffset, float]:
    """The worst offset within a ball whose centre has an answer, and the least |F_s| that was found in it, N.

    Parameters
    ----------
    answers : callable
        Takes offsets, shape (k, 3), m, and returns the reaction in the pose with each, shape (k,).
    radius : float
        m.
    """
    search = _Search(answers, radius)
    return search.worst(), float(np.nanmin(np.linalg.norm(search.force, axis=1)))


class _Search:
    """Offsets of one pose in radii, |x| <= 1."""

    def __init__(self, answers: Callable[[FloatArray], Reaction], radius: float) -> None:
        self.answers, self.radius = answers, radius
        self.x, self.force, self.sign = np.empty((0, 3)), np.empty((0, 3)), np.empty(0)
        self.answered, self.holds = np.empty(0, dtype=bool), True
        self._try(np.concatenate([np.zeros((1, 3)), DIRECTIONS]))
        # Relative to that of the centre, which has an answer, as a scale for the search.
        self.unit = self.sign[0]
        if not np.isnan(self.unit):
            self._try(np.concatenate([part * DIRECTIONS for part in _WITHIN]))

    def _try(self, x: FloatArray) -> None:
        """Ask at offsets, shape (k, 3), and keep the answers."""
        found = self._at(x)
        self.x, self.force = np.concatenate([self.x, x]), np.concatenate([self.force, found.shoulder_force])
        self.sign, self.answered = np.append(self.sign, found.determinant), np.append(self.answered, found.has_answer)
        self.holds = self.holds and bool(found.held.all())

    def worst(self) -> WorstOffset:
        """The worst offset."""
        if (lost := self._without_answer()) is None:
            self._search_extremes()
            lost = self._without_answer()
        if lost is not None:
            return self._found(lost, np.full(3, np.nan), False)
        largest = int(np.linalg.norm(self.force, axis=1).argmax())
        return self._found(self.x[largest], self.force[largest], self.holds)

    def _found(self, x: FloatArray, force: FloatArray, holds: bool) -> WorstOffset:
        size = float(np.linalg.norm(force))
        there = np.linalg.norm(self.force[1 : 1 + len(DIRECTIONS)], axis=1)
        return WorstOffset(
            self.radius, self.radius * x, np.inf if np.isnan(size) else size, force, holds, DIRECTIONS, there
        )

    def _without_answer(self) -> FloatArray | None:
        """The point nearest to the centre, of those found, at which there is no equilibrium; None if there is none."""
        found = [*self.x[~self.answered]]
        if not np.isnan(self.unit):
            found += self._singular()
        return min(found, key=lambda p: float(np.linalg.norm(p))) if found else None

    def _singular(self) -> list[FloatArray]:
        """Points at which the determinant is zero and the forces grow without bound."""
        relative = self.sign / self.unit
        beyond = [*self.x[relative <= 0.0]]
        if not beyond:
            lowest = np.argsort(relative)[:_STARTS]
            beyond = [x for x in (self._descend(self.x[k]) for k in lowest) if x is not None]
        crossings = []
        for x in sorted(beyond, key=np.linalg.norm)[:_STARTS]:
            t = scipy.optimize.brentq(lambda t, x=x: self._relative(t * x), 0.0, 1.0, xtol=1e-15)
            nearest = self._nearest(t * x)
            crossings += [p for p in (nearest, t * x) if self._diverges(p)]
        return crossings

    def _descend(self, start: FloatArray) -> FloatArray | None:
        """A point of the ball beyond the singular surface, by lowering the determinant."""
        x = _into_ball(_descent(self._slope_of_sign, start).x)
        return x if self._relative(x) <= 0.0 else None

    def _nearest(self, start: FloatArray) -> FloatArray:
        """The singular point nearest to the centre, searched from another one."""
        on_surface = {
            "type": "eq",
            "fun": lambda x: self._slope_of_sign(x)[0],
            "jac": lambda x: self._slope_of_sign(x)[1],
        }
        x = scipy.optimize.minimize(
            lambda x: x @ x, start, bounds=_CUBE, constraints=on_surface, options={"ftol": 1e-12}
        ).x
        near = abs(self._relative(x)) < 1e-8 and x @ x <= start @ start
        return x if near else start

    def _relative(self, x: FloatArray) -> float:
        """The determinant at one point, relative to that of the centre."""
        return float(np.nan_to_num(self._at(x[None]).determinant[0]) / self.unit)

    def _at(self, x: FloatArray) -> Reaction:
        return self.answers(self.radius * x)

    def _slope_of_sign(self, x: FloatArray) -> tuple[float, FloatArray]:
        return _slope(lambda points: self._at(points).determinant / self.unit, x)

    def _diverges(self, point: FloatArray) -> bool:
        """Whether |F_s| grows towards a point: without a moment in the lost direction it does not."""
        outward = point / np.linalg.norm(point)
        far, near = (self._at(np.array([point - step * outward, point + step * outward])) for step in (1e-3, 1e-5))
        return bool((near.magnitude > 10.0 * far.magnitude).any())

    def _search_extremes(self) -> None:
        """Try offsets where |F_s| is least and largest, until these are where it was tried."""
        for _ in range(_ROUNDS):
            fit = scipy.interpolate.RBFInterpolator(self.x, self.force, kernel="cubic", degree=2)
            places = [self._extreme(fit, sign) for sign in (1.0, -1.0)]
            new = [x for x in places if np.linalg.norm(self.x - x, axis=1).min() > _SAME]
            if not new:
                return
            self._try(np.array(new))
            if not self.answered.all():
                return

    def _extreme(self, fit: Callable[[FloatArray], FloatArray], sign: float) -> FloatArray:
        """Where |F_s| of an interpolation is least (``sign`` 1) or largest (-1)."""
        slope = partial(_slope, lambda points: sign * np.linalg.norm(fit(points), axis=1))
        tried = self.x[np.argsort(sign * np.linalg.norm(self.force, axis=1))[:_STARTS]]
        found = [_into_ball(_descent(slope, start).x) for start in tried]
        return min(found, key=lambda x: slope(x)[0])


def _slope(values: Callable[[FloatArray], FloatArray], x: FloatArray) -> tuple[float, FloatArray]:
    """A function of offsets, shape (k, 3), at one of them, and its gradient by central differences in one call."""
    steps = _STEP * np.eye(3)
    found = np.nan_to_num(values(np.concatenate([x[None], x + steps, x - steps])))
    return float(found[0]), (found[1:4] - found[4:]) / (2.0 * _STEP)


def _into_ball(x: FloatArray) -> FloatArray:
    return np.asarray(x / max(1.0, float(np.linalg.norm(x))))


def _descent(slope: Callable[[FloatArray], tuple[float, FloatArray]], start: FloatArray) -> Any:
    """The least of a function with its gradient in the unit ball, by SLSQP, whose steps stay near the ball."""
    inside = {"type": "ineq", "fun": lambda x: 1.0 - x @ x}
    return scipy.optimize.minimize(slope, start, jac=True, bounds=_CUBE, constraints=inside, options={"ftol": 1e-9})
