"""Right angles that a file rounds: 1.5708 for π/2.

Plane loops whose axes are meant to be parallel are not, by as much as their angles are rounded. The loops are then
neither plane, with a redundant row, nor clearly spatial: rows across the plane that should be redundant have a singular
value as small as rounding.
"""

from __future__ import annotations

import math

from ...core.errors import InvalidInput
from ...core.validation import as_positive
from .xml_elements import Element

__all__ = ["exact_right_angles", "refuse_tolerance"]

#: Larger tolerances would change angles that are meant.
_LARGEST = 1e-2


def refuse_tolerance(tolerance: float) -> None:
    """Raise InvalidInput if a tolerance of right angles is not from 0 to 0.01 rad."""
    if as_positive("right_angle_tolerance", tolerance, zero=True) > _LARGEST:
        raise InvalidInput(f"expected a right_angle_tolerance up to {_LARGEST:g} rad, got {tolerance}")


def exact_right_angles(root: Element, tolerance: float) -> int:
    """Replace angles near a multiple of π/2 by that multiple, in place, and return their number.

    Angles are those of ``rpy`` attributes (URDF) and of ``<pose>`` in radians (SDF). Text that is no number is left for
    the reader to refuse.

    Parameters
    ----------
    root : Element
        The file.
    tolerance : float
        Largest change of an angle, rad, checked; with 0 nothing changes.
    """
    return _exact(root, tolerance) if tolerance else 0


def _exact(element: Element, tolerance: float) -> int:
    changed = 0
    given = element.attributes
    if "rpy" in given:
        given["rpy"], changed = _rounded(given["rpy"], 0, 3, tolerance)
    in_degrees = given.get("degrees", "false").lower() not in ("false", "0")
    if element.tag == "pose" and not in_degrees and given.get("rotation_format", "euler_rpy") == "euler_rpy":
        element.text, changed = _rounded(element.text, 3, 6, tolerance)
    return changed + sum(_exact(child, tolerance) for child in element.children)


def _rounded(text: str, first: int, count: int, tolerance: float) -> tuple[str, int]:
    """Words of a text, those from ``first`` on as exact right angles, and how many have changed."""
    words = text.split()
    if len(words) != count:
        return text, 0
    changed = 0
    for k in range(first, count):
        try:
            angle = float(words[k])
        except ValueError:
            return text, 0
        if not math.isfinite(angle):
            return text, 0
        exact = round(angle / (math.pi / 2)) * (math.pi / 2)
        if exact != angle and abs(exact - angle) <= tolerance:
            words[k], changed = repr(exact), changed + 1
    return (" ".join(words), changed) if changed else (text, 0)
