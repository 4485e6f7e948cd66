"""Actuators whose strokes fit the lengths that a design needs, by family.

Which longest length serves best is chosen for each limb by itself, from a few quantiles of its lengths: the family
sets the shortest length that goes with it (:mod:`exo_pin.design.actuator_families`), and the choice is the one that
leaves the least weighted shortfall over the poses.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.errors import MissingData
from ...core.validation import FloatArray
from ...design import Actuator, Mechanism, Stroke
from ...design.actuator_families import family_limits, fitting_stroke, least_length
from ...reaction.constraints.actuator_limits import length_limits

__all__ = ["FitOptions", "fitted_strokes", "stroke_windows", "window_margin"]

#: Quantiles of a limb's lengths that are tried as its longest length.
_QUANTILES = np.array([1.0, 0.98, 0.95, 0.9, 0.85, 0.8, 0.7, 0.6, 0.5])
#: A pose outside the stroke by more than this, m, counts no more than one outside by as much.
_WORST = 0.1


class FitOptions(NamedTuple):
    """How the strokes of n limbs are fitted.

    Attributes
    ----------
    is_given : ndarray of bool
        Shape (n,): limbs that keep the stroke that they have.
    end_fittings : tuple of float or None
        One a limb, m; None for what the family needs.
    """

    is_given: NDArray[np.bool_]
    end_fittings: tuple[float | None, ...]

    @classmethod
    def of_family(cls, mechanism: Mechanism) -> FitOptions:
        """All limbs fitted, with the end fittings of their families."""
        n = mechanism.limb_count
        return cls(np.zeros(n, dtype=bool), (None,) * n)


def stroke_windows(
    mechanism: Mechanism, lengths: FloatArray, weights: FloatArray, options: FitOptions | None = None
) -> FloatArray:
    """Shortest and longest length that each limb's actuator should take, shape (n, 2), m.

    Parameters
    ----------
    mechanism : Mechanism
        Whose limbs name the families of their actuators.
    lengths : ndarray
        l_i over the poses, shape (N, n), m.
    weights : ndarray
        Of the poses, shape (N,).
    options : FitOptions, optional
        :meth:`FitOptions.of_family` if left out.

    Raises
    ------
    MissingData
        If a limb has no actuator.
    """
    given, fittings = FitOptions.of_family(mechanism) if options is None else options
    windows = np.stack(length_limits(mechanism), axis=-1)
    for i, limb in enumerate(mechanism.limbs):
        if limb.actuator is None:
            raise MissingData([f"actuator of limb {i + 1}"], "the fit of its stroke", mechanism.name)
        if given[i]:
            continue
        family = limb.actuator.family
        share, constant = family_limits(family, least_length(family, fittings[i]))
        column = lengths[:, i]
        ends = np.sort(column)[np.rint(_QUANTILES * (len(column) - 1)).astype(int)]
        starts = np.maximum(share * ends + constant, column.min())
        if limb.actuator.travel_limit is not None:
            starts = np.maximum(starts, ends - limb.actuator.travel_limit)
        outside = np.maximum(np.maximum(starts[:, None] - column, column - ends[:, None]), 0.0)
        cost = (weights * (np.minimum(outside, _WORST) / _WORST + (outside > 0.0))).sum(axis=1)
        best = int(cost.argmin())
        windows[i] = starts[best], max(ends[best], starts[best])
    return windows


def window_margin(windows: FloatArray, lengths: FloatArray) -> FloatArray:
    """Distance of the lengths, shape (N, n), to the ends of the windows, shape (N,), m; negative outside."""
    return np.minimum(lengths - windows[:, 0], windows[:, 1] - lengths).min(axis=1)


def fitted_strokes(
    mechanism: Mechanism,
    lengths: FloatArray,
    weights: FloatArray,
    spare: float = 0.0,
    options: FitOptions | None = None,
) -> Mechanism:
    """The design with strokes by :func:`stroke_windows`.

    Parameters
    ----------
    mechanism, lengths, weights
        As there.
    spare : float
        What an actuator whose family allows it takes beyond each end of the window, m.
    options : FitOptions, optional
        :meth:`FitOptions.of_family` if left out.
    """
    options = FitOptions.of_family(mechanism) if options is None else options
    limbs = []
    for i, (short, long) in enumerate(stroke_windows(mechanism, lengths, weights, options)):
        limb = mechanism.limbs[i]
        assert limb.actuator is not None
        if not options.is_given[i]:
            limb = replace(limb, stroke=_fitted(limb.actuator, short, long, spare, options.end_fittings[i]))
        limbs.append(limb)
    return mechanism.replace(limbs=limbs)


def _fitted(actuator: Actuator, short: float, long: float, spare: float, end_fitting: float | None) -> Stroke:
    family, travel = actuator.family, actuator.travel_limit
    least = least_length(family, end_fitting)
    share, constant = family_limits(family, least)
    travel_room = np.inf if travel is None else travel
    # What is spared beyond the long end must not cost poses at the short one.
    most = min((short - constant) / share if share > 0.0 else np.inf, short + travel_room)
    longest = max(long, min(long + spare, most))
    shortest = min(max(short - spare, share * longest + constant, longest - travel_room), longest)
    if family == "pneumatic muscle" or end_fitting is None:
        return fitting_stroke(family, shortest, longest, least, travel)
    # The actuator without the fitting, so that its nominal length is its own.
    own = fitting_stroke(family, shortest - end_fitting, longest - end_fitting, None, travel)
    return replace(own, end_fitting=(own.end_fitting or 0.0) + end_fitting)
