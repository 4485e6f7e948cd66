"""The share of each daily range of motion beyond the singular surface."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors.checked import checked
from ...design import WristGeometry
from ...load_case.ranges_of_motion import ADL_BOX, DAILY_RANGES, RangeOfMotion, Share, share_of_volume
from .singular_curves import locus_function
from .singularity_free_region import free_region

#: |det X| below which a pose of a daily range counts as close to the locus.
CLOSE = 0.05


@dataclass(frozen=True, eq=False)
class RangeCrossing:
    """Shares of the volume of a range of motion on either side of the singular surface, with their errors.

    Attributes
    ----------
    range : RangeOfMotion
        The range.
    across : Share
        Share of it on the other side of the locus than the rest pose.
    unreachable : Share
        Share that cannot be reached from rest without passing a singular pose; at least ``across``.
    close : Share
        Share with |det X| below 0.05.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> found = wrist.daily_crossings(ep.load("optimised-table-c-2").geometry, step_deg=15.0)[0]
    >>> found.range.name, bool(found.unreachable >= found.across)
    ('daily-life box', True)
    """

    range: RangeOfMotion
    across: Share
    unreachable: Share
    close: Share


@checked
def daily_crossings(
    geometry: WristGeometry,
    ranges: Iterable[RangeOfMotion] = (ADL_BOX, *DAILY_RANGES),
    step_deg: float = 5.0,
    side: str = "left",
    start: Rotation | None = None,
) -> list[RangeCrossing]:
    """Share of each range on the other side of the singular surface than the rest pose.

    Parameters
    ----------
    geometry : WristGeometry
        Three limbs.
    ranges : iterable of RangeOfMotion
        The ranges.
    step_deg : float
        Of the grids, degrees; must divide 90.
    side : {"left", "right"}
        Side of the body.
    start : Rotation, optional
        The rest pose; the hanging arm if left out.

    Returns
    -------
    list of RangeCrossing

    Raises
    ------
    InvalidInput
        As :func:`free_region`.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> crossings = wrist.daily_crossings(ep.load("prototype").geometry, step_deg=15.0)
    >>> round(float(crossings[0].across), 1)  # of the box of daily life, beyond the singular surface
    0.4
    """
    region = free_region(geometry, start, step_deg, side)
    found = []
    for item in ranges:
        poses = item.poses(step_deg, side)
        smooth, determinant = locus_function(geometry, poses)
        sets = (np.sign(smooth) != region.sign, ~region.contains(poses), np.abs(np.nan_to_num(determinant)) < CLOSE)
        found.append(RangeCrossing(item, *(share_of_volume(member, item.axes(step_deg)) for member in sets)))
    return found
