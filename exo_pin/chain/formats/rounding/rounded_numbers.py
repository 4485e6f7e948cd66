"""The numbers of a file's geometry as they are written, and other numbers that would have been written so."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from ...structure.description import Closures
from ...structure.frames import Placement
from ..xml_elements import Element

__all__ = ["closure_words", "decimals", "geometry_words", "pose_words", "rounding_of"]

#: Attributes of URDF and MJCF that are places and directions.
_GEOMETRY = frozenset(
    ("xyz", "rpy", "quat_xyzw", "pos", "quat", "euler", "axis", "axisangle", "xyaxes", "zaxis", "anchor", "relpose")
)
#: Elements of MJCF, and those of URDF and MJCF that place no joint.
_UNPLACED = frozenset(("inertial", "visual", "collision", "geom", "camera", "light", "asset", "visual", "site"))
#: Fewer decimals are exact numbers, more are doubles.
FEWEST, MOST = 4, 12


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
            yield from (word for word in words if decimals(word) <= MOST)


def rounding_of(words: Iterable[str]) -> float:
    """Half a unit of the last decimal of rounded numbers, m and rad; 0 for exact ones."""
    most, right = 0, MOST
    for word in words:
        try:
            value, count = float(word), decimals(word)
            quarter = value / (0.5 * math.pi)
            turns = round(quarter)
        except (ValueError, OverflowError):
            continue
        if turns and abs(quarter - turns) < 1e-14:
            continue
        most = max(most, count)
        if turns and count >= FEWEST and abs(value - turns * 0.5 * math.pi) <= 0.5 * 10.0**-count:
            right = min(right, count)
    return 0.5 * 10.0 ** -min(most, right) if FEWEST <= most <= MOST else 0.0


def decimals(word: str) -> int:
    """Decimals of a number as it is written, less its trailing zeros."""
    mantissa, _, exponent = word.lower().partition("e")
    fraction = mantissa.partition(".")[2].rstrip("0")
    return max(len(fraction) - int(exponent or 0), 0)


class Redrawn:
    """One geometry of those that would have been written with the same digits.

    Every number of 4 to 12 decimals is moved by up to half a unit of its last one. Equal numbers are moved alike, and
    opposite ones oppositely, because they are rounded alike: axes that are parallel in the file stay so. Multiples of a
    right angle that are exact to the last digit of a double, shorter numbers and longer ones are exact. Only where the
    file has no more than 4 decimals are numbers of 3 moved as if a zero were left out: one of ten loses its last digit
    so, and Pinocchio's, MuJoCo's and Python's writers leave it out.

    Parameters
    ----------
    seed : int
        Of the random numbers.
    rounding : float
        Of the file, see :func:`rounding_of`.

    Attributes
    ----------
    rng : numpy.random.Generator
        The random numbers.
    """

    def __init__(self, seed: int, rounding: float = 0.0) -> None:
        self._fewest = FEWEST - 1 if rounding >= 0.5 * 10.0**-FEWEST else FEWEST
        self.rng, self._moves = np.random.default_rng(seed), dict[tuple[float, int], float]()

    def number(self, word: str) -> str:
        """A number as written, moved."""
        try:
            value, count = float(word), decimals(word)
        except ValueError:
            return word
        if not self._fewest <= count <= MOST:
            return word
        count = max(count, FEWEST)
        key = abs(value), count
        if key not in self._moves:
            self._moves[key] = self.rng.uniform(-0.5, 0.5) * 10.0**-count
        return repr(value + self._moves[key] * math.copysign(1.0, value))

    def text(self, text: str) -> str:
        """Numbers of a text; four at its end that make a quaternion make one again."""
        words = text.split()
        moved = [self.number(word) for word in words]
        if len(words) in (4, 7) and moved != words:
            end = np.array([float(word) for word in moved[-4:]])
            moved[-4:] = map(repr, (end / np.linalg.norm(end)).tolist())
        return " ".join(moved)

    def element(self, root: Element) -> Element:
        """A copy of a URDF, SDF or a part of it with its places and directions moved."""
        given = {key: self.text(text) if key in _GEOMETRY else text for key, text in root.attributes.items()}
        text = self.text(root.text) if root.tag in ("pose", "xyz") else root.text
        children = [child if child.tag in _UNPLACED else self.element(child) for child in root.children]
        return replace(root, attributes=given, children=children, text=text)

    def closures(self, described: Closures) -> Closures:
        """Closures with their points moved."""

        def moved(place: Placement) -> Placement:
            parts = (place.translation, place.quaternion)
            texts = (self.text(" ".join(map(repr, part))) for part in parts)
            return Placement(*(tuple(map(float, text.split())) for text in texts))  # type: ignore[arg-type]

        return replace(
            described,
            closures=tuple(
                replace(each, placement_a=moved(each.placement_a), placement_b=moved(each.placement_b))
                for each in described.closures
            ),
        )
