"""What criteria of a workspace need: what a design, limits and poses lack of it, and who wears the design."""

from __future__ import annotations

import functools
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..core.errors import MissingData
from ..design import Arm, Mechanism, Wearer
from ..device.clearance import unknown_for_gaps
from ..device.wrist_device import as_device
from ..reaction.holding.hold_check import missing_limits
from ..wrist.clearance.clearance import BodyShape
from ..wrist.clearance.gaps import NOBODY

if TYPE_CHECKING:
    from .criteria import Criteria

#: Largest step between the postures of an elbow in which forces are checked, rad.
_ARM_STEP = np.radians(45.0)
#: Why the angles of universal joints are left out where there are none.
NO_UNIVERSAL_JOINTS = "no limb has universal joints"
#: Why data of springs are left out where there are none.
NO_SPRINGS = "no spring has a law"
#: Limits of an actuator that are none of its forces.
_NO_FORCES = ("stroke", "end fitting", "range of length")


def joints(mechanism: Mechanism, criteria: Criteria, is_grid: bool) -> list[str]:
    """Need of the universal joints' ranges."""
    jointed = [limb for limb in mechanism.limbs if limb.kind == "UPU"]
    lacking = [] if jointed else [NO_UNIVERSAL_JOINTS]
    if any(limb.joint_limit is None for limb in jointed):
        lacking.append("range of the universal joints (joint_limit)")
    if any(limb.joint_straight is None for limb in jointed):
        lacking.append("straight direction of the universal joints (joint_straight)")
    return lacking


def springs(mechanism: Mechanism, criteria: Criteria, is_grid: bool) -> list[str]:
    """Need of springs, whose laws may end."""
    return [] if mechanism.springs else [NO_SPRINGS]


def grid(mechanism: Mechanism, criteria: Criteria, is_grid: bool) -> list[str]:
    """Need of poses on a grid."""
    return [] if is_grid else ["poses on a grid of three angles"]


def forces(mechanism: Mechanism, criteria: Criteria, is_grid: bool) -> list[str]:
    """Need of the tensions within the actuators' limits."""
    lacking = [] if mechanism.arm is not None or criteria.wearers else ["arm mass"]
    lacking += [text for text in missing_limits(mechanism) if not text.startswith(_NO_FORCES)]
    # A muscle's pull depends on its length.
    laws = any(limb.actuator is not None and limb.actuator.force_law is not None for limb in mechanism.limbs)
    return [*lacking, *strokes(mechanism, criteria, is_grid)] if laws else lacking


def body(mechanism: Mechanism, criteria: Criteria, is_grid: bool) -> list[str]:
    """Need of the wearer's body and of the shapes of the device's parts."""
    return list(unknown_for_gaps(as_device(mechanism), criteria.body_of(mechanism), criteria.limb_radius))


def shoulder(mechanism: Mechanism, criteria: Criteria, is_grid: bool) -> list[str]:
    """Need of the shoulder's range."""
    known = mechanism.shoulder.half_diagonal is not None and mechanism.shoulder.abduction_centre is not None
    return [] if known else ["range of motion of the shoulder ([shoulder])"]


def strokes(mechanism: Mechanism, criteria: Criteria, is_grid: bool) -> list[str]:
    """Need of the strokes."""
    known = not any(np.isnan(limb.length_range).any() for limb in mechanism.limbs)
    return [] if known else ["stroke or end fitting of limbs"]


def socket(mechanism: Mechanism, criteria: Criteria, is_grid: bool) -> list[str]:
    """Need of the way the socket faces."""
    known = criteria.socket is not None and criteria.socket.orientation is not None
    return [] if known else ["where the socket faces (socket, --person)"]


def own_arm(mechanism: Mechanism, criteria: Criteria, is_grid: bool) -> list[str]:
    """Need of a person's arm."""
    known = criteria.wearers or (mechanism.arm is not None and mechanism.arm.person is not None)
    return [] if known else ["a person's arm"]


def cuff(mechanism: Mechanism, criteria: Criteria, is_grid: bool) -> list[str]:
    """Need of the cuff's stiffness."""
    return [] if mechanism.interfaces.cuff is not None else ["stiffness of the cuff (interfaces)"]


def limbs(mechanism: Mechanism, criteria: Criteria, is_grid: bool) -> list[str]:
    """Need of limbs between two joint centres."""
    return ["limbs between two joint centres"] if as_device(mechanism).accelerate("workspace") is None else []


def wearers(mechanism: Mechanism, criteria: Criteria, is_grid: bool) -> list[str]:
    """Need of who wears it."""
    return [] if criteria.wearers_of(mechanism) else [NOBODY]


class WornCriteria:
    """For whom criteria must hold: the arms and the body that they are about."""

    wearers: tuple[Wearer, ...]
    elbow_range: tuple[float, float] | None
    body: BodyShape | None

    def wearers_of(self, mechanism: Mechanism) -> tuple[Wearer, ...]:
        """For whom the criteria must hold; empty where that is not known.

        Parameters
        ----------
        mechanism : Mechanism
            The design.

        Returns
        -------
        tuple of Wearer

        Examples
        --------
        >>> (wearer,) = ep.Criteria().wearers_of(ep.load("four-cables-worn").mechanism)
        >>> wearer.height, wearer.mass  # m, kg
        (1.75, 75.0)
        """
        if self.wearers:
            return self.wearers
        own = None if mechanism.arm is None else mechanism.arm.wearer
        return () if own is None else (own,)

    def arms(self, mechanism: Mechanism) -> tuple[Arm | None, ...]:
        """Arms that must be held, with what the device moves besides.

        Parameters
        ----------
        mechanism : Mechanism
            The design.

        Returns
        -------
        tuple of Arm or None

        Raises
        ------
        MissingData
            If the elbow bends and it is not known whose it is.

        Examples
        --------
        >>> exo = ep.load("four-linear-actuators-worn")
        >>> arms = ep.Criteria().arms(exo.mechanism)
        >>> round(float(arms[0].mass), 2)  # kg, of the wearer's arm and what the device moves
        4.86
        """
        if not self.wearers and self.elbow_range is None:
            return (mechanism.arm,)
        wearers = self.wearers_of(mechanism)
        if not wearers:
            raise MissingData([NOBODY], "an arm whose elbow bends", mechanism.name)
        return _arms(mechanism.arm, wearers, self.elbow_range)

    def body_of(self, mechanism: Mechanism) -> BodyShape | None:
        """What limbs must keep clear of; None where that is not known.

        Parameters
        ----------
        mechanism : Mechanism
            The design.

        Returns
        -------
        BodyShape or None

        Examples
        --------
        >>> exo = ep.load("four-linear-actuators-worn")
        >>> body = ep.Criteria().body_of(exo.mechanism)
        >>> round(float(body.arm[0, 6] / 0.030), 3)  # m, stature of the wearer, whose arm's radius is 3 % of it
        1.755
        """
        wearers = self.wearers_of(mechanism)
        if self.body is not None or not wearers:
            return self.body
        return _body(wearers, mechanism.side, self.elbow_range)


# A search asks for the same arms and the same body for every design.
@functools.lru_cache(maxsize=32)
def _arms(own: Arm | None, wearers: tuple[Wearer, ...], elbow_range: tuple[float, float] | None) -> tuple[Arm, ...]:
    found = []
    for wearer in wearers:
        low, high = (wearer.elbow_flexion,) * 2 if elbow_range is None else elbow_range
        for bend in np.linspace(low, high, 1 + int(np.ceil((high - low) / _ARM_STEP))):
            # A person's arm lies in the x-z plane, so that it is the same on either side of the body.
            arm = Arm.of_wearer(replace(wearer, elbow_flexion=float(bend)))
            found.append(arm.with_device_of(own))
    return tuple(found)


@functools.lru_cache(maxsize=32)
def _body(wearers: tuple[Wearer, ...], side: str, elbow_range: tuple[float, float] | None) -> BodyShape:
    return BodyShape.of(wearers, side, elbow_range)
