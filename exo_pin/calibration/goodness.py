"""Whether the errors of the measurements explain the residuals of a device; if they do not, the device is wrong."""

from __future__ import annotations

import numpy as np
import scipy

from ..core.validation import FloatArray
from .estimation import UNIT, Estimate, MeasurementErrors, losses_of, robust_scale
from .information import whitening
from .length_model import LengthModel
from .search.descent import descend, misfits
from .search.starts import subsets

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


def contradiction(
    z: FloatArray, errors: MeasurementErrors, probability: float, lack_of_fit: float, losses_differ: bool
) -> str:
    """What residuals say against a device, one sentence, or nothing.

    Parameters
    ----------
    z : ndarray
        Shape (N, n): over their standard deviation, which is the stated one, or that of all of them.
    errors : MeasurementErrors
        As stated.
    probability, lack_of_fit : float
        Of the chi-square test, and of :func:`lack_of_fit`, where they apply; else NaN.
    losses_differ : bool
        See :func:`losses_differ`.
    """
    size, middle = float(np.sqrt((z**2).mean())), float(robust_scale(z.ravel()))
    chance = np.exp(_CHANCE * _SPREAD / np.sqrt(z.size))
    stated = errors.length_noise is not None
    if probability < _IMPROBABLE:
        return f"The residuals contradict the stated noise: they are {size:.2g} times as large."
    outliers = np.abs(z) > OUTLIER
    if errors.loss == "linear":
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
    if losses_differ:
        return "Outliers that go together decide (a slack muscle?): loss='cauchy' gives them less weight."
    if lack_of_fit < _IMPROBABLE:
        return (
            "The residuals change with the pose as no noise does: something that was taken as known is wrong, a muscle "
            "is slack, or the shoulder's centre moves."
        )
    return ""


def lack_of_fit(model: LengthModel, measured: FloatArray, found: Estimate, errors: MeasurementErrors) -> float:
    """Probability that residuals depend on the pose as much as these or more by chance (F test).

    The device is compared with a model of each limb in which (l + o)² is any linear function of 1 and the nine S_jk,
    and o a constant: what lengths would be with other joints, mountings and offsets, to first order, and more. NaN if
    there are too few lengths.
    """
    here = model.evaluate(found.values, measured)
    count, n = here.values.shape
    noise = UNIT if errors.length_noise is None else errors.length_noise
    columns = np.concatenate([np.ones((count, 1)), measured.reshape(-1, 9)], axis=1)
    smooth = np.zeros((count, n, n, 11))
    for i in range(n):
        spans = here.values[:, i] + model.length_offsets(found.values)[i]
        smooth[:, i, i] = np.column_stack([columns / spans[:, None], np.ones(count)])
    smooth = whitening(here, noise, errors.orientation_noise) @ smooth.reshape(count, n, -1)
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


def losses_differ(
    model: LengthModel,
    measured: FloatArray,
    lengths: FloatArray,
    found: Estimate,
    errors: MeasurementErrors,
    prior: FloatArray,
) -> bool:
    """Whether a loss that gives outliers next to no weight leads to another device.

    The Huber loss bounds the pull of an outlier, but outliers that go together, as those of a slack muscle do, still
    pull the device to themselves.
    """
    firm = errors._replace(loss="cauchy")
    parts = subsets(lengths)
    others = descend(model, np.tile(found.values, (len(parts), 1)), measured, lengths, firm, prior, parts)
    scale = max(found.scale, 1e-12)
    costs = losses_of(misfits(model, others, measured, lengths, errors) / scale, "cauchy").sum(axis=(1, 2))
    change = found.jacobian @ (others[costs.argmin()] - found.values) / scale
    return bool(change @ change > OUTLIER**2 + model.size)
