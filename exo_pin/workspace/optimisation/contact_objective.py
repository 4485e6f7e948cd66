"""Contact force of the wearer's shoulder as an objective of a search.

The force is the least that the design can bring about: limb forces within the limits of the actuators and activations
of the wearer's muscles are chosen together so that the contact force is least
(:meth:`exo_pin.ShoulderExo.joint_contact`, ``forces="least_contact"``). That is a lower bound of what a wearer feels,
and it counts what |F_s| leaves out: poses that the device holds only together with the muscles, and the muscles of the
elbow, which press on the shoulder as well.

One pose is a cone program of some milliseconds, as much as a whole design costs by the other objectives. So it is
solved in a few poses, drawn evenly from the weights of the search, and only for the better designs of a generation;
the others get a **surrogate**: the smaller one of |F_s| (which needs no muscle) and the contact force without the
device, shifted by what it misses on average in the better designs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.errors import MissingData
from ...core.records import Record
from ...core.validation import FloatArray
from ...load_case import CentreOffset
from ...load_case.pose_stacks import pose_matrices, require_massless
from ...reaction.constraints.given_limits import Limits
from ...reaction.holding.least_held_forces import tension_limits
from ...reaction.splits.pose_stack import limb_lengths
from ..criteria import Criteria
from ..device_values import values_of
from .search_poses import SearchPoses

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo
    from ...person import Person

#: Poses in which the contact force is computed.
_POSES = 12


class ContactObjective(Record):
    """Mean contact force of a wearer over some poses.

    Parameters
    ----------
    person : Person
        The wearer, on the side of the design.
    poses : SearchPoses
        Of the search; those that the person can take and hold without the device count.
    kind : type of ShoulderExo
        Class of design that is made of a device; it computes the contact force.
    criteria : Criteria
        Whose ``least_tension`` the limbs have.

    Raises
    ------
    MissingData
        If the person can hold none of the poses.
    MissingExtra
        If the extra ``person`` is not installed.
    """

    def __init__(self, person: Person, poses: SearchPoses, kind: type[ShoulderExo], criteria: Criteria) -> None:
        self._person, self._kind = person, kind
        self._criteria = criteria.replace(names=("forces",))
        bare = np.full(len(poses.weights), np.nan)
        allowed = np.flatnonzero(person.allows(poses.poses))
        if allowed.size:
            bare[allowed] = person.joint_contact(poses.poses[allowed]).magnitude
        chosen = _evenly(np.where(np.isfinite(bare), poses.weights, 0.0))
        if not chosen.size:
            raise MissingData(["poses that the person can hold"], "the contact force of a search")
        self.poses, self.bare = poses.poses[chosen], bare[chosen]
        self._matrices = pose_matrices(self.poses)[1]
        self._offsets = poses.offsets.rows(chosen)

    def surrogate(self, mechanism: Any) -> float:
        """Mean of the smaller one of |F_s| and the contact force without the device, N."""
        values = values_of(mechanism, self._matrices, self._criteria, ("forces",), offsets=self._offsets)
        return float(np.fmin(np.sqrt((values.shoulder**2).sum(axis=1)), self.bare).mean())

    def exact(self, mechanism: Any) -> float:
        """Mean of the least contact force, N; where no answer is found that without the device counts."""
        design, wearer = self._kind.from_device(mechanism), self._person
        bounds: Limits = "design"
        offsets = self._offsets.spread(len(self._matrices))
        record = design.device.accelerate("workspace")
        if record is not None:
            require_massless(record)
            lengths = limb_lengths(record, self._matrices, offsets)
            bounds = tension_limits(record, lengths, self._criteria.least_tension)
        moved = None if self._offsets.is_aligned else CentreOffset(*offsets)
        found = design.joint_contact(
            self.poses, wearer, "least_contact", limits=bounds, centre_offset=moved, outside="mark"
        ).magnitude
        return float(np.where(np.isfinite(found), found, self.bare).mean())

    def description(self) -> Any:
        """What a stored study says of it."""
        return {"person": repr(self._person), "poses": len(self.bare)}


def _evenly(weights: FloatArray) -> np.ndarray:
    """Indices of some poses, in proportion to their weights: at equal steps of the sum of the weights."""
    total = weights.sum()
    if not total > 0.0:
        return np.empty(0, dtype=int)
    marks = (np.arange(_POSES) + 0.5) / _POSES * total
    return np.unique(np.searchsorted(np.cumsum(weights), marks))
