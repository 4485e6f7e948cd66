"""How near the parts of a device come to its wearer and to one another: one record for every device, and its words.

A gap is the distance between surfaces, negative where they overlap. What touches has a gap below zero, at every door:
verdicts, :attr:`exo_pin.Reaction.clearance`, the criterion "clearance" (whose ``least_gap`` asks for more), the contact
force, comparisons and the viewer.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...core.records import Record
from ...core.tables import enumerated, limb_list
from ...core.validation import FloatArray
from ...design import Arm, Mechanism, Wearer
from .clearance import BodyShape, clearances, limb_gaps, limb_radii

#: What is not known where nobody wears the device.
NOBODY = "who wears it (worn_by, --person)"
#: So many parts are named in a sentence on a stack; of more their number is given.
_NAMED = 3


class Gaps(Record, ABC):
    """Gaps of a device in N poses.

    Attributes
    ----------
    parts : tuple of str
        Names of the P parts.
    unknown : tuple of str
        What is not known and needed for any gap, in words: whose body, which shapes; empty where gaps are known.
    left_out : tuple of str
        What is not looked at although gaps are known, in words.
    least : ndarray
        Least gap of all parts to the wearer's arm, to the torso and to one another, shape (N, 3), m; NaN where it is
        not known or the pose is not reached, infinite where there is nothing to come near.
    """

    parts: tuple[str, ...]
    unknown: tuple[str, ...]
    left_out: tuple[str, ...] = ()
    #: What all parts are called, and one of them beside another.
    plural, another = "limbs", "another limb"

    @cached_property
    @abstractmethod
    def least(self) -> FloatArray:
        """See the class."""

    @abstractmethod
    def each(self, rows: NDArray[np.intp]) -> FloatArray:
        """Least gaps of each part over some of the poses, shape (P, 3), m, in the order of :attr:`least`."""

    @property
    def beside(self) -> str:
        """What else does not fit the wearer, as a sentence; empty for nothing."""
        return ""

    @property
    def words(self) -> str:
        """A sentence on what passes through what, and :attr:`beside`; empty where nothing is known to."""
        return " ".join(text for text in (self._through(), self.beside) if text)

    def _through(self) -> str:
        touched = (self.least < 0.0).any(axis=1)
        rows = np.flatnonzero(touched)
        if not rows.size:
            return ""
        places = ("the wearer's arm", "the wearer's torso", self.another)
        if len(self.least) == 1:
            each = self.each(rows)
            found = [
                f"{self.parts[part]} passes through {places[k]} ({depth(each[part, k])} deep)"
                for part, k in np.argwhere(each < 0.0).tolist()
            ]
            return f"As it is worn, {', '.join(found)}."
        gaps = self.least[rows]
        through = " or ".join(place for place, gap in zip(places, gaps.min(axis=0), strict=True) if gap < 0.0)
        share = f"In {rows.size} of {len(self.least)} poses {self._subject(rows)} {through}"
        return f"{share}, by up to {depth(gaps.min())}."

    def _subject(self, rows: NDArray[np.intp]) -> str:
        """Which parts pass through something in some of the poses, with the verb."""
        return f"{self.plural} pass through"


class LimbGaps(Gaps):
    """Gaps of a wrist: each limb is a capsule between its joints, with the radius of its actuator's family.

    Parameters
    ----------
    mechanism : Mechanism
        The wrist.
    matrices : ndarray
        Orientations of the arm, shape (N, 3, 3).
    offset : tuple of ndarray, optional
        Where its centre lies from the shoulder's, held by the base and carried by the cuff, shape (N, 3) or (1, 3)
        each, m.
    body : BodyShape, optional
        What to keep clear of; that of who wears it if left out.
    radius : float, optional
        Of all limbs, m.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        matrices: FloatArray,
        offset: tuple[FloatArray, FloatArray] | None = None,
        body: BodyShape | None = None,
        radius: float | None = None,
    ) -> None:
        self._mechanism, self._matrices, self._offset = mechanism, matrices, offset
        self._body = own_body(mechanism.arm, mechanism.side) if body is None else body
        self._radii = limb_radii(mechanism, radius)
        self.parts = tuple(f"limb {i + 1}" for i in range(mechanism.limb_count))
        bare = [int(i) + 1 for i in np.flatnonzero(np.isnan(self._radii))]
        self.unknown = (NOBODY,) if self._body is None else ()
        if bare:
            self.unknown += (f"radius of {limb_list(bare)} (family of the actuator, or limb_radius)",)

    @cached_property
    def least(self) -> FloatArray:
        """See :class:`Gaps`."""
        if self.unknown or self._body is None:
            return np.full((len(self._matrices), 3), np.nan)
        points = self._mechanism.geometry
        places = points.base_points, points.platform_points
        return clearances(self._matrices, *places, self._radii, self._body, self._offset)

    def each(self, rows: NDArray[np.intp]) -> FloatArray:
        """See :class:`Gaps`."""
        if self.unknown or self._body is None:
            return np.full((len(self.parts), 3), np.nan)
        offset = None
        if self._offset is not None:
            base, cuff = self._offset
            offset = (base, cuff) if len(base) == 1 else (base[rows], cuff[rows])
        return limb_gaps(self._matrices[rows], self._mechanism, self._radii, self._body, offset)

    @property
    def beside(self) -> str:
        """Joints beyond the elbow of who wears it."""
        return beyond_own_elbow(self._mechanism.geometry.platform_points, self._mechanism.arm)


def own_body(arm: Arm | None, side: str) -> BodyShape | None:
    """The body of the person whose arm this is; None where that is not known."""
    return None if arm is None or arm.wearer is None else BodyShape.of(arm.wearer, side)


def beyond_own_elbow(points: FloatArray, arm: Arm | None) -> str:
    """Which joints on an arm lie beyond the elbow of whose it is, as a sentence; empty for none."""
    found = beyond_elbow(points, () if arm is None or arm.wearer is None else (arm.wearer,))
    return f"{found}." if found else ""


def beyond_elbow(points: FloatArray, wearers: tuple[Wearer, ...]) -> str:
    """Which joints, shape (n, 3), m, {O_B}, lie where the shortest upper arm has ended, in words; empty for none."""
    if not wearers:
        return ""
    beyond = -points[:, 2] - min(wearer.upper_arm_length for wearer in wearers)
    count = int((beyond > 0.0).sum())
    if not count:
        return ""
    joints = f"{count} of {len(beyond)} joints on the upper arm {'lies' if count == 1 else 'lie'}"
    return f"{joints} beyond the wearer's elbow, by up to {depth(-beyond.max())}"


def named(parts: list[str], plural: str) -> str:
    """Parts that pass through something, with the verb: by name, or of many how many."""
    who = enumerated(parts) if len(parts) <= _NAMED else f"{len(parts)} {plural}"
    return f"{who} {'passes' if len(parts) == 1 else 'pass'} through"


def depth(gap: float) -> str:
    """How deep a gap below zero is, in words."""
    return f"{-1e3 * gap:.2g} mm" if gap > -0.01 else f"{-1e3 * gap:.0f} mm"
