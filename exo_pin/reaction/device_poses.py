"""Poses of a device that is not a wrist: its equilibrium and its limits, as a split takes them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from ..core.errors import InvalidInput
from ..core.validation import FloatArray
from ..device.balance.device_state import DeviceState, least_efforts
from ..device.chain_device import ChainDevice
from ..device.device_model import SINGULAR_BEFORE, device_model
from ..device.elastic.soft_equilibrium import determined_device, soft_equilibrium
from ..device.elastic.soft_tree import twisting_device
from ..device.equilibrium import DeviceEquilibrium, device_equilibrium
from ..device.turns.given_postures import given_posture
from ..load_case.case import Case
from ..load_case.pose_stacks import Query, arm_loads
from ..wrist.forces.affine_state import BalancedTensions
from ..wrist.forces.displaced import as_offset
from .answer import QUERY_STATUS, answered
from .assumptions import Assumptions
from .constraints.actuator_limits import LimbLimits, limits_motion
from .constraints.given_limits import UNBOUNDED, SideForceBounds, are_actuators, as_limb_limits
from .elastic import DeviceElastic
from .splits.limb_and_side_forces import Socket
from .splits.pose_stack import UNFELT, EffortSharing, PoseStack, sharing_of
from .splits.split import shortest_tensions

if TYPE_CHECKING:
    from ..design import Mechanism

#: Codes of a pose that the device does not reach, in :data:`exo_pin.reaction.answer.QUERY_STATUS`: the loops cannot
#: close on the way, or the assembly mode from rest ends on it at a singular configuration; and of one that the data of
#: a part do not cover.
OUT_OF_REACH, BEYOND_SINGULAR, NOT_EVALUATED = (
    QUERY_STATUS.index(name) for name in ("out_of_reach", "beyond_singular", "not_evaluated")
)
#: Rounds between geometry and efforts, and their change, relative to the largest effort, at which they end.
_ROUNDS, _SAME = 30, 1e-10


def law_of_device(assumptions: Assumptions) -> Assumptions:
    """The assumptions with what a split means for a device that is not a wrist."""
    if not assumptions.law.moves:
        return assumptions
    own = replace(assumptions)
    vars(own)["law"] = DeviceElastic(assumptions.law.name)
    return own


def device_poses(
    device: ChainDevice, case: Case, assumptions: Assumptions, progress: bool = False
) -> tuple[PoseStack, tuple[FloatArray, FloatArray, FloatArray]]:
    """Poses with their equilibrium and limits, and the loads of the arm as of :func:`arm_loads`.

    Raises
    ------
    MissingData
        If the device has no arm, or the case has a motion and the arm no inertia.
    InvalidInput
        If an assumption does not fit the device.
    """
    arm = device.arm
    if arm is None or case.motion is not None:
        arm = device.require_arm("weight", inertia=case.motion is not None)
    law, query = assumptions.law, case.query
    settled: Callable[..., DeviceEquilibrium]
    moved = case.offset
    offset = None if moved is None else law.offsets(query.matrices, *as_offset(moved, query.shape))
    posture = None if case.posture is None else given_posture(device, case.posture, query.shape)
    if law.moves:
        count = len(query.matrices)
        base, cuff = (np.broadcast_to(part, (count, 3)) for part in offset or (np.zeros(3), np.zeros(3)))
        settled = partial(soft_equilibrium, device, query, base, cuff, posture=posture)
        if not law.chooses_tensions:
            settled = partial(settled, turned=partial(_turned, case))
        found = settled(progress=progress)
        device = determined_device(device)
    else:
        if offset is not None and device.guided_slides:
            device = twisting_device(device)
        found = device_equilibrium(device, query, offset, progress, posture)
    # What the limits ask of a mechanism a device has, too.
    own, rank, sharing = cast("Mechanism", device), device.structure.rank, sharing_of(device)
    # The way from a device to its answer needs none of the other forms of limits.
    if isinstance(assumptions.limits, str) and assumptions.limits == "design":
        limits = LimbLimits.of_design(own, found.coordinates)
    else:
        limits = as_limb_limits(assumptions.limits, own, query.shape, lambda: found.coordinates)
    if limits.asked:
        limits = replace(limits, passive_error=_passive_error(device, found.q))
        if law.moves and law.chooses_tensions and limits.bound_forces and len(device.efforts) > rank:
            _within_limits(settled, found, limits, rank, sharing)
    if case.motion is not None and limits.asked and limits_motion(own) and not are_actuators(assumptions.limits):
        limits = limits.in_motion(own, found.rates)
    unreached = np.where(found.why == SINGULAR_BEFORE, BEYOND_SINGULAR, OUT_OF_REACH)
    status = np.where(found.evaluated, found.status, NOT_EVALUATED)
    status = np.where(found.reached, status, unreached).astype(np.int8)
    bounds = UNBOUNDED
    if assumptions.constraint_bounds is not None:
        options = (query.shape, device.limb_count, limits.one_signed, False)
        bounds = SideForceBounds(assumptions.constraint_bounds, *options)
        if bounds.by_tension:
            raise InvalidInput('expected constraint_bounds in N for a device that is not a wrist, got "actuator"')
    cone = assumptions.cone
    socket = None if cone is None else Socket.of(cone, device.side, case.poses)
    tensions = balanced_efforts(found.state, rank, sharing)
    if found.moved is not None and not law.chooses_tensions:
        # What a lock bears follows from the lengths.
        query = case.turned(np.arange(len(status)), found.moved.arm)
        tensions.f[:] = found.moved.efforts
    if sharing.wearer is not None and limits.asked:
        limits = limits.allowing(sharing.wearer, tensions.f, UNFELT * arm.weight_moment(device.gravity))
    nothing = np.zeros((len(status), device.limb_count))
    poses = PoseStack(
        own, query.matrices, offset, found.state, tensions, nothing, nothing, status, found.margin,  # type: ignore[arg-type]
        np.full(len(status), np.nan), limits, bounds, socket, assumptions.weights, None, found, sharing,
    )  # fmt: skip
    return poses, arm_loads(arm, device.gravity, query)


def _turned(case: Case, k: int, matrix: FloatArray) -> Query:
    """The question of one pose with the arm in another orientation, shape (3, 3)."""
    return case.turned(np.array([k]), matrix[None])


def balanced_efforts(state: DeviceState, rank: int, sharing: EffortSharing) -> BalancedTensions:
    """Efforts in equilibrium, without limits, as :class:`.EffortSharing` says.

    Parameters
    ----------
    state : DeviceState
        N poses.
    rank : int
        Rows that drives and brakes can meet in general; the columns of what is left free do not depend on the pose.
    sharing : EffortSharing
        Of the device.
    """
    count, _, p = state.moment_of_f.shape
    held = p if sharing.wearer is None else int((~sharing.wearer).sum())
    scales = 1.0 if sharing.scales is None else sharing.scales[:held]
    rows, rest = state.moment_of_f[..., :held], (rank, sharing.wearer is not None, scales)
    f, stress, values = least_efforts(rows, state.moment, *rest)
    f_of_g = np.zeros((count, p, p))
    if state.moment_of_g.any():
        f_of_g[:] = least_efforts(rows[:, None], -state.moment_of_g.mT, *rest).f.mT
    return BalancedTensions(
        f,
        f_of_g,
        stress,
        state.shoulder + (state.shoulder_of_f @ f[..., None])[..., 0],
        state.shoulder_of_g + state.shoulder_of_f @ f_of_g,
        state.shoulder_of_f @ stress,
        values,
    )


def _passive_error(device: ChainDevice, q: FloatArray) -> FloatArray:
    """By how much joints without drive are beyond their limits, shape (N,), m or rad."""
    places, lower, upper = device_model(device).passive_limits
    past = np.maximum(lower - q[:, places], q[:, places] - upper)
    return np.asarray(past.max(axis=1, initial=0.0))


def _within_limits(
    settled: Callable[..., DeviceEquilibrium],
    found: DeviceEquilibrium,
    limits: LimbLimits,
    rank: int,
    sharing: EffortSharing,
) -> None:
    """Move poses of a device that gives way to the equilibrium of efforts within the limits, in place.

    Poses in which no efforts will do stay where they are; those that do not come to rest are not solved.

    Parameters
    ----------
    settled : callable
        Takes ``preferred`` efforts and ``rows``, and returns the equilibrium.
    found : DeviceEquilibrium
        Without limits, changed.
    limits : LimbLimits
        Of the efforts.
    rank, sharing
        As of :func:`.balanced_efforts`.
    """
    rows, free = answered(found.status), balanced_efforts(found.state, rank, sharing)
    rows = rows[limits.reachable[rows] & ~limits.met(free.f[rows], rows)]
    last = np.full(found.coordinates.shape, np.nan)
    for _ in range(_ROUNDS):
        f = _chosen(balanced_efforts(found.state, rank, sharing), limits, rows, sharing.scales)
        known = np.isfinite(f).all(axis=1)
        rows, f = rows[known], f[known]
        with np.errstate(invalid="ignore"):
            moved = np.abs(f - last[rows]).max(axis=1)
        left = ~(moved <= _SAME * np.abs(f).max(axis=1))
        rows = rows[left]
        if not rows.size:
            return
        last[rows] = f[left]
        _put(found, settled(preferred=last, rows=rows), rows)
        rows = rows[found.status[rows] < QUERY_STATUS.index("singular")]
    found.status[rows] = QUERY_STATUS.index("not_solved")


def _chosen(
    tensions: BalancedTensions, limits: LimbLimits, rows: NDArray[np.intp], scales: FloatArray | None
) -> FloatArray:
    """Efforts of least norm within the limits at the geometry as it is; NaN where there are none."""
    own = tensions.f[rows], tensions.self_stress[rows]
    return shortest_tensions(*own, limits.lower[rows], limits.upper[rows], scales)


def _put(whole: tuple[object, ...], part: tuple[object, ...], rows: NDArray[np.intp]) -> None:
    """Take rows of all arrays of one record from another."""
    for one, other in zip(whole, part, strict=True):
        if isinstance(one, tuple) and isinstance(other, tuple):
            _put(one, other, rows)
        elif isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
            one[rows] = other[rows]
