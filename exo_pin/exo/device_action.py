"""From the limb forces of a device to its wrenches on the wearer's arm."""

from __future__ import annotations

from functools import partial
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.validation import FloatArray, as_choice, as_finite, as_pair, broadcast_to
from ..design import Mechanism
from ..device.chain_device import ChainDevice
from ..device.protocol import Device
from ..load_case import Case
from ..load_case.pose_stacks import carried, require_massless
from ..person import DeviceAction
from ..reaction import Assumptions, Limits, Reaction
from ..reaction.answer import QUERY_STATUS
from ..reaction.constraints.given_limits import as_limb_limits, two_ends
from ..reaction.device_poses import device_poses
from ..reaction.holding.hold_check import hold_check
from ..reaction.splits.pose_stack import limb_lengths
from ..wrist.forces.displaced import as_offset
from ..wrist.forces.side_forces import side_wrenches
from ..wrist.forces.wrench_feasibility import force_bounds

#: Ways to choose the limb forces together with the muscles, and their words.
_CHOSEN = {
    "least_effort": "limb forces of least muscle effort, chosen together with the activations",
    "least_contact": "limb forces and activations of least contact force: a lower bound, as muscles do not choose so",
}
_SIDES = "side forces and activations of least contact force: a lower bound, as muscles do not choose so"


def _cuff(reaction: Reaction) -> str:
    """What the cuff does on the arm, to follow what is said of the device; empty where it is on nobody's."""
    text = reaction.cuff_text().rstrip(".")
    return f"; {text[0].lower()}{text[1:]}" if text else ""


def action_of_reaction(reaction: Reaction, poses: Rotation, words: str = "") -> DeviceAction:
    """What a computed reaction puts on the person's arm; where it is beyond the device's limits, the closest forces.

    Forces that the device cannot give relieve nobody.
    """
    if reaction.status.shape != poses.shape:
        raise InvalidInput(
            f"expected a Reaction of the same poses, of shape {poses.shape}, got {reaction.status.shape}"
        )
    f, _, cuff = reaction.closest
    nothing = np.zeros((*f.shape, 6))
    blank = np.asarray(np.isnan(cuff).any(axis=-1))
    # A row without wrench is marked by its bounds.
    f = np.where(blank[..., None], np.nan, f)
    device, violated = cast(Device, reaction.source.poses.mechanism), reaction.limits.violated
    if not device.holds_alone:
        f[..., len(device.efforts) :] *= 0.0
        violated = blank | _beyond_own_limits(reaction, device)
    wrench = np.where(blank[..., None], 0.0, cuff)
    caution = _caution(violated & (reaction.reasons == ""), closest=True)
    if lacking := [text for text in reaction.reasons.ravel().tolist() if text]:
        caution = f"{_unevaluated(lacking)} {caution}".rstrip()
    return DeviceAction(
        wrench,
        nothing,
        f,
        f,
        chosen_by=(words or f"limb forces of a reaction, split {reaction.split}") + _cuff(reaction),
        caution=caution,
        held=~violated,
        drive_units=() if device.has_limbs else reaction.drive_units,
    )


def _beyond_own_limits(reaction: Reaction, device: Device) -> NDArray[np.bool_]:
    """Poses in which a device cannot do its part; moments that it leaves to its wearer are no limit of the device."""
    limits, evidence = reaction.limits, reaction.infeasibility
    f = reaction.actuator_forces
    moments = device.moment_of_wearer(f.reshape(-1, f.shape[-1]))
    left = np.linalg.norm(moments, axis=1).reshape(f.shape[:-1])
    # With the closest efforts the wearer has to add no more than equilibrium without limits leaves.
    lacking = left if evidence is None else np.linalg.norm(evidence.missing_wrench[..., 3:], axis=-1)
    apart = (np.nan_to_num(limits.length_error) != 0.0) | (np.nan_to_num(limits.excess_speed) != 0.0)
    beyond = apart.any(axis=-1) | (lacking > left + 1e-6 * (1.0 + left))
    return beyond if limits.passive is None else beyond | limits.passive


def _unevaluated(reasons: list[str]) -> str:
    """What of the poses is not known, by the reasons."""
    where = "in this pose" if len(reasons) == 1 else f"in {len(reasons)} poses"
    return f"What the device does {where} is not known: {reasons[0]}."


def _caution(violated: NDArray[np.bool_], closest: bool = False) -> str:
    """What the device cannot do in poses of any stack shape."""
    if not violated.any():
        return ""
    where = "" if violated.size == 1 else f" in {int(violated.sum())} of {violated.size} poses"
    text = f"Limb lengths or forces are beyond the device's limits{where}"
    return f"{text}; the closest forces that it can give are taken there." if closest else f"{text}."


def action_of_limbs(
    device: Device,
    case: Case,
    forces: ArrayLike | str,
    limits: Limits,
    constraint_bounds: float | tuple[ArrayLike, ArrayLike] | None,
    given_by: str = "",
) -> DeviceAction:
    """What each limb does per newton, and its bounds; with ``constraint_bounds`` its side force besides.

    ``given_by`` tells the reader where forces that are given come from.
    """
    mechanism = device.accelerate("contact") if case.posture is None else None
    if mechanism is None:
        if constraint_bounds is not None:
            raise InvalidInput("constraint_bounds are for wrists: pass a Reaction with side forces of the structure")
        return _action_of_drives(device.as_chain(), case, forces, limits, given_by)
    require_massless(mechanism)
    query, moved = case.query, case.offset
    shape, count, n = query.shape, len(query.matrices), mechanism.limb_count
    base, cuff = as_offset(np.zeros(3) if moved is None else moved, shape)
    side = side_wrenches(mechanism, query.matrices, base, cuff)
    limbs = -np.concatenate([side.directions, side.moment_arms], axis=-1)
    carried_part = np.zeros((count, 6))
    nothing = np.zeros((count, 3))
    for part in () if mechanism.arm is None else mechanism.arm.parts:
        if part.device:
            carried_part += np.concatenate(carried(part, mechanism.gravity, query, nothing, nothing), axis=1)
    allowed = as_limb_limits(limits, mechanism, shape, partial(limb_lengths, mechanism, query.matrices, (base, cuff)))
    lower, upper, least, words, violated = _bounds(
        forces, mechanism, allowed, np.ones(count, dtype=bool), shape, given_by or "given limb forces"
    )
    sides = 0
    if constraint_bounds is None:
        words = f"{words}; no side forces"
    else:
        own = -np.concatenate([side.forces, side.moments], axis=-1)
        low, high = _side_bounds(mechanism, constraint_bounds, shape)
        limbs = np.concatenate([limbs, own], axis=1)
        lower, upper = np.concatenate([lower, low], axis=1), np.concatenate([upper, high], axis=1)
        if isinstance(forces, str):
            words = f"{words}; side forces of the limbs with them"
        else:
            least, words = "contact", f"{words}; {_SIDES}"
        n, sides = 2 * n, n
    return DeviceAction(
        carried_part.reshape(*shape, 6),
        limbs.reshape(*shape, n, 6),
        lower.reshape(*shape, n),
        upper.reshape(*shape, n),
        least,
        words,
        _caution(violated.reshape(shape)),
        sides,
        ~violated.reshape(shape),
    )


def _action_of_drives(
    device: ChainDevice, case: Case, forces: ArrayLike | str, limits: Limits, given_by: str
) -> DeviceAction:
    """What each drive of a device does per unit of its effort, and its bounds; the structure puts no couple on it."""
    stack, loads = device_poses(device, case, Assumptions(limits=limits))
    shape, n, state, placed = case.poses.shape, device.limb_count, stack.state, stack.placed
    assert placed is not None
    unit = np.swapaxes(state.attached_of_f.sum(axis=1), 1, 2)  # type: ignore[attr-defined]
    alone = state.wrenches(*np.zeros((2, len(loads[2]), n)))[0].sum(axis=1) + loads[2]
    if isinstance(forces, str) and device.structure.held:
        raise InvalidInput(
            f"{device.name} can move while the arm rests, and its drives hold that: efforts that are chosen together "
            "with the muscles would not. Pass a reaction"
        )
    known = placed.reached & placed.evaluated
    alone[~known], unit[~known] = 0.0, 0.0
    lower, upper, least, words, violated = _bounds(
        forces, device, stack.limits, known, shape, given_by or "given efforts of the drives"
    )
    violated = violated | ~placed.reached | (placed.status == QUERY_STATUS.index("no_equilibrium"))
    whole = (alone.reshape(*shape, 6), unit.reshape(*shape, n, 6), lower.reshape(*shape, n), upper.reshape(*shape, n))
    caution = _caution(violated.reshape(shape))
    if lacking := ["; ".join(map(str, parts)) for parts in stack.lacking if parts]:
        caution = f"{_unevaluated(lacking)} {caution}".rstrip()
    return DeviceAction(
        *whole, least, words, caution, 0, ~violated.reshape(shape), () if device.has_limbs else device.drive_units
    )


def _side_bounds(
    mechanism: Mechanism, bounds: float | tuple[ArrayLike, ArrayLike], shape: tuple[int, ...]
) -> tuple[FloatArray, FloatArray]:
    """Bounds of the side forces, shape (N, n) each; zero for limbs that carry none."""
    ends = two_ends(
        as_pair("constraint_bounds", bounds), "constraint_bounds to be None, a number or (lower, upper) in N"
    )
    low, high = force_bounds("constraint_bounds", *ends, shape, mechanism.limb_count)
    return np.where(mechanism.is_upu, low, 0.0), np.where(mechanism.is_upu, high, 0.0)


def _bounds(
    forces: ArrayLike | str, device: Any, limits: Any, known: NDArray[np.bool_], shape: tuple[int, ...], given_by: str
) -> tuple[FloatArray, FloatArray, str, str, NDArray[np.bool_]]:
    """Bounds of the forces of N poses, shape (N, n), what is least, words on both, and where limits are broken.

    A pose that is not ``known``, and a length that an actuator cannot take at all, are marked by their bounds.
    """
    if isinstance(forces, str):
        as_choice("choice of limb forces", forces, _CHOSEN)
        lost = ~known[:, None] | np.isinf(limits.length_error).any(axis=1, keepdims=True)
        lower, upper = (np.where(lost, np.nan, ends) for ends in (limits.lower, limits.upper))
        return lower, upper, forces.removeprefix("least_"), _CHOSEN[forces], ~limits.reachable
    n = device.limb_count
    given = broadcast_to("forces", as_finite("forces", forces, (n,), stack=True), (*shape, n)).reshape(-1, n)
    given = np.where(known[:, None], given, np.nan)
    return given, given, "effort", given_by, hold_check(device, limits, given, known).violated
