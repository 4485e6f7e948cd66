"""The verdict on a pose or a stack of poses, as one plain sentence."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.conventions import shoulder_angles
from ...core.tables import drive_list, enumerated, limb_list
from ...core.validation import FloatArray
from .hold_check import HoldCheck

if TYPE_CHECKING:
    from ..result import Reaction

#: Why a pose without an answer cannot be held, by its status.
_WITHOUT_ANSWER = {
    "singular": "it is singular, and the limbs cannot resist a moment about {axis}",
    "folded": "a joint of a limb lies in the shoulder's centre",
    "no_equilibrium": "no equilibrium is near it",
    "guide_overloaded": "the guide of a limb would have to bear more than it can",
    "out_of_reach": "the device does not reach it",
    "beyond_singular": "on the way to it from rest the device comes to a singular configuration",
}
#: The same where loops of a device keep the arm from turning: any effort of the drives is then an answer.
_LOCKED = (
    "it is singular: its loops block rotations of the arm, and equilibrium does not determine the efforts of its drives"
)


#: Statuses of poses of which nothing is known.
UNSOLVED = ("not_solved", "not_evaluated")
#: The arm's own axis at rest.
_ALONG = np.array([0.0, 0.0, -1.0])
_PASSIVE = "a joint without drive would be beyond its range"
#: Limit of an effort, as a share of it, that is zero and the slack of rounding.
_ROUNDING = 1e-6


def _of_pose(
    check: HoldCheck,
    status: str,
    weak_axis: FloatArray | None = None,
    unheld: str = "",
    along: FloatArray | None = None,
) -> str:
    """One sentence on a pose.

    Parameters
    ----------
    check : HoldCheck
        Limits beside the pose's lengths and forces.
    status : str
        Of the pose.
    weak_axis : ndarray, optional
        Of a singular pose: the axis about which the limbs resist no moment, shape (3,), base frame; NaN where loops
        keep the arm from turning.
    unheld : str
        Joints of a device that would move because nothing holds them, in words; empty where there are none.
    along : ndarray, optional
        The arm's own axis, shape (3,), base frame.
    """
    if status in _WITHOUT_ANSWER:
        if weak_axis is not None and np.isnan(weak_axis).any():
            return f"The device cannot hold this pose: {_LOCKED}."
        if status == "no_equilibrium" and unheld:
            return f"The device cannot hold this pose: {unheld}."
        axis = "some axis" if weak_axis is None else describe_axis(weak_axis)
        return f"The device cannot hold this pose: {_WITHOUT_ANSWER[status].format(axis=axis)}."
    if check.can_hold:
        return "The device can hold this pose."
    if not check.asked and not check.violated:
        return 'It is not known whether the device can hold this pose: limits were left out (limits="none").'
    if check.violated:
        probably, reason = "", "; ".join(_reasons(check, along)) or "no forces within the limits balance the arm"
        if check.unknown:
            probably, reason = "probably ", f"{reason} (by an estimate of {_estimates(check)})"
        return f"The device {probably}cannot hold this pose: {reason}."
    lacking = f"; not known: {', '.join(check.missing)}" if check.missing else ""
    if check.estimated:
        return f"The device can hold this pose if the estimates are right ({_estimates(check)}){lacking}."
    if lacking:
        return f"It is not known whether the device can hold this pose{lacking}."
    return "It is not known whether the device can hold this pose: a muscle's length is outside the range of its law."


def _of_stack(check: HoldCheck, status: NDArray[np.str_], unheld: str, unknown: tuple[str, str]) -> str:
    total, held = status.size, int(check.can_hold.sum())
    counts = [int((status == name).sum()) for name in UNSOLVED]
    unsolved = [(n, why) for n, why in zip(counts, unknown, strict=True) if n]
    if not check.asked and not check.violated.any():
        text = f'It is not known which of {total} poses the device can hold: limits were left out (limits="none")'
        return "; ".join([text, *(f"{count} have no result, because {why}" for count, why in unsolved)]) + "."
    likely = int((check.unknown & ~check.violated & ~np.isin(status, UNSOLVED)).sum())
    depends = (
        "if the estimates are right" if check.estimated and not check.missing else "if the unknown limits allow it"
    )
    reasons = _stack_reasons(check, status, unheld)
    if unsolved:
        # Poses of each outcome.
        lost = total - held - likely - sum(counts)
        cases = ((held, "can hold"), (likely, f"can hold {depends}"), (lost, "cannot hold"))
        parts = [*cases, *((count, f"not known, because {why}") for count, why in unsolved)]
        (count, first), *others = [(count, words) for count, words in parts if count]
        text = "; ".join([f"{count} of {total} poses: {first}", *(f"{count}: {words}" for count, words in others)])
        return f"{text}." + (f" Where it cannot: {', '.join(reasons)}." if reasons else "")
    if held or not likely:
        text = f"The device can hold {held or 'none'} of {total} poses"
        text += f", and {likely} more {depends}" if likely else ""
    else:
        text = f"The device can hold {likely} of {total} poses {depends}"
    if not reasons:
        return f"{text}."
    return f"{text}{'; in the others' if held or likely else ':'} {', '.join(reasons)}."


def _reasons(check: HoldCheck, along: FloatArray | None) -> list[str]:
    """The limits that a single pose exceeds: the wearer's, forces, moments, speeds, then positions."""
    count = check.tensions.shape[-1]
    named = list(check.drives) or [(f"limb {i}", "N") for i in range(1, 1 + count)]
    pulls, is_force = np.array(check.pulls or [True] * count), np.array([unit == "N" for _, unit in named])
    error, length, fast = check.force_error, check.length_error, check.excess_speed

    def words(rows: NDArray[np.intp]) -> str:
        return drive_list(named, rows)

    # An effort of a slide that is no tension pushes where it is positive.
    sign = np.where(pulls, 1.0, -1.0)
    counts = is_force & np.isfinite(error)
    reasons = _of_wearer(check, along) if check.drives else []
    reasons += _force_reasons(words, sign * check.tensions, np.where(counts, sign * error, 0.0))
    for i in np.flatnonzero(~is_force & np.isfinite(error) & (error != 0.0)):
        (name, unit), effort, beyond = named[i], float(check.tensions[i]), float(error[i])
        if not name.startswith("wearer"):
            most = 0.0 if abs(effort - beyond) <= _ROUNDING * abs(effort) else effort - beyond
            limit = f" (it gives {'at most' if beyond > 0.0 else 'at least'} {most + 0.0:.3g} {unit})" if most else ""
            reasons.append(f"{name} would have to give {effort:.3g} {unit}{limit}")
    for own, rate in ((is_force, "m/s"), (~is_force, "rad/s")):
        rows = np.flatnonzero((fast > 0.0) & own)
        if rows.size:
            speeds = enumerated(f"{speed:.2g}" for speed in fast[rows])
            reasons.append(f"{words(rows)} would have to be {speeds} {rate} faster than the actuator can")
    is_length, past = is_force & pulls, np.isfinite(length) & (length != 0.0)
    cases = (
        (np.isinf(length) & is_length, "an actuator cannot take the length of {}", 0.0),
        (np.isinf(length) & ~is_length, "{} cannot take this position", 0.0),
        (past & is_length & (length < 0.0), "{} would be {} mm too short", 1e3),
        (past & is_length & (length > 0.0), "{} would be {} mm too long", 1e3),
        (past & is_force & ~pulls, "{} would be {} mm beyond its range", 1e3),
        (past & ~is_force, "{} would be {}° beyond its range", 180.0 / np.pi),
    )
    for broken, text, scale in cases:
        rows = np.flatnonzero(broken)
        if rows.size:
            reasons.append(text.format(words(rows), _listed(scale * np.abs(length[rows])) if scale else ""))
    return reasons + ([_PASSIVE] if check.passive is not None and check.passive else [])


def _force_reasons(named: Callable[[NDArray[np.intp]], str], tension: FloatArray, error: FloatArray) -> list[str]:
    """The limits that forces exceed, of limbs or drives ``named`` by their rows; shape (n,), tension positive, N.

    What does not count has no error.
    """
    limit = tension - error
    hanging = np.flatnonzero((error < 0.0) & (limit > 0.0) & (tension >= 0.0))
    pushing, pulling = np.flatnonzero((error < 0.0) & ((limit <= 0.0) | (tension < 0.0))), np.flatnonzero(error > 0.0)
    at_most = np.maximum(np.where(error < 0.0, -limit, limit), 0.0)
    reasons = []
    if hanging.size:
        least = f"(at least {_listed(limit[hanging])} N)"
        reasons.append(f"{named(hanging)} would pull with only {_listed(tension[hanging])} N {least}")
    for rows, does in ((pushing, "push"), (pulling, "pull")):
        if rows.size:
            limited = does == "pull" or at_most[rows].max() > _ROUNDING * np.abs(tension[rows]).max()
            most = f" (at most {_listed(at_most[rows])} N)" if limited else ""
            reasons.append(f"{named(rows)} would have to {does} with {_listed(np.abs(tension[rows]))} N{most}")
    return reasons


def _of_wearer(check: HoldCheck, along: FloatArray | None) -> list[str]:
    """What the wearer would have to add to a device that does not hold the arm alone."""
    moment = np.zeros(3)
    for (name, _), effort, beyond in zip(check.drives, check.tensions, check.force_error, strict=True):
        if name.startswith("wearer") and beyond != 0.0 and np.isfinite(beyond):
            moment["xyz".index(name[-1])] = effort
    size = float(np.linalg.norm(moment))
    if size == 0.0:
        return []
    own = along is not None and float(np.linalg.norm(np.cross(moment, along))) < np.sin(np.radians(1.0)) * size
    axis = "the arm" if own else describe_axis(moment)
    return [f"the wearer's own muscles would have to add {size:.3g} N m about {axis}"]


def _listed(sizes: FloatArray) -> str:
    """Numbers in words: "264 and 222"."""
    return enumerated(f"{size:.0f}" if size >= 9.5 else f"{size:.2g}" for size in sizes)


def _stack_reasons(check: HoldCheck, status: NDArray[np.str_], unheld: str) -> list[str]:
    """How many poses fail for each reason; a pose may have several."""
    # Of these, the forces of plain equilibrium are beyond their limits, which says more.
    plain = (np.nan_to_num(check.force_error) != 0.0).any(axis=-1)
    beyond, off = (np.nan_to_num(part) for part in (check.force_error, check.length_error))
    wearers = np.array([name.startswith("wearer") for name, _ in check.drives], dtype=bool)
    kinds = {
        "a limb would have to push": beyond < 0.0,
        "a limb would have to pull too hard": beyond > 0.0,
        "a limb would be too short": off < 0.0,
        "a limb would be too long": (off > 0.0) & np.isfinite(check.length_error),
    }
    if check.drives:
        kinds = {
            "a drive would have to give more than it can": (beyond != 0.0) & ~wearers,
            "the wearer's own muscles would have to add moments": (beyond != 0.0) & wearers,
            "a drive would be beyond its range": off != 0.0,
        }
    failing = {
        **{text: own.any(axis=-1) for text, own in kinds.items()},
        "a limb would have to be too fast": (check.excess_speed > 0.0).any(axis=-1),
        "an actuator cannot take the length of its limb": np.isinf(check.length_error).any(axis=-1),
        _PASSIVE: np.zeros(status.shape, dtype=bool) if check.passive is None else check.passive,
        "the pose is singular": status == "singular",
        "a joint of a limb lies in the shoulder's centre": status == "folded",
        "no forces within the limits balance it": (status == "infeasible") & ~plain,
        unheld or "no equilibrium is near the pose": status == "no_equilibrium",
        "the guide of a limb would be overloaded": status == "guide_overloaded",
        "the device does not reach the pose": status == "out_of_reach",
        "the pose is beyond a singular one": status == "beyond_singular",
    }
    return [f"{text} ({int(poses.sum())})" for text, poses in failing.items() if poses.any()]


def _estimates(check: HoldCheck) -> str:
    """The estimated limits in words: "end fitting of limbs 1, 2 and 3"."""
    named: dict[str, list[int]] = {}
    for key in check.estimated:
        owner, _, name = key.partition(".")
        quantity = name.rpartition(".")[2].replace("_", " ")
        named.setdefault(quantity, []).append(int(owner.removeprefix("limbs[").removesuffix("]")) + 1)
    return ", ".join(f"{quantity} of {limb_list(numbers)}" for quantity, numbers in named.items())


def describe_axis(axis: FloatArray) -> str:
    """An axis in the base frame in words, such as "an axis 12° from the forward direction (0.98, 0.21, 0)"."""
    names = ("the forward axis", "the sideways axis", "the vertical axis")
    unit = axis / np.linalg.norm(axis)
    nearest = int(np.abs(unit).argmax())
    angle = np.degrees(np.arctan2(np.linalg.norm(np.delete(unit, nearest)), np.abs(unit[nearest])))
    unit = unit * np.sign(unit[nearest])
    numbers = ", ".join(f"{0.0 if abs(v) < 5e-3 else v:.2f}" for v in unit)
    where = names[nearest] if angle < 1.0 else f"an axis {angle:.0f}° from {names[nearest]}"
    return f"{where} ({numbers})"


def angle_words(poses: Rotation, side: str) -> str:
    """Clinical angles of a single pose in words: "flexion 10°, abduction 90°, internal rotation 0°"."""
    angles = shoulder_angles(poses, side, degrees=True)
    # Two triples say the same: the one with less of flexion and rotation, as a person would say it.
    other = angles * [1.0, -1.0, 1.0] % 360.0 - 180.0
    angles = other if np.abs(other[::2]).sum() < np.abs(angles[::2]).sum() else angles
    names = ("flexion", "abduction", "internal rotation")
    # "+ 0.0" turns -0 into 0.
    return ", ".join(f"{name} {round(angle) + 0.0:.0f}°" for name, angle in zip(names, angles, strict=True))


def verdict_of(answer: Reaction) -> str:
    """See :attr:`exo_pin.Reaction.verdict`."""
    poses, check, status, unheld = answer.source.poses, answer.limits, answer.status, _unheld(answer)
    if status.ndim:
        why = _unsolved(answer)[(status == "not_solved").ravel()]
        words = _of_stack(check, status, unheld, (" or ".join(sorted(set(why))), _lacking(answer)))
    elif status in UNSOLVED:
        why = _lacking(answer) if status == "not_evaluated" else str(_unsolved(answer)[0])
        words = f"It is not known whether the device can hold this pose: {why}."
    else:
        axis = poses.weak_axis(0) if answer.equilibrium_status == "singular" else None
        words = _of_pose(check, str(status), axis, unheld, poses.matrices[0] @ _ALONG)
    texts = (words, poses.gaps.words, _end_of_way(answer))
    return " ".join(text for text in texts if text)


def row_verdicts(answer: Reaction) -> tuple[NDArray[np.object_], NDArray[np.object_]]:
    """Shape (...) each: "held", "not held" or "not known", and why where it is not held, with parts and sizes."""
    check, status, why = answer.limits, answer.status, answer.reasons.astype(object)
    no_result = np.isin(status, UNSOLVED)
    open_ = no_result | (check.unknown & ~check.violated & answer.has_answer)
    words = np.where(check.can_hold, "held", np.where(open_, "not known", "not held")).astype(object)
    arrays = {name: value for name, value in vars(check).items() if isinstance(value, np.ndarray)}
    for row in map(tuple, np.argwhere(~check.can_hold & ~no_result)):
        own = replace(check, **{name: value[row] for name, value in arrays.items()})
        said = _of_pose(own, str(status[row]))
        why[row] = said.partition(": ")[2].rstrip(".") or said.partition(" (")[2].rstrip(").")
    unsolved = status == "not_solved"
    why[unsolved] = _unsolved(answer).reshape(status.shape)[unsolved]
    return words, why


def _unsolved(answer: Reaction) -> NDArray[np.str_]:
    """Why poses are not solved, shape (N,): loops that close there do not allow a motion; else unknown."""
    placed, count = answer.source.poses.placed, answer.status.size
    still = np.zeros(count, dtype=bool)
    if placed is not None and answer.case.motion is not None:
        still = placed.reached & placed.evaluated & np.isnan(placed.coordinates).any(axis=1)
    return np.where(still, "the device cannot make this motion", "its equilibrium could not be solved")


def _unheld(answer: Reaction) -> str:
    """Joints that would move because neither drive nor brake holds them, with what is missing in a single pose."""
    placed = answer.source.poses.placed
    if placed is None or not placed.unheld.any():
        return ""
    missing = placed.unheld
    device: Any = answer.source.poses.mechanism
    chain, nobody = device.chain, "neither drive nor brake holds" if device.brakes else "no drive holds"
    names = list(chain.model.names)
    moved = np.flatnonzero(missing.any(axis=0)).tolist()
    if answer.status.ndim:
        return f"{nobody} {enumerated(repr(names[joint]) for joint in moved)}"
    texts = []
    for joint in moved:
        unit = "N" if chain.metres[chain.velocity_slice(names[joint])][0] else "N m"
        texts.append(f"{nobody} {names[joint]!r}: {missing[0, joint]:.3g} {unit} are missing")
    return "; ".join(texts)


def _lacking(answer: Reaction) -> str:
    """Why poses are not evaluated, as a clause; empty where all are."""
    found = [part for parts in answer.source.poses.lacking for part in parts]
    if not found:
        return ""
    from ...device.parts.lacking_data import lacking_words  # here: few answers need it

    return lacking_words(found)


def _end_of_way(answer: Reaction) -> str:
    """Where the way of a device to a single pose ends that has no answer; else empty."""
    poses = answer.source.poses
    if not answer.status.ndim and answer.load_share is not None and answer.load_share < 1.0:
        redundant = answer.source.split.chooses_tensions and poses.tensions.self_stress.shape[2] > 0
        return _end_of_load(float(answer.load_share), str(answer.status), redundant)
    if answer.status.ndim or answer.status not in ("out_of_reach", "beyond_singular") or poses.placed is None:
        return ""
    followed = poses.placed.share[0]
    if followed == 0.0:
        if answer.status == "beyond_singular":
            return "It is singular at rest, so that it has no assembly mode to follow."
        if answer.case.offset is None:
            return "From rest it cannot turn the arm this way."
        return "Its loops do not close even at rest: off its centre a rigid device needs a cuff that gives way."
    turn = Rotation.from_matrix(poses.matrices[0]).as_rotvec()
    last = Rotation.from_rotvec(followed * turn)
    return f"On the way from rest it gets as far as {angle_words(last, poses.mechanism.side)}."


def _end_of_load(share: float, status: str, redundant: bool) -> str:
    """Where the way of an elastic device to its whole load and offset ends, whose efforts could be others or not."""
    if status == "out_of_reach":
        part = f"Beyond {100.0 * share:.0f} % of the offset" if share > 0.0 else "With the offset"
        return f"{part} its loops open: what is rigid of it does not follow."
    if status == "no_equilibrium":
        others = ' With other efforts it may hold: split="elastic_locked" keeps the drives where they are.'
        return f"At {100.0 * share:.0f} % of load and offset what is soft gives way.{others if redundant else ''}"
    return ""
