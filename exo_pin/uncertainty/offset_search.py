"""Search over the centre offsets of a pose for a singular configuration and for the largest shoulder force."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
import scipy
from numpy.typing import NDArray

from ..core.records import Record
from ..core.validation import FloatArray, frozen
from ..design import Mechanism
from ..wrist.forces.displaced import Displaced
from ..wrist.limbs import STATUS
from .worst_case import Loaded

__all__ = ["OffsetSearch"]

#: 2^m points of a Sobol sequence within the ball, and as many on its surface.
_SOBOL_POWER = 7
#: Step of the central differences that guide the search, in radii.
_STEP = 1e-5
#: Number of best points that the search starts from.
_STARTS = 3


@functools.cache
def _points() -> FloatArray:
    """The centre, points within the unit ball and on its surface, shape (k, 3)."""
    u = scipy.stats.qmc.Sobol(3, scramble=False).random_base2(_SOBOL_POWER)
    height, turn = 2.0 * u[:, 1] - 1.0, 2.0 * np.pi * u[:, 2]
    ring = np.sqrt(np.maximum(1.0 - height**2, 0.0))
    sphere = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=-1)
    return frozen(np.concatenate([np.zeros((1, 3)), np.cbrt(u[:, :1]) * sphere, sphere]))


class OffsetSearch(Record):
    """The offsets of one pose in radii: x of base and cuff together, |x| <= 1."""

    def __init__(
        self,
        mechanism: Mechanism,
        given: Loaded,
        row: int,
        middle: FloatArray,
        size: float,
        stiffness: FloatArray | None,
    ) -> None:
        self.mechanism, self.given, self.row = mechanism, given, row
        self.middle, self.size, self.stiffness = middle, size, stiffness
        self.signed = mechanism.limb_count == 3
        self.x = _points()
        self.force, self.sign, self.codes = self._evaluate(self.x)
        self.code = self.codes[0]
        self.nominal = float(np.linalg.norm(self.force[0]))
        # Relative to that of the centre, as a scale for the search.
        self.unit = self.sign[0] if self.sign[0] != 0.0 else 1.0

    def _evaluate(self, x: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.int8]]:
        """F_s, the determinant of the equilibrium equations, and status codes, at a stack of points."""
        offset = self.middle + self.size * x
        state = self.given.one(self.row, len(x)).displaced(self.mechanism, offset, offset)
        force = state.tensions.shoulder
        sign: FloatArray = np.full(len(x), np.nan)
        if self.signed:
            sign = np.asarray(np.linalg.det(state.side.moment_arms))
        if self.stiffness is not None:
            g, _ = state.elastic_side_forces(self.stiffness)
            force = force + np.einsum("kij,kj->ki", state.tensions.shoulder_of_g, g)
            sign = sign * self._stability(state)
        force = np.where((state.status < STATUS.index("singular"))[:, None], force, np.nan)
        return force, sign, state.status

    def _stability(self, state: Displaced) -> FloatArray:
        """det(K_s + K_X) relative to its scale.

        With an offset, side forces help the tensions to hold the arm. With stiff limbs the forces then grow without
        bound where the whole system is singular, not where the tensions alone are: there the product of the two
        determinants, which is the determinant of the whole system, changes its sign.
        """
        whole, _ = state.elastic_system(np.asarray(self.stiffness))
        scale = np.trace(np.asarray(self.stiffness)) + state.side.stiffness.sum(axis=1)
        return np.asarray(np.linalg.det(whole / np.where(scale > 0.0, scale, 1.0)[:, None, None]))

    def singular(self) -> FloatArray | None:
        """The point nearest to the centre, of those found, at which the forces grow without bound."""
        if self.code == STATUS.index("singular"):
            return np.zeros(3)
        if not self.signed:
            return None
        relative = self.sign / self.unit
        beyond = self.x[relative <= 0.0]
        if not len(beyond):
            lowest = np.argsort(relative)[:_STARTS]
            beyond = np.array([x for x in (self._descend(self.x[k]) for k in lowest) if x is not None])
        crossings = []
        for x in sorted(beyond, key=np.linalg.norm)[:_STARTS]:
            t = scipy.optimize.brentq(lambda t, x=x: self._relative(t * x), 0.0, 1.0, xtol=1e-15)
            nearest = self._nearest(t * x)
            crossings += [p for p in (nearest, t * x) if self._diverges(p)]
        return min(crossings, key=lambda p: float(np.linalg.norm(p))) if crossings else None

    def _descend(self, start: FloatArray) -> FloatArray | None:
        """A point of the ball beyond the singular surface, by lowering the determinant."""
        answer = scipy.optimize.minimize(
            self._slope_of_sign,
            start,
            jac=True,
            method="SLSQP",
            constraints=_INSIDE,
            options={"maxiter": 40, "ftol": 1e-9},
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
        return float(self._evaluate(x[None])[1][0] / self.unit)

    def _slope_of_sign(self, x: FloatArray) -> tuple[float, FloatArray]:
        return self._slope(x, lambda f, sign: sign / self.unit)

    def _diverges(self, point: FloatArray) -> bool:
        """Whether |F_s| grows towards a point: without a moment in the lost direction it does not."""
        inward = point / max(float(np.linalg.norm(point)), 1e-12)
        steps = np.array([1e-3, 1e-4, 1e-5])[:, None]
        for side in (-1.0, 1.0):
            sizes = np.linalg.norm(self._evaluate(point + side * steps * inward)[0], axis=1)
            if sizes[2] > 3.0 * sizes[1] > 9.0 * sizes[0]:
                return True
        return False

    def largest(self) -> tuple[FloatArray, FloatArray, int]:
        """Where |F_s| is largest, F_s there, and the status code."""
        sizes = np.linalg.norm(self.force, axis=1)
        sizes[np.isnan(sizes)] = -1.0
        best = int(sizes.argmax())
        if sizes[best] < 0.0:
            return self.x[0], self.force[0], int(self.code)
        champion = self.x[best]
        if sizes[best] == 0.0:
            return champion, self.force[best], int(self.codes[best])
        for start in np.argsort(sizes)[-_STARTS:]:
            answer = scipy.optimize.minimize(
                lambda x: self._slope(x, lambda f, sign: -np.log(np.linalg.norm(f, axis=1) + 1e-300)),
                self.x[start],
                jac=True,
                method="SLSQP",
                constraints=_INSIDE,
                options={"maxiter": 60, "ftol": 1e-12},
            )
            x = _into_ball(np.asarray(answer.x))
            force, _, codes = self._evaluate(x[None])
            if codes[0] == STATUS.index("singular"):
                return x, np.full(3, np.nan), int(codes[0])
            if np.linalg.norm(force[0]) > sizes[best]:
                sizes[best], champion = np.linalg.norm(force[0]), x
        force, _, codes = self._evaluate(champion[None])
        return champion, force[0], int(codes[0])

    def _slope(self, x: FloatArray, of: Callable[[FloatArray, FloatArray], FloatArray]) -> tuple[float, FloatArray]:
        """A function of F_s and determinant, and its gradient by central differences in one stack."""
        n, steps = len(x), _STEP * np.eye(len(x))
        force, sign, _ = self._evaluate(x + np.concatenate([np.zeros((1, n)), steps, -steps]))
        values = np.nan_to_num(of(force, sign))
        return float(values[0]), (values[1 : n + 1] - values[n + 1 :]) / (2.0 * _STEP)


def _room(x: FloatArray) -> float:
    return float(1.0 - x @ x)


def _slope_of_room(x: FloatArray) -> FloatArray:
    return -2.0 * x


def _into_ball(x: FloatArray) -> FloatArray:
    return np.asarray(x / max(1.0, float(np.linalg.norm(x))))


#: SLSQP's constraint that x stays in the unit ball.
_INSIDE = {"type": "ineq", "fun": _room, "jac": _slope_of_room}
