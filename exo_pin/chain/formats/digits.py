"""How well a file knows its robot's geometry: by the digits of its numbers.

A CAD export has 4 to 8 decimals everywhere. Loops whose rows agree in the exact mechanism then agree within the
rounding only, and would lock it. Such a file has a tolerance of half a unit of its last decimal, or of a right angle's
that it rounds further, 1.5708. It counts where it makes a difference: where rows of the loops agree within it, and not
exactly, or where the loops close within it and not otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace

import pinocchio as pin

from ...core.errors import LoopNotClosed
from ...core.validation import FloatArray
from ..kinematics.closing import NOTHING_HELD, nearest_closed, reference_configuration
from ..kinematics.structural_rank import agreeing_rows
from ..structure.chain_state import ChainState
from ..structure.description import Closures
from .xml_elements import Element

__all__ = ["closure_words", "geometry_words", "pose_words", "with_digits"]

#: Attributes of URDF and MJCF that are places and directions.
_GEOMETRY = frozenset(
    ("xyz", "rpy", "quat_xyzw", "pos", "quat", "euler", "axis", "axisangle", "xyaxes", "zaxis", "anchor", "relpose")
)
#: Elements of MJCF, and those of URDF and MJCF that place no joint.
_UNPLACED = frozenset(("inertial", "visual", "collision", "geom", "camera", "light", "asset", "visual", "site"))
#: Fewer decimals are exact numbers, more are doubles.
_FEWEST, _MOST = 4, 12
#: Steps and restarts of closing the loops.
_STEPS, _RESTARTS = 60, 2


def geometry_words(root: Element) -> Iterator[str]:
    """The numbers of a file that are places and directions, as written."""
    waiting = [root]
    while waiting:
        element = waiting.pop()
        for key, text in element.attributes.items():
            if key in _GEOMETRY:
                yield from text.split()
        waiting += (child for child in element.children if child.tag not in _UNPLACED)


def pose_words(element: Element) -> Iterator[str]:
    """The numbers of a ``<pose>``, or of the ``<xyz>`` of an axis, of SDF."""
    if element.tag == "pose":
        yield from element.text.split()
    elif element.tag in ("axis", "axis2"):
        yield from (word for child in element.all("xyz") for word in child.text.split())


def closure_words(closures: Closures) -> Iterator[str]:
    """The rounded numbers of the points of closures; their quaternions are normalised."""
    for closure in closures.closures:
        for place in (closure.placement_a, closure.placement_b):
            words = map(repr, place.translation)
            yield from (word for word in words if _decimals(word) <= _MOST)


def with_digits(model: pin.Model, closures: Closures, words: Iterable[str]) -> Closures:
    """The closures with the tolerance of the digits of their geometry, if it makes a difference.

    Parameters
    ----------
    model : pinocchio.Model
        The tree.
    closures : Closures
        Its loops, with a tolerance only if a file states it.
    words : iterable of str
        The numbers of the geometry as written.
    """
    tolerance = _tolerance(words)
    if closures.tolerance or not tolerance or not closures.rows:
        return closures
    rounded = replace(closures, tolerance=tolerance)
    q = _closed(model, rounded)
    agreeing = None if q is None else agreeing_rows(ChainState(model, rounded), q)
    if agreeing is None:
        return closures
    count, size = agreeing
    if count:
        reason = f"of the loops' rows {count} agree with others to {size:.0e}"
    elif _closed(model, closures) is None:
        reason = "the loops close no better"
    else:
        return closures
    said = f"digits: places are known to {tolerance:.0e} m and rad, and {reason}"
    return replace(rounded, left_out=(*closures.left_out, said))


def _closed(model: pin.Model, closures: Closures) -> FloatArray | None:
    """A closed configuration, None if there is none near the file's."""
    state = ChainState(model, closures)
    start = reference_configuration(state)
    try:
        return nearest_closed(state, start, NOTHING_HELD, 1e-12, _STEPS, False, _RESTARTS)[0]
    except LoopNotClosed:
        return None


def _tolerance(words: Iterable[str]) -> float:
    """Half a unit of the last decimal of rounded numbers, m and rad; 0 for exact ones."""
    most, right = 0, _MOST
    for word in words:
        try:
            value, decimals = float(word), _decimals(word)
        except ValueError:
            continue
        quarter = value / (0.5 * math.pi)
        turns = round(quarter) if math.isfinite(quarter) else 0
        if turns and abs(quarter - turns) < 1e-14:
            continue
        most = max(most, decimals)
        if turns and decimals >= _FEWEST and abs(value - turns * 0.5 * math.pi) <= 0.5 * 10.0**-decimals:
            right = min(right, decimals)
    return 0.5 * 10.0 ** -min(most, right) if _FEWEST <= most <= _MOST else 0.0


def _decimals(word: str) -> int:
    """Decimals of a number as it is written, less its trailing zeros."""
    mantissa, _, exponent = word.lower().partition("e")
    fraction = mantissa.partition(".")[2].rstrip("0")
    return max(len(fraction) - int(exponent or 0), 0)
