"""A design without dimensions of its own, for a search over free joints."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...core.conventions import as_side
from ...core.errors import InvalidInput
from ...design import Actuator, Arm, Limb, Mechanism, WristGeometry

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["starting_design"]


def starting_design(
    actuators: Actuator | Sequence[Actuator], arm: Arm, limb_count: int = 4, side: str = "left", name: str = "search"
) -> Mechanism:
    """Limbs with spherical joints at both ends, spread evenly around the shoulder.

    Parameters
    ----------
    actuators : Actuator or sequence of Actuator
        Of all limbs, or one a limb.
    arm : Arm
        What moves about the shoulder, person and device.
    limb_count : int
        n, where one actuator is given.
    side : {"left", "right"}
        Side of the body.
    name : str
        Of the design.
    """
    each = (actuators,) * limb_count if isinstance(actuators, Actuator) else tuple(actuators)
    if len(each) < 3:
        raise InvalidInput(f"expected at least 3 limbs (fewer cannot hold an arm), got {len(each)}")
    angles = 2.0 * np.pi * np.arange(len(each)) / len(each) + 0.3
    base = np.stack([0.15 * np.cos(angles), 0.15 * np.sin(angles), np.full(len(each), 0.1)], axis=-1)
    platform = np.stack([0.1 * np.cos(angles), 0.1 * np.sin(angles), np.full(len(each), -0.2)], axis=-1)
    return Mechanism(
        WristGeometry(base, platform),
        arm=arm,
        limbs=tuple(Limb("SPS", actuator=actuator) for actuator in each),
        side=as_side(side),
        name=name,
    )
