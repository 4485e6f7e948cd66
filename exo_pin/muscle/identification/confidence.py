"""How well measurements determine coefficients: columns that they cannot distinguish, and Student's intervals."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_positive

#: Condition index above which a dependency among columns of unit length is called strong (Belsley, Kuh, Welsch).
CONDITION_LIMIT = 30.0


def collinear(jacobian: FloatArray) -> NDArray[np.bool_]:
    """Columns that the data cannot distinguish.

    Columns are scaled to unit length. A column is flagged if more than half of the variance of its coefficient
    comes from directions with a condition index above ``CONDITION_LIMIT`` (variance decomposition of Belsley, Kuh
    and Welsch), or if it is zero.

    Parameters
    ----------
    jacobian : ndarray
        Shape (n, k), n at least k.

    Returns
    -------
    ndarray of bool
        Shape (k,).
    """
    norms = np.linalg.norm(jacobian, axis=0)
    flagged = norms == 0
    live = ~flagged
    if not live.any():
        return flagged
    _, singular, right = np.linalg.svd(jacobian[:, live] / norms[live], full_matrices=False)
    singular = np.maximum(singular, np.finfo(float).tiny)
    shares = (right / singular[:, np.newaxis]) ** 2
    weak = singular[0] / singular > CONDITION_LIMIT
    flagged[live] = shares[weak].sum(axis=0) > 0.5 * shares.sum(axis=0)
    return flagged


def confidence_interval(centre: FloatArray, variance: FloatArray, level: float, degrees_of_freedom: int) -> FloatArray:
    """Student's interval about each of n estimates, shape (n, 2)."""
    if not 0 < as_positive("level", level) < 1:
        raise InvalidInput(f"expected level between 0 and 1, got {level:g}")
    half = scipy.stats.t.ppf(0.5 + level / 2, degrees_of_freedom) * np.sqrt(variance)
    return np.column_stack([centre - half, centre + half])
