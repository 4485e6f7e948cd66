"""What an answer does not say by itself: how it was chosen, what was not checked, which data were not used."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...core.tables import enumerated, limb_list
from ...design import Mechanism
from ..effort_sharing import UNFELT
from ..indeterminacy.certificate import AnswerSource
from .hold_check import HoldCheck

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
    if sharing is not None and sharing.unknown and source.poses.tensions.self_stress.shape[2]:
        yield (
            f"Efforts in N and in N m are shared by their numbers: no limit is known of {enumerated(sharing.unknown)}, "
            "to compare them by."
        )
    if sharing is not None and sharing.wearer is not None and source.poses.limits.asked:
        left = np.linalg.norm(source.poses.limits.upper[:, sharing.wearer], axis=1)
        if left.any():
            most = device.require_arm("moments").weight_moment(device.gravity)
            yield (
                f"Counted as held: up to {left.max():.2g} N m are left to the wearer, at most {100.0 * UNFELT:g} % of "
                f"the greatest moment of the arm's weight ({most:.3g} N m)."
            )
    if source.poses.posture:
        yield f"Posture: {source.poses.posture}."
    if device.is_upu.any() and not device.cuff_is_known:  # type: ignore[attr-defined]
        yield "Not known: where the cuff is ([roles] cuff); couples are least at the single attachments instead."


def _slack(mechanism: Mechanism, source: AnswerSource, held: NDArray[np.bool_]) -> Iterator[str]:
    """Limbs that only pull, have no least tension and pull with nothing."""
    f = source.values[held, : mechanism.limb_count]
    none = np.abs(f) <= 1e-9 * np.abs(f).max(axis=1, initial=0.0)[:, None]
    none &= source.poses.limits.lower[held] == 0.0
    loose = [i + 1 for i, limb in enumerate(mechanism.limbs) if limb.actuator is not None and none[:, i].any()]
    if loose:
        poses = f" in {int(none.any(axis=1).sum())} of {len(none)} held poses" if len(none) > 1 else ""
        verb = "is" if len(loose) == 1 else "are"
        words = mechanism.limb_words(loose)
        yield f"{words[:1].upper()}{words[1:]} {verb} slack{poses}: a least_tension of the actuator keeps a limb taut."


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
