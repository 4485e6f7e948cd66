"""Actuators whose strokes fit the lengths that a design needs, by family.

Which longest length serves best is chosen for each limb by itself, from a few quantiles of its lengths: the family
sets the shortest length that goes with it (:mod:`exo_pin.design.actuator_families`), and the choice is the one that
leaves the least weighted shortfall over the poses.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import MissingData
from ...core.validation import FloatArray
from ...design import Actuator, Mechanism, Stroke
from ...design.actuator_families import family_limits, fitting_stroke
from ...load_case.pose_stacks import pose_matrices
from ...reaction.constraints.actuator_limits import length_limits
from ...reaction.splits.pose_stack import limb_lengths
from ..pose_offsets import PoseOffsets
from .search_poses import Centre

#: Beyond the window of the lengths on the grid, an actuator takes this much, m, where its family allows it.
_SPARE = 0.002
#: Quantiles of a limb's lengths that are tried as its longest length.
_QUANTILES = np.array([1.0, 0.98, 0.95, 0.9, 0.85, 0.8, 0.7, 0.6, 0.5])
#: A pose outside the stroke by more than this, m, counts no more than one outside by as much.
_WORST = 0.1


def stroke_windows(
    mechanism: Mechanism, lengths: FloatArray, weights: FloatArray, is_given: ArrayLike = False
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
    is_given : array_like of bool
        Limbs that keep the stroke that they have, broadcasting to (n,).

    Raises
    ------
    MissingData
        If a limb has no actuator.
    """
    given = np.broadcast_to(is_given, mechanism.limb_count)
    windows = np.array(length_limits(mechanism)).T
    for i, limb in enumerate(mechanism.limbs):
        if limb.actuator is None:
            raise MissingData([f"actuator of limb {i + 1}"], "the fit of its stroke", mechanism.name)
        if given[i]:
            continue
        family = limb.actuator.family
        share, constant = family_limits(family)
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
    mechanism: Mechanism, lengths: FloatArray, weights: FloatArray, spare: float = 0.0, is_given: ArrayLike = False
) -> Mechanism:
    """The design with strokes by :func:`stroke_windows`.

    Parameters
    ----------
    mechanism, lengths, weights, is_given
        As there.
    spare : float
        What an actuator whose family allows it takes beyond each end of the window, m.
    """
    given, limbs = np.broadcast_to(is_given, mechanism.limb_count), []
    for i, (short, long) in enumerate(stroke_windows(mechanism, lengths, weights, given)):
        limb = mechanism.limbs[i]
        assert limb.actuator is not None
        if not given[i]:
            limb = replace(limb, stroke=_fitted(limb.actuator, short, long, spare))
        limbs.append(limb)
    return mechanism.replace(limbs=limbs)


def _fitted(actuator: Actuator, short: float, long: float, spare: float) -> Stroke:
    family, travel = actuator.family, actuator.travel_limit
    share, constant = family_limits(family)
    travel_room = np.inf if travel is None else travel
    # What is spared beyond the long end must not cost poses at the short one.
    most = min((short - constant) / share if share > 0.0 else np.inf, short + travel_room)
    longest = max(long, min(long + spare, most))
    shortest = min(max(short - spare, share * longest + constant, longest - travel_room), longest)
    return fitting_stroke(family, shortest, longest, travel)


def with_strokes(
    mechanism: Mechanism,
    weights: FloatArray,
    lengths: FloatArray,
    centres: tuple[Centre, ...],
    is_given: ArrayLike,
) -> Mechanism:
    """The design with strokes that fit the full grid of daily activities and the poses of a search.

    ``weights``, shape (N,), and ``lengths``, shape (N, n), m, are of the poses of the search; the rest is that of
    :func:`fitted_strokes`.
    """
    from ...study import adl_box

    full = adl_box(4.0, mechanism.side)
    matrices = pose_matrices(full)[1]
    each = [limb_lengths(mechanism, matrices, PoseOffsets.of(centre, full).spread(len(matrices))) for centre in centres]
    # The grid has many poses and the search few: both count alike.
    grid = len(matrices) * len(centres)
    both = np.concatenate([np.full(grid, 0.5 / grid), 0.5 * weights])
    return fitted_strokes(mechanism, np.concatenate([*each, lengths]), both, _SPARE, is_given)
