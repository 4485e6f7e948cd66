"""What criteria of a workspace need: each function lists what a design, limits and poses lack of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..design import Mechanism
from ..device.chain_device import ChainDevice
from ..device.link_shapes import link_capsules
from ..reaction.holding.hold_check import missing_limits
from ..wrist.clearance.clearance import limb_radii

if TYPE_CHECKING:
    from .criteria import Criteria

#: Limits of an actuator that are none of its forces.
_NO_FORCES = ("stroke", "end fitting", "range of length")


def joints(mechanism: Mechanism, criteria: Criteria, is_grid: bool) -> list[str]:
    """Need of the universal joints' ranges."""
    jointed = [limb for limb in mechanism.limbs if limb.kind == "UPU"]
    lacking = [] if jointed else ["no limb has universal joints"]
    if any(limb.joint_limit is None for limb in jointed):
        lacking.append("range of the universal joints (joint_limit)")
    if any(limb.joint_straight is None for limb in jointed):
        lacking.append("straight direction of the universal joints (joint_straight)")
    return lacking


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
    """Need of the wearer's body and of the limbs' radii."""
    lacking = [] if criteria.body_of(mechanism) is not None else ["who wears it (worn_by, --person)"]
    if isinstance(mechanism, ChainDevice):
        shown = len(link_capsules(mechanism)[1]) or any(part.route for part in (*mechanism.drives, *mechanism.springs))
        return lacking + ([] if shown else ["shapes of the links"])
    radii = limb_radii(mechanism, criteria.limb_radius)
    return lacking + (["radius of the limbs (limb_radius)"] if np.isnan(radii).any() else [])


def shoulder(mechanism: Mechanism, criteria: Criteria, is_grid: bool) -> list[str]:
    """Need of the shoulder's range."""
    known = mechanism.shoulder.half_diagonal is not None and mechanism.shoulder.abduction_centre is not None
    return [] if known else ["range of the shoulder"]


def strokes(mechanism: Mechanism, criteria: Criteria, is_grid: bool) -> list[str]:
    """Need of the strokes."""
    known = not any(np.isnan(limb.length_range).any() for limb in mechanism.limbs)
    return [] if known else ["strokes or end fittings"]


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
    return ["limbs between two joint centres"] if isinstance(mechanism, ChainDevice) else []


def wearers(mechanism: Mechanism, criteria: Criteria, is_grid: bool) -> list[str]:
    """Need of who wears it."""
    return [] if criteria.wearers_of(mechanism) else ["who wears it (worn_by, --person)"]
