"""What a comparison of kinds asks beside :func:`exo_pin.study.evaluate`: fit, joint, masses, failure; and blanks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.validation import FloatArray
from ..design import Interface
from ..device.accuracy.hand_stiffness import cuff_distance
from ..person import Person
from ..reaction import Reaction
from ..reaction.assumptions import Question
from ..uncertainty.offset_search import DIRECTIONS
from .figure_words import JOINT_FIGURES

if TYPE_CHECKING:
    from ..exo.shoulder_exo import ShoulderExo

__all__: list[str] = []


#: Poses that a device cannot take.
_BEYOND = ("out_of_reach", "beyond_singular", "out_of_stroke")


def is_passive(exo: ShoulderExo) -> bool:
    """Whether a device has no drives, so that what it leaves is the wearer's."""
    return drive_count(exo) == 0


def drive_count(exo: ShoulderExo) -> int:
    """Number of its drives."""
    return len(exo.device.drives)


def within_reach(status: NDArray[np.str_]) -> NDArray[np.bool_]:
    """Poses that a device closes in, with its drives and joints within their travel as far as that is known."""
    return ~np.isin(status, _BEYOND)


def drive_figures(exo: ShoulderExo, poses: Rotation, answer: Reaction) -> dict[str, float]:
    """Largest effort of any drive in the held poses, also over its limit, and largest stroke over the reached ones.

    Forces and slides apart from torques and hinges; NaN where there is none of the kind, and where no limit is known.
    """
    count = drive_count(exo)
    units = np.array([unit for _, unit in answer.drive_units][:count])
    held = np.asarray(answer.held).reshape(-1)
    efforts = answer.actuator_forces.reshape(len(held), -1)[:, :count]
    limits = answer.source.poses.limits
    bounds = np.where(efforts >= 0.0, limits.upper[:, :count], limits.lower[:, :count])
    known = held[:, None] & np.isfinite(bounds) & (bounds != 0.0)
    reached = within_reach(answer.status).reshape(-1)
    coordinates = _coordinates(exo, poses, answer)[:, :count]
    coordinates = coordinates[reached if reached.any() else ~np.isnan(coordinates).any(axis=1)]
    slides, hinges = units == "N", units == "N m"
    return {
        "effort_N": _largest(np.abs(efforts[held][:, slides])),
        "effort_Nm": _largest(np.abs(efforts[held][:, hinges])),
        "effort_share": _largest(efforts[known] / bounds[known]),
        "stroke_mm": 1e3 * (_largest(np.ptp(coordinates[:, slides], axis=0)) if len(coordinates) else np.nan),
        "stroke_deg": float(np.degrees(_largest(_arcs(coordinates[:, hinges])))),
    }


def _largest(values: FloatArray) -> float:
    return float(values.max()) if values.size else np.nan


def _arcs(angles: FloatArray) -> FloatArray:
    """Range of each hinge, rad; one that turns on takes the shorter arc that holds all its angles."""
    if not len(angles):
        return np.empty(0)
    turns = np.sort(angles % (2.0 * np.pi), axis=0)
    gaps = np.diff(turns, axis=0, append=turns[:1] + 2.0 * np.pi)
    return np.asarray(2.0 * np.pi - gaps.max(axis=0))


def _coordinates(exo: ShoulderExo, poses: Rotation, answer: Reaction) -> FloatArray:
    """Coordinates of the drives, m or rad, shape (N, n); NaN out of reach."""
    if exo.device.accelerate("rates") is not None:
        return exo.inverse_kinematics(poses).lengths.reshape(-1, drive_count(exo))
    placed = answer.source.poses.placed
    assert placed is not None
    return np.where(placed.reached[:, None], placed.coordinates, np.nan)


#: A pose is nearly singular below this margin, as in a workspace (``Criteria.least_margin``).
_NEAR = 0.05
#: By so much the device's centre is beside the shoulder's, m, and in at most so many poses of the list, evenly spaced.
_OFF, _OFF_POSES = 0.01, 6
#: So many of the directions in which it is are asked first.
_ASKED_FIRST = 6
#: Kinds and states of poses that a device does not reach.
_UNREACHED = ("out_of_reach", "beyond_singular")
#: Of the arm's weight, N m: below it is zero but for rounding.
_LEAST_MOMENT = 1e-9


def detailed_figures(exo: ShoulderExo, poses: Rotation, question: Question) -> dict[str, float]:
    """Figures of one device that take longer; see :func:`exo_pin.study.compare` for what each is.

    Raises
    ------
    InvalidInput
        If the question has a ``centre_offset``: these figures have one of their own.
    MissingExtra
        If the device has a wearer and the extra ``person`` is not installed.
    """
    if question.get("centre_offset") is not None:
        raise InvalidInput("expected no centre_offset: a detailed comparison moves the centre by 10 mm itself")
    if poses.as_quat().ndim == 1:
        poses = Rotation.from_quat([poses.as_quat()])
    passive = is_passive(exo)
    answer = exo.reaction(poses, **(question | {"limits": "none"} if passive else question))
    # 1 where the device's parts keep clear of the wearer, 0 where not; NaN without a wearer, and without shapes.
    held, clear = np.asarray(answer.held), np.full(poses.shape, np.nan)
    if not exo.device.gaps(np.empty((0, 3, 3))).unknown:
        clear = np.asarray(exo.workspace(poses, ["clearance"]).inside, dtype=float)
    return {
        "not_evaluated": float((answer.status == "not_evaluated").mean()),
        "clear": float(clear.mean()),
        "held_and_clear": np.nan if passive else float((held * clear).mean()),
        **singularity_figures(exo, poses),
        "held_after_failure": np.nan if passive else held_after_failure(exo, poses, question),
        **drive_figures(exo, poses, answer),
        **_masses(exo),
        **contact_figures(exo, poses, answer, question),
        "left_to_wearer": left_to_wearer(exo, poses, answer) if passive else np.nan,
        "undetermined": int(exo.device.is_upu.sum()),
        **misalignment_figures(exo, poses, question),
        **_accuracy(exo, poses),
    }


def singularity_figures(exo: ShoulderExo, poses: Rotation) -> dict[str, float]:
    """Of the reached poses: share that is singular or nearly, and median margin."""
    none = {"singular": np.nan, "median_margin": np.nan}
    if is_passive(exo):
        return none
    found = exo.singularity(poses)
    kind, margin = np.ravel(found.kind), np.ravel(found.margin)
    there = ~np.isin(kind, _UNREACHED) & np.isfinite(margin)
    # A device that holds the arm about two axes alone does so in every pose: no pose of it is a singular one.
    if not (there & (kind != "passive")).any():
        return none
    lost = (margin < _NEAR) | (kind != "regular")
    return {"singular": float(lost[there].mean()), "median_margin": float(np.median(margin[there]))}


def held_after_failure(exo: ShoulderExo, poses: Rotation, question: Question) -> float:
    """Share of the poses that are held while one drive gives no effort: the worst drive; NaN without limits."""
    given = question.get("limits", "design")
    if not isinstance(given, str | tuple) or given == "none":
        return np.nan
    bounds: Any = (0.0 if given == "pull" else -np.inf, np.inf) if isinstance(given, str) else given
    shares = []
    for lost in range(drive_count(exo)):
        least, most = (np.array(np.broadcast_to(each, exo.device.limb_count), dtype=float) for each in bounds)
        least[lost] = most[lost] = 0.0
        shares.append(float(exo.reaction(poses, **(question | {"limits": (least, most)})).held.mean()))
    return min(shares)


def _accuracy(exo: ShoulderExo, poses: Rotation) -> dict[str, float]:
    """Rate of the drives that 99 % of the reached poses exceed, mm/° or °/° of hinges; share of poses with twins."""
    closed = exo.device.accelerate("rates") is not None
    seen = exo.accuracy(poses, twins=closed)
    rate = seen.mm_per_degree[np.isfinite(seen.rate)]
    twins = float(seen.has_twin.mean()) if closed else np.nan
    return {"weakest_rate": float(np.quantile(rate, 0.01)) if rate.size else np.nan, "twins": twins}


def _masses(exo: ShoulderExo) -> dict[str, float]:
    """Mass of the device on the arm, and of its other moving links, kg; NaN where a design does not say it."""
    assert exo.arm is not None
    own = sum(part.mass for part in exo.arm.parts if part.device)
    links = np.nan if exo.device.limbs_are_massless else exo.chain_device.links_mass
    return {"mass_on_arm_kg": own if own > 0.0 else np.nan, "mass_of_links_kg": links}


#: Most poses whose force in the joint is computed, some milliseconds each, beside a study.
JOINT_POSES = 100


def joint_figures(exo: ShoulderExo, poses: Rotation, question: Question) -> dict[str, float]:
    """Those of :func:`contact_figures` over the held of at most :data:`JOINT_POSES` of the poses."""
    some = sampled(poses, JOINT_POSES)
    return contact_figures(exo, some, exo.reaction(some, **question), question)


def require_rest(question: Question) -> None:
    """Refuse a motion and a load, with which the force in the joint would be that of another arm than the device's."""
    if question.get("motion") is not None or question.get("load") is not None:
        raise InvalidInput("expected no motion and no load: the force in the joint is that of an arm at rest (joint)")


def joint_words(poses: Rotation) -> str:
    """Of which poses the force in the joint is, and whose force on whom, as a sentence."""
    total = poses.as_quat()[..., 0].size
    return (
        "Force in the joint (contact_N), of the socket on the head with the wearer's own muscles: over the held of "
        f"{min(JOINT_POSES, total)} of {total} poses."
    )


def contact_figures(exo: ShoulderExo, poses: Rotation, answer: Reaction, question: Question) -> dict[str, float]:
    """Contact force in the joint with the wearer's muscles over the held poses, and how much the device relieves it."""
    names = JOINT_FIGURES
    assert exo.arm is not None
    wearer = exo.arm.wearer
    if wearer is None or not answer.held.any():
        return dict.fromkeys(names, np.nan)
    person = Person.of_wearer(wearer)
    motion, load = question.get("motion"), question.get("load")
    found = exo.joint_contact(poses, person, answer, motion, load, outside="mark")
    bare: Any = found.without_device
    known = np.asarray(answer.held) & np.isfinite(found.magnitude) & np.isfinite(bare.magnitude)
    if not known.any():
        return dict.fromkeys(names, np.nan)
    force, alone = found.magnitude[known], bare.magnitude[known]
    figures = np.median(force), force.max(), np.median(alone), np.median(1.0 - force / alone)
    return dict(zip(names, map(float, figures), strict=True))


def left_to_wearer(exo: ShoulderExo, poses: Rotation, answer: Reaction) -> float:
    """Moments that the wearer of a passive device makes, over those of the weight of the arm alone: the median."""
    assert exo.arm is not None
    alone = exo.arm.person
    if alone is None:
        return np.nan
    weight = np.cross(poses.as_matrix() @ alone.centre_of_mass, alone.mass * exo.device.gravity)
    bare, left = np.linalg.norm(weight, axis=-1), np.linalg.norm(answer.actuator_forces, axis=-1)
    # Where the arm hangs there is no moment to take a share of.
    known = np.isfinite(left) & (bare > _LEAST_MOMENT)
    return float(np.median(left[known] / bare[known])) if known.any() else np.nan


def sampled(poses: Rotation, most: int) -> Rotation:
    """At most so many of the poses, evenly spaced over the flat stack."""
    flat = Rotation.from_quat(poses.as_quat().reshape(-1, 4))
    return flat[np.unique(np.linspace(0, len(flat) - 1, min(most, len(flat))).round().astype(int))]


def misalignment_figures(exo: ShoulderExo, poses: Rotation, question: Question) -> dict[str, float]:
    """What 10 mm of misalignment does, at rest, without load and limits."""
    some = sampled(poses, _OFF_POSES)
    keys = ("split", "constraint_bounds", "weights")
    split: dict[str, Any] = {key: question[key] for key in keys if key in question}  # type: ignore[literal-required]
    follows, change = _worst_change(exo, some, split)
    figures = {"follows_10_mm": follows, "change_by_10_mm_N": change}
    return figures | {"change_on_cuff_N": change_on_cuff(exo, some)}


def change_on_cuff(exo: ShoulderExo, poses: Rotation) -> float:
    """Largest change of F_s, N, by 10 mm on the design's cuff, or one as measured; NaN where no cuff is known."""
    soft = _on_cuff(exo)
    return float("nan") if soft is None else _worst_change(soft, sampled(poses, _OFF_POSES), {"split": "elastic"})[1]


def _on_cuff(exo: ShoulderExo) -> ShoulderExo | None:
    """The design on its own cuff, or on one as measured; None where no cuff is known."""
    interfaces = exo.device.interfaces
    if interfaces.cuff is not None:
        return exo
    distance = cuff_distance(exo.chain)
    cuff = Interface.upper_arm_cuff(distance) if distance > 0.0 else None
    return None if cuff is None else exo.replace(interfaces=replace(interfaces, cuff=cuff))


def change_of_rigid(exo: ShoulderExo, poses: Rotation) -> float:
    """The same of the device with a rigid cuff; NaN where it follows nowhere."""
    return _worst_change(exo, sampled(poses, _OFF_POSES), {})[1]


def _worst_change(exo: ShoulderExo, poses: Rotation, split: dict[str, Any]) -> tuple[float, float]:
    """Share of the poses where the device follows 10 mm in all directions, and there the median of the worst change."""
    reached = _answered(exo.reaction(poses, limits="none", **split))
    if not reached.any():
        return np.nan, np.nan
    kept = poses[reached].as_quat()
    worst = np.zeros(len(kept))
    # A pose that does not follow in one direction is asked in no more: a search that finds nothing takes longest.
    for asked in np.split(DIRECTIONS, [_ASKED_FIRST]):
        left = np.flatnonzero(~np.isinf(worst))
        if not left.size:
            break
        # The aligned device first: that is where a search for the others begins.
        offsets = _OFF * np.concatenate([np.zeros((1, 3)), asked])
        every = Rotation.from_quat(np.broadcast_to(kept[left], (len(offsets), left.size, 4)))
        moved = exo.reaction(every, limits="none", centre_offset=offsets[:, None], **split)
        change = np.linalg.norm(moved.shoulder_force[1:] - moved.shoulder_force[0], axis=-1)
        # Where data of a spring end within the offset, it is not known what the offset does.
        unknown = (moved.status == "not_evaluated")[1:]
        fails = ~_answered(moved)[1:] & ~unknown
        change = np.maximum(worst[left], np.where(unknown, np.nan, change).max(axis=0))
        worst[left] = np.where(fails.any(axis=0), np.inf, change)
    follows = np.isfinite(worst)
    if not follows.any():
        return 0.0 if np.isinf(worst).any() else np.nan, np.nan
    return float(follows.sum() / (~np.isnan(worst)).sum()), float(np.median(worst[follows]))


def _answered(answer: Reaction) -> NDArray[np.bool_]:
    """Poses of a stack that are reached and have an equilibrium."""
    return ~np.isin(answer.status, _UNREACHED) & np.isfinite(answer.magnitude)


_NO_DRIVES = "it has no drives"
_NONE_HELD = "it holds no pose"
_NO_WEARER = "the size of its wearer is not known"
#: Of columns that only some designs have.
_OF_SOME = {
    "one_side": "of three drives that hold the arm alone",
    "reach": "a stroke or an end fitting is not known",
    "least_margin": "no pose is reached",
    "mass_on_arm_kg": "its file does not say which mass on the arm is the device's",
    "mass_of_links_kg": "its file gives its limbs no mass",
    "effort_share": "no limit of a drive is known",
    "left_to_wearer": "of passive supports alone",
    "twins": "looked for among limbs between two joint centres alone",
    "change_on_cuff_N": "of devices with a frame at the cuff alone",
}


def why_blank(exo: ShoulderExo, row: Mapping[str, Any], question: Question) -> str:
    """The columns of a row that have no number, with the reason, such as ``"relief (it holds no pose)"``."""
    reasons: dict[str, list[str]] = {}
    for name, value in row.items():
        if isinstance(value, (float, np.floating)) and np.isnan(value):
            reasons.setdefault(_reason(exo, row, question, name), []).append(name)
    return "; ".join(f"{', '.join(names)} ({reason})" for reason, names in reasons.items())


def _reason(exo: ShoulderExo, row: Mapping[str, Any], question: Question, name: str) -> str:
    passive, holds, wearer = is_passive(exo), row["holdable"] > 0.0, exo.arm and exo.arm.wearer
    if name == "left_to_wearer" and passive:
        return "no arm of a person hangs in it, or its weight has no moment"
    if name in ("held_and_clear", "held_after_failure", "singular", "median_margin", "weakest_rate") and passive:
        return _NO_DRIVES
    if name == "held_after_failure":
        return "the question gives no numbers for the limits of its drives"
    if name in ("clear", "held_and_clear"):
        return _NO_WEARER if wearer is None else "its parts have no shapes"
    if name.startswith(("effort_", "stroke_")):
        pair = {"effort_N": "effort_Nm", "effort_Nm": "effort_N", "stroke_mm": "stroke_deg", "stroke_deg": "stroke_mm"}
        if passive:
            return _NO_DRIVES
        if name in pair and not np.isnan(row[pair[name]]):
            return f"none of its drives {'slides' if name in ('effort_N', 'stroke_mm') else 'turns'}"
        if name.startswith("effort_") and not holds:
            return _NONE_HELD
        return _OF_SOME.get(name, "no pose is reached")
    if name in ("contact_N", "peak_contact_N", "contact_without_N", "relief"):
        if wearer is None:
            return _NO_WEARER
        return "its wearer's muscles hold none of its poses" if holds or passive else _NONE_HELD
    if name in ("follows_10_mm", "change_by_10_mm_N"):
        beyond = "no pose is reached, or a spring has no data about it"
        return "it follows none of the moved centres" if row.get("follows_10_mm") == 0.0 else beyond
    if name == "change_on_cuff_N" and _on_cuff(exo) is not None:
        return "on a soft cuff it follows none of the moved centres"
    if name == "common_peak_F_s_N" and (holds or passive):
        return "it and the other designs hold no pose in common"
    if name.endswith("F_s_N"):
        return _NONE_HELD if not passive else "it has no force in any pose"
    return _OF_SOME.get(name, "no pose is reached")
