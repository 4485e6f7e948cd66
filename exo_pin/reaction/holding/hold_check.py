"""Whether the actuators can take the lengths and forces of a pose, and what an answer does not say by itself.

The forces are those of the answer: they were chosen within the limits where that is possible
(:func:`exo_pin.reaction.answer.chosen_forces`). What is computed here is by how much limits are missed, for the texts.
Cautions say how it was chosen, what was not checked, and which data were not used.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.results import Result
from ...core.tables import drive_list, enumerated, limb_list
from ...core.validation import FloatArray, ReadOnly
from ...design import Mechanism
from ...device.device_singularity import in_doubt, is_rounded
from ..constraints.actuator_limits import LimbLimits
from ..evidence import AnswerSource
from ..splits.pose_stack import UNFELT

#: Change of F_s with a unit of the last digit, over |F_s|, from which on it is a caution.
_NOTED = 0.01


@dataclass(frozen=True, eq=False)
class HoldCheck(Result, ReadOnly):
    """Lengths and tensions of a pose, or a stack of shape (...), compared with the limits of the actuators.

    Attributes
    ----------
    can_hold : ndarray of bool
        Shape (...): true only where every limit is known, none is estimated, and all are met.
    violated : ndarray of bool
        Shape (...): whether a limit, known or estimated, cannot be met.
    unknown : ndarray of bool
        Shape (...): whether the outcome depends on a limit that is missing or estimated, or was not found.
    length_error : ndarray
        Shape (..., n), m: negative where the limb would be shorter than its stroke allows, positive where longer,
        zero within, NaN where the stroke is not known.
    force_error : ndarray
        Shape (..., n), N: positive where the tension is above the greatest pull, negative where the limb would have to
        push harder than it can, zero within, NaN where the limit is not known.
    excess_speed : ndarray
        Shape (..., n), m/s: by how much the limb would have to be faster than its actuator can; zero within.
    tensions : ndarray
        f_i of the answer, shape (..., n), N.
    missing, estimated : tuple of str
        Limits of the design that are not known, and limits that are estimates.
    asked : bool
        Whether the query asked for limits; where it did not, nothing is known.
    drives : tuple of (str, str)
        Name and unit of the effort of each drive that has a name; empty for limbs, which have numbers
        and tensions in N.
    pulls : tuple of bool
        Of these drives: whether the effort is a tension, along a route or in a limb that is counted so; of a slide
        else it pushes where it is positive. All are tensions if left out.
    passive : ndarray of bool or None
        Shape (...): whether a joint without drive would be beyond its limits; None where none has any.
    """

    can_hold: NDArray[np.bool_]
    violated: NDArray[np.bool_]
    unknown: NDArray[np.bool_]
    length_error: FloatArray
    force_error: FloatArray
    excess_speed: FloatArray
    tensions: FloatArray
    missing: tuple[str, ...]
    estimated: tuple[str, ...]
    asked: bool = True
    drives: tuple[tuple[str, str], ...] = ()
    pulls: tuple[bool, ...] = ()
    passive: NDArray[np.bool_] | None = None

    def reshaped(self, shape: tuple[int, ...]) -> HoldCheck:
        """The same with the stack's shape."""
        arrays: dict[str, Any] = {
            name: value.reshape((*shape, *value.shape[1:]))
            for name, value in vars(self).items()
            if isinstance(value, np.ndarray)
        }
        return replace(self, **arrays)


def hold_check(
    mechanism: Mechanism,
    limits: LimbLimits,
    tensions: FloatArray,
    answered: NDArray[np.bool_],
    unmet: NDArray[np.bool_] | None = None,
    unsolved: NDArray[np.bool_] | bool = False,
) -> HoldCheck:
    """Compare the forces of N poses with their limits; nothing is chosen here.

    Parameters
    ----------
    mechanism : Mechanism
        The design.
    limits : LimbLimits
        Of these poses.
    tensions : ndarray
        f_i, shape (N, n), N.
    answered : ndarray of bool
        Shape (N,): poses with an answer; the others cannot be held.
    unmet : ndarray of bool, optional
        Shape (N,): poses that a query found cannot be held; those whose tensions or lengths are beyond a limit if left
        out.
    unsolved : ndarray of bool, optional
        Shape (N,): poses whose equilibrium was not found, although there may be one: nothing is known of them.
    """
    force_error = limits.force_error(tensions)
    estimated = estimated_limbs(mechanism) if limits.asked else np.zeros(mechanism.limb_count, dtype=bool)
    long = np.nan_to_num(limits.length_error) != 0.0
    fast = np.zeros_like(force_error) if limits.excess_speed is None else limits.excess_speed
    strong = (np.nan_to_num(force_error) != 0.0) | (fast != 0.0)
    if unmet is None:
        unmet = (long | strong).any(axis=1) & answered
    known = ~np.isnan(limits.length_error) & ~np.isnan(force_error)
    passive = None
    if limits.passive_error is not None:
        passive = answered & (limits.passive_error > 0.0)
        unmet = unmet | passive
    # Where estimated lengths alone are beyond their limits, the outcome depends on the estimate.
    sure = (unmet & ~(long.any(axis=1) & ~(long & ~estimated).any(axis=1) & ~strong.any(axis=1))) | ~answered
    open_ = ~sure & ((~known | estimated).any(axis=1) | (not limits.asked))
    return HoldCheck(
        can_hold=answered & ~unmet & ~open_,
        violated=unmet,
        unknown=open_ | unsolved,
        length_error=np.where(answered[:, None], limits.length_error, np.nan),
        force_error=np.where(answered[:, None], force_error, np.nan),
        excess_speed=np.where(answered[:, None], fast, np.nan),
        tensions=np.where(answered[:, None], tensions, np.nan),
        missing=missing_limits(mechanism, not (limits.open_below | limits.open_above).any()) if limits.asked else (),
        estimated=_estimates(mechanism) if limits.asked else (),
        asked=limits.asked,
        drives=() if mechanism.has_limbs else mechanism.drive_units,
        pulls=() if mechanism.has_limbs else tuple(own.joint is None or own.pulls for own in mechanism.limbs),  # type: ignore[attr-defined]
        passive=passive,
    )


def _estimates(mechanism: Mechanism) -> tuple[str, ...]:
    return tuple(key for key in mechanism.estimated if ".stroke" in key or ".actuator" in key)


def estimated_limbs(mechanism: Mechanism) -> NDArray[np.bool_]:
    """Shape (n,): limbs of which a limit is an estimate."""
    keys = _estimates(mechanism)
    names = [(f"limbs[{i}].stroke", f"limbs[{i}].actuator") for i in range(mechanism.limb_count)]
    return np.array([any(key.startswith(own) for key in keys) for own in names])


def missing_limits(mechanism: Mechanism, known_forces: bool = False) -> tuple[str, ...]:
    """Data that are missing for a verdict on every pose, one entry for each quantity, with the limbs that lack it.

    Limits of the forces are left out if all of them are known (``known_forces``), by the design or from a query.
    """
    lacking: dict[str, list[int]] = {}
    for row, limb in enumerate(mechanism.limbs):
        for quantity in limb.missing_limits(known_forces):
            lacking.setdefault(quantity, []).append(row)
    return tuple(f"{name} of {drive_list(mechanism.drive_units, rows)}" for name, rows in lacking.items())


#: Side forces that are so many times larger than every other force of an answer are named.
_LARGE_SIDE_FORCES = 10.0


def criterion(source: AnswerSource) -> str:
    """By what one of many sets of forces was chosen, in words."""
    poses, split = source.poses, source.split
    mechanism = poses.mechanism
    if not poses.tensions.self_stress.shape[2] and not (split.chooses_sides and mechanism.is_upu.any()):
        return f"none needed: with {split.assumed(mechanism)} equilibrium determines the forces"
    words = split.criterion or f"that of split {split.name!r}"
    if poses.sharing is not None:
        words += poses.sharing.words
    if poses.weights is not None:
        words = "least weighted sum of squares of F_s and of the tensions"
    if poses.socket is not None:
        words += f", with F_s {'inside' if poses.socket.is_hard else 'near'} the cone of the glenoid"
    return words + (", within the limits of the limbs" if poses.limits.bound_forces else "")


def cautions(source: AnswerSource, check: HoldCheck) -> Iterator[str]:
    """Sentences on what was not checked and not used; see :attr:`exo_pin.Reaction.cautions`.

    Parameters
    ----------
    source : AnswerSource
        The answer.
    check : HoldCheck
        Its limits, of the same stack.
    """
    mechanism = source.poses.mechanism
    held = source.held & ~np.isnan(source.values).any(axis=1)
    if held.any():
        yield from _slack(mechanism, source, held)
        yield from _large_side_forces(source, held)
    if check.asked and check.missing and check.can_hold.ndim:
        yield f"Not checked, because not known: {', '.join(check.missing)}."
    yield from _of_device(source)
    near = source.poses.gaps
    if near.unknown:
        yield f"Not checked: whether the device touches the body or itself. Not known: {', '.join(near.unknown)}."
    elif near.left_out:
        yield f"Not checked for clearance: {enumerated(near.left_out)}."
    yield from _not_used(mechanism, source)
    if source.split.moves:
        yield from _rigid(mechanism)


def _of_device(source: AnswerSource) -> Iterator[str]:
    """What to mind of efforts and postures, and of a cuff whose place is not known."""
    sharing, device = source.poses.sharing, source.poses.mechanism
    yield from device.doubts
    placed = source.poses.placed
    if placed is not None and (doubt := in_doubt(device.chain, placed.q)).any():  # type: ignore[attr-defined]
        where = f" in {doubt.sum()} of {len(doubt)} poses" if len(doubt) > 1 else ""
        yield f"Undetermined{where}: the digits of the robot's file may make or hide a singular pose."
    if placed is not None and is_rounded(device.chain):  # type: ignore[attr-defined]
        yield from _of_digits(source)
    if sharing is not None and sharing.unknown and source.poses.tensions.self_stress.shape[2]:
        yield (
            f"Efforts in N and in N m are shared by their numbers: no limit is known of {enumerated(sharing.unknown)}, "
            "to compare them by."
        )
    if sharing is not None and sharing.wearer is not None and source.poses.limits.asked:
        left = np.linalg.norm(source.poses.limits.upper[:, sharing.wearer], axis=1)
        # Less is rounding of a device that leaves nothing.
        if left.max(initial=0.0) > 1e-9:
            most = device.require_arm("moments").weight_moment(device.gravity)
            yield (
                f"Counted as held: up to {left.max():.2g} N m are left to the wearer, at most {100.0 * UNFELT:g} % of "
                f"the greatest moment of the arm's weight ({most:.3g} N m)."
            )
    if sharing is not None and sharing.wearer is not None and source.split.moves and source.split.chooses_tensions:
        left = np.linalg.norm(source.values[:, : len(sharing.wearer)][:, sharing.wearer], axis=1)
        if (left > UNFELT * device.require_arm("moments").weight_moment(device.gravity)).any():
            yield (
                'The arm is kept in the pose also about axes that no drive turns; split="elastic_locked" lets it turn '
                "there as far as what is soft gives way."
            )
    if source.poses.posture:
        yield f"Posture: {source.poses.posture}."
    if device.is_upu.any() and not device.cuff_is_known:  # type: ignore[attr-defined]
        yield "Not known: where the cuff is ([roles] cuff); couples are least at the single attachments instead."


def _of_digits(source: AnswerSource) -> Iterator[str]:
    """What a unit of the last digit of a robot's file can do to F_s.

    A unit moves the lines of all forces on the arm by as much, and so changes the moments that the efforts balance.
    """
    described, state = source.poses.mechanism.chain.description, source.poses.state  # type: ignore[attr-defined]
    unit, count = 2.0 * (described.tolerance or described.rounding), state.moment_of_f.shape[2]
    known = np.flatnonzero(~np.isnan(source.values).any(axis=1))
    f, g, F_s = np.split(source.values[known], [count, 2 * count], axis=1)
    state = type(state)(*(part[known] for part in state))
    per_moment = np.linalg.norm(state.shoulder_of_f @ np.linalg.pinv(state.moment_of_f), 2, axis=(1, 2))
    on_arm = np.linalg.norm(state.wrenches(f, g)[0][..., :3], axis=2).sum(axis=1)
    change = unit * per_moment * np.maximum(on_arm, np.abs(f).sum(axis=1))
    if not (change > _NOTED * np.linalg.norm(F_s, axis=1)).any():
        return
    worst = int(change.argmax())
    where = f" in pose {known[worst]}" if len(source.values) > 1 else ""
    yield (
        f"Rounded: one unit of the last digit of the robot's file, {unit:.2g} m, changes F_s by up to about "
        f"{change[worst]:.2g} N{where}."
    )


def _slack(mechanism: Mechanism, source: AnswerSource, held: NDArray[np.bool_]) -> Iterator[str]:
    """Limbs that only pull, have no least tension and pull with nothing."""
    f = source.values[held, : mechanism.limb_count]
    none = f <= 1e-9 * np.abs(f).max(axis=1)[:, None]
    none &= source.poses.limits.lower[held] == 0.0
    counts = {i: int(none[:, i].sum()) for i, limb in enumerate(mechanism.limbs) if limb.actuator is not None}
    loose = {limb: count for limb, count in counts.items() if count}
    if not loose:
        return
    if len(none) == 1:
        words, verb = drive_list(mechanism.drive_units, loose), "is" if len(loose) == 1 else "are"
        text = f"{words[:1].upper()}{words[1:]} {verb} slack"
    else:
        each = enumerated(f"{drive_list(mechanism.drive_units, [limb])} in {count}" for limb, count in loose.items())
        text = f"Of {len(none)} held poses limbs are slack, {each}"
    yield f"{text}: a least tension of the actuator (least_tension) keeps a limb taut."


def _large_side_forces(source: AnswerSource, held: NDArray[np.bool_]) -> Iterator[str]:
    """Side forces far above the rest: small lever arms, as of an offset of some micrometres, make them."""
    n = source.poses.mechanism.limb_count
    values = np.abs(source.values[held])
    # Of the needed forces those without side forces are the measure: large ones can make tensions large, too.
    needed = source.poses.tensions
    plain = np.maximum(np.abs(needed.f[held]).max(axis=1), np.linalg.norm(needed.shoulder[held], axis=1))
    ratio = values[:, n : 2 * n].max(axis=1) / np.maximum(plain, 1e-300)
    if ratio.max() > _LARGE_SIDE_FORCES:
        worst = int(ratio.argmax())
        yield (
            f"Side forces reach {values[worst, n : 2 * n].max():.3g} N, {ratio[worst]:.0f} times the forces without "
            "them: nothing bounds them there (constraint_bounds does)."
        )


def _rigid(mechanism: Mechanism) -> Iterator[str]:
    """Parts without a stiffness, which a split by stiffness takes as rigid, and limbs without a guide."""
    parts = {"shoulder": mechanism.shoulder.stiffness}
    parts |= {name: getattr(mechanism.interfaces, name) for name in ("harness", "cuff")}
    names = [name for name, stiffness in parts.items() if stiffness is None]
    if names:
        yield f"Taken as rigid, because no stiffness is given: {enumerated(names)}."


def _not_used(mechanism: Mechanism, source: AnswerSource) -> Iterator[str]:
    """Data of the design that the assumptions leave out."""
    names = []
    split = source.split
    if not split.determines_sides:
        names += ["shoulder"] if mechanism.shoulder.stiffness is not None else []
        guided = [i + 1 for i, limb in enumerate(mechanism.limbs) if limb.guide is not None]
        names += [f"guides of {limb_list(guided)}"] if guided else []
    if not split.moves:
        interfaces = mechanism.interfaces
        names += [name for name in ("harness", "cuff") if getattr(interfaces, name) is not None]
    if names:
        yield (
            f"Not used: the stiffness of {', '.join(names)}, which split={split.name!r} takes as rigid "
            '(split="elastic" uses it).'
        )
