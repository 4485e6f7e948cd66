"""Actuators whose strokes fit the lengths that a design needs, by family.

Which longest length serves best is chosen for each limb by itself, from a few quantiles of its lengths: the family
sets the shortest length that goes with it (:mod:`exo_pin.design.actuator_families`), and the choice is the one that
leaves the least weighted shortfall over the poses.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...core.errors import MissingData
from ...core.validation import FloatArray
from ...design import Mechanism
from ...design.actuator_families import family_limits, fitting_stroke

__all__ = ["fitted_strokes", "stroke_windows", "window_margin"]

#: Quantiles of a limb's lengths that are tried as its longest length.
_QUANTILES = np.array([1.0, 0.98, 0.95, 0.9, 0.85, 0.8, 0.7, 0.6, 0.5])
#: A pose outside the stroke by more than this, m, counts no more than one outside by as much.
_WORST = 0.1


def stroke_windows(mechanism: Mechanism, lengths: FloatArray, weights: FloatArray) -> FloatArray:
    """Shortest and longest length that each limb's actuator should take, shape (n, 2), m.

    Parameters
    ----------
    mechanism : Mechanism
        Whose limbs name the families of their actuators.
    lengths : ndarray
        l_i over the poses, shape (N, n), m.
    weights : ndarray
        Of the poses, shape (N,).

    Raises
    ------
    MissingData
        If a limb has no actuator.
    """
    windows = np.empty((mechanism.limb_count, 2))
    for i, limb in enumerate(mechanism.limbs):
        if limb.actuator is None:
            raise MissingData([f"actuator of limb {i + 1}"], "the fit of its stroke", mechanism.name)
        share, constant = family_limits(limb.actuator.family)
        column = lengths[:, i]
        ends = np.sort(column)[np.rint(_QUANTILES * (len(column) - 1)).astype(int)]
        starts = np.maximum(share * ends + constant, column.min())
        outside = np.maximum(np.maximum(starts[:, None] - column, column - ends[:, None]), 0.0)
        cost = (weights * (np.minimum(outside, _WORST) / _WORST + (outside > 0.0))).sum(axis=1)
        best = int(cost.argmin())
        windows[i] = starts[best], max(ends[best], starts[best])
    return windows


def window_margin(windows: FloatArray, lengths: FloatArray) -> FloatArray:
    """Distance of the lengths, shape (N, n), to the ends of the windows, shape (N,), m; negative outside."""
    return np.minimum(lengths - windows[:, 0], windows[:, 1] - lengths).min(axis=1)


def fitted_strokes(mechanism: Mechanism, lengths: FloatArray, weights: FloatArray, spare: float = 0.0) -> Mechanism:
    """The design with strokes by :func:`stroke_windows`.

    Parameters
    ----------
    mechanism, lengths, weights
        As there.
    spare : float
        What an actuator whose family allows it takes beyond each end of the window, m.
    """
    limbs = []
    for limb, (short, long) in zip(mechanism.limbs, stroke_windows(mechanism, lengths, weights), strict=True):
        assert limb.actuator is not None
        family = limb.actuator.family
        share, constant = family_limits(family)
        longest = long + spare
        shortest = max(short - spare, share * longest + constant)
        limbs.append(replace(limb, stroke=fitting_stroke(family, min(shortest, longest), longest)))
    return mechanism.replace(limbs=limbs)
