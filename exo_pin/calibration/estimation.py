"""Nonlinear least squares for the unknowns, weighted for errors of lengths and orientations, robust if desired."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy

from ..core.errors import InvalidInput, SolverFailed
from ..core.records import reduced_tuple
from ..core.validation import FloatArray
from .information import whitening
from .length_model import LengthModel

#: How residuals count: as their squares, or ever less.
LOSSES = ("linear", "cauchy")
#: Residual, in standard deviations, from which the Cauchy loss counts less; 95 % efficient for normal errors.
_LIMIT = 2.385
#: Weights have converged when the unknowns move by less than this part of the joints' distance from the centre, and no
#: weight changes by more than this.
_STILL, _SETTLED, _UNNOTICED = 1e-7, 1e-3, 1e-4
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
#: Standard deviation of a normal distribution over the median of its absolute values.
_MEDIAN = 1.4826
#: Of the lengths beyond as many as there are unknowns, share that must be no outliers, about.
_LEAST_SHARE = 0.1


class MeasurementErrors(NamedTuple):
    """Errors as stated: of lengths (m, None if unknown), of orientations (rad), and the loss."""

    length_noise: float | None
    orientation_noise: float
    loss: str

    @property
    def noise(self) -> float:
        """What lengths are weighted with, m: :data:`UNIT` if their noise is unknown."""
        return UNIT if self.length_noise is None else self.length_noise

    @property
    def is_robust(self) -> bool:
        """Whether outliers count less."""
        return self.loss != "linear"


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
    weights : ndarray
        Shape (N n,): of the robust loss, 1 for all of the linear one.
    scale : float
        Standard deviation of the residuals: 1 if the noise is stated, else estimated.
    """

    values: FloatArray
    residuals: FloatArray
    jacobian: FloatArray
    weights: FloatArray
    scale: float


def estimate(problem: CalibrationProblem, start: FloatArray, near: bool = True) -> Estimate:
    """Minimise the weighted squares of the lengths' errors, and of the unknowns' changes over their tolerances.

    Parameters
    ----------
    problem : CalibrationProblem
        The noise of lengths is estimated from the residuals if it is not stated. With a robust loss weights and
        unknowns are found in turn (iteratively reweighted least squares).
    start : ndarray
        Shape (p,), near the minimum. Outliers there have little weight from the beginning.
    near : bool
        Whether to bring what is undetermined near to the nominal design first.

    Raises
    ------
    SolverFailed
        If least squares or the weights do not converge.
    InvalidInput
        If they do not because most residuals are outliers of the stated noise.
    """
    model, (length_noise, orientation_noise, loss) = problem.model, problem.errors
    residuals = _Weighted(problem, start).residuals(start)
    values, scale = start, max(float(robust_scale(residuals)), 1.0 if length_noise is not None else 0.0)
    weights = weights_of(residuals / scale if scale > 0.0 else residuals, loss)
    for size in _NEAR if near else ():
        loose = np.minimum(problem.prior, size * model.scales)
        values = _Weighted(problem, values).solve(values, weights, loose, _COARSE)
    # With one kind of error and no robust loss the weights are the same everywhere.
    plain = orientation_noise == 0.0 and loss == "linear"
    for _ in range(_MOST_ROUNDS):
        fit, before = _Weighted(problem, values), values
        values = fit.solve(values, weights, problem.prior, _FINE if plain else 1e-2 * _STILL)
        residuals, jacobian = fit.residuals(values), fit.jacobian(values)
        freedom = len(residuals) - min(np.linalg.matrix_rank(jacobian * model.scales), len(residuals))
        scale = 1.0 if length_noise is not None else _scale(residuals, freedom, loss)
        old, weights = weights, weights_of(residuals / scale if scale > 0.0 else residuals, loss)
        moved = float(np.abs((values - before) / model.scales).max(initial=0.0))
        settled = moved < _STILL * model.reach and np.abs(weights - old).max() < _SETTLED
        # Or the lengths move by far less than their errors.
        if plain or settled or np.linalg.norm(jacobian @ (values - before)) < _UNNOTICED * scale:
            return Estimate(values, residuals, jacobian, weights, scale)
    inflation(Estimate(values, residuals, jacobian, weights, scale), loss, len(residuals) - freedom)
    raise SolverFailed("reweighted least squares", moved, "the weights do not converge; try loss='linear'")


def _scale(residuals: FloatArray, freedom: int, loss: str) -> float:
    if freedom <= 0:
        return float("nan")
    if loss == "linear":
        return float(np.sqrt(residuals @ residuals / freedom))
    return float(robust_scale(residuals) * np.sqrt(len(residuals) / freedom))


def robust_scale(residuals: FloatArray) -> FloatArray:
    """Standard deviation of residuals of which less than half are outliers, from their median size; last axis."""
    return np.asarray(_MEDIAN * np.median(np.abs(residuals), axis=-1))


def weights_of(z: FloatArray, loss: str) -> FloatArray:
    """Weight of residuals of so many standard deviations."""
    return 1.0 / (1.0 + (z / _LIMIT) ** 2) if loss == "cauchy" else np.ones_like(z)


def losses_of(z: FloatArray, loss: str) -> FloatArray:
    """What residuals of so many standard deviations cost: z² of a small one."""
    return np.asarray(_LIMIT**2 * np.log1p((z / _LIMIT) ** 2) if loss == "cauchy" else z**2)


def inflation(found: Estimate, loss: str, unknowns: int) -> float:
    """Variance of a robust estimate over that of least squares with the same noise (Huber 1981, section 7.6).

    Raises
    ------
    InvalidInput
        If most residuals are outliers of the stated noise, so that nothing is left to estimate from.
    """
    if loss == "linear" or found.scale == 0.0 or len(found.residuals) <= unknowns:
        # Without a residual no length is an outlier.
        return 1.0
    z = found.residuals / found.scale
    pull = found.weights * z
    size = (z / _LIMIT) ** 2
    slope = (1.0 - size) / (1.0 + size) ** 2
    mean, count = float(slope.mean()), len(z)
    # As many lengths as unknowns are met exactly, whatever the others are.
    if mean * count - unknowns < _LEAST_SHARE * (count - unknowns):
        raise InvalidInput(
            f"with loss={loss!r} most lengths count as outliers: expected a length_noise near the size of the "
            f"residuals, which are {np.median(np.abs(z)):.2g} standard deviations in the median"
        )
    correction = 1.0 + unknowns / count * float(slope.var()) / mean**2
    return correction**2 * float(pull @ pull) / (count - unknowns) / mean**2


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

    def solve(self, start: FloatArray, weights: FloatArray, prior: FloatArray, tolerance: float) -> FloatArray:
        """Least squares with these weights."""
        root = np.sqrt(weights)
        held = np.isfinite(prior)
        stiff = np.diag(1.0 / prior)[held]
        found = scipy.optimize.least_squares(
            lambda p: np.concatenate([-root * self.residuals(p), p[held] / prior[held]]),
            start,
            jac=lambda p: np.concatenate([root[:, None] * self.jacobian(p), stiff]),
            x_scale=self.model.scales,
            xtol=tolerance,
            ftol=1e-14,
            gtol=_FLAT,
            max_nfev=500,
        )
        if found.status == 0 and tolerance < _COARSE:
            raise SolverFailed("least squares", found.optimality, "start nearer to the device: check the design")
        return np.asarray(found.x)
