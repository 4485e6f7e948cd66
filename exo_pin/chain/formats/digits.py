"""Numbers of files as they are rounded: right angles, decimals, and how exactly loops are known by them.

Right angles that a file rounds: 1.5708 for π/2.

Plane loops whose axes are meant to be parallel are not, by as much as their angles are rounded. The loops are then
neither plane, with a redundant row, nor clearly spatial: rows across the plane that should be redundant have a singular
value as small as rounding.

The numbers of a file's geometry as they are written, and other numbers that would have been written so.

How well a file knows its robot's geometry: by the digits of its numbers.

A CAD export has 4 to 8 decimals everywhere. Loops whose rows agree in the exact mechanism then agree within the
rounding only, and would lock it. Such a file has a tolerance of half a unit of its last decimal, or of a right angle's
that it rounds further, 1.5708. It counts where it makes a difference: where rows of the loops agree within it, and not
exactly, where the loops close within it and not otherwise, or where the drawn configuration is singular within it.

Which rows agree is measured: the robot is built again from numbers that would have been written with the same digits,
and a singular value that the digits explain is zero (:mod:`exo_pin.chain.kinematics.structural_rank`). Where the
tolerance, which is for the worst chain, decides otherwise, the smaller one is taken that explains what was measured.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np
import pinocchio as pin

from ...core.errors import ExoPinError, InvalidInput, LoopNotClosed
from ...core.validation import FloatArray, as_positive
from ..kinematics.closing import close, reference_configuration
from ..kinematics.mobility import mobility
from ..kinematics.structural_rank import Agreement, agreeing_rows, measured_agreement
from ..structure.chain_state import ChainState
from ..structure.description import Closures
from ..structure.frames import Placement
from .leaving_out import entry
from .xml_elements import Element

#: Larger tolerances would change angles that are meant.
_LARGEST = 1e-2


#: Attributes of URDF and MJCF that are places and directions.
_GEOMETRY = frozenset(
    ("xyz", "rpy", "quat_xyzw", "pos", "quat", "euler", "axis", "axisangle", "xyaxes", "zaxis", "anchor", "relpose")
)
#: Elements of MJCF, and those of URDF and MJCF that place no joint.
_UNPLACED = frozenset(("inertial", "visual", "collision", "geom", "camera", "light", "asset", "visual", "site"))
#: Elements of SDF whose text is a place or direction.
_TEXTS = ("pose", "xyz")
#: Fewer decimals, or fewer digits in every number with as many decimals, are exact numbers; more are doubles.
FEWEST, MOST = 4, 12
#: Number of geometries with the same digits.
_REDRAWN = 16


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
    try:
        for k, angle in enumerate(map(float, words[first:]), first):
            right = round(angle / (math.pi / 2)) * (math.pi / 2)
            words[k] = repr(right) if 0.0 < abs(right - angle) <= tolerance else words[k]
    except (ValueError, OverflowError):
        return text
    return " ".join(words)


def geometry_words(root: Element) -> Iterator[str]:
    """The numbers of attributes of a URDF or MJCF that are places and directions, as written."""
    waiting = [root]
    while waiting:
        element = waiting.pop()
        for key, text in element.attributes.items():
            if key in _GEOMETRY:
                yield from text.split()
        waiting += (child for child in element.children if child.tag not in _UNPLACED)


def pose_words(part: Element) -> Iterator[str]:
    """The numbers of the pose and the axes of a link, joint or frame of SDF, and of nothing else in it."""
    for element in (part, *part.all("axis"), *part.all("axis2")):
        yield from (word for tag in _TEXTS for child in element.all(tag) for word in child.text.split())


def closure_words(closures: Closures) -> Iterator[str]:
    """The rounded numbers of the points of closures; their quaternions are normalised."""
    for closure in closures.closures:
        for place in (closure.placement_a, closure.placement_b):
            words = map(repr, place.translation)
            yield from (word for word in words if decimals(word) <= MOST)


def rounding_of(words: Iterable[str]) -> float:
    """Half a unit of the last decimal of rounded numbers, m and rad; 0 for exact ones.

    A small robot's 0.0003 m is as exact as a large one's 0.3 m: one number at least has four digits after its zeros.
    """
    most, right, figures = 0, MOST, 0
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
        if count >= FEWEST:
            figures = max(figures, len(word.lower().partition("e")[0].lstrip("+-").replace(".", "").strip("0")))
        if turns and count >= FEWEST and abs(value - turns * 0.5 * math.pi) <= 0.5 * 10.0**-count:
            right = min(right, count)
    return 0.5 * 10.0 ** -min(most, right) if FEWEST <= most <= MOST and figures >= FEWEST else 0.0


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
        text = self.text(root.text) if root.tag in _TEXTS else root.text
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


def with_digits(
    model: pin.Model, closures: Closures, words: Iterable[str], again: Callable[[Redrawn], tuple[pin.Model, Closures]]
) -> Closures:
    """The closures with the tolerance of the digits of their geometry, if it makes a difference.

    Parameters
    ----------
    model : pinocchio.Model
        The tree.
    closures : Closures
        Its loops, with a tolerance only if a file states it.
    words : iterable of str
        The numbers of the geometry as written.
    again : callable
        Builds tree and loops from a geometry with the same digits.
    """
    tolerance = rounding_of(words)
    if closures.tolerance or not tolerance or not closures.rows:
        return closures
    rounded = replace(closures, tolerance=tolerance)
    state = ChainState(model, rounded)
    q = _closed(state)
    if q is None:
        return closures
    worst, known = agreeing_rows(state, q), f"places are known to {tolerance:.0e} m and rad"
    measured = (
        None
        if worst == (0, 0.0)
        else _measured(ChainState(model, closures), q, lambda seed: again(Redrawn(seed, tolerance)), state.tolerance)
    )
    closes = _closed(ChainState(model, closures)) is not None
    if worst != (0, 0.0) and measured is None:
        said, read = f"{known}, which leaves open whether rows of the loops agree", rounded
        if closes:
            said, read = f"{said}: read as they stand", replace(closures, rounding=tolerance)
        return replace(read, left_out=(*closures.left_out, entry("digits", said)))
    finer = (
        rounded if measured is None else replace(closures, tolerance=min(measured.tolerance or tolerance, tolerance))
    )
    if measured is not None and measured.rows:
        if worst is None or worst[0] != measured.rows:
            rounded = finer
        reason = f"of the loops' rows {measured.rows} agree with others to {measured.size:.0e}"
    elif not closes:
        reason = "the loops close no better"
        rounded = finer
    elif mobility(ChainState(model, finer), q).kinds:
        reason = "the drawn configuration is singular within them"
        rounded = finer if worst is None else rounded
    else:
        return replace(closures, rounding=finer.tolerance)
    return replace(rounded, left_out=(*closures.left_out, entry("digits", f"{known}, and {reason}")))


def _measured(
    state: ChainState, q: FloatArray, again: Callable[[int], tuple[pin.Model, Closures]], tolerance: float
) -> Agreement | None:
    """Which rows agree by the digits; None where that is not clear, or other digits make another chain."""
    try:
        others = [ChainState(*again(seed)) for seed in range(_REDRAWN)]
    except ExoPinError:
        return None
    if any((other.nv, other.row_count) != (state.nv, state.row_count) for other in others):
        return None
    return measured_agreement(state, others, q, tolerance)


def _closed(state: ChainState) -> FloatArray | None:
    """A closed configuration, None if there is none near the file's."""
    try:
        return close(state, reference_configuration(state))
    except LoopNotClosed:
        return None
