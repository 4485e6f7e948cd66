"""How many of the measurements one law describes, and which single ones the others contradict: tests for regimes.

Measurements are sorted by contraction, the most contracted first; see :mod:`.region` for the physics.
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...core.validation import FloatArray
from ..laws.static import BAR

Powers = tuple[tuple[int, int], ...]

#: Powers (of contraction, of pressure) of (3-10), in the order K_1, K_2, C_1, S_1, S_2, S_3.
SECOND_ORDER: Powers = ((2, 1), (1, 1), (0, 1), (2, 0), (1, 0), (0, 0))
#: Probability of calling one of the measurements of a law an outlier.
OUTLIER_LEVEL = 0.001
#: A difference from the law below this share of the greatest force is a misfit of its form: no braid, no slip in a row.
LEAST_EXCESS = 0.05
#: So many more measurements, or all that are left, obey one law without a measurement that is an outlier.
_MORE = 3


def design_matrix(contraction: FloatArray, pressure: FloatArray, powers: Powers) -> FloatArray:
    """Columns x^i P^j with x in m and P in bar, shape (n, len(powers))."""
    bar = pressure / BAR
    if not len(powers):
        raise InvalidInput("expected one pair of powers or more, got none")
    return np.column_stack([contraction**i * bar**j for i, j in powers])


def resolution_of(values: FloatArray) -> float:
    """Greatest power of ten of which all values are multiples, to twelve digits; 0 if there is none.

    Parameters
    ----------
    values : ndarray
        Shape (n,), in SI.

    Returns
    -------
    float
        In the unit of the values.
    """
    size = float(np.abs(values).max(initial=0.0))
    if size == 0.0:
        return 0.0
    most = int(np.floor(np.log10(size)))
    for power in range(most, most - 9, -1):
        steps = values / 10.0**power
        if np.allclose(steps, steps.round(), rtol=1e-12, atol=1e-9):
            return float(10.0**power)
    return 0.0


def rounding_variance(contraction: FloatArray, pressure: FloatArray, force: FloatArray, powers: Powers) -> float:
    """Variance of a measured force from the digits that the three columns have, N², of the law fitted to all of them.

    Parameters
    ----------
    contraction, pressure, force : ndarray
        Shape (n,), m, Pa, N.
    powers : tuple of (int, int)
        Terms of the law.

    Returns
    -------
    float
        A step of rounding d has the variance d²/12; those of contraction and pressure count by the law's slopes.
    """
    x, p, f = contraction, pressure, force
    matrix = design_matrix(x, p, powers)
    law = np.linalg.lstsq(matrix, f, rcond=None)[0]
    moved = [
        (design_matrix(x + resolution_of(x), p, powers) - matrix) @ law,
        (design_matrix(x, p + resolution_of(p), powers) - matrix) @ law,
        np.full(len(f), resolution_of(f)),
    ]
    return float(np.mean(np.square(moved).sum(axis=0)) / 12.0)


def _leftovers(matrix: FloatArray, force: FloatArray) -> FloatArray:
    """Sum of squares that the law leaves of the first m measurements, shape (n + 1,), zero up to the coefficients."""
    squares = np.zeros(len(force) + 1)
    for m in range(matrix.shape[1] + 1, len(force) + 1):
        rest = force[:m] - matrix[:m] @ np.linalg.lstsq(matrix[:m], force[:m], rcond=None)[0]
        squares[m] = rest @ rest
    return squares


def _one_regime(matrix: FloatArray, force: FloatArray, level: float, least: float) -> int:
    """Most of the first measurements that no cut shows to be two regimes; ``least`` is a variance, N²."""
    n, k = matrix.shape
    squares = _leftovers(matrix, force)
    for size in range(n, k + 2, -1):
        cuts = np.arange(k + 2, size)
        beyond = (squares[size] - squares[cuts]) / (size - cuts)
        within = np.maximum(squares[cuts] / (cuts - k), least)
        doubt = scipy.special.fdtrc(size - cuts, cuts - k, beyond / within)
        if len(cuts) == 0 or doubt.min() * len(cuts) > level:
            return size
    return n


def leave_one_out_p(matrix: FloatArray, force: FloatArray, least: float) -> FloatArray:
    """Probability of so large a difference of each measurement from the law of all the others, shape (n,).

    Parameters
    ----------
    matrix : ndarray
        Shape (n, k), columns of the law.
    force : ndarray
        Shape (n,), N.
    least : float
        Least variance of a measurement, N².

    Returns
    -------
    ndarray
        Two-sided, of Student's t with n - k - 1 degrees of freedom; one where there are none.
    """
    n, k = matrix.shape
    if n - k < 2:
        return np.ones(n)
    orthogonal = np.linalg.qr(matrix)[0]
    rest = force - orthogonal @ (orthogonal.T @ force)
    free = np.maximum(1.0 - (orthogonal**2).sum(axis=1), 1e-12)
    others = np.maximum((rest @ rest - rest**2 / free) / (n - k - 1), max(least, np.finfo(float).tiny))
    return np.asarray(2.0 * scipy.special.stdtr(n - k - 1, -np.abs(rest) / np.sqrt(others * free)))


def regimes(
    x: FloatArray, p: FloatArray, f: FloatArray, powers: Powers, level: float
) -> tuple[FloatArray, NDArray[np.int_], int, list[int]]:
    """Sort measurements and find how many of the first obey one law.

    Parameters
    ----------
    x, p, f : ndarray
        Shape (n,), m, Pa, N.
    powers : tuple of (int, int)
        Terms of the law.
    level : float
        Probability of finding two regimes in measurements of one law.

    Returns
    -------
    matrix : ndarray
        Shape (n, k), the terms in columns of unit length.
    order : ndarray of int
        The measurements without the outliers, the most contracted first.
    size : int
        How many of the first in that order obey one law.
    outliers : list of int
        Single measurements that the others contradict.
    """
    matrix = design_matrix(x, p, powers)
    matrix = matrix / np.maximum(np.linalg.norm(matrix, axis=0), np.finfo(float).tiny)
    # Exact data have no scatter: differences below twelve digits are rounding of the computer.
    least = max(rounding_variance(x, p, f, powers), 1e-24 * float(f @ f))
    order = np.argsort(-x, kind="stable")
    size = _one_regime(matrix[order], f[order], level, least)
    outliers: list[int] = []
    for _ in range(1 + len(x) // 20):
        found = _outlier(matrix, f, order, size, level, least)
        if found is None:
            break
        index, order, size = found
        outliers.append(index)
    return matrix, order, size, outliers


def _outlier(
    matrix: FloatArray, force: FloatArray, order: NDArray[np.int_], size: int, level: float, least: float
) -> tuple[int, NDArray[np.int_], int] | None:
    """Index of an outlier, the order without it, and how many of that obey one law; None if there is none."""
    most = LEAST_EXCESS * float(np.abs(force).max())

    def off(index: int, others: NDArray[np.int_]) -> bool:
        law = np.linalg.lstsq(matrix[others], force[others], rcond=None)[0]
        return bool(abs(force[index] - matrix[index] @ law) > most)

    if size < len(order):
        # The first measurement that ends the regime is an outlier if others go on behind it.
        without = np.delete(order, size)
        further = _one_regime(matrix[without], force[without], level, least)
        if further - size >= min(_MORE, len(without) - size) and off(order[size], without[:further]):
            return int(order[size]), without, further
    inside = order[:size]
    doubt = leave_one_out_p(matrix[inside], force[inside], least)
    worst = int(doubt.argmin())
    if doubt[worst] * len(inside) >= OUTLIER_LEVEL or size - 1 <= matrix.shape[1] + 2:
        return None
    if not off(inside[worst], np.delete(inside, worst)):
        return None
    without = np.delete(order, worst)
    return int(inside[worst]), without, _one_regime(matrix[without], force[without], level, least)
