"""The wearer's torso, head and arm as capsules about the shoulder, scaled by stature.

Lengths and breadths are the shares of stature of Drillis and Contini, as Winter (Biomechanics and Motor Control of
Human Movement) prints them: half shoulder breadth 0.129, chest breadth 0.174, shoulder height 0.818, chin 0.870, upper
arm 0.186, forearm 0.146, hand 0.108. That figure has no depths and girths. Those used here are **estimates**: depth of
the chest 0.137, radius of the upper arm 0.030 and of the forearm 0.025, of the neck 0.035 and of the head 0.050 of
stature, and 0.031 for the soft tissue above the collar bone.

Assumptions: the trunk is upright and stays where it is; the elbow is straight or bent by the given angle. Where the
shoulder's centre moves against the trunk, the capsule from neck to shoulder follows it with its outer end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.conventions import as_side
from ..core.errors import InvalidInput
from ..core.records import Record
from ..core.validation import FloatArray, as_finite

#: Torso of a left shoulder of unit stature: two ends and the radius, about the shoulder centre, x forward, y left.
_TORSO = np.array(
    [
        # The chest: three upright capsules side by side, 0.174 broad and 0.137 deep, to 0.28 below the shoulder.
        [0.0, -0.1105, -0.040, 0.0, -0.1105, -0.280, 0.0685],
        [0.0, -0.1290, -0.040, 0.0, -0.1290, -0.280, 0.0685],
        [0.0, -0.1475, -0.040, 0.0, -0.1475, -0.280, 0.0685],
        [0.0, -0.1290, 0.015, 0.0, 0.0, 0.0, 0.031],  # from neck to shoulder
        [0.0, -0.1290, 0.000, 0.0, -0.1290, 0.100, 0.035],  # neck
        [0.0, -0.1290, 0.090, 0.0, -0.1290, 0.130, 0.050],  # head
    ]
)
_UPPER_ARM, _FOREARM_AND_HAND = 0.186, 0.194
_UPPER_ARM_RADIUS, _FOREARM_RADIUS = 0.030, 0.025


@dataclass(frozen=True, eq=False)
class BodyShape(Record):
    """Capsules that limbs must keep clear of: rows of two ends and a radius, m.

    Attributes
    ----------
    torso : ndarray
        Shape (K, 7), base frame {O_A}. An end in O is the shoulder itself: it stays in the shoulder's centre where that
        moves against the torso (:mod:`.pose_offsets`).
    arm : ndarray
        Shape (K, 7), arm frame {O_B}.
    elbow_flexion : float
        Of the arm that :meth:`from_height` made, rad.
    """

    torso: FloatArray
    arm: FloatArray
    elbow_flexion: float = 0.0

    def __post_init__(self) -> None:
        for name in ("torso", "arm"):
            rows = as_finite(name, getattr(self, name), (None, 7))
            if (rows[:, 6] < 0.0).any():
                raise InvalidInput(f"expected radii of zero or more in {name}, got {rows[:, 6].min():g} m")
            object.__setattr__(self, name, rows)

    @classmethod
    def from_height(cls, height: float, side: str = "left", elbow_flexion: float = 0.0) -> BodyShape:
        """A person of given stature; see the module's description for the numbers.

        Parameters
        ----------
        height : float
            Stature, m.
        side : {"left", "right"}
            Which shoulder is at O.
        elbow_flexion : float
            0 for a straight arm, rad; the forearm swings forward.

        Raises
        ------
        InvalidInput
            If the stature is not that of a person.
        """
        stature = float(as_finite("height", height, ()))
        if not 0.5 <= stature <= 2.6:
            raise InvalidInput(f"expected a height of 0.5 to 2.6 m, got {stature:g}; give it in metres")
        bend = float(as_finite("elbow_flexion", elbow_flexion, ()))
        elbow = np.array([0.0, 0.0, -_UPPER_ARM])
        hand = elbow + _FOREARM_AND_HAND * np.array([np.sin(bend), 0.0, -np.cos(bend)])
        arm = np.array(
            [[0.0, 0.0, 0.0, *elbow, _UPPER_ARM_RADIUS], [*elbow, *hand, _FOREARM_RADIUS]],
        )
        torso = np.array(_TORSO)
        if as_side(side) == "right":
            torso[:, [1, 4]] *= -1.0
        return cls(stature * torso, stature * arm, bend)
