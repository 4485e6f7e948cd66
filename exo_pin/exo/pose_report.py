"""What a designer asks of one pose, together.

Forces, what would make the pose possible, the load with the wearer's muscles, and how near a singular pose is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.compiled import one_search
from ..core.conventions import shoulder_angles
from ..core.results import Result
from ..core.tables import NOTES, aligned, filled, indented, newtons, three_digits, under_verdict
from ..core.validation import FloatArray
from ..design import Wearer
from ..design.shoulder import PRESSURE_LIMITS
from ..device.accuracy.pose_accuracy import PoseAccuracy, pose_accuracy
from ..device.device_singularity import device_singularity, with_doubts
from ..device.protocol import Device
from ..person.bare_arm import bare_arm_share
from ..reaction import SPLITS, Reaction
from ..reaction.constraints.actuator_limits import length_limits
from ..reaction.holding.remedy import Remedy
from ..reaction.holding.verdict import describe_axis
from ..wrist.singularities.measures import singularity
from ..wrist.singularities.singular_surface import nearest_singularity
from .contact import with_kept
from .first_answer import EMG_FALL, MEASURED, first_answer, relief_words, words_of_angles
from .pose_numbers import PoseNumbers

if TYPE_CHECKING:
    from ..person import JointContact, Person
    from .shoulder_exo import ShoulderExo

#: Shares of their activation that muscles may keep: of the EMG of wearers 36 to 91 % is left (:data:`MEASURED`).
KEPT = (0.3, 0.6)
#: Bend of the elbow and lean of the torso, rad, up to which what the joint of a bare arm carries is that of its table.
_STRAIGHT, _UPRIGHT = math.radians(20.0), math.radians(10.0)
#: How near the limbs come, and the directions of a force.
_CLEAR_LIMBS = "Limbs are {} mm clear of the wearer and of one another."
_DIRECTIONS = (("forward", "backward"), ("to the left", "to the right"), ("up", "down"))


@dataclass(frozen=True, eq=False)
class PoseReport(Result):
    """One pose with what stands beside it.

    Attributes
    ----------
    answer : Reaction
        Forces in the pose.
    remedy : Remedy or None
        What would make the pose possible; None where it is possible.
    contact : JointContact or None
        The load of the joint with the wearer's own muscles, where they are counted.
    pose_words : str
        The pose as it was asked for, in words; empty for the angles of the pose.
    kept : mapping of float to JointContact
        The same load of a wearer whose every muscle keeps this share of its activation without the device, while the
        device carries the rest; empty where that is not asked or cannot be.
    """

    _hidden = frozenset({"answer", "contact", "pose_words", "kept"})
    _described = (PoseNumbers,)

    answer: Reaction
    remedy: Remedy | None
    contact: JointContact | None
    pose_words: str = ""
    kept: Mapping[float, JointContact] = field(default_factory=dict)

    @property
    def verdict(self) -> str:
        """That of the forces."""
        return self.answer.verdict

    @property
    def cautions(self) -> tuple[str, ...]:
        """Those of the forces."""
        return self.answer.cautions

    def _fields(self) -> dict[str, Any]:
        poses, seen = self.answer.source.poses, self.accuracy  # beside the answer, which has its own
        own = super()._fields() | {
            "weakest_rate": float(seen.mm_per_degree),
            "weakest_rate_unit": seen.unit,
            "twin_degrees": float(np.degrees(seen.twin_angle)) if seen.has_twin else None,
            "twin_difference_rss": float(np.linalg.norm(seen.differences)) if seen.has_twin else None,
            "bare_arm_share": self.bare_arm_share,
            "wearer": None if self.wearer is None else {"height": self.wearer.height, "mass": self.wearer.mass},
            "percent_of_limits": self.percent_of_limits,
            "force_on_head_in_socket": None if self.socket is None else -self.socket @ self.answer.shoulder_force,
            "emg_fall_percent": EMG_FALL,
            "relief_percent": {f"{100.0 * share:.0f} % kept": relief for share, relief in self.reliefs.items()},
            "singular_kind": self.singular_kind,
            "singular_margin": float(self.answer.margin),
            "singular_distance": self.singular_distance,
        }
        if not self.device.has_limbs:
            units = [list(pair) for pair in self.device.drive_units]
            return own | {"drive_coordinates": poses.lengths[0], "drive_units": units}
        return own | {"limb_lengths": poses.lengths[0], "strokes": self.ranges}

    @property
    def device(self) -> Device:
        """The device on its wearer."""
        return cast(Device, self.answer.source.poses.mechanism)

    @property
    def ranges(self) -> FloatArray:
        """Least and greatest position of each drive, shape (n, 2), m or rad."""
        return np.transpose(length_limits(self.answer.source.poses.mechanism))

    @property
    def _pose(self) -> Rotation:
        return self.answer.case.poses

    @property
    def singular_kind(self) -> str:
        """See ``kind`` of :meth:`exo_pin.ShoulderExo.singularity`."""
        record = self.device.accelerate("singularity")
        if record is None:
            found = device_singularity(self.device.as_chain(), self._pose)
            return str(with_doubts(self.device, self._pose, found).kind)
        return str(singularity(record.geometry, self._pose, record.is_upu).kind)

    @cached_property
    def accuracy(self) -> PoseAccuracy:
        """How well the drives place the arm."""
        return pose_accuracy(self.device, self._pose)

    @cached_property
    def singular_distance(self) -> float:
        """Angle to the nearest singular pose, degrees; NaN of other than wrists of three limbs, without a surface."""
        record = self.device.accelerate("singularity")
        if record is None or record.limb_count != 3:
            return float("nan")
        return float(nearest_singularity(record.geometry, self._pose).degrees)

    @property
    def bare_arm_share(self) -> tuple[float, float]:
        """Load of the joint without a device at this elevation, least and greatest percent of body weight, or NaN.

        It is that of a straight arm at rest with an empty hand beside an upright torso, and not known of others.
        """
        low, high = bare_arm_share(self._pose)
        return (float(low), float(high)) if self._is_bare else (float("nan"), float("nan"))

    @property
    def _is_bare(self) -> bool:
        case, wearer, g = self.answer.case, self.wearer, self.device.gravity
        acting = [] if case.load is None else [case.load.force, case.load.moment]
        acting += [] if case.motion is None else [case.motion.angular_velocity, case.motion.angular_acceleration]
        other = any(np.any(part) for part in acting)
        if wearer is not None:
            other = other or wearer.payload > 0.0 or wearer.elbow_flexion > _STRAIGHT
        return not other and bool(-g[2] >= math.cos(_UPRIGHT) * np.linalg.norm(g))

    @property
    def pose_in_words(self) -> str:
        """The pose, without angles that are zero."""
        return self.pose_words or words_of_angles(shoulder_angles(self._pose, self.device.side, degrees=True).tolist())

    @property
    def socket(self) -> FloatArray | None:
        """Axes of the wearer's socket, rows out of it, up and forward, shape (3, 3); None where no scapula is known."""
        if self.contact is None or np.isnan(self.contact.glenoid).any():
            return None
        return self.contact.glenoid

    @property
    def wearer(self) -> Wearer | None:
        """Who wears the device, if that is known."""
        return None if self.device.arm is None else self.device.arm.wearer

    @property
    def percent_of_limits(self) -> FloatArray:
        """Force of each drive over its limit to the same side, percent, shape (n,); NaN where that is not known."""
        force, bounds = self.answer.actuator_forces, self.answer.source.poses.limits
        limit = np.where(force > 0.0, bounds.upper[0], -bounds.lower[0])
        known = np.isfinite(limit) & (limit > 0.0) & bounds.asked
        return np.where(known, 100.0 * np.abs(force) / np.where(known, limit, 1.0), np.nan)

    @property
    def reliefs(self) -> dict[float, float]:
        """How much less the joint carries with the device, percent, by the share of activation that muscles keep.

        NaN where there is no such answer; empty where the muscles are not counted or the pose is not held.
        """
        contacts = {} if self.contact is None else {0.0: self.contact, **self.kept}
        found = {share: contact.relief_percent for share, contact in contacts.items()}
        shares = {share: float(relief) for share, relief in found.items() if relief is not None}
        return shares if np.isfinite(shares.get(0.0, np.nan)) else {}

    @property
    def elevation_cosine(self) -> float:
        """Cosine of the angle between the arm and the vertical."""
        return float(self._pose.as_matrix()[2, 2])

    @property
    def left_to_wearer(self) -> tuple[FloatArray, bool] | None:
        """Moment that a device leaves to its wearer, shape (3,), N m, and whether another limit is broken, too.

        None of a device that holds the arm by itself.
        """
        if self.device.holds_alone or not self.answer.has_answer:
            return None
        limits, f = self.answer.limits, self.answer.actuator_forces
        theirs = np.array([name.startswith("wearer") for name, _ in limits.drives], dtype=bool)
        beyond = np.nan_to_num(limits.force_error) != 0.0
        others = bool((beyond & ~theirs).any() or np.nan_to_num(limits.length_error).any() or limits.passive)
        return self.device.moment_of_wearer(f[None])[0], others

    def __str__(self) -> str:
        return first_answer(self)

    def explained(self) -> str:
        """All that is known of the pose: forces, how they were chosen, and what equilibrium leaves undetermined."""
        answer = self.answer
        told = [text for text in answer.cautions if not text.startswith(NOTES)]
        parts = [under_verdict(answer.verdict, told), "" if self.remedy is None else filled(str(self.remedy))]
        if not answer.has_answer:
            parts += ["" if self.contact is None else with_muscles(self.contact), "\n".join(self._notes())]
            return "\n\n".join(part for part in parts if part)
        parts.append(filled(self._near()))
        parts += ["\n".join([*self._shoulder(), *self._yardstick()]), "\n".join(self._limbs())]
        parts.append("\n".join(self._footnotes()))
        return "\n\n".join(part for part in parts if part)

    def _shoulder(self) -> list[str]:
        answer = self.answer
        head = f"Force of the shoulder on the arm: {three_digits(float(answer.magnitude))} N"
        if answer.percent_body_weight is not None:
            head += f", {three_digits(float(answer.percent_body_weight))} % of body weight"
        if not answer.held:
            head += self._unheld_words
        parts = zip(answer.shoulder_force, _DIRECTIONS, strict=True)
        along = ", ".join(f"{_felt(abs(value))} N {pair[int(value < 0.0)]}" for value, pair in parts)
        assumed = answer.source.split.assumed(answer.source.poses.mechanism)
        how = f"({along}; assumed: {assumed}; criterion: {answer.criterion})"
        allowed = answer.range()
        wider = allowed is not None and not allowed.is_single
        where = ", with the displacements of this answer" if answer.source.split.moves else ""
        rest = [indented(f"All forces that these assumptions allow{where}: {allowed}.")] if wider else []
        return [filled(head), indented(how), *rest]

    @property
    def _unheld_words(self) -> str:
        """On what the forces of a pose that is not held rest."""
        if not self.device.holds_alone:
            return ", with what is listed below from the wearer"
        part, force = ("limbs", "forces") if self.device.has_limbs else ("drives", "efforts")
        return f", if the {part} could supply the {force} below"

    def _yardstick(self) -> list[str]:
        """What the joint of the same pose carries without the device."""
        if self.contact is not None:
            kept = [filled(f"{relief_words(self.reliefs)} {MEASURED}")] if self.reliefs else []
            return [with_muscles(self.contact), *kept]
        low, high = self.bare_arm_share
        if np.isnan(high):
            return []
        share = f"{low:.0f} to {high:.0f} %" if round(low) != round(high) else f"about {high:.0f} %"
        return [
            filled(
                f"For comparison: at this elevation a bare arm loads the joint with {share} of body "
                "weight (computed, least effort, abduction and flexion), mostly by the wearer's own muscles, which are "
                "not part of the number above; --person adds them."
            )
        ]

    def _limbs(self) -> list[str]:
        """Position and effort of each drive beside its limits; limbs have numbers, and one unit."""
        poses, units = self.answer.source.poses, self.device.drive_units
        limbs = self.device.has_limbs
        bounds, forces = poses.limits, self.answer.actuator_forces
        rows = [("drive", "coordinate", "range", "effort", "limits")]
        if limbs:
            rows = [("limb", "length, mm", "stroke, mm", "tension, N", "actuator, N")]
            units = tuple((name.removeprefix("limb "), "") for name, _ in units)
        for i, ((name, unit), (low, high)) in enumerate(zip(units, self.ranges, strict=True)):
            scale, at = (180.0 / np.pi, " °") if unit == "N m" else (1e3, " mm" if unit else "")
            own = ("", "")
            if not name.startswith("wearer"):
                own = f"{np.round(scale * poses.lengths[0, i]) + 0.0:.0f}{at}", _range(scale * low, scale * high, at)
            shown, limits = f" {unit}" if unit else "", "not asked"
            if bounds.asked:
                limits = _range(float(bounds.lower[0, i]), float(bounds.upper[0, i]), shown)
            rows.append((name, *own, f"{_felt(forces[i])}{shown}", limits))
        return aligned(rows)

    def _footnotes(self) -> list[str]:
        named = not self.device.has_limbs
        lines = [] if named else ["Tension is positive; a negative one is a push."]
        if self.accuracy.is_doubtful:
            lines.append(filled(str(self.accuracy)))
        if self.answer.clearance >= 0.0:
            what = "The device is {} mm clear of the wearer." if named else _CLEAR_LIMBS
            lines.append(what.format(f"{1e3 * self.answer.clearance:.0f}"))
        if text := self.answer.cuff_text():
            known = self.answer.cuff_pressure is not None
            lines.append(filled(f"{text} Peaks are higher; {PRESSURE_LIMITS}." if known else text))
        if self.answer.certificate.undetermined > 0:
            lines.append(filled(self.answer.certificate.statement))
            lines.append("--compare shows other assumptions, --table all forces.")
        return [*lines, *self._notes()]

    def _notes(self) -> list[str]:
        """What was not checked or is not known."""
        return [filled(text) for text in self.answer.cautions if text.startswith(NOTES)]

    def _near(self) -> str:
        """That the pose is close to a singular one, how close, and where the drives hold least; else empty."""
        if self.answer.equilibrium_status != "near_singular":
            return ""
        axis = describe_axis(self.answer.source.poses.weak_axis(0))
        text = "This pose is almost singular, and forces change a lot near it: the "
        text += f"{'limbs' if self.device.has_limbs else 'drives'} hardly resist a moment about {axis}."
        if np.isfinite(self.singular_distance):
            text += f" A singular pose is {self.singular_distance:.2g}° away."
        return text


def report_on_pose(
    exo: ShoulderExo,
    answer: Reaction,
    person: Person | None = None,
    angles: Sequence[float] | None = None,
    offset: Sequence[float] | None = None,
) -> PoseReport:
    """What stands beside the forces in a pose.

    Parameters
    ----------
    exo : ShoulderExo
        The design, as the wearer carries it.
    answer : Reaction
        Of a single pose; in motion without what muscles keep and the nearest pose, which are questions of rest.
    person : Person, optional
        Whose muscles are counted.
    angles : sequence of float, optional
        Flexion, abduction and internal rotation as they were asked for, degrees (default: those of the pose).
    offset : sequence of float, optional
        Of the device's centre, mm, as it was asked for.
    """
    pose: Any = answer.case.poses
    remedy, motion = None, answer.case.motion
    # A device that cannot hold the arm by itself in any pose has no better pose nearby; a configuration is of its pose.
    rests = motion is None
    if rests and not answer.held and exo.device.holds_alone and isinstance(answer.case.posture, Mapping | None):
        with nullcontext() if answer.source.split.moves else one_search():
            remedy = exo.remedy(pose, **nearby_query(answer))
    contact, kept = None, {}
    if person is not None:
        contact = exo.joint_contact(pose, person, answer, motion, answer.case.load, outside="mark")
    is_relieved = contact is not None and contact.relief_percent is not None and contact.relief_percent > 0.0
    if person is not None and rests and is_relieved and exo.device.driven_moments == 3 and exo.device.holds_alone:
        kept = {share: with_kept(exo, answer, person, share) for share in KEPT}
    words = "" if angles is None else words_of_angles(angles)
    if words and offset is not None:
        words += f", device off by ({', '.join(f'{value:g}' for value in offset)}) mm"
    if words and answer.case.load is not None:
        words += f", pushed with {newtons(float(np.linalg.norm(answer.case.load.force)))} N"
    return PoseReport(answer, remedy, contact, words, kept)


def nearby_query(answer: Reaction) -> dict[str, Any]:
    """The question of an answer, for poses near its own.

    Of a split that chooses side forces the limits alone count, which do not depend on how these are shared. Others have
    forces of their own there, and a device that gives way other lengths.
    """
    split = next(iter(SPLITS)) if answer.source.split.chooses_sides else answer.assumptions.split
    case = answer.case
    question: dict[str, Any] = {"split": split, "centre_offset": case.centre_offset, "posture": case.posture}
    question |= {"load": case.load} if case.load is not None else {}
    return question | {"limits": answer.assumptions.limits}


def with_muscles(contact: JointContact) -> str:
    """What the joint carries with the wearer's own muscles, with a device and without, in a single pose."""
    bare = contact.without_device
    assert bare is not None
    text = "With the wearer's own muscles (least effort) the joint carries "
    if not bare.has_result:
        own = f" With it: {float(contact.magnitude):.0f} N." if contact.has_result else ""
        return filled(f"{text}an unknown load without the device: {bare.verdict}{own}")
    alone = f"{float(bare.magnitude):.0f} N without the device, {float(bare.percent_body_weight):.0f} % of body weight"
    if not contact.has_result:
        return filled(f"{text}{alone}. With it: {contact.verdict}")
    relief, own = contact.relief_percent, f"{text}{alone}, and {float(contact.magnitude):.0f} N with"
    assert relief is not None
    if np.isnan(relief):
        return filled(f"{own} the closest forces that it can give: they do not hold this pose.")
    less = f"{abs(float(relief)):.0f} % {'less' if relief >= 0.0 else 'more'}"
    return filled(f"{own} it, {less}. exo-pin person has the details.")


def moving_mass(device: Device) -> str:
    """Masses of the arm and of the moving part of the device, in words; those of a chain with all its links."""
    arm = device.require_arm("weight")
    own = 0.0 if arm.person is None else arm.person.mass
    moving = arm.mass - own + device.links_mass
    words = f"moving part of the device {moving:.3g} kg"
    if device.has_limbs and device.limbs_are_massless:
        words += ", massless limbs"
    if not own:
        return f"{words}, without a person's arm"
    # A share of an arm that is rounding is no mass.
    return f"arm {own:.3g} kg, {words if moving > 1e-9 * own else 'massless device'}"


def _felt(newtons: float) -> str:
    """A force in three digits; zero below 0.05 N."""
    return three_digits(newtons) if abs(newtons) >= 0.05 else "0"


def _range(low: float, high: float, unit: str) -> str:
    """Two ends in words, with a unit after a space where there is one."""
    if np.isnan(low) or (np.isinf(low) and np.isinf(high)):
        return "no end" if unit == " °" else "not known"
    least = f"{np.round(low) + 0.0:.0f}" if np.isfinite(low) else "?"
    return f"{least} to {np.round(high) + 0.0:.0f}{unit}" if np.isfinite(high) else f"from {least}{unit}"
