"""From the limb forces of a device to its wrenches on the wearer's arm."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.validation import FloatArray, as_choice, as_finite, as_pair, as_real
from ..design import Mechanism
from ..load_case import CentreOffset, CentrePath, Load, Motion
from ..load_case.pose_stacks import Query, as_query, carried, require_massless
from ..numerics.vectors import SINGULAR_MARGIN
from ..person import DeviceAction, Person
from ..reaction import Limits, Reaction
from ..reaction.constraints.actuator_limits import LimbLimits
from ..reaction.constraints.limb_limits import as_limb_limits
from ..reaction.constraints.side_force_bounds import two_ends
from ..reaction.holding.hold_check import hold_check
from ..reaction.splits.spherical import shortest_tensions
from ..reaction.splits.split import limb_lengths
from ..wrist.forces.displaced import as_offset
from ..wrist.forces.side_forces import side_wrenches
from ..wrist.forces.wrench_feasibility import force_bounds

__all__ = ["action_of_limbs", "action_of_reaction"]

#: Ways to choose the limb forces together with the muscles, and their words.
_CHOSEN = {
    "least_effort": "limb forces of least muscle effort, chosen together with the activations",
    "least_contact": "limb forces and activations of least contact force: a lower bound, as muscles do not choose so",
}
_SIDES = "side forces and activations of least contact force: a lower bound, as muscles do not choose so"


def action_of_reaction(reaction: Reaction, orientation: Rotation) -> DeviceAction:
    """What a computed reaction puts on the person's arm."""
    if reaction.status.shape != orientation.shape:
        raise InvalidInput(
            f"expected a Reaction of the same poses, of shape {orientation.shape}, got {reaction.status.shape}"
        )
    # Forces that the device cannot give relieve nobody: where it cannot hold the pose, the closest that it can give.
    closest = reaction.closest
    f = closest.actuator_forces
    nothing = np.zeros((*f.shape, 6))
    blank = np.asarray(np.isnan(closest.cuff_wrench).any(axis=-1))
    # A row without wrench is marked by its bounds.
    f = np.where(blank[..., None], np.nan, f)
    wrench = np.where(blank[..., None], 0.0, closest.cuff_wrench)
    words = f"limb forces of a reaction, split {reaction.split}"
    return DeviceAction(wrench, nothing, f, f, chosen_by=words, caution=_caution(reaction.limits.violated))


def _caution(violated: NDArray[np.bool_]) -> str:
    """What the device cannot do in poses of any stack shape."""
    if not violated.any():
        return ""
    where = "" if violated.size == 1 else f" in {int(violated.sum())} of {violated.size} poses"
    return f"Limb lengths or forces are beyond the device's limits{where}."


def action_of_limbs(
    mechanism: Mechanism,
    wearer: Person,
    orientation: Rotation,
    forces: ArrayLike | str,
    motion: Motion | None,
    load: Load | None,
    limits: Limits,
    constraint_bounds: float | tuple[ArrayLike, ArrayLike] | None,
    centre_offset: CentreOffset | CentrePath | ArrayLike | None,
) -> DeviceAction:
    """What each limb does per newton, and its bounds; with ``constraint_bounds`` its side force besides."""
    require_massless(mechanism)
    if isinstance(centre_offset, CentrePath):
        centre_offset = centre_offset.offset(orientation)
    query = as_query(orientation, motion, load)
    shape, count, n = query.shape, len(query.matrices), mechanism.limb_count
    base, cuff = as_offset(np.zeros(3) if centre_offset is None else centre_offset, shape)
    side = side_wrenches(mechanism, query.matrices, base, cuff)
    limbs = -np.concatenate([side.directions, side.moment_arms], axis=-1)
    device = np.zeros((count, 6))
    nothing = np.zeros((count, 3))
    for part in () if mechanism.arm is None else mechanism.arm.parts:
        if part.device:
            device += np.concatenate(carried(part, mechanism.gravity, query, nothing, nothing), axis=1)
    caution, lengths = "", partial(limb_lengths, mechanism, query.matrices, (base, cuff))
    if isinstance(forces, str):
        as_choice("choice of limb forces", forces, _CHOSEN)
        allowed = as_limb_limits(limits, mechanism, shape, lengths)
        # A row without a possible length is marked by its bounds.
        lower, upper = (np.where(allowed.reachable[:, None], side, np.nan) for side in (allowed.lower, allowed.upper))
        words = _CHOSEN[forces]
        least = forces.removeprefix("least_")
    else:
        allowed = as_limb_limits(limits, mechanism, shape, lengths)
        lower, words, caution = _given(forces, limbs, device, wearer, mechanism, query, allowed)
        upper, least = lower, "effort"
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
        device.reshape(*shape, 6),
        limbs.reshape(*shape, n, 6),
        lower.reshape(*shape, n),
        upper.reshape(*shape, n),
        least,
        words,
        caution,
        sides,
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


def _given(
    forces: ArrayLike,
    limbs: FloatArray,
    device: FloatArray,
    wearer: Person,
    mechanism: Mechanism,
    query: Query,
    limits: LimbLimits,
) -> tuple[FloatArray, str, str]:
    """Limb forces of a share, or as given, shape (N, n), how they were chosen, and what the device cannot do.

    Of a share they are the shortest ones, or, where the actuators cannot give these and more than three limbs leave a
    choice, ones that they can give.
    """
    shape, (count, n) = query.shape, limbs.shape[:2]
    if as_real("forces", forces).ndim > 0:
        given = as_finite("forces", forces, (n,), stack=True)
        try:
            f = np.array(np.broadcast_to(given, (*shape, n)).reshape(count, n))
        except ValueError:
            raise InvalidInput(f"expected forces to broadcast to {(*shape, n)}, got {given.shape}") from None
        return f, "given limb forces", _caution(hold_check(mechanism, limits, f, np.ones(count, dtype=bool)).violated)
    share = float(as_finite("forces", forces, ()))
    if not 0.0 <= share <= 1.0:
        raise InvalidInput(f"expected forces as a share of 0 to 1 of the arm's moments, got {share:g} (percent?)")
    arm = wearer.arm
    moment = carried(arm, mechanism.gravity, query, query.force, query.moment)[1]
    needed = -(device[:, 3:] + share * moment)
    arms = np.swapaxes(limbs[:, :, 3:], 1, 2)
    _, values, axes = np.linalg.svd(arms)
    reach = float(np.linalg.norm(mechanism.geometry.platform_points, axis=-1).max())
    f = np.einsum("kni,ki->kn", np.linalg.pinv(arms), needed)
    good = values[:, -1] >= SINGULAR_MARGIN * reach
    beyond = np.flatnonzero(good & ~limits.met(f, np.arange(count)))
    if beyond.size and n > 3:
        stress = np.swapaxes(axes[beyond, 3:], 1, 2)
        within = shortest_tensions(f[beyond], stress, limits.lower[beyond], limits.upper[beyond])
        f[beyond] = np.where(np.isnan(within), f[beyond], within)
    words = f"limbs carry {100.0 * share:g} % of the moments of the person's arm"
    return np.where(good[:, None], f, np.nan), words, _caution(hold_check(mechanism, limits, f, good).violated)
