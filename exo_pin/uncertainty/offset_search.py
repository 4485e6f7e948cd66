"""The largest shoulder force over a ball of centre offsets, and whether the device loses its hold there.

The device's centre is known to a centimetre or two at best. Within that ball the displaced geometry may be singular:
tensions and shoulder force then grow without bound, and samples may miss such a surface. Across it the determinant of
the limbs' lever arms changes its sign, so that a change of sign is searched first. Only in a ball without one the
largest force is searched. A device that is not a wrist has no such determinant, and its answers take longer: it is
asked along 26 directions, and where a quadratic fit of F_s through these answers is largest.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from ..core.conventions import MIRROR
from ..core.records import Record
from ..core.validation import FloatArray, frozen
from ..reaction import Reaction

#: 2^m points within the ball, and as many on its surface: half of them a Sobol sequence, half its mirror image.
_SOBOL_POWER = 7
#: Step of the central differences that guide the search, in radii.
_STEP = 1e-5
#: Largest offset that a search may try, in radii.
_FARTHEST = 2.0
#: Number of best points that the search starts from.
_STARTS = 3
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


@functools.cache
def _points(thorough: bool) -> FloatArray:
    """The centre, the 26 directions, and for a thorough search points within the unit ball and on it, shape (k, 3)."""
    centre = np.zeros((1, 3))
    if not thorough:
        return frozen(np.concatenate([centre, DIRECTIONS]))
    u = scipy.stats.qmc.Sobol(3, scramble=False).random_base2(_SOBOL_POWER - 1)
    height, turn = 2.0 * u[:, 1] - 1.0, 2.0 * np.pi * u[:, 2]
    ring = np.sqrt(np.maximum(1.0 - height**2, 0.0))
    sphere = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=-1)
    spread = np.concatenate([np.cbrt(u[:, :1]) * sphere, sphere])
    # As many on the left as on the right, so that a device and its mirror image have the same answer.
    return frozen(np.concatenate([centre, DIRECTIONS, spread, spread @ MIRROR]))


def worst_offset(
    answers: Callable[[FloatArray], Reaction], radius: float, thorough: bool = True
) -> tuple[WorstOffset, float]:
    """The worst offset within a ball, and the least |F_s| of the offsets that were tried, N.

    Parameters
    ----------
    answers : callable
        Takes offsets, shape (k, 3), m, and returns the reaction in the pose with each, shape (k,).
    radius : float
        m.
    thorough : bool
        Whether answers are so fast that hundreds may be asked, and have a determinant.
    """
    search = _Search(answers, radius, thorough)
    return search.worst(), float(np.fmin.reduce(np.linalg.norm(search.force, axis=-1), initial=np.inf))


class _Search:
    """Offsets of one pose in radii, |x| <= 1."""

    def __init__(self, answers: Callable[[FloatArray], Reaction], radius: float, thorough: bool) -> None:
        self.answers, self.radius = answers, radius
        self.x, self.thorough = _points(thorough), thorough
        first = answers(radius * self.x)
        self.force, self.sign = first.shoulder_force, first.determinant
        self.answered, self.holds = first.has_answer, bool(first.held.all())
        # Relative to that of the centre, as a scale for the search.
        self.unit = self.sign[0] if self.sign[0] else 1.0

    def worst(self) -> WorstOffset:
        """The worst offset."""
        lost = self._without_answer()
        if lost is not None:
            return self._found(lost, np.full(3, np.nan), False)
        x, force = self._largest() if self.thorough else self._largest_of_fit()
        return self._found(x, force, self.holds)

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
        options = {"maxiter": 40, "ftol": 1e-9}
        answer = scipy.optimize.minimize(
            self._slope_of_sign, start, jac=True, method="SLSQP", constraints=_INSIDE, options=options
        )
        x = _into_ball(answer.x)
        return x if self._relative(x) <= 0.0 else None

    def _nearest(self, start: FloatArray) -> FloatArray:
        """The singular point nearest to the centre, searched from another one."""
        on_surface = {
            "type": "eq",
            "fun": lambda x: self._slope_of_sign(x)[0],
            "jac": lambda x: self._slope_of_sign(x)[1],
        }
        answer = scipy.optimize.minimize(
            lambda x: (x @ x, 2.0 * x), start, jac=True, method="SLSQP", constraints=[on_surface],
            options={"maxiter": 40, "ftol": 1e-12},
        )  # fmt: skip
        x = np.asarray(answer.x)
        near = abs(self._relative(x)) < 1e-8 and x @ x <= start @ start
        return x if near and np.linalg.norm(x) <= 1.0 else start

    def _relative(self, x: FloatArray) -> float:
        """The determinant at one point, relative to that of the centre."""
        return float(np.nan_to_num(self._at(x[None]).determinant[0]) / self.unit)

    def _at(self, x: FloatArray) -> Reaction:
        # A search may step far out of the ball, where no offset is meant.
        far = np.maximum(np.linalg.norm(x, axis=1, keepdims=True) / _FARTHEST, 1.0)
        return self.answers(self.radius * x / far)

    def _slope_of_sign(self, x: FloatArray) -> tuple[float, FloatArray]:
        return self._slope(x, lambda answer: answer.determinant / self.unit)

    def _diverges(self, point: FloatArray) -> bool:
        """Whether |F_s| grows towards a point: without a moment in the lost direction it does not."""
        inward = point / max(float(np.linalg.norm(point)), 1e-12)
        steps = np.array([1e-3, 1e-4, 1e-5])[:, None]
        for side in (-1.0, 1.0):
            sizes = self._at(point + side * steps * inward).magnitude
            if sizes[2] > 3.0 * sizes[1] > 9.0 * sizes[0]:
                return True
        return False

    def _largest(self) -> tuple[FloatArray, FloatArray]:
        """Where |F_s| is largest, and F_s there."""
        sizes = np.linalg.norm(self.force, axis=1)
        best = int(sizes.argmax())
        champion, force = self.x[best], self.force[best]
        for start in np.argsort(sizes)[-_STARTS:] if sizes[best] > 0.0 else ():
            answer = scipy.optimize.minimize(
                lambda x: self._slope(x, _minus_log),
                self.x[start],
                jac=True,
                method="SLSQP",
                constraints=_INSIDE,
                options={"maxiter": 60, "ftol": 1e-12},
            )
            x = _into_ball(np.asarray(answer.x))
            found = self._at(x[None])
            self.holds = self.holds and bool(found.held[0])
            if found.magnitude[0] > np.linalg.norm(force):
                champion, force = x, found.shoulder_force[0]
        return champion, force

    def _largest_of_fit(self) -> tuple[FloatArray, FloatArray]:
        """Where |F_s| of a quadratic fit is largest, and F_s there; or the offset that was tried with the largest."""
        parts = np.linalg.lstsq(_quadratic(self.x), self.force, rcond=None)[0]
        sizes = np.linalg.norm(_quadratic(_points(True)) @ parts, axis=1)
        answer = scipy.optimize.minimize(
            lambda x: -np.linalg.norm(_quadratic(x[None]) @ parts),
            _points(True)[sizes.argmax()],
            method="SLSQP",
            constraints=_INSIDE,
        )
        x = _into_ball(np.asarray(answer.x))
        found = self._at(x[None])
        self.holds = self.holds and bool(found.held[0])
        tried = [*zip(self.x, self.force, strict=True), (x, found.shoulder_force[0])]
        return max(tried, key=lambda each: float(np.nan_to_num(np.linalg.norm(each[1]))))

    def _slope(self, x: FloatArray, of: Callable[[Reaction], FloatArray]) -> tuple[float, FloatArray]:
        """A function of the answer, and its gradient by central differences in one stack."""
        n, steps = len(x), _STEP * np.eye(len(x))
        values = np.nan_to_num(of(self._at(x + np.concatenate([np.zeros((1, n)), steps, -steps]))))
        return float(values[0]), (values[1 : n + 1] - values[n + 1 :]) / (2.0 * _STEP)


def _quadratic(x: FloatArray) -> FloatArray:
    """Constant, linear and quadratic terms of points, shape (k, 3), in columns, shape (k, 10)."""
    pairs = [x[:, i] * x[:, j] for i in range(3) for j in range(i + 1)]
    return np.column_stack([np.ones(len(x)), x, *pairs])


def _minus_log(answer: Reaction) -> FloatArray:
    return np.asarray(-np.log(answer.magnitude + 1e-300))


def _room(x: FloatArray) -> float:
    return float(1.0 - x @ x)


def _slope_of_room(x: FloatArray) -> FloatArray:
    return -2.0 * x


def _into_ball(x: FloatArray) -> FloatArray:
    return np.asarray(x / max(1.0, float(np.linalg.norm(x))))


#: SLSQP's constraint that x stays in the unit ball.
_INSIDE = {"type": "ineq", "fun": _room, "jac": _slope_of_room}
