"""The share of each daily range of motion beyond the singular surface."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import as_single_rotation
from ...design import WristGeometry
from ...load_case.ranges_of_motion import (
    ADL_BOX,
    DAILY_RANGES,
    RangeOfMotion,
    Share,
    share_of_volume,
)
from .measures import locus_function

#: The locus function, of order one, is zero to rounding below this.
_SINGULAR = 1e-12


#: |det X| below which a pose of a daily range counts as close to the locus.
CLOSE = 0.05


def side_of_rest(geometry: WristGeometry) -> int:
    """Side of the singular surface of the hanging arm: the sign of det X there, 0 if that pose is singular."""
    value = float(locus_function(geometry, Rotation.identity())[0])
    return 0 if abs(value) < _SINGULAR else int(np.sign(value))


@dataclass(frozen=True, eq=False)
class RangeCrossing:
    """Shares of the volume of a range of motion on either side of the singular surface, with their errors.

    Attributes
    ----------
    range : RangeOfMotion
        The range.
    across : Share
        Share of it on the other side of the locus than the rest pose, which is not reached without a singular pose.
    close : Share
        Share with |det X| below 0.05.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> found = wrist.daily_crossings(ep.load("optimised-table-c-2").geometry, step_deg=15.0)[0]
    >>> found.range.name, bool(found.across > 0.3)
    ('daily-life box', True)
    """

    range: RangeOfMotion
    across: Share
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
        Of the grids, degrees.
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
        For other than three limbs, or a start that is singular.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> crossings = wrist.daily_crossings(ep.load("prototype").geometry, step_deg=15.0)
    >>> round(float(crossings[0].across), 1)  # of the box of daily life, beyond the singular surface
    0.4
    """
    pose = as_single_rotation("start", Rotation.identity() if start is None else start)
    here = float(locus_function(geometry, pose)[0])
    if abs(here) < _SINGULAR:
        raise InvalidInput("the start is a singular pose: it belongs to neither side")
    found = []
    for item in ranges:
        smooth, determinant = locus_function(geometry, item.poses(step_deg, side))
        sets = (np.sign(smooth) != np.sign(here), np.abs(np.nan_to_num(determinant)) < CLOSE)
        found.append(RangeCrossing(item, *(share_of_volume(member, item.axes(step_deg)) for member in sets)))
    return found
