"""Remedies for a pose that cannot be held: a pose nearby that can, and the moment that is missing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.validation import ReadOnly
from ...wrist_chain.equilibrium import EquilibriumModel
from ..indeterminacy.infeasibility import Infeasibility
from ..query import as_split, reaction
from .actuator_limits import DesignActuators
from .nearest_pose import NearestPose, nearest_held_pose

__all__ = ["Remedy", "at_rest", "remedy"]

#: Largest turn of the search for a pose that can be held, rad.
_REACH = float(np.radians(60.0))


@dataclass(frozen=True, eq=False)
class Remedy(ReadOnly):
    """Remedies for a single pose that cannot be held.

    Attributes
    ----------
    nearest : NearestPose or None
        A pose nearby, or the pose itself, that can be held, as far as the limits are known; None if none was found
        within 60°.
    infeasibility : Infeasibility or None
        What is missing in the pose itself, the strokes of the limbs left out; None if nothing is missing, if the
        actuators of the design are not known, or if the split takes no limits (locked actuators).
    side : {"left", "right"}
        Side of the body, for the angles.
    """

    nearest: NearestPose | None
    infeasibility: Infeasibility | None
    side: str

    def __str__(self) -> str:
        if self.nearest is None:
            parts = [f"No pose within {np.degrees(_REACH):.0f}° can be held."]
        else:
            parts = [self.nearest.sentence(self.side)]
        if self.infeasibility is not None and self.infeasibility.infeasible:
            parts.append(self.infeasibility.summary())
        return " ".join(parts)


def remedy(model: EquilibriumModel, orientation: Rotation, progress: bool = False, **options: Any) -> Remedy:
    """Remedies for a pose that cannot be held.

    Parameters
    ----------
    model : EquilibriumModel
        The design.
    orientation : Rotation
        Single.
    progress : bool
        Whether to show a bar on standard error: an elastic device takes some milliseconds a pose, for up to a thousand
        poses.
    **options
        Of the query: ``load``, ``centre_offset``, ``split``. There is no motion: poses nearby are at rest.

    Raises
    ------
    InvalidInput
        If ``orientation`` is a stack, or ``motion`` is given.
    """
    at_rest(options)
    if orientation.shape != ():
        raise InvalidInput(f"expected a single pose, got a stack of shape {orientation.shape}")
    mechanism = model.mechanism
    nearest = nearest_held_pose(lambda poses: reaction(model, poses, **options).limits, orientation, _REACH, progress)
    infeasibility = None
    law = as_split(options.get("split", "spherical"))
    if "actuator_bounds" not in law.refusals and all(limb.actuator is not None for limb in mechanism.limbs):
        bounds = DesignActuators(mechanism, stroke=False)
        infeasibility = reaction(model, orientation, actuator_bounds=bounds, **options).infeasibility
    return Remedy(nearest, infeasibility, mechanism.side)


def at_rest(options: dict[str, Any]) -> None:
    """Raise InvalidInput if the options of a query have a motion, for what compares poses at rest."""
    if options.get("motion") is not None:
        raise InvalidInput("expected no motion: the poses nearby are at rest; leave it out")
