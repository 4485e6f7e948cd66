"""B-splines of degree 7 on given samples: rows of values and derivatives, penalty, banded equations."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy

from ...core.validation import FloatArray

_DEGREE = 7
#: Order of the derivative in the penalty.
_ORDER = 4
#: Weight of the conditions at the ends beside that of a sample: large, and small enough for double precision.
_HELD = 1e5
#: Half the step in log λ of the difference that gives tr H.
_STEP = 0.01


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
        above = np.empty_like(block)
        above[1:, 1:] = block[:-1, :-1]
        above[0, 0], above[0, 1:], above[1:, 0] = top, side[:-1], side[:-1]
        block = above
    return out
