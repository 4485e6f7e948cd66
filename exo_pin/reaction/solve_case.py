"""From a case and assumptions to an answer."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.errors.checked import checked
from ..core.validation import FloatArray, require_method, require_type
from ..device.wrist_device import WristDevice, as_device
from ..load_case import Case
from ..load_case.pose_stacks import Query, arm_loads
from ..wrist.forces.affine_state import BalancedTensions, EquilibriumParts
from ..wrist.forces.displaced import Displaced, as_offset
from ..wrist.limbs import Limbs, classify
from ..wrist_chain.equilibrium import EquilibriumModel, equilibrium_model
from .answer import answer, answered
from .assumptions import Assumptions
from .constraints.actuator_limits import LimbLimits, limits_motion
from .constraints.given_limits import UNBOUNDED, SideForceBounds, are_actuators, as_limb_limits
from .elastic import Elastic, ElasticPoses
from .result import Reaction
from .splits.limb_and_side_forces import Socket
from .splits.pose_stack import PoseStack, limb_lengths


@checked
def solve(device: Any, case: Case, assumptions: Assumptions | None = None, *, progress: bool = False) -> Reaction:
    """Forces on arm, shoulder and torso: the one way from a question to its answer.

    Parameters
    ----------
    device : ShoulderExo, Device, Mechanism or EquilibriumModel
        The device, on the wearer's arm.
    case : Case
        Poses, motion, load, centre offset, wearer.
    assumptions : Assumptions, optional
        How undetermined forces are chosen, and within which limits; limbs without side force within the limits of the
        design if left out.
    progress : bool
        Whether to show a progress bar on standard error.

    Returns
    -------
    Reaction

    Raises
    ------
    MissingData
        If the device has no arm, the case has a motion and the arm has no inertia, or the split is "elastic" and
        nothing has a stiffness.
    InvalidInput
        If case or assumptions do not fit the device; NonConvexBound and InfeasibleBounds are its children.

    Notes
    -----
    Source: thesis (D-7), (D-9), (D-30).

    Examples
    --------
    >>> exo = ep.load("four-linear-actuators")
    >>> case = ep.Case(exo.pose([0, 30, 60]), load=ep.Load([0, 0, -20], at=[0, 0, -0.5]))  # 20 N in the hand
    >>> ep.solve(exo, case, ep.Assumptions(split="minimal")).magnitude.round(1)
    array([33.6, 45.4, 37.1])
    """
    require_type("case", case, Case)
    chosen = Assumptions() if assumptions is None else assumptions
    require_type("assumptions", chosen, Assumptions)
    if case.wearer is not None:
        require_method("device", device, "worn_by", "a ShoulderExo, which a wearer can wear")
        device = device.worn_by(case.wearer)
    own = as_device(device)
    record = own.accelerate("forces") if case.posture is None else None
    if record is None:
        from .device_poses import device_poses, law_of_device  # here: closed forms need none of it

        chosen = law_of_device(chosen)
        return answer(case, chosen, *device_poses(own.as_chain(), case, chosen, progress), progress)
    mechanism = WristDevice.of(record)
    model, law = equilibrium_model(mechanism), chosen.law
    law.check(mechanism)
    if case.motion is not None:
        mechanism.require_arm("motion", inertia=True)
    query, moved, offset = case.query, case.offset, None
    if moved is not None:
        offset = law.offsets(query.matrices, *as_offset(moved, query.shape))
    elastic = limbs = None
    lengths: Callable[[], FloatArray] = partial(limb_lengths, mechanism, query.matrices, offset)
    if isinstance(law, Elastic):

        def loads_at(rows: NDArray[np.intp], matrices: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
            # A row may occur more than once.
            return arm_loads(model.arm, mechanism.gravity, case.turned(rows, matrices))

        elastic = ElasticPoses(law, mechanism, query, offset, loads_at)
        lengths = elastic.lengths
    elif offset is None:
        limbs = classify(mechanism, query.matrices)
        lengths = partial(getattr, limbs, "length")
    # The way from a design to its answer needs none of the other forms of limits.
    if isinstance(chosen.limits, str) and chosen.limits == "design":
        limits = LimbLimits.of_design(mechanism, lengths())
    else:
        limits = as_limb_limits(chosen.limits, mechanism, query.shape, lengths)
    bounds = UNBOUNDED
    if chosen.constraint_bounds is not None:
        options = (query.shape, mechanism.limb_count, limits.one_signed, offset is not None)
        bounds = SideForceBounds(chosen.constraint_bounds, *options)
    cone = chosen.cone
    socket = None if cone is None else Socket.of(cone, mechanism.side, case.poses)
    loads = arm_loads(model.arm, mechanism.gravity, query) if elastic is None else elastic.loads
    if elastic is not None:
        found = elastic.parts
    elif offset is not None:
        found = Displaced(mechanism, query, *offset, *loads[:2]).parts
    else:
        assert limbs is not None
        found = _aligned(model, query, limbs, progress)
    if case.motion is not None and limits.asked and limits_motion(mechanism) and not are_actuators(chosen.limits):
        shortening = (query.velocity[:, None] @ found[0].moment_of_f)[:, 0]
        limits = limits.in_motion(mechanism, shortening)
    poses = PoseStack(mechanism, query.matrices, offset, *found, limits, bounds, socket, chosen.weights)
    if elastic is not None:
        poses, loads = elastic.within_limits(poses, progress), elastic.loads
    return answer(case, chosen, poses, loads, progress)


def _aligned(model: EquilibriumModel, query: Query, limbs: Limbs, progress: bool) -> EquilibriumParts:
    """Equilibrium through Pinocchio, where the device's centre is the shoulder's: parts as of :class:`Displaced`."""
    state = model.states(query, limbs, answered(limbs.status), progress)
    nothing = np.zeros_like(limbs.length)
    return state, BalancedTensions.of(state), nothing, nothing, *limbs[:3]
