"""A wearer's torso, head and arm as capsules about the shoulder.

The lengths of upper arm, forearm and fist are those of the arm's mass (:class:`exo_pin.Wearer`, de Leva 1996), between
the centres of the joints. Breadths and heights of the trunk are the shares of stature of Drillis and Contini, as Winter
(Biomechanics and Motor Control of Human Movement) prints them: half shoulder breadth 0.129, chest breadth 0.174,
shoulder height 0.818, chin 0.870. That figure has no depths and girths. Those used here are **estimates**: depth of
the chest 0.137, radius of the upper arm 0.030 and of the forearm 0.025, of the neck 0.035 and of the head 0.050 of
stature, and 0.031 for the soft tissue above the collar bone.

Assumptions: the trunk is upright and stays where it is. Where the shoulder's centre moves against the trunk, the
capsule from neck to shoulder follows it with its outer end.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ...core.conventions import as_side
from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.records import Record
from ...core.validation import FloatArray, as_finite, require_type
from ...design.wearer import Wearer

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
_UPPER_ARM_RADIUS, _FOREARM_RADIUS = 0.030, 0.025
#: Largest step between two postures of an elbow that bends, rad: the fist moves by less than the forearm's radius on
#: either side of its own place.
_ELBOW_STEP = np.radians(10.0)


#: By how much the upper arm of a body may be longer or shorter than that of who is said to have it, m.
_FIT = 0.005


@checked
@dataclass(frozen=True, eq=False)
class BodyShape(Record):
    """Capsules that limbs must keep clear of: rows of two ends and a radius, m.

    Attributes
    ----------
    torso : ndarray
        Shape (K, 7), base frame {O_A}. An end in O is the shoulder itself: it stays in the shoulder's centre where that
        moves against the torso (:mod:`exo_pin.workspace.pose_offsets`).
    arm : ndarray
        Shape (K, 7), arm frame {O_B}.

    Examples
    --------
    >>> trunk = [[0.0, -0.15, 0.0, 0.0, -0.15, -0.4, 0.1]]  # a capsule of 0.1 m radius
    >>> body = ep.BodyShape(torso=trunk, arm=[[0.0, 0.0, 0.0, 0.0, 0.0, -0.3, 0.05]])
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> found = exo.workspace(exo.pose([0, 60]), criteria=ep.Criteria(body=body))
    >>> (1e3 * found.gaps[:, 1]).round().tolist()  # mm between limbs and trunk
    [75.0, 24.0]
    """

    torso: FloatArray
    arm: FloatArray

    def __post_init__(self) -> None:
        for name in ("torso", "arm"):
            rows = as_finite(name, getattr(self, name), (None, 7))
            if (rows[:, 6] < 0.0).any():
                raise InvalidInput(f"expected radii of zero or more in {name}, got {rows[:, 6].min():g} m")
            object.__setattr__(self, name, rows)

    @classmethod
    def of(
        cls, wearers: Wearer | Iterable[Wearer], side: str = "left", elbow_range: tuple[float, float] | None = None
    ) -> BodyShape:
        """The body of a person, or of all of several at once, so that what is clear of it is clear of each.

        Parameters
        ----------
        wearers : Wearer or iterable of Wearer
            One person or several, each with the elbow as it is.
        side : {"left", "right"}
            Which shoulder is at O.
        elbow_range : tuple of float, optional
            From which to which angle all of them bend the elbow, rad; the forearm is then in all places between.

        Returns
        -------
        BodyShape

        Raises
        ------
        InvalidInput
            If there is no wearer.

        Examples
        --------
        >>> body = ep.BodyShape.of(ep.Wearer(1.75, 75, "male"))
        >>> upper_arm = body.arm[0]
        >>> (1e3 * upper_arm[[6, 5]]).round(1)  # mm: radius, 3 % of stature; place of the elbow
        array([  52.5, -283.2])
        """
        listed = (wearers,) if isinstance(wearers, Wearer) else tuple(wearers)
        if not listed or not all(isinstance(each, Wearer) for each in listed):
            raise InvalidInput("expected a Wearer, or several")
        torsos, arms = [], []
        for each in listed:
            torsos.append(each.height * _TORSO)
            low, high = (each.elbow_flexion,) * 2 if elbow_range is None else elbow_range
            arms.append(_arm(each, np.linspace(low, high, 1 + int(np.ceil((high - low) / _ELBOW_STEP)))))
        torso = np.concatenate(torsos)
        if as_side(side) == "right":
            torso[:, [1, 4]] *= -1.0
        return cls(torso, np.concatenate(arms))

    def require_fit(self, wearers: Iterable[Wearer]) -> None:
        """Refuse persons whose upper arm this body does not have.

        Parameters
        ----------
        wearers : iterable of Wearer
            The persons.

        Raises
        ------
        InvalidInput
            If it has upper arms (capsules from O), and none as long as a person's, to 5 mm.

        Examples
        --------
        >>> body = ep.BodyShape.of(ep.Wearer(1.63, 67, "female"))
        >>> try:
        ...     body.require_fit([ep.Wearer(1.63, 60, "female"), ep.Wearer(1.90, 90, "male")])
        ... except ep.InvalidInput as error:
        ...     print(str(error).split(", ")[0])
        expected a body with an upper arm of 307 mm
        """
        own = np.linalg.norm(self.arm[~self.arm[:, 0:3].any(axis=1), 3:6], axis=1)
        for each in wearers:
            require_type("wearers", each, Wearer)
            if own.size and np.abs(own - each.upper_arm_length).min() > _FIT:
                lengths = ", ".join(f"{1e3 * length:.0f}" for length in sorted(set(own.round(3).tolist())))
                raise InvalidInput(
                    f"expected a body with an upper arm of {1e3 * each.upper_arm_length:.0f} mm, that of a person of "
                    f"{each.height:g} m, got one of {lengths} mm; leave body out, and the body is the wearers'"
                )


def _arm(wearer: Wearer, bends: FloatArray) -> FloatArray:
    """Capsules of the upper arm and of the forearm at each angle of the elbow, shape (1 + angles, 7)."""
    elbow = np.array([0.0, 0.0, -wearer.upper_arm_length])
    hands = elbow + wearer.forearm_length * np.stack([np.sin(bends), 0.0 * bends, -np.cos(bends)], axis=1)
    radius = _FOREARM_RADIUS * wearer.height
    rows = [[0.0, 0.0, 0.0, *elbow, _UPPER_ARM_RADIUS * wearer.height], *([*elbow, *hand, radius] for hand in hands)]
    return np.array(rows)
