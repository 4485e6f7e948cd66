"""Nonlinear least squares for the unknowns, weighted for errors of lengths and orientations."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy

from ..core.errors import SolverFailed
from ..core.records import reduced_tuple
from ..core.validation import FloatArray
from .information import whitening
from .length_model import LengthModel

#: Weights have converged when the unknowns move by less than this part of the joints' distance from the centre, or the
#: lengths by less than this part of their errors.
_STILL, _UNNOTICED = 1e-7, 1e-4
_MOST_ROUNDS = 200
#: Relative change of the unknowns at which least squares ends: the last time, and before.
_FINE, _COARSE = 1e-12, 1e-6
#: Gradient at which least squares ends: none. Where it is zero SciPy would divide zero by zero.
_FLAT = float(np.finfo(float).eps)
#: Lengths without a stated noise are weighted with this one, m.
UNIT = 1e-3
#: Noise, m, below which no sensor measures: smaller residuals come from rounding.
FINEST = 1e-6
#: Tolerances, m, that lead to the solution nearest to the nominal design before they are dropped: what is not
#: determined then stays near its nominal value.
_NEAR = (0.02, 1.0)


class MeasurementErrors(NamedTuple):
    """Errors as stated: of lengths (m, None if unknown) and of orientations (rad)."""

    length_noise: float | None
    orientation_noise: float

    @property
    def noise(self) -> float:
        """What lengths are weighted with, m: :data:`UNIT` if their noise is unknown."""
        return UNIT if self.length_noise is None else self.length_noise


class CalibrationProblem(NamedTuple):
    """Measurements of a device, and what its unknowns are estimated with.

    Attributes
    ----------
    model : LengthModel
        Equations and unknowns.
    measured : ndarray
        Shape (N, 3, 3), S of each pose.
    lengths : ndarray
        Shape (N, n), m.
    errors : MeasurementErrors
        As stated.
    prior : ndarray
        Shape (p,), tolerances of the unknowns, infinite without one.
    """

    model: LengthModel
    measured: FloatArray
    lengths: FloatArray
    errors: MeasurementErrors
    prior: FloatArray

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced_tuple(self)


class Estimate(NamedTuple):
    """What least squares found.

    Attributes
    ----------
    values : ndarray
        Shape (p,).
    residuals : ndarray
        Shape (N n,): measured minus predicted lengths, errors independent with standard deviation 1 as far as known.
    jacobian : ndarray
        Shape (N n, p): derivatives of the predicted lengths in the same unit.
    scale : float
        Standard deviation of the residuals: 1 if the noise is stated, else estimated.
    """

    values: FloatArray
    residuals: FloatArray
    jacobian: FloatArray
    scale: float


def estimate(problem: CalibrationProblem, start: FloatArray, near: bool = True) -> Estimate:
    """Minimise the weighted squares of the lengths' errors, and of the unknowns' changes over their tolerances.

    Parameters
    ----------
    problem : CalibrationProblem
        The noise of lengths is estimated from the residuals if it is not stated.
    start : ndarray
        Shape (p,), near the minimum.
    near : bool
        Whether to bring what is undetermined near to the nominal design first.

    Raises
    ------
    SolverFailed
        If least squares or the weights do not converge.
    """
    model, (length_noise, orientation_noise) = problem.model, problem.errors
    values = start
    for size in _NEAR if near else ():
        values = _Weighted(problem, values).solve(values, np.minimum(problem.prior, size * model.scales), _COARSE)
    # With one kind of error the weights are the same everywhere.
    plain = orientation_noise == 0.0
    for _ in range(_MOST_ROUNDS):
        fit, before = _Weighted(problem, values), values
        values = fit.solve(values, problem.prior, _FINE if plain else 1e-2 * _STILL)
        residuals, jacobian = fit.residuals(values), fit.jacobian(values)
        freedom = len(residuals) - min(np.linalg.matrix_rank(jacobian * model.scales), len(residuals))
        scale = 1.0
        if length_noise is None:
            scale = float(np.sqrt(residuals @ residuals / freedom)) if freedom > 0 else float("nan")
        moved = float(np.abs((values - before) / model.scales).max(initial=0.0))
        still = moved < _STILL * model.reach
        if plain or still or np.linalg.norm(jacobian @ (values - before)) < _UNNOTICED * scale:
            return Estimate(values, residuals, jacobian, scale)
    raise SolverFailed("reweighted least squares", moved, "the weights do not converge")


class _Weighted:
    """Residuals and their derivatives, errors weighted as they are at some values."""

    def __init__(self, problem: CalibrationProblem, values: FloatArray) -> None:
        self.model, self.measured, self.lengths = problem.model, problem.measured, problem.lengths
        here, errors = self.model.evaluate(values, self.measured), problem.errors
        self.whiten = whitening(here, errors.noise, errors.orientation_noise)

    def residuals(self, values: FloatArray) -> FloatArray:
        """Measured minus predicted."""
        short = self.lengths - self.model.lengths(values, self.measured)
        return np.asarray(np.einsum("kij,kj->ki", self.whiten, short).ravel())

    def jacobian(self, values: FloatArray) -> FloatArray:
        """Derivatives of the predicted lengths."""
        by = self.model.evaluate(values, self.measured).by_unknowns
        return np.asarray((self.whiten @ by).reshape(-1, self.model.size))

    def solve(self, start: FloatArray, prior: FloatArray, tolerance: float) -> FloatArray:
        """Least squares with these weights."""
        held = np.isfinite(prior)
        stiff = np.diag(1.0 / prior)[held]
        found = scipy.optimize.least_squares(
            lambda p: np.concatenate([-self.residuals(p), p[held] / prior[held]]),
            start,
            jac=lambda p: np.concatenate([self.jacobian(p), stiff]),
            x_scale=self.model.scales,
            xtol=tolerance,
            ftol=1e-14,
            gtol=_FLAT,
            max_nfev=500,
        )
        if found.status == 0 and tolerance < _COARSE:
            raise SolverFailed("least squares", found.optimality, "start nearer to the device: check the design")
        return np.asarray(found.x)
