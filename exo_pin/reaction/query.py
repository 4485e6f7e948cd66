"""The reaction query: poses, motion and load in, forces out."""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.validation import FloatArray, as_choice, require_type
from ..load_case import CentreOffset, CentrePath, Load, Motion
from ..load_case.pose_stacks import Query, arm_loads, as_query
from ..wrist.forces.affine_state import AffineState, BalancedTensions
from ..wrist.forces.displaced import Displaced, as_offset
from ..wrist.forces.side_forces import side_wrenches
from ..wrist.limbs import classify
from ..wrist_chain.equilibrium import EquilibriumModel
from .answer import answer, answered
from .constraints.actuator_limits import LimbLimits
from .constraints.glenoid_cone import GlenoidCone
from .constraints.limb_limits import Limits, as_limb_limits
from .constraints.side_force_bounds import UNBOUNDED, ConstraintBounds, SideForceBounds
from .elastic_poses import ElasticPoses
from .result import Reaction
from .splits.elastic import Elastic
from .splits.limb_and_side_forces import Socket, Weights
from .splits.registry import SPLITS
from .splits.split import PoseStack, Split, limb_lengths

__all__ = ["as_split", "check_option", "reaction"]


def reaction(
    model: EquilibriumModel,
    orientation: Rotation,
    motion: Motion | None = None,
    load: Load | None = None,
    split: str | Split = "spherical",
    constraint_bounds: ConstraintBounds = None,
    centre_offset: CentreOffset | CentrePath | ArrayLike | None = None,
    *,
    limits: Limits = "design",
    cone: GlenoidCone | None = None,
    weights: Weights | None = None,
    progress: bool = False,
) -> Reaction:
    """Forces on arm, shoulder and torso; see :meth:`exo_pin.ShoulderExo.reaction`.

    Source: thesis (D-7), (D-9), (D-30).
    """
    law, mechanism = as_split(split), model.mechanism
    if not (constraint_bounds is None and weights is None and cone is None):
        _check_options(law, constraint_bounds=constraint_bounds, weights=weights, cone=cone)
    law.check(mechanism)
    if motion is not None:
        mechanism.require_arm("motion", inertia=True)
    query = as_query(orientation, motion, load)
    offset = None
    if centre_offset is not None:
        moved = centre_offset.offset(orientation) if isinstance(centre_offset, CentrePath) else centre_offset
        offset = law.offsets(query.matrices, *as_offset(moved, query.shape))
    device = None
    if isinstance(law, Elastic):
        device = ElasticPoses(law, mechanism, query, offset, partial(_loads_at, model, orientation, motion, load))
    lengths = partial(limb_lengths, mechanism, query.matrices, offset) if device is None else device.lengths
    # The way from a design to its answer needs none of the other forms of limits.
    if isinstance(limits, str) and limits == "design":
        allowed = LimbLimits.of_design(mechanism, lengths())
    else:
        allowed = as_limb_limits(limits, mechanism, query.shape, lengths)
    bounds = UNBOUNDED
    if constraint_bounds is not None:
        signed = allowed.one_signed
        bounds = SideForceBounds(constraint_bounds, query.shape, mechanism.limb_count, signed, offset is not None)
    socket = None if cone is None else Socket.of(cone, mechanism.side, orientation)
    loads = arm_loads(model.arm, mechanism.gravity, query) if device is None else device.loads
    if device is not None:
        own, unmoved = device.device.displaced, device.unmoved
        classified = (device.status, unmoved.margin, unmoved.determinant)
        found = _Equilibria(own.state, own.tensions, own.side.stiffness, device.device.misfit, *classified)
    elif offset is None:
        found = _aligned(model, law, query, progress)
    else:
        own = Displaced(mechanism, query, *offset, *loads[:2])
        found = _Equilibria(own.state, own.tensions, own.side.stiffness, own.side.misfit, *own.classified)
    options = (allowed, bounds, socket, weights)
    poses = PoseStack(mechanism, model.radius, model.upu, *found, *options, query.matrices, offset)
    if device is not None:
        poses, loads = device.within_limits(poses, progress), device.loads
    return answer(law, poses, query.shape, loads, progress)


def as_split(split: str | Split) -> Split:
    """The split with a name; an instance of a class of the user is returned as it is.

    Raises
    ------
    InvalidInput
        If there is no split of that name.
    """
    if isinstance(split, str) and split in SPLITS:
        return SPLITS[split]
    return split if isinstance(split, Split) else SPLITS[as_choice("split", split, tuple(SPLITS))]


def check_option(split: Split, option: str) -> None:
    """Raise for an option that a split does not support.

    Raises
    ------
    InvalidInput
        With the reason, or the splits that support it.
    """
    if option in split.options:
        return
    if option in split.refusals:
        raise InvalidInput(split.refusals[option])
    names = [f'split="{other.name}"' for other in SPLITS.values() if option in other.options]
    raise InvalidInput(f"{option} belong to {' or '.join(names)}, got split={split.name!r}")


class _Equilibria(NamedTuple):
    """Equilibrium of N poses, stiffness and misfit of their limbs, and their distance from a singularity."""

    state: AffineState
    tensions: BalancedTensions
    stiffness: FloatArray
    misfit: FloatArray
    status: NDArray[np.int8]
    margin: FloatArray
    determinant: FloatArray


def _aligned(model: EquilibriumModel, law: Split, query: Query, progress: bool) -> _Equilibria:
    """Equilibrium through Pinocchio, where the device's centre is the shoulder's."""
    mechanism = model.mechanism
    limbs = classify(mechanism, query.matrices)
    state = model.states(query, limbs, answered(limbs.status), progress)
    stiffness = misfit = np.zeros_like(limbs.length)
    if law.shoulder_stiffness(mechanism) is not None:
        none = np.zeros((len(stiffness), 3))
        stiffness = side_wrenches(mechanism, query.matrices, none, none).stiffness
    return _Equilibria(state, BalancedTensions.of(state), stiffness, misfit, *limbs[:3])


def _loads_at(
    model: EquilibriumModel,
    orientation: Rotation,
    motion: Motion | None,
    load: Load | None,
    rows: NDArray[np.intp],
    matrices: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Loads of the arm in rows of the stack at other orientations; a row may occur more than once."""

    def own(array: Any) -> FloatArray:
        return np.asarray(np.broadcast_to(array, (*orientation.shape, 3)).reshape(-1, 3)[rows])

    if motion is not None:
        motion = Motion(own(motion.angular_velocity), own(motion.angular_acceleration))
    if load is not None:
        load = Load(own(load.force), own(load.moment), own(load.at), load.frame)
    query = as_query(Rotation.from_matrix(matrices, assume_valid=True), motion, load)
    return arm_loads(model.arm, model.mechanism.gravity, query)


def _check_options(law: Split, **options: Any) -> None:
    """Raise for options that the split does not support or that have a wrong type."""
    kinds = {"cone": GlenoidCone, "weights": Weights}
    for name, value in options.items():
        if value is None:
            continue
        check_option(law, name)
        if name in kinds:
            require_type(name, value, kinds[name])
