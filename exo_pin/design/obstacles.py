"""What stands about a person and limbs must keep clear of: chair, wheelchair, car seat, bed, door, limits of a frame.

Each obstacle is a list of capsules about the shoulder's centre, like the body. A plane is a sphere of 1 km radius, flat
to 0.2 mm within 0.6 m.

Sizes: a chair's seat is 455 mm wide and 405 mm deep, its back 420 mm and its arm rests 230 mm above the seat; a
wheelchair is 660 mm wide, with seat, arm rests and handles at 485, 760 and 915 mm (ADA Standards, figure A3); a passage
is 815 mm wide. The shoulder sits at sitting height (:mod:`.body_dimensions`) less 0.182 of stature above the seat, and
0.288 of it above the hip (Drillis and Contini). A car's head restraint ends up to 830 mm above the hip (GTR 7, proposal
GRSP/2019/5) and is at most 55 mm behind the head (72 Fed. Reg. 25484, 2007).

Assumptions: the person leans on the back with the rear of chest or belly, whichever is farther back; a chair's back is
30 mm thick, arm rests are rods of 50 mm and reach over two thirds of the seat, a wheelchair's handles 100 mm behind its
back; a car's seat is as wide as a chair's, its back ends at the shoulder and its restraint is as wide as the head, and
its door and middle are left out; the bed is a plane behind the back. Hard: nothing gives way.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..core.errors import InvalidInput, UnknownName
from ..core.errors.checked import checked
from ..core.validation import FloatArray, require_type
from .wearer import Wearer

#: Radius of a sphere that stands for a plane, m.
_FLAT = 1e3
#: Shoulder below the top of the head and from the body's middle, shares of stature (Drillis and Contini).
_TO_TOP, _MIDDLE = 0.182, 0.129
#: Shoulder above the hip, a share of stature; a car's head restraint: its top above the hip, and behind the head, m.
_TO_HIP, _RESTRAINT, _BACKSET = 0.288, 0.830, 0.055
_THICK, _REST = 0.015, 0.025
_CHAIR = {"width": 0.455, "back": 0.420, "rests": 0.230, "depth": 0.405}
_WHEELCHAIR = {"width": 0.660, "back": 0.430, "rests": 0.275, "depth": 0.405}
_PASSAGE = 0.815


@checked
def obstacle(name: str, wearer: Wearer) -> FloatArray:
    """Capsules of an obstacle about the left shoulder of a person.

    Parameters
    ----------
    name : str
        "chair", "wheelchair", "car", "bed", "door"; "wall" and "ceiling" for planes behind the back and above the
        head, with a distance in mm after a colon, such as "wall:120".
    wearer : Wearer
        Whose back, head and sitting height.

    Returns
    -------
    ndarray
        Shape (K, 7), rows of two ends and a radius, m, base frame {O_A} (x forward, y left, z up).

    Raises
    ------
    UnknownName, InvalidInput
        If there is no such obstacle, or its distance is none.

    Examples
    --------
    >>> from exo_pin.design.obstacles import obstacle
    >>> back = obstacle("chair", ep.Wearer(1.755, 85, "male"))[0]  # a slat of the back
    >>> (1e3 * back[[0, 5]]).round()  # mm: behind the shoulder's centre, and its top below it
    array([-142., -194.])
    """
    kind, away = as_obstacle(name)
    return np.array(OBSTACLES[kind](wearer, away))


def as_obstacle(name: str) -> tuple[str, float]:
    """Kind and distance, m, of an obstacle's name; the errors are those of :func:`obstacle`."""
    require_type("obstacle", name, str)
    kind, _, distance = name.partition(":")
    if kind not in OBSTACLES:
        raise UnknownName("obstacle", kind, OBSTACLES)
    try:
        away = 1e-3 * float(distance or 0.0)
    except ValueError:
        away = np.nan
    if not 0.0 <= away < 10.0:
        raise InvalidInput(f"expected a distance in mm after {kind}:, such as {kind}:120, got {name!r}")
    return kind, away


def _plane(outward: tuple[float, float, float], distance: float) -> list[float]:
    """All that lies farther than a distance from O along a direction."""
    centre = (distance + _FLAT) * np.array(outward)
    return [*centre, *centre, _FLAT]


def _back(wearer: Wearer) -> float:
    """How far the back lies behind the shoulder's centre, with clothing, m."""
    sizes = wearer.dimensions()
    return 0.5 * max(sizes["chest depth"], sizes["waist depth"]) + wearer.clothing


def _wall(wearer: Wearer, away: float) -> list[list[float]]:
    return [_plane((-1.0, 0.0, 0.0), _back(wearer) + away)]


def _door(wearer: Wearer, away: float) -> list[list[float]]:
    """The person goes through the middle; ``away`` widens it on either side."""
    middle, half = _MIDDLE * wearer.height, 0.5 * _PASSAGE + away
    return [_plane((0.0, 1.0, 0.0), half - middle), _plane((0.0, -1.0, 0.0), half + middle)]


def _slats(wearer: Wearer, behind: float, half: float, low: float, top: float) -> list[list[float]]:
    """Rods side by side whose front is so far behind the shoulder."""
    x, middle = -behind - _THICK, -_MIDDLE * wearer.height
    places = np.linspace(-half + _THICK, half - _THICK, int(np.ceil(half / _THICK)))
    return [[x, middle + y, low, x, middle + y, top - _THICK, _THICK] for y in places]


def _seat(wearer: Wearer, sizes: dict[str, float], handles: float) -> list[list[float]]:
    """Back, arm rests and handles."""
    seat = _TO_TOP * wearer.height - wearer.dimensions()["sitting height"]
    back, middle, half = _back(wearer), -_MIDDLE * wearer.height, 0.5 * sizes["width"]
    rows = _slats(wearer, back, half, seat, seat + sizes["back"])
    behind, top = -back - _THICK, seat + sizes["back"] - _THICK
    height, front = seat + sizes["rests"] - _REST, behind + 2.0 / 3.0 * sizes["depth"]
    sides = (middle + half - _REST, middle - half + _REST)
    rows += [[behind, y, height, front, y, height, _REST] for y in sides]
    if handles:
        rows += [[behind, y, top, behind - handles, y, top, _THICK] for y in sides]
    return rows


def _car(wearer: Wearer, away: float) -> list[list[float]]:
    """Back and head restraint, in the frame of a trunk that leans with them."""
    sizes = wearer.dimensions()
    seat, head = _TO_TOP * wearer.height - sizes["sitting height"], sizes["head girth"] / (2.0 * np.pi)
    rows = _slats(wearer, _back(wearer), 0.5 * _CHAIR["width"], seat, 0.0)
    return rows + _slats(wearer, head + _BACKSET, head, 0.0, _RESTRAINT - _TO_HIP * wearer.height)


#: Makes the capsules of each obstacle.
OBSTACLES: dict[str, Callable[[Wearer, float], list[list[float]]]] = {
    "chair": lambda wearer, away: _seat(wearer, _CHAIR, 0.0),
    "wheelchair": lambda wearer, away: _seat(wearer, _WHEELCHAIR, 0.1),
    "car": _car,
    "bed": _wall,
    "door": _door,
    "wall": _wall,
    "ceiling": lambda wearer, away: [_plane((0.0, 0.0, 1.0), _TO_TOP * wearer.height + away)],
}
