"""The reaction query: poses, motion and load in, forces out."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..design import CentreOffset, CentrePath, Load, Motion
from ..errors import InvalidInput, UnknownName
from ..wrist.forces import STATUS, require_standalone
from ..wrist.stacks import as_query
from .answer import Answer
from .bounds import ConstraintBounds, SideForceBounds
from .determination import certified
from .elastic import as_offset, shoulder_stiffness
from .equilibrium import EquilibriumModel
from .misaligned import misaligned_reaction
from .result import Reaction

__all__ = ["Split", "reaction"]

Split = Literal["spherical", "minimal", "elastic", "standalone"]


def reaction(
    model: EquilibriumModel,
    orientation: Rotation,
    motion: Motion | None = None,
    load: Load | None = None,
    split: str = "spherical",
    constraint_bounds: ConstraintBounds = None,
    centre_offset: CentreOffset | CentrePath | ArrayLike | None = None,
) -> Reaction:
    """Forces on arm, shoulder and torso; see :meth:`exo_pin.ShoulderExo.reaction`."""
    if split not in get_args(Split):
        raise UnknownName("split", split, get_args(Split))
    if constraint_bounds is not None and split != "minimal":
        raise InvalidInput(f'constraint_bounds belong to split="minimal", got split={split!r}')
    mechanism = model.mechanism
    if split == "standalone":
        require_standalone(mechanism)
    if motion is not None:
        mechanism.require_arm("motion", inertia=True)
    query = as_query(orientation, motion, load)
    bounds = SideForceBounds(constraint_bounds, query.shape, mechanism.limb_count)
    if split == "elastic":
        shoulder_stiffness(mechanism)  # raises now, not in the middle of a stack
    if isinstance(centre_offset, CentrePath):
        centre_offset = centre_offset.offset(orientation)
    if centre_offset is not None:
        offset = as_offset(centre_offset, query.shape)
        return certified(misaligned_reaction(mechanism, query, offset, split, bounds), mechanism, query, offset, bounds)
    answer = Answer(mechanism, query)
    if split == "elastic":
        answer.prepare_elastic(query)
    quaternions = orientation.as_quat().reshape(-1, 4)
    for row in np.flatnonzero(answer.status < STATUS.index("singular")).tolist():
        R = query.matrices[row]
        q = model.configuration(R, quaternions[row])
        outside = np.concatenate([query.force[row], query.moment[row]])
        state = model.equilibrium(R, q, query.velocity[row], query.acceleration[row], outside)
        answer.fill(row, state, split, bounds)
    return certified(answer.finished(query, split), mechanism, query, None, bounds)
