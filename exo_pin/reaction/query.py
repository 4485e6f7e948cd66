"""The reaction query: poses, motion and load in, forces out."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.validation import FloatArray
from ..load_case import CentreOffset, CentrePath, Load, Motion
from ..load_case.pose_stacks import Query, as_query
from ..wrist.forces.affine_state import BalancedTensions
from ..wrist.forces.closed_form import classify
from ..wrist.forces.displaced import Displaced, as_offset
from ..wrist.forces.side_forces import side_wrenches
from ..wrist_chain.equilibrium import EquilibriumModel
from .answer import QUERY_STATUS, answered, distribute
from .constraints.glenoid_cone import GlenoidCone
from .constraints.limb_limits import ActuatorBounds, ForceLimits
from .constraints.side_force_bounds import ConstraintBounds, SideForceBounds
from .finished import finished
from .mechanism_loads import arm_loads
from .result import Reaction
from .splits.limb_and_side_forces import Socket, Weights
from .splits.registry import as_split, check_option
from .splits.split import PoseStack, Split

__all__ = ["QUERY_STATUS", "reaction"]


def reaction(
    model: EquilibriumModel,
    orientation: Rotation,
    motion: Motion | None = None,
    load: Load | None = None,
    split: str | Split = "spherical",
    constraint_bounds: ConstraintBounds = None,
    centre_offset: CentreOffset | CentrePath | ArrayLike | None = None,
    *,
    actuator_bounds: ActuatorBounds = None,
    cone: GlenoidCone | None = None,
    weights: Weights | None = None,
    progress: bool = False,
) -> Reaction:
    """Forces on arm, shoulder and torso; see :meth:`exo_pin.ShoulderExo.reaction`."""
    law = as_split(split)
    _check_options(law, constraint_bounds=constraint_bounds, weights=weights, cone=cone)
    mechanism = model.mechanism
    law.check(mechanism)
    if motion is not None:
        mechanism.require_arm("motion", inertia=True)
    query = as_query(orientation, motion, load)
    n = mechanism.limb_count
    if isinstance(centre_offset, CentrePath):
        centre_offset = centre_offset.offset(orientation)
    offset = None
    if centre_offset is not None:
        offset = law.offsets(query.matrices, *as_offset(centre_offset, query.shape))
    geometry = mechanism.geometry

    def lengths() -> FloatArray:
        base, cuff = offset or (np.zeros((len(query.matrices), 3)),) * 2
        arm = (geometry.platform_points + cuff[:, None]) @ np.swapaxes(query.matrices, 1, 2)
        return np.asarray(np.linalg.norm(arm - geometry.base_points - base[:, None], axis=-1))

    limits = ForceLimits(actuator_bounds, query.shape, n, lengths)
    bounds = SideForceBounds(constraint_bounds, query.shape, n, limits.one_signed, offset is not None)
    arm = arm_loads(mechanism, query)
    socket = None if cone is None else Socket(*cone.half_spaces(mechanism.side), cone.penalty)
    if offset is None:
        status, margin, determinant = classify(mechanism, query.matrices)
        status[(status < QUERY_STATUS.index("singular")) & ~limits.reachable] = QUERY_STATUS.index("out_of_stroke")
        quaternions = orientation.as_quat().reshape(-1, 4)
        state = model.states(query, quaternions, answered(status).tolist(), progress)
        tensions = BalancedTensions.of(state)
        stiffness, misfit = _aligned_sides(law, model, query)
    else:
        displaced = Displaced(mechanism, query, *offset, *arm[:2])
        status, margin, determinant = displaced.status, displaced.margin, displaced.determinant
        status[(status < QUERY_STATUS.index("singular")) & ~limits.reachable] = QUERY_STATUS.index("out_of_stroke")
        state, tensions = displaced.state, displaced.tensions
        stiffness, misfit = displaced.side.stiffness, displaced.side.misfit
    radius = float(np.linalg.norm(geometry.platform_points, axis=-1).max())
    upu = np.flatnonzero(mechanism.is_upu)
    poses = PoseStack(mechanism, radius, upu, state, tensions, stiffness, misfit, limits, bounds, socket, weights)
    chosen, missing = distribute(law, poses, status, progress)
    return finished(law, poses, query, chosen, missing, margin, determinant, arm)


def _aligned_sides(law: Split, model: EquilibriumModel, query: Query) -> tuple[FloatArray, FloatArray]:
    """Stiffness of the limbs and misfit where the centres coincide; zero for a split that does not use them."""
    none = np.zeros((len(query.matrices), 3))
    misfit = np.zeros((len(none), model.mechanism.limb_count))
    if law.shoulder_stiffness(model.mechanism) is None:
        return misfit, misfit
    return side_wrenches(model.mechanism, query.matrices, none, none).stiffness, misfit


def _check_options(law: Split, **options: Any) -> None:
    """Refuse options that do not belong together."""
    kinds = {"cone": GlenoidCone, "weights": Weights}
    for name, value in options.items():
        if value is None:
            continue
        check_option(law, name)
        if name in kinds and not isinstance(value, kinds[name]):
            raise InvalidInput(f"expected {name} to be a {kinds[name].__name__}, got {type(value).__name__}")
