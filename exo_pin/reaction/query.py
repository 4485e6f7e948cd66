"""The reaction query: poses, motion and load in, forces out."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.validation import FloatArray
from ..design import Mechanism
from ..load_case import CentreOffset, CentrePath, Load, Motion
from ..load_case.arm_loads import arm_loads
from ..load_case.pose_stacks import Query, as_query
from ..wrist.forces.affine_state import AffineState, BalancedTensions
from ..wrist.forces.closed_form import classify
from ..wrist.forces.displaced import Displaced, as_offset
from ..wrist.forces.side_forces import side_wrenches
from ..wrist_chain.equilibrium import EquilibriumModel
from .answer import QUERY_STATUS, answered, distribute
from .constraints.glenoid_cone import GlenoidCone
from .constraints.limb_limits import ActuatorBounds, ForceLimits
from .constraints.side_force_bounds import ConstraintBounds, SideForceBounds
from .elastic_poses import ElasticPoses
from .finished import finished
from .result import Reaction
from .splits.elastic import Elastic
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
    """Forces on arm, shoulder and torso; see :meth:`exo_pin.ShoulderExo.reaction`.

    Source: thesis (D-7), (D-9), (D-30).
    """
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
    loads = arm_loads(mechanism, query)
    device = None
    lengths: Callable[[], FloatArray] = partial(_lengths, mechanism, query, offset)
    if isinstance(law, Elastic):
        law.check_limits(actuator_bounds)
        device = ElasticPoses(law, mechanism, query, offset, partial(_loads_at, mechanism, orientation, motion, load))
        lengths, loads = device.lengths, device.loads
    limits = ForceLimits(actuator_bounds, query.shape, n, lengths)
    bounds = SideForceBounds(constraint_bounds, query.shape, n, limits.one_signed, offset is not None)
    socket = None if cone is None else Socket(*cone.half_spaces(mechanism.side), cone.penalty)
    if device is not None:
        _mark_out_of_stroke(device.status, limits)
        found = _Equilibria(*device.equilibria)
    elif offset is None:
        found = _aligned(model, law, query, orientation, limits, progress)
    else:
        displaced = Displaced(mechanism, query, *offset, *loads[:2])
        _mark_out_of_stroke(displaced.status, limits)
        side = displaced.side
        found = _Equilibria(displaced.state, displaced.tensions, side.stiffness, side.misfit, *displaced.classified)
    poses = PoseStack(
        mechanism,
        float(np.linalg.norm(mechanism.geometry.platform_points, axis=-1).max()),
        np.flatnonzero(mechanism.is_upu),
        found.state,
        found.tensions,
        found.state.shoulder_of_g,
        found.stiffness,
        found.misfit,
        limits,
        bounds,
        socket,
        weights,
    )
    if device is not None:
        poses, loads = device.within_limits(poses, progress), device.loads
    chosen, missing = distribute(law, poses, found.status, progress)
    return finished(law, poses, query, chosen, missing, found.margin, found.determinant, loads)


class _Equilibria(NamedTuple):
    """Equilibrium of N poses, stiffness and misfit of their limbs, and how near they are to a singularity."""

    state: AffineState
    tensions: BalancedTensions
    stiffness: FloatArray
    misfit: FloatArray
    status: NDArray[np.int8]
    margin: FloatArray
    determinant: FloatArray


def _aligned(
    model: EquilibriumModel, law: Split, query: Query, orientation: Rotation, limits: ForceLimits, progress: bool
) -> _Equilibria:
    """Equilibrium through Pinocchio, where the device's centre is the shoulder's."""
    mechanism = model.mechanism
    status, margin, determinant = classify(mechanism, query.matrices)
    _mark_out_of_stroke(status, limits)
    state = model.states(query, orientation.as_quat().reshape(-1, 4), answered(status).tolist(), progress)
    none = np.zeros((len(status), 3))
    stiffness = misfit = np.zeros((len(status), mechanism.limb_count))
    if law.shoulder_stiffness(mechanism) is not None:
        stiffness = side_wrenches(mechanism, query.matrices, none, none).stiffness
    return _Equilibria(state, BalancedTensions.of(state), stiffness, misfit, status, margin, determinant)


def _lengths(mechanism: Mechanism, query: Query, offset: tuple[FloatArray, FloatArray] | None) -> FloatArray:
    """Lengths of the limbs, shape (N, n), m."""
    base, cuff = offset or (np.zeros((len(query.matrices), 3)),) * 2
    arm = (mechanism.geometry.platform_points + cuff[:, None]) @ np.swapaxes(query.matrices, 1, 2)
    return np.asarray(np.linalg.norm(arm - mechanism.geometry.base_points - base[:, None], axis=-1))


def _loads_at(
    mechanism: Mechanism,
    orientation: Rotation,
    motion: Motion | None,
    load: Load | None,
    rows: NDArray[np.intp],
    matrices: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Loads of the arm in some poses of the stack with other orientations."""
    whole = orientation.as_matrix().reshape(-1, 3, 3)
    whole[rows] = matrices
    turned = Rotation.from_matrix(whole.reshape(*orientation.shape, 3, 3))
    force, moment, device = arm_loads(mechanism, as_query(turned, motion, load))
    return force[rows], moment[rows], device[rows]


def _mark_out_of_stroke(status: NDArray[np.int8], limits: ForceLimits) -> None:
    """Mark poses in which an actuator cannot take the length of its limb."""
    status[(status < QUERY_STATUS.index("singular")) & ~limits.reachable] = QUERY_STATUS.index("out_of_stroke")


def _check_options(law: Split, **options: Any) -> None:
    """Refuse options that do not belong together."""
    kinds = {"cone": GlenoidCone, "weights": Weights}
    for name, value in options.items():
        if value is None:
            continue
        check_option(law, name)
        if name in kinds and not isinstance(value, kinds[name]):
            raise InvalidInput(f"expected {name} to be a {kinds[name].__name__}, got {type(value).__name__}")
