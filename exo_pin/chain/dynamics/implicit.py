"""Steps of stiff differential equations: collocation at Radau's points (Hairer and Wanner, Solving ODEs II, IV.8).

A fast mode that damping has ended bounds the steps of an explicit method by its own time, thousands a second where the
motion needs tens. Radau IIA is stable however fast it is; seven points make few, long steps at tight tolerances.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.polynomial import legendre

from ...core.records import OneProcess
from ...core.validation import FloatArray

#: Points of a step.
_POINTS = 5
#: Most iterations of Newton's method, the change at which they end, as a share of the tolerance, and the number of them
#: above which the derivative of the right side is computed anew in the next step.
_ITERATIONS, _CONVERGED, _SLOW = 10, 5e-2, 3
#: Changes of the step size: least, largest, and the share of the one that the error asks for.
_LEAST, _LARGEST, _CAUTION = 0.2, 8.0, 0.9
#: DOP853 is stable up to steps of about six in units of the fastest decay. So many steps above this size, with fewer
#: than so many others in turn between them, say that stability and not accuracy bounds them (Hairer's own test).
_STABLE, _STIFF, _OTHERS = 4.5, 15, 6


class _Method(NamedTuple):
    """Radau's method.

    Its points in [0, 1]; the weights of the stages, their eigenvalues, eigenvectors, and the inverse of these; the
    derivative at 0 from those at the points; Legendre's coefficients from values at 0 and the points.
    """

    points: FloatArray
    stages: FloatArray
    own: FloatArray
    ways: FloatArray
    back: FloatArray
    first: FloatArray
    inside: FloatArray


@cache
def _method() -> _Method:
    points = np.append(0.5 * (scipy.special.roots_jacobi(_POINTS - 1, 1.0, 0.0)[0] + 1.0), 1.0)
    places = 2.0 * points - 1.0
    back = np.linalg.inv(legendre.legvander(places, _POINTS - 1))
    integrals = [0.5 * legendre.legval(places, legendre.legint(unit, lbnd=-1.0)) for unit in np.eye(_POINTS)]
    stages = np.transpose(integrals) @ back
    own, ways = np.linalg.eig(stages)
    first = legendre.legvander(np.array([-1.0]), _POINTS - 1)[0] @ back
    inside = np.linalg.inv(legendre.legvander(np.append(-1.0, places), _POINTS))
    return _Method(points, stages, own, ways, np.linalg.inv(ways), first, inside)


class _Inside(scipy.integrate.DenseOutput):
    """The polynomial of a step."""

    def __init__(self, start: float, end: float, coefficients: FloatArray) -> None:
        super().__init__(start, end)
        self._coefficients = coefficients

    def _call_impl(self, t: FloatArray) -> FloatArray:
        return np.asarray(legendre.legval(2.0 * (t - self.t_old) / (self.t - self.t_old) - 1.0, self._coefficients))


class _Collocation(scipy.integrate.OdeSolver):
    """SciPy's interface, with which it goes step by step in place of DOP853.

    ``jac(t, y, rate)`` returns the derivative of the right side by y, shape (n, n). From the solver of the step
    ``before`` come its derivative, which serves as long as Newton's method is fast with it, and a first guess.
    """

    def __init__(
        self,
        fun: Callable[[float, FloatArray], FloatArray],
        t0: float,
        y0: FloatArray,
        t_bound: float,
        first_step: float | None = None,
        *,
        rtol: float,
        atol: float,
        jac: Callable[[float, FloatArray, FloatArray], FloatArray],
        before: _Collocation | None = None,
    ) -> None:
        super().__init__(fun, t0, y0, t_bound, vectorized=False)
        self.t: float = t0
        self.y: FloatArray = y0
        self._tolerances, self._jac, self._rate = (rtol, atol), jac, self.fun(t0, y0)
        self._J: FloatArray | None = None
        self._polynomial: _Inside | None = None
        if before is not None and before.n == self.n:
            self._J, self._polynomial = before._J, before.dense_output()
        # A hundredth of the time in which the state would change by itself.
        self.h_abs = first_step or 0.01 * self._size(np.ones_like(y0), y0) / max(self._size(self._rate, y0), 1e-300)

    def _size(self, error: FloatArray, y: FloatArray) -> float:
        rtol, atol = self._tolerances
        return float(np.sqrt(np.mean((error / (atol + rtol * np.abs(y))) ** 2)))

    def _step_impl(self) -> tuple[bool, str | None]:
        t, y, method, h = self.t, self.y, _method(), float(self.h_abs)
        real = float(method.own[np.abs(method.own.imag).argmin()].real)
        fresh = self._J is None
        J = self._jac(t, y, self._rate) if self._J is None else self._J
        while h > 10.0 * np.spacing(abs(t)):
            h = min(h, self.t_bound - t)
            moved, rates, iterations = self._solved(h, J)
            if moved is None:
                h, J, fresh = (0.5 * h if fresh else h), (J if fresh else self._jac(t, y, self._rate)), True
                continue
            # The derivative at the start is another than that of the polynomial; fast modes are filtered out of it.
            miss = real * h * (self._rate - method.first @ rates)
            size = np.maximum(np.abs(y), np.abs(y + moved[-1]))
            error = self._size(np.linalg.solve(np.eye(len(y)) - h * real * J, miss), size)
            factor = float(np.clip(_CAUTION * max(error, 1e-12) ** (-1.0 / (_POINTS + 1)), _LEAST, _LARGEST))
            if error <= 1.0:
                self.h_abs, self._J, self._rate = h * factor, J if iterations <= _SLOW else None, rates[-1]
                self._polynomial = _Inside(t, t + h, method.inside @ np.vstack([y, y + moved]))
                self.t, self.y = t + h if h < self.t_bound - t else self.t_bound, y + moved[-1]
                return True, None
            h *= factor
        return False, self.TOO_SMALL_STEP

    def _solved(self, h: float, J: FloatArray) -> tuple[FloatArray | None, FloatArray, int]:
        """Changes of the state up to the points, rates there, and iterations; None if Newton's method is too slow."""
        y, method = self.y, _method()
        inverses = np.linalg.inv(np.eye(len(y)) - h * method.own[:, None, None] * J)
        times, last = self.t + h * method.points, np.inf
        moved = np.zeros((_POINTS, len(y)))
        if self._polynomial is not None:
            moved = (self._polynomial(times) - self._polynomial(self.t)[:, None]).T
        for k in range(_ITERATIONS):
            rates = np.array([self.fun(t, y + z) for t, z in zip(times.tolist(), moved, strict=True)])
            missed = method.back @ (h * method.stages @ rates - moved)
            step = (method.ways @ (inverses @ missed[:, :, None])[:, :, 0]).real
            moved = moved + step
            size = self._size(step, y)
            if size <= _CONVERGED * max(1.0 - size / last, 0.01):
                return moved, rates, k + 1
            if not np.isfinite(size) or (k and size > 0.9 * last):
                break
            last = size
        return None, rates, _ITERATIONS

    def _dense_output_impl(self) -> _Inside:
        assert self._polynomial is not None
        return self._polynomial


class Stiffness(OneProcess):
    """The method of every step: DOP853 until stability and not accuracy bounds its steps, collocation afterwards.

    ``derivative`` is the ``jac`` of :class:`_Collocation`; ``implicit`` begins with collocation.
    """

    def __init__(
        self, derivative: Callable[[float, FloatArray, FloatArray], FloatArray], implicit: bool = False
    ) -> None:
        self._derivative = derivative
        self._last: scipy.integrate.OdeSolver | None = None
        self._bound, self._others = _STIFF if implicit else 0, 0

    @property
    def implicit(self) -> bool:
        """Whether steps are those of collocation from now on."""
        return self._bound >= _STIFF

    def solver(self, *arguments: Any, **options: Any) -> scipy.integrate.OdeSolver:
        """For the next step; the last one's has taken its."""
        if isinstance(self._last, scipy.integrate.DOP853):
            self._see(self._last)
        if not self.implicit:
            self._last = scipy.integrate.DOP853(*arguments, **options)
        else:
            before = self._last if isinstance(self._last, _Collocation) else None
            self._last = _Collocation(*arguments, **options, jac=self._derivative, before=before)
        return self._last

    def _see(self, solver: scipy.integrate.DOP853) -> None:
        """Count a step: its last two stages are both at its end, a little apart."""
        h = solver.t - solver.t_old
        before = solver.y_old + h * (solver.A[-1, :-1] @ solver.K[: len(solver.A) - 1])
        rate = float(np.linalg.norm(solver.K[-1] - solver.K[-2]))
        if h * rate > _STABLE * float(np.linalg.norm(solver.y - before)):
            self._bound, self._others = self._bound + 1, 0
        else:
            self._others += 1
            self._bound = self._bound if self._others < _OTHERS else 0
