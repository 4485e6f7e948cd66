"""The reaction query: poses, motion and load in, forces out."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.progress import track
from ..core.validation import FloatArray, as_choice
from ..load_case import CentreOffset, CentrePath, Load, Motion
from ..load_case.pose_stacks import as_query
from ..wrist.forces.closed_form import STATUS, require_standalone
from ..wrist.kinematics.inverse import inverse_kinematics
from ..wrist_chain.equilibrium import EquilibriumModel
from .answer import QUERY_STATUS, Answer, Wanted
from .constraints.glenoid_cone import GlenoidCone
from .constraints.limb_limits import ActuatorBounds, ForceLimits
from .constraints.side_force_bounds import ConstraintBounds, SideForceBounds
from .finished import finished
from .result import Reaction
from .splits.elastic import as_offset, shoulder_stiffness
from .splits.limb_and_side_forces import Weights
from .splits.misaligned import misaligned_reaction

__all__ = ["QUERY_STATUS", "Split", "reaction"]

Split = Literal["spherical", "minimal", "elastic", "standalone"]


def reaction(
    model: EquilibriumModel,
    orientation: Rotation,
    motion: Motion | None = None,
    load: Load | None = None,
    split: str = "spherical",
    constraint_bounds: ConstraintBounds = None,
    centre_offset: CentreOffset | CentrePath | ArrayLike | None = None,
    *,
    actuator_bounds: ActuatorBounds = None,
    cone: GlenoidCone | None = None,
    weights: Weights | None = None,
    progress: bool = False,
) -> Reaction:
    """Forces on arm, shoulder and torso; see :meth:`exo_pin.ShoulderExo.reaction`.

    Source: thesis (D-7), (D-9), (D-30).
    """
    _check_options(split, constraint_bounds, cone, weights)
    limited = actuator_bounds is not None or cone is not None or weights is not None
    if limited and (split == "elastic" or centre_offset is not None):
        raise InvalidInput(
            'actuator_bounds, cone and weights choose forces: they do not go with split="elastic" or a centre_offset'
        )
    mechanism = model.mechanism
    if split == "standalone":
        require_standalone(mechanism)
    if motion is not None:
        mechanism.require_arm("motion", inertia=True)
    query = as_query(orientation, motion, load)
    n = mechanism.limb_count

    def lengths() -> FloatArray:
        return inverse_kinematics(mechanism.geometry, orientation).lengths.reshape(-1, n)

    limits = ForceLimits(actuator_bounds, query.shape, n, lengths)
    bounds = SideForceBounds(constraint_bounds, query.shape, n, limits.one_signed)
    wanted = Wanted(split, bounds, limits, cone, weights)
    if split == "elastic":
        shoulder_stiffness(mechanism)  # raises now, not in the middle of a stack
    if isinstance(centre_offset, CentrePath):
        centre_offset = centre_offset.offset(orientation)
    if centre_offset is not None:
        offset = as_offset(centre_offset, query.shape)
        return misaligned_reaction(mechanism, query, offset, wanted)
    answer = Answer(mechanism, query)
    if split == "elastic":
        answer.prepare_elastic(query)
    answer.status[(answer.status < STATUS.index("singular")) & ~limits.reachable] = QUERY_STATUS.index("out_of_stroke")
    quaternions = orientation.as_quat().reshape(-1, 4)
    rows = np.flatnonzero(answer.status < STATUS.index("singular")).tolist()
    for row in track(rows, "reaction", progress):
        R = query.matrices[row]
        q = model.configuration(R, quaternions[row])
        outside = np.concatenate([query.force[row], query.moment[row]])
        state = model.equilibrium(R, q, query.velocity[row], query.acceleration[row], outside)
        answer.fill(row, state, wanted)
    return finished(answer, query, wanted)


def _check_options(
    split: str, constraint_bounds: ConstraintBounds, cone: GlenoidCone | None, weights: Weights | None
) -> None:
    """Refuse options that do not belong together."""
    as_choice("split", split, get_args(Split))
    if constraint_bounds is not None and split != "minimal":
        raise InvalidInput(f'constraint_bounds belong to split="minimal", got split={split!r}')
    if weights is not None and split != "minimal":
        raise InvalidInput(f'weights belong to split="minimal", got split={split!r}')
    if cone is not None and split == "standalone":
        raise InvalidInput('a glenoid cone bounds F_s, which split="standalone" sets to zero')
    for name, value, kind in (("cone", cone, GlenoidCone), ("weights", weights, Weights)):
        if value is not None and not isinstance(value, kind):
            raise InvalidInput(f"expected {name} to be a {kind.__name__}, got {type(value).__name__}")
