"""How the efforts of a device share what it holds: the wearer least, then the drives, then the brakes.

In each pose equilibrium is A f + w = m, with a row for each motion that drives or brakes hold; w, in the three rows of
the arm's turns, is the wearer's moment where they cannot hold the arm alone. Chosen are, in this order,

1. the least w: no drive is spared at the wearer's expense;
2. efforts f of least sum of squares. Where drives have one unit these are squares of N, or of N m. Where they mix N
   and N m, each effort is divided by the larger magnitude of its limits; where a limit is not known, squares of N and
   N m are added as they are, and the answer says so. A brake's effort is a reaction: before it is squared it counts a
   thousandth of a drive's, so that a drive is spared wherever a brake within its limit can do the work.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.validation import FloatArray
from .constraints.actuator_limits import depend_on_length, stroke_limits

#: What a unit of a brake's effort counts beside one of a drive.
_OF_BRAKES = 1e-3
#: Share of the greatest limit that counts for a drive that gives nothing.
_NOTHING = 1e-6
#: Moment of the wearer in a pose that still counts as held by the device, over m g |c|, the greatest moment of the
#: arm's weight. A centre of mass that is off by as much of its distance, 0.3 mm, makes it; none is known so well.
UNFELT = 1e-3


class EffortSharing(NamedTuple):
    """By what the efforts of a device are chosen among those in equilibrium.

    Attributes
    ----------
    scales : ndarray or None
        What each effort is divided by, shape (p,), the largest of the drives' 1; None where all count alike.
    unknown : tuple of str
        Drives that have no limit to divide by, although the units mix.
    wearer : ndarray of bool or None
        Components that are the wearer's moment, shape (p,); None where the device holds the arm.
    """

    scales: FloatArray | None
    unknown: tuple[str, ...]
    wearer: NDArray[np.bool_] | None

    @property
    def words(self) -> str:
        """What goes before and after "least sum of squares", in words; empty where nothing does."""
        words = "" if self.scales is None else ", each effort over its greatest limit"
        return words if self.wearer is None else f"{words}, after the wearer's least moment"


@lru_cache(maxsize=256)
def sharing_of(device: Any) -> EffortSharing:
    """Of a device whose efforts are drives, brakes and, at the end, the wearer's moments."""
    p, drives, held = device.limb_count, len(device.drives), len(device.efforts)
    wearer = None if p == held else np.arange(p) >= held
    scales, unknown = np.ones(p), ()
    if len({device.unit_of(drive) for drive in device.drives}) > 1:
        ends = [drive.effort_range for drive in device.drives]
        known = stroke_limits(device) if depend_on_length(device) else np.array(ends).T
        size = np.nan_to_num(np.abs(known), nan=0.0, posinf=0.0).max(axis=0)[:drives]
        lacking = (size == 0.0) & ~(np.array(ends) == 0.0).all(axis=1)
        unknown = tuple(drive.name for drive, lacks in zip(device.drives, lacking, strict=True) if lacks)
        if not unknown and size.max() > 0.0:
            scales[:drives] = np.maximum(size / size.max(), _NOTHING)
    scales[drives:held] = 1.0 / _OF_BRAKES
    return EffortSharing(None if (scales == 1.0).all() else scales, unknown, wearer)
