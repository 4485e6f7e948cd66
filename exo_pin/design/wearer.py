"""Who wears a device: a person's size and posture, with the segments of the arm that follow from them.

P. de Leva, "Adjustments to Zatsiorsky-Seluyanov's segment inertia parameters", Journal of Biomechanics 29 (1996)
1223-1230. Masses are fractions of body mass, lengths are scaled with stature from the table's mean lengths,
centres of mass and radii of gyration are fractions of segment length. All come from its Table 4, because its
hand ends at the third knuckle: its fractions on another author's lengths, whose hand ends at the fingertips, would move
the arm's centre of mass by 4 cm.

The mean lengths and statures agree with other transcriptions of that table in public code: upper arm, forearm and
statures with ``DeLevaTable`` of pyomeca/biobuddy, which takes the other hand of the table, that ends at the fingertips
(187.9 and 170.1 mm); and all three lengths of both sexes, hands of 86.2 and 78.0 mm, with a further one.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, InitVar, dataclass
from typing import NamedTuple

import numpy as np

from ..core.errors import InvalidInput, OutsideHumanRange
from ..core.errors.base import warn
from ..core.errors.checked import checked
from ..core.records import Record
from ..core.validation import FloatArray, as_choice, as_count, as_finite, set_fields, set_positive
from .body_dimensions import body_dimensions

#: A payload, kg, above which it is likely that newtons were given: few hold it at arm's length.
_HEAVY = 12.0


class _Segment(NamedTuple):
    mass: float  # fraction of body mass
    length_mm: float  # mean of the sample
    centre: float  # fraction of the length, from the proximal end
    gyration: tuple[float, float, float]  # sagittal (x), transverse (y), longitudinal (z) axis


_MEAN_STATURE_MM = {"male": 1741.0, "female": 1735.0}
_SEGMENTS = {
    "male": (
        _Segment(0.0271, 281.7, 0.5772, (0.285, 0.269, 0.158)),
        _Segment(0.0162, 268.9, 0.4574, (0.276, 0.265, 0.121)),
        _Segment(0.0061, 86.2, 0.7900, (0.628, 0.513, 0.401)),
    ),
    "female": (
        _Segment(0.0255, 275.1, 0.5754, (0.278, 0.260, 0.148)),
        _Segment(0.0138, 264.3, 0.4559, (0.261, 0.257, 0.094)),
        _Segment(0.0056, 78.0, 0.7474, (0.531, 0.454, 0.335)),
    ),
}

#: 5th and 95th percentile of stature, m, and of body mass, kg: ANSUR II, 4,082 men and 1,986 women, public tables.
_SIZES = {"male": ((1.648, 1.870), (64.0, 111.0)), "female": ((1.525, 1.740), (51.0, 87.0))}
#: Correlation of stature and the logarithm of body mass, of the same tables.
_TOGETHER = {"male": 0.471, "female": 0.539}
#: Thickest clothing, m.
_THICKEST = 0.05
#: Standard deviations from the mean to the 95th percentile of a normal distribution.
_TO_95 = 1.6448536269514722

Body = tuple[float, FloatArray, FloatArray]


@checked
@dataclass(frozen=True, eq=False)
class Wearer(Record):
    """Who wears a device: size, and posture of the elbow. One record stands behind arm, body shape and figure.

    Attributes
    ----------
    height : float
        Stature, m.
    mass : float
        Body mass, kg.
    sex : {"male", "female"}
        Which half of the table of de Leva (1996).
    elbow_flexion : float
        0 for a straight arm; the forearm swings forward, to +x of {O_B}; in rad, or degrees with ``degrees=True``.
    payload : float
        A point mass at the end of the hand segment (the third knuckle), kg.
    arm_girth : float, optional
        Girth of the upper arm with tense muscles, m; by default the mean of persons of that sex, stature and mass
        (:mod:`exo_pin.design.body_dimensions`). The forearm is thicker or thinner by the same factor.
    clothing : float
        Thickness of what is worn between body and device, m.
    degrees : bool
        Whether the angle is in degrees.

    Raises
    ------
    InvalidInput
        If height or mass is outside what an adult or child has (metres and kilograms are expected).
    UnknownName
        If ``sex`` is not in the table.

    Examples
    --------
    >>> woman = ep.Wearer(1.60, 55, "female", payload=1.0)
    >>> round(float(ep.load("four-cables").worn_by(woman).arm.mass), 2)  # kg, with cuff and payload
    4.13
    """

    height: float
    mass: float
    sex: str
    _: KW_ONLY
    elbow_flexion: float = 0.0
    payload: float = 0.0
    arm_girth: float | None = None
    clothing: float = 0.0
    degrees: InitVar[bool] = False

    def __post_init__(self, degrees: bool) -> None:
        set_positive(self, "height", "mass")
        set_positive(self, "payload", "clothing", zero=True)
        set_positive(self, "arm_girth", optional=True)
        if not 0.5 <= self.height <= 2.6:
            likely = f"; did you mean {self.height / 100:g} m?" if 50.0 <= self.height <= 260.0 else ""
            raise InvalidInput(f"expected a height of 0.5 to 2.6 m, got {self.height:g}{likely}")
        if not 3.0 <= self.mass <= 400.0:
            raise InvalidInput(f"expected a body mass of 3 to 400 kg, got {self.mass:g}")
        as_choice("sex", self.sex, _SEGMENTS)
        if self.clothing > _THICKEST:
            raise InvalidInput(f"expected clothing of 0 to {_THICKEST:g} m, got {self.clothing:g} m (mm?)")
        if self.arm_girth is not None and not 0.1 <= self.arm_girth <= 0.8:
            raise InvalidInput(f"expected an arm_girth of 0.1 to 0.8 m, got {self.arm_girth:g} m")
        if self.payload > _HEAVY:
            warn(
                f"a payload of {self.payload:g} kg weighs {9.81 * self.payload:.0f} N: it is given in kg (newtons?)",
                OutsideHumanRange,
            )
        bend = float(as_finite("elbow_flexion", self.elbow_flexion, ()))
        bend = float(np.radians(bend)) if degrees else bend
        if not -0.3 <= bend <= 2.8:
            raise InvalidInput(f"expected elbow_flexion of -0.3 to 2.8 rad (-17 to 160°), got {bend:g} rad")
        set_fields(self, elbow_flexion=bend)

    @property
    def posture(self) -> dict[str, float]:
        """What another person does alike, by name: bend of the elbow, payload and clothing."""
        return {"elbow_flexion": self.elbow_flexion, "payload": self.payload, "clothing": self.clothing}

    @classmethod
    def drawn(cls, count: int, seed: int = 0) -> tuple[Wearer, ...]:
        """Persons drawn at random, women and men in turn, with straight arms.

        Stature is normal and mass log-normal, each through the 5th and 95th percentile of ANSUR II (4,082 men and 1,986
        women; a woman's 50th percentiles are then 1.633 m and 66.6 kg, measured 1.626 m and 67 kg), with the measured
        correlation of 0.47 and 0.54 between stature and the logarithm of mass.

        Parameters
        ----------
        count : int
            How many.
        seed : int
            Of the random numbers; the first k of a larger count are those of k.

        Returns
        -------
        tuple of Wearer

        Examples
        --------
        >>> people = ep.Wearer.drawn(200, seed=1)
        >>> round(float(np.median([each.height for each in people if each.sex == "female"])), 2)  # m; 1.626 in ANSUR II
        1.63
        """
        numbers = np.random.default_rng(as_count("seed", seed)).standard_normal((as_count("count", count), 2)) / _TO_95
        found = []
        for row, (tall, heavy) in enumerate(numbers):
            sex = ("female", "male")[row % 2]
            (short, long), (light, dense) = _SIZES[sex]
            shared = _TOGETHER[sex]
            heavy = shared * tall + np.sqrt(1.0 - shared**2) * heavy
            height = 0.5 * (short + long) + 0.5 * (long - short) * tall
            mass = np.sqrt(light * dense) * np.sqrt(dense / light) ** heavy
            found.append(cls(float(height), float(mass), sex))
        return tuple(found)

    @property
    def _scale(self) -> float:
        """Table's mm to this person's m."""
        return self.height / _MEAN_STATURE_MM[self.sex]

    @property
    def upper_arm_length(self) -> float:
        """From the shoulder's centre to the elbow's, m."""
        return _SEGMENTS[self.sex][0].length_mm * self._scale

    @property
    def forearm_length(self) -> float:
        """From the elbow's centre to the third knuckle, where the hand of a closed fist ends, m."""
        return sum(segment.length_mm for segment in _SEGMENTS[self.sex][1:]) * self._scale

    def dimensions(self) -> dict[str, float]:
        """Breadths, depths and girths of the body without clothing.

        Returns
        -------
        dict of str to float
            m, by the names of :func:`exo_pin.design.body_dimensions.body_dimensions`.

        Examples
        --------
        >>> thick = ep.Wearer(1.87, 111, "male", arm_girth=0.418)  # the 95th percentile of ANSUR II's men
        >>> round(1e3 * thick.dimensions()["forearm girth"])  # mm
        354
        """
        found = body_dimensions(self.height, self.mass, self.sex)
        if self.arm_girth is not None:
            found["forearm girth"] *= self.arm_girth / found["upper arm girth"]
            found["upper arm girth"] = self.arm_girth
        return found

    def segments(self) -> list[Body]:
        """Upper arm, forearm, hand and payload as (mass, centre of mass, inertia about it), SI, in {O_B}.

        The arm hangs along -z from O; hand and forearm are one line, turned forward at the elbow.

        Returns
        -------
        list of Body
            Without a payload three of them.

        Examples
        --------
        >>> parts = ep.Wearer(1.75, 75, "male").segments()  # upper arm, forearm, hand
        >>> [round(100 * float(part[0]) / 75, 2) for part in parts]  # % of body mass, de Leva (1996)
        [2.71, 1.62, 0.61]
        """
        # Ry(-bend) swings -z towards +x.
        cos, sin = np.cos(self.elbow_flexion), np.sin(self.elbow_flexion)
        turn = np.array([[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]])
        bodies: list[Body] = []
        start, frame = np.zeros(3), np.eye(3)
        for index, segment in enumerate(_SEGMENTS[self.sex]):
            if index == 1:
                frame = turn
            length = segment.length_mm * self._scale
            down = frame @ np.array([0.0, 0.0, -1.0])
            weight = segment.mass * self.mass
            tensor = frame @ np.diag(weight * (length * np.array(segment.gyration)) ** 2) @ frame.T
            bodies.append((weight, start + segment.centre * length * down, tensor))
            start = start + length * down
        if self.payload > 0.0:
            bodies.append((self.payload, start, np.zeros((3, 3))))
        return bodies
