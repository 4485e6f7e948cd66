"""Smoothing splines of degree 7 with automatic smoothing parameter, and the noise of their derivatives.

The curve f through samples y_i at x_i minimises Σ |y_i - f(x_i)|² + λ ∫ |d⁴f/dx⁴|² dx (Woltring 1985 and 1986, GCVSPL).
With the penalty on the fourth derivative, the second one, an acceleration, is itself smooth, and its slope is free at
the ends. With the third derivative, the more usual choice, f''' = 0 is a condition at the ends, and accelerations of
movements have up to three times the error. λ minimises the generalised cross-validation score
Σ |y_i - f(x_i)|² / (N - γ tr H)², H the matrix from the samples to f(x_i) (Craven and Wahba 1979), with γ = 1.4 (Kim
and Gu 2004) which avoids the occasional rough curve of γ = 1. Where the standard deviation σ of the noise is
known, λ minimises the estimate of the risk Σ |y_i - f(x_i)|² / d + 2 σ² γ tr H for d noisy components, unbiased for
γ = 1. Both assume white noise: independent from sample to sample.

Samples without noise are interpolated: with them the end conditions of a smoothing spline would be the largest error.
Which of the two applies is decided by the noise that each predicts in f''.

f has knots at the samples, or at every second, fourth, ... of them where λ is so large that f does not change by it
(and the equations for all knots would be ill-conditioned). All matrices are banded.

B-splines of degree 7 on given samples: rows of values and derivatives, penalty, banded equations.

Curves of quaternions: sign, unit length, angular velocity and acceleration.

A curve q(t) in four dimensions, brought to unit length, u = q/|q|, is a movement. ω = 2 vec(u̇ ū) and η = 2 vec(ü ū) are
exact wherever q is twice differentiable.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy
from scipy.spatial.transform import Rotation

from ...core.validation import FloatArray

_DEGREE = 7
#: Order of the derivative in the penalty.
_ORDER = 4
#: Weight of the conditions at the ends beside that of a sample: large, and small enough for double precision.
_HELD = 1e5
#: Half the step in log λ of the difference that gives tr H.
_STEP = 0.01


#: Fewest samples from which noise can be distinguished from movement.
FEWEST = 12
#: Weight of the degrees of freedom in the score.
_GAMMA = 1.4
#: Samples nearer than this, in mean spacings, share a knot.
_NEAREST = 0.3
#: Largest λ, with the spacing of the knots as the unit of x, for which these knots are used.
_LARGEST = 1e2
#: Largest λ of all, with the spacing of the fewest knots as the unit: the curve is a cubic.
_STIFFEST = 1e4
#: Least λ, with the mean spacing as the unit: the curve passes through the samples.
_LEAST = 1e-9
#: Half the knots make λ, with their spacing as the unit, smaller by this: 2⁷ for the penalty, 2 for samples a knot.
_HALVING = 2.0**8
#: Trial values in a decade of λ; the best is refined.
_TRIALS = 3
#: Number of samples for a divided difference of order 8.
_WINDOW = 9


class SplineBasis:
    """B-splines for the fit of Σ |y_i - f(x_i)|² + λ ∫ |d⁴f/dx⁴|² dx.

    Parameters
    ----------
    x : ndarray
        Shape (N,), rising, mean spacing 1, N >= 10.
    stride : int
        There is a knot at every ``stride``-th sample; with 1 the splines can interpolate.
    nearest : float
        Samples nearer than this, in mean spacings, share a knot.
    rest : bool
        Whether f' and f'' are zero at the first and the last sample.
    """

    def __init__(self, x: FloatArray, stride: int = 1, nearest: float = 0.0, rest: bool = False) -> None:
        inner = _apart(x[_ORDER:-_ORDER][::stride], float(x[0]), float(x[-1]), nearest)
        # Knots beyond the ends instead of multiple knots at the ends: the equations are far better conditioned.
        beyond = float(x[-1] - x[0]) / (len(inner) + 1) * np.arange(_DEGREE + 1)
        self.knots = np.concatenate([x[0] - beyond[::-1], inner, x[-1] + beyond])
        design = scipy.interpolate.BSpline.design_matrix
        down: list[Any] = [scipy.sparse.eye_array(len(self.knots) - _DEGREE - 1)]
        for order in range(_ORDER):
            down.append(self._lowered(order) @ down[-1])
        #: Sparse rows of value, first and second derivative at the samples.
        self.rows = [design(x, self._knots_of(k), _DEGREE - k) @ down[k] for k in range(3)]
        # The integral is exact: between knots the integrand is a polynomial of degree 6.
        breaks = self.knots[_DEGREE:-_DEGREE]
        nodes, weights = np.polynomial.legendre.leggauss(_ORDER)
        half = 0.5 * np.diff(breaks)[:, None]
        places = (0.5 * (breaks[1:] + breaks[:-1])[:, None] + half * nodes).ravel()
        fourth = design(places, self._knots_of(_ORDER), _DEGREE - _ORDER) @ down[_ORDER]
        self._penalty = _bands(fourth.T @ fourth.multiply((half * weights).ravel()[:, None]).tocsr())
        self._normal = _bands(self.rows[0].T @ self.rows[0])
        #: Conditions at the ends, each of which removes a degree of freedom.
        self._conditions = 4 if rest else 0
        if rest:
            for row in self.rows[1:]:
                held = row[[0, -1]]
                held = _HELD * held / np.sqrt(held.multiply(held).sum(axis=1))[:, None]
                self._normal += _bands(held.T.tocsr() @ held.tocsr())

    def _knots_of(self, order: int) -> FloatArray:
        """The knots of the derivative of this order."""
        return self.knots[order : len(self.knots) - order]

    def _lowered(self, order: int) -> Any:
        """Matrix from the coefficients of a spline's derivative of this order to those of the next."""
        degree, knots = _DEGREE - order, self._knots_of(order)
        count = len(knots) - degree - 1
        factor = degree / (knots[degree + 1 : degree + count] - knots[1:count])
        return scipy.sparse.diags_array([-factor, factor], offsets=[0, 1], shape=(count - 1, count)).tocsr()

    def factor(self, penalty: float) -> FloatArray:
        """Banded Cholesky factor of X'X + λ P, as in LAPACK: [k, i] is entry (i + k, i).

        Raises
        ------
        numpy.linalg.LinAlgError
            If the equations are singular to working precision.
        """
        return np.asarray(scipy.linalg.cholesky_banded(self._normal + penalty * self._penalty, lower=True))

    def values(self, y: FloatArray, factor: FloatArray) -> FloatArray:
        """The fitted curve and its first two derivatives at the samples, shape (3, N, D)."""
        weights = scipy.linalg.cho_solve_banded((factor, True), self.rows[0].T @ y)
        return np.stack([row @ weights for row in self.rows])

    def freedom(self, penalty: float) -> float:
        """tr H, for H the matrix from y to the fitted values: K - d log det(X'X + λ P) / d log λ."""
        ahead, behind = (log_determinant(self.factor(penalty * np.exp(sign * _STEP))) for sign in (1, -1))
        return self._normal.shape[1] - self._conditions - (ahead - behind) / (2.0 * _STEP)

    def covariance(self, factor: FloatArray) -> FloatArray:
        """Posterior covariance of value, first and second derivative at the samples, shape (N, 3, 3), for σ = 1."""
        inverse = _inverse_bands(factor)
        below = scipy.sparse.dia_array((inverse, -np.arange(_DEGREE + 1)), shape=(inverse.shape[1],) * 2).tocsr()
        # A sample depends on eight neighbouring coefficients: the rest of the inverse is not needed.
        band = below + scipy.sparse.tril(below, -1).T
        half = [row @ band for row in self.rows]
        found = [[np.asarray(a.multiply(b).sum(axis=1)).ravel() for b in self.rows] for a in half]
        return np.asarray(np.moveaxis(np.array(found), -1, 0))


def log_determinant(factor: FloatArray) -> float:
    """Logarithm of the determinant of the matrix that a banded Cholesky factor belongs to."""
    return 2.0 * float(np.log(factor[0]).sum())


def _apart(knots: FloatArray, first: float, last: float, nearest: float) -> FloatArray:
    """Those of sorted knots that are farther apart than ``nearest``, and from the ends."""
    selected, before = [], first
    for knot in knots.tolist():
        if knot - before > nearest and last - knot > nearest:
            selected.append(knot)
            before = knot
    return np.array(selected)


def _bands(matrix: Any) -> FloatArray:
    """Lower bands of a symmetric sparse matrix, as in LAPACK."""
    size, _ = matrix.shape
    out = np.zeros((_DEGREE + 1, size))
    for k in range(_DEGREE + 1):
        out[k, : size - k] = matrix.diagonal(k)
    return out


def _inverse_bands(factor: FloatArray) -> FloatArray:
    """Bands of the inverse within the bands of the matrix, from its Cholesky factor (Takahashi's recursion)."""
    width, size = factor.shape[0] - 1, factor.shape[1]
    # The block holds rows i + 1 to i + width of the inverse; below the last row are zeros.
    block, out = np.zeros((width, width)), np.empty((width + 1, size))
    for i in reversed(range(size)):
        column = factor[1:, i] / factor[0, i]
        side = -(block @ column)
        top = 1.0 / factor[0, i] ** 2 - column @ side
        out[0, i], out[1:, i] = top, side
        block[1:, 1:] = block[:-1, :-1]
        block[0, 0], block[0, 1:], block[1:, 0] = top, side[:-1], side[:-1]
    return out


@dataclass(frozen=True, eq=False)
class SmoothedSamples:
    """A curve at the samples.

    Attributes
    ----------
    values : ndarray
        Shape (3, N, D): the curve and its first two derivatives at the samples.
    noise : float
        Standard deviation of a noisy component of the samples, estimated; NaN with fewer than :data:`FEWEST`.
    covariance : ndarray
        Shape (N, 3, 3): covariance of a component's value, first and second derivative at each sample, for noise of
        standard deviation 1. Of a smoothing spline it is the posterior covariance (Wahba 1983), which includes the
        bias, except near the ends. NaN where ``noise`` is NaN.
    penalty : float
        λ; 0 for interpolation.
    """

    values: FloatArray
    noise: float
    covariance: FloatArray
    penalty: float

    def roughness(self, noise: float) -> float:
        """Root mean square noise of the second derivative, for samples with this noise."""
        return noise * float(np.sqrt(self.covariance[:, 2, 2].mean()))


def fit_samples(
    x: FloatArray, y: FloatArray, components: int, noise: float | None = None, rest: bool = False
) -> SmoothedSamples:
    """Smooth samples with noise, interpolate samples without.

    Parameters
    ----------
    x : ndarray
        Shape (N,), rising, mean spacing 1.
    y : ndarray
        Shape (N, D).
    components : int
        Number of independent components of the noise of a sample, at most D.
    noise : float, optional
        Standard deviation of each, if it is known.
    rest : bool
        Whether the curve starts and ends at rest: f' = f'' = 0 there, unless samples without noise are interpolated.
    """
    plain = interpolate_samples(x, y, components)
    if len(x) < FEWEST or noise == 0.0 or plain.noise == 0.0:
        return plain
    try:
        smooth = smooth_samples(x, y, components, noise, rest)
    except np.linalg.LinAlgError:
        # The samples lie in a few clusters: they do not determine a smooth curve.
        return plain
    # The residual of differences is noise; a larger residual of a smoothing spline is bias, which is larger in f''.
    bias = max(1.0, smooth.noise / plain.noise) ** 2
    return plain if plain.roughness(plain.noise) < bias * smooth.roughness(smooth.noise) else smooth


def interpolate_samples(x: FloatArray, y: FloatArray, components: int) -> SmoothedSamples:
    """Interpolate by a spline of degree 7 (5 with fewer than 12 samples, 3 with fewer than six).

    Arguments as in :func:`fit_samples`.
    """
    spline = scipy.interpolate.make_interp_spline(x, y, k=7 if len(x) >= FEWEST else 5 if len(x) >= 6 else 3)
    values = np.stack([spline(x, order) for order in range(3)])
    blank = SmoothedSamples(values, np.nan, np.full((len(x), 3, 3), np.nan), 0.0)
    if len(x) < FEWEST:
        return blank
    covariance = _interpolation_noise(x)
    if covariance is None:
        return blank
    return replace(blank, noise=_noise_of_differences(x, y, components), covariance=covariance)


def _interpolation_noise(x: FloatArray) -> FloatArray | None:
    """Covariance of an interpolating spline for noise 1, or None where the samples are in too few clusters."""
    # Two samples at almost the same time may share a knot; the noise is then somewhat underestimated.
    for nearest, penalty in ((0.0, 0.0), (_NEAREST, _LEAST)):
        basis = SplineBasis(x, nearest=nearest)
        try:
            return basis.covariance(basis.factor(penalty))
        except np.linalg.LinAlgError:
            continue
    return None


def _noise_of_differences(x: FloatArray, y: FloatArray, components: int) -> float:
    """Noise from divided differences of order 8, in which a smooth curve nearly cancels."""
    first = np.arange(len(x) - _WINDOW + 1)
    places = x[first[:, None] + np.arange(_WINDOW)]
    # A window across a gap contains too much of the curve.
    span = places[:, -1] - places[:, 0]
    first, places = first[span <= 2.0 * np.median(span)], places[span <= 2.0 * np.median(span)]
    gaps = places[:, :, None] - places[:, None, :]
    weights = np.reciprocal(gaps.prod(axis=2, where=~np.eye(_WINDOW, dtype=bool)))
    weights /= np.linalg.norm(weights, axis=1, keepdims=True)
    left = np.einsum("wk,wkd->wd", weights, y[first[:, None] + np.arange(_WINDOW)])
    return float(np.sqrt((left**2).sum(axis=1).mean() / components))


def smooth_samples(
    x: FloatArray, y: FloatArray, components: int, noise: float | None = None, rest: bool = False
) -> SmoothedSamples:
    """Fit the smoothing spline with λ from the data; arguments of :func:`fit_samples`, N >= :data:`FEWEST`."""
    search = _Search(x, y, components, noise, rest)
    penalty = search.best()
    basis = search.basis(penalty)
    factor = basis.factor(penalty)
    values = basis.values(y, factor)
    left = components * (len(x) - basis.freedom(penalty))
    found = float(np.sqrt(((y - values[0]) ** 2).sum() / left))
    return SmoothedSamples(values, found, basis.covariance(factor), penalty)


class _Search:
    """Scores of λ for given samples."""

    def __init__(self, x: FloatArray, y: FloatArray, components: int, noise: float | None, rest: bool) -> None:
        self.x, self.y, self.components, self.noise, self.rest = x, y, components, noise, rest
        #: Largest number of times that the knots can be halved.
        self.levels = max(0, int(np.log2(len(x) / 6.0)))
        self._bases: dict[int, SplineBasis] = {}

    def basis(self, penalty: float) -> SplineBasis:
        """The basis with the knots that this λ needs."""
        level = int(np.clip(np.ceil(np.log(penalty / _LARGEST) / np.log(_HALVING)), 0, self.levels))
        if level not in self._bases:
            self._bases[level] = SplineBasis(self.x, 2**level, _NEAREST, self.rest)
        return self._bases[level]

    def score(self, log_penalty: float) -> float:
        """Score that the best λ minimises; infinite where the equations cannot be solved."""
        penalty = float(np.exp(log_penalty))
        basis = self.basis(penalty)
        try:
            fitted = basis.values(self.y, basis.factor(penalty))[0]
            freedom = _GAMMA * basis.freedom(penalty)
        except np.linalg.LinAlgError:
            return np.inf
        squares = float(((self.y - fitted) ** 2).sum())
        if self.noise is not None:
            return squares / self.components + 2.0 * self.noise**2 * freedom
        left = len(self.x) - freedom
        return float(np.log(squares + np.finfo(float).tiny) - 2.0 * np.log(left)) if left > 0.0 else np.inf

    def best(self) -> float:
        low, high = np.log(_LEAST), np.log(_STIFFEST) + self.levels * np.log(_HALVING)
        trials = np.linspace(low, high, int(_TRIALS * (high - low) / np.log(10.0)) + 1)
        scores = np.array([self.score(trial) for trial in trials])
        k = int(scores.argmin())
        bounds = (trials[max(k - 1, 0)], trials[min(k + 1, len(trials) - 1)])
        found = scipy.optimize.minimize_scalar(self.score, bounds=bounds, options={"xatol": 0.02})
        return float(np.exp(found.x if found.fun <= scores[k] else trials[k]))


def continuous_quaternions(poses: Rotation) -> FloatArray:
    """Quaternions x, y, z, w of a stack of shape (N,), each of the sign that is nearer to the one before.

    After half a turn neither is nearer; the sign stays as it is.
    """
    q = poses.as_quat()
    q[1:] *= np.cumprod(np.where(np.einsum("ij,ij->i", q[1:], q[:-1]) < 0.0, -1.0, 1.0))[:, None]
    return q


def motion_of_quaternions(values: FloatArray, unit: float = 1.0) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Unit quaternions, ω and η from quaternions of any length and their derivatives.

    Parameters
    ----------
    values : ndarray
        Shape (3, N, 4): q and its first two derivatives by t/unit.
    unit : float
        s.

    Returns
    -------
    u, velocity, acceleration : ndarray
        Shapes (N, 4), (N, 3) in rad/s and (N, 3) in rad/s²; base frame.
    """
    q, dq, ddq = values[0], values[1] / unit, values[2] / unit**2
    size = np.sqrt(_dot(q, q))
    u = q / size
    # Up to a multiple of u, of which vec(u ū) is zero: du, and with it ddu.
    du = dq / size
    ddu = (ddq - 2.0 * du * _dot(u, dq)) / size
    return u, 2.0 * _vector_part(du, u), 2.0 * _vector_part(ddu, u)


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.einsum("ij,ij->i", a, b)[:, None]


def _vector_part(p: FloatArray, u: FloatArray) -> FloatArray:
    """vec(p ū) of quaternions xyzw."""
    v, w = p[..., :3], p[..., 3:]
    a, b = -u[..., :3], u[..., 3:]
    return np.asarray(w * a + b * v + np.cross(v, a))
