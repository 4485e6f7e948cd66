"""Whether the errors of the measurements explain the residuals of a device; if they do not, the device is wrong."""

from __future__ import annotations

import numpy as np
import scipy

from ..core.validation import FloatArray
from .estimation import Estimate, Problem, robust_scale
from .information import whitening

#: Residuals beyond this many standard deviations are outliers.
OUTLIER = 4.0
#: Residuals that are less probable than this contradict the stated noise.
_IMPROBABLE = 1e-3
#: A limb with more outliers than this share, and than this number, is not one of the model with some outliers.
_SHARE, _FEW = 0.2, 3
#: Standard deviation of the logarithm of a robust scale of N normal residuals, times √N.
_SPREAD = 1.17
#: Scales may differ by chance by this many standard deviations.
_CHANCE = 5.0
#: Singular values below this part of the largest are zero; freedoms that a test of fit needs.
_RANK, _LEAST_FREEDOM = 1e-8, 10


def contradiction(problem: Problem, found: Estimate, z: FloatArray, probability: float) -> str:
    """What residuals say against a device, one sentence, or nothing.

    Parameters
    ----------
    problem : Problem
        The measurements.
    found : Estimate
        The device.
    z : ndarray
        Shape (N, n): residuals over their standard deviation, which is the stated one, or that of all of them.
    probability : float
        Of the chi-square test, where it applies; else NaN.
    """
    errors = problem.errors
    size, middle = float(np.sqrt((z**2).mean())), float(robust_scale(z.ravel()))
    chance = np.exp(_CHANCE * _SPREAD / np.sqrt(z.size))
    stated = errors.length_noise is not None
    if probability < _IMPROBABLE:
        return f"The residuals contradict the stated noise: they are {size:.2g} times as large."
    outliers = np.abs(z) > OUTLIER
    if not errors.is_robust:
        if not stated and middle > 0.0 and size > chance * middle:
            return (
                "The residuals are not those of one normally distributed noise: their root of the mean square is "
                f"{size / middle:.2g} times what their median says (outliers, a slack muscle?)."
            )
    else:
        # The median of absolute values, if so many are outliers.
        share = min(float(outliers.mean()), 0.4)
        shifted = float(scipy.stats.norm.ppf(0.5 + 0.25 / (1.0 - share)) / scipy.stats.norm.ppf(0.75))
        if stated and middle > shifted * chance:
            return f"The residuals contradict the stated noise: most are {middle:.2g} times as large."
        counts = outliers.sum(axis=0)
        worst = int(counts.argmax())
        if counts[worst] > max(_SHARE * len(z), _FEW):
            return (
                f"Of limb {worst + 1}, {counts[worst]} of {len(z)} lengths are outliers, too many to be left out "
                "(a slack muscle, a wrong column?)."
            )
    if _lack_of_fit(problem, found) < _IMPROBABLE:
        return (
            "The residuals change with the pose as no noise does: something that was taken as known is wrong, a muscle "
            "is slack, or the shoulder's centre moves."
        )
    return ""


def _lack_of_fit(problem: Problem, found: Estimate) -> float:
    """Probability that residuals depend on the pose as much as these or more by chance (F test).

    The device is compared with a model of each limb in which (l + o)² is any linear function of 1 and the nine S_jk,
    and o a constant: what lengths would be with other joints, mountings and offsets, to first order, and more. NaN if
    there are too few lengths.
    """
    model, measured, noise = problem.model, problem.measured, problem.errors.noise
    here = model.evaluate(found.values, measured)
    count, n = here.values.shape
    columns = np.concatenate([np.ones((count, 1)), measured.reshape(-1, 9)], axis=1)
    smooth = np.zeros((count, n, n, 11))
    for i in range(n):
        spans = here.values[:, i] + model.length_offsets(found.values)[i]
        smooth[:, i, i] = np.column_stack([columns / spans[:, None], np.ones(count)])
    smooth = whitening(here, noise, problem.errors.orientation_noise) @ smooth.reshape(count, n, -1)
    root = np.sqrt(found.weights)
    small = root[:, None] * found.jacobian * model.scales
    large = np.concatenate([small, root[:, None] * smooth.reshape(count * n, -1) * noise], axis=1)
    left, ranks = list[float](), list[int]()
    for matrix in (small, large):
        u, sizes, _ = np.linalg.svd(matrix, full_matrices=False)
        u = u[:, sizes > _RANK * sizes[0]]
        r = root * found.residuals
        left.append(float(((r - u @ (u.T @ r)) ** 2).sum()))
        ranks.append(u.shape[1])
    freedom, more = len(root) - ranks[1], ranks[1] - ranks[0]
    if freedom < _LEAST_FREEDOM or more == 0 or left[1] <= 0.0:
        return float("nan")
    return float(scipy.stats.f.sf((left[0] - left[1]) / more / (left[1] / freedom), more, freedom))
