"""Right angles that a file rounds: 1.5708 for π/2.

Plane loops whose axes are meant to be parallel are not, by as much as their angles are rounded. The loops are then
neither plane, with a redundant row, nor clearly spatial: rows across the plane that should be redundant have a singular
value as small as rounding.
"""

from __future__ import annotations

import math

from ....core.errors import InvalidInput
from ....core.validation import as_positive
from ..xml_elements import Element

#: Larger tolerances would change angles that are meant.
_LARGEST = 1e-2


def refuse_tolerance(tolerance: float) -> None:
    """Raise InvalidInput if a tolerance of right angles is not from 0 to 0.01 rad."""
    if as_positive("right_angle_tolerance", tolerance, zero=True) > _LARGEST:
        raise InvalidInput(f"expected a right_angle_tolerance up to {_LARGEST:g} rad, got {tolerance}")


def exact_right_angles(root: Element, tolerance: float) -> None:
    """Replace angles near a multiple of π/2 by that multiple, in place.

    Angles are those of ``rpy`` attributes (URDF) and of ``<pose>`` in radians (SDF). Text that is no number is left for
    the reader to refuse.

    Parameters
    ----------
    root : Element
        The file, or a part of it.
    tolerance : float
        Largest change of an angle, rad, checked; with 0 nothing changes.
    """
    given = root.attributes
    if "rpy" in given:
        given["rpy"] = _rounded(given["rpy"], 0, 3, tolerance)
    in_degrees = given.get("degrees", "false").lower() not in ("false", "0")
    if root.tag == "pose" and not in_degrees and given.get("rotation_format", "euler_rpy") == "euler_rpy":
        root.text = _rounded(root.text, 3, 6, tolerance)
    for child in root.children:
        exact_right_angles(child, tolerance)


def _rounded(text: str, first: int, count: int, tolerance: float) -> str:
    """A text of ``count`` words, those from ``first`` on as exact right angles."""
    words = text.split()
    if len(words) != count:
        return text
    found = words.copy()
    try:
        for k in range(first, count):
            angle = float(words[k])
            right = round(angle / (math.pi / 2)) * (math.pi / 2)
            if 0.0 < abs(right - angle) <= tolerance:
                found[k] = repr(right)
    except (ValueError, OverflowError):
        return text
    return text if found == words else " ".join(found)
