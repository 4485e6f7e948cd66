"""Arm segments of a person of given height and mass.

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

import warnings
from typing import NamedTuple

import numpy as np

from ..core.errors import InvalidInput, OutsideHumanRange
from ..core.validation import FloatArray, as_choice, as_finite, as_positive

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

Body = tuple[float, FloatArray, FloatArray]


def arm_segments(
    height: float, mass: float, sex: str, elbow_flexion: float, payload: float, degrees: bool
) -> list[Body]:
    """Upper arm, forearm, hand and payload as (mass, centre of mass, inertia about it), SI, in {O_B}.

    The arm hangs along -z from O; hand and forearm are one line, turned forward at the elbow.
    """
    height, mass = as_positive("height", height), as_positive("mass", mass)
    if not 0.5 <= height <= 2.6:
        likely = f"; did you mean {height / 100:g} m?" if 50.0 <= height <= 260.0 else ""
        raise InvalidInput(f"expected a height of 0.5 to 2.6 m, got {height:g}{likely}")
    if not 3.0 <= mass <= 400.0:
        raise InvalidInput(f"expected a body mass of 3 to 400 kg, got {mass:g}")
    as_choice("sex", sex, _SEGMENTS)
    payload = as_positive("payload", payload, zero=True)
    if payload > _HEAVY:
        warnings.warn(
            f"a payload of {payload:g} kg weighs {9.81 * payload:.0f} N: it is given in kg (newtons?)",
            OutsideHumanRange,
            stacklevel=3,
        )
    bend = float(as_finite("elbow_flexion", elbow_flexion, ()))
    bend = np.radians(bend) if degrees else bend
    if not -0.3 <= bend <= 2.8:
        raise InvalidInput(f"expected elbow_flexion of -0.3 to 2.8 rad (-17 to 160°), got {bend:g} rad")

    # Ry(-bend) swings -z towards +x.
    cos, sin = np.cos(bend), np.sin(bend)
    turn = np.array([[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]])
    scale = height * 1000.0 / _MEAN_STATURE_MM[sex] / 1000.0  # table's mm to this person's m
    bodies: list[Body] = []
    start, frame = np.zeros(3), np.eye(3)
    for index, segment in enumerate(_SEGMENTS[sex]):
        if index == 1:
            frame = turn
        length = segment.length_mm * scale
        down = frame @ np.array([0.0, 0.0, -1.0])
        weight = segment.mass * mass
        tensor = frame @ np.diag(weight * (length * np.array(segment.gyration)) ** 2) @ frame.T
        bodies.append((weight, start + segment.centre * length * down, tensor))
        start = start + length * down
    if payload > 0.0:
        bodies.append((payload, start, np.zeros((3, 3))))
    return bodies


def upper_arm_length(height: float, sex: str) -> float:
    """Length of the upper arm, from the shoulder's centre to the elbow's, m."""
    return _SEGMENTS[sex][0].length_mm / _MEAN_STATURE_MM[sex] * height
