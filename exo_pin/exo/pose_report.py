"""What a designer asks of one pose, together.

Forces, what would make the pose possible, the load with the wearer's muscles, and how near a singular pose is.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.compiled import current_mode, mode
from ..core.results import Result
from ..core.tables import NOTES, aligned, filled, indented, under_verdict
from ..core.validation import FloatArray
from ..design.shoulder import PRESSURE_LIMITS
from ..device.device_singularity import device_singularity, with_doubts
from ..device.protocol import Device
from ..device.wrist_device import as_device
from ..person.bare_arm import bare_arm_share
from ..reaction import SPLITS, Reaction
from ..reaction.constraints.actuator_limits import length_limits
from ..reaction.holding.remedy import Remedy
from ..reaction.holding.verdict import describe_axis
from ..wrist.singularities.measures import singularity
from ..wrist.singularities.singular_surface import nearest_singularity

if TYPE_CHECKING:
    from ..person import JointContact, Person
    from .shoulder_exo import ShoulderExo

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
    """

    _hidden = frozenset({"answer", "contact"})

    answer: Reaction
    remedy: Remedy | None
    contact: JointContact | None

    @property
    def verdict(self) -> str:
        """That of the forces."""
        return self.answer.verdict

    @property
    def cautions(self) -> tuple[str, ...]:
        """Those of the forces."""
        return self.answer.cautions

    def _fields(self) -> dict[str, Any]:
        # Beside the answer, which has its own.
        poses = self.answer.source.poses
        own = super()._fields() | {
            "bare_arm_share": self.bare_arm_share,
            "singular_kind": self.singular_kind,
            "singular_margin": float(self.answer.margin),
            "singular_distance": self.singular_distance,
        }
        if self._device.drive_units:
            units = [list(pair) for pair in self._device.drive_units]
            return own | {"drive_coordinates": poses.lengths[0], "drive_units": units}
        return own | {"limb_lengths": poses.lengths[0], "strokes": self._ranges}

    @property
    def _device(self) -> Device:
        return as_device(self.answer.source.poses.mechanism)

    @property
    def _ranges(self) -> FloatArray:
        """Least and greatest position of each drive, shape (n, 2), m or rad."""
        return np.transpose(length_limits(self.answer.source.poses.mechanism))

    @property
    def _pose(self) -> Rotation:
        return self.answer.case.poses

    @property
    def singular_kind(self) -> str:
        """See ``kind`` of :meth:`exo_pin.ShoulderExo.singularity`."""
        record = self._device.accelerate("singularity")
        if record is None:
            found = device_singularity(self._device.as_chain(), self._pose)
            return str(with_doubts(self._device, self._pose, found).kind)
        return str(singularity(record.geometry, self._pose, record.is_upu).kind)

    @cached_property
    def singular_distance(self) -> float:
        """Angle to the nearest singular pose, degrees; NaN of other than wrists of three limbs, without a surface."""
        record = self._device.accelerate("singularity")
        if record is None or record.limb_count != 3:
            return float("nan")
        return float(nearest_singularity(record.geometry, self._pose).degrees)

    @property
    def bare_arm_share(self) -> tuple[float, float]:
        """Load of the joint without a device at this elevation, least and greatest percent of body weight, or NaN."""
        low, high = bare_arm_share(self._pose)
        return float(low), float(high)

    def __str__(self) -> str:
        answer = self.answer
        told = [text for text in answer.cautions if not text.startswith(NOTES)]
        parts = [under_verdict(answer.verdict, told), "" if self.remedy is None else filled(str(self.remedy))]
        if not answer.has_answer:
            parts.append("" if self.contact is None else with_muscles(self.contact))
            return "\n\n".join(part for part in parts if part)
        if answer.equilibrium_status == "near_singular":
            parts.append(self._near())
        parts += ["\n".join([*self._shoulder(), *self._yardstick()]), "\n".join(self._limbs())]
        parts.append("\n".join(self._footnotes()))
        return "\n\n".join(part for part in parts if part)

    def _shoulder(self) -> list[str]:
        answer = self.answer
        head = f"Force of the shoulder on the arm: {float(answer.magnitude):.1f} N"
        if answer.percent_body_weight is not None:
            head += f", {float(answer.percent_body_weight):.1f} % of body weight"
        if not answer.held:
            head += self._unheld_words
        parts = zip(answer.shoulder_force, _DIRECTIONS, strict=True)
        along = ", ".join(f"{abs(value):.1f} N {pair[int(value < 0.0)]}" for value, pair in parts)
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
        if not self._device.holds_alone:
            return ", with what is listed below from the wearer"
        part, force = ("drives", "efforts") if self._device.drive_units else ("limbs", "forces")
        return f", if the {part} could supply the {force} below"

    def _yardstick(self) -> list[str]:
        """What the joint of the same pose carries without the device."""
        if self.contact is not None:
            return [with_muscles(self.contact)]
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
        poses, units = self.answer.source.poses, self._device.drive_units
        bounds, forces = poses.limits, self.answer.actuator_forces
        rows = [("drive", "coordinate", "range", "effort", "limits")]
        if not units:
            rows = [("limb", "length, mm", "stroke, mm", "tension, N", "actuator, N")]
        numbers = [(str(k), "") for k in range(1, 1 + len(forces))]
        for i, ((name, unit), (low, high)) in enumerate(zip(units or numbers, self._ranges, strict=True)):
            scale, at = (180.0 / np.pi, " °") if unit == "N m" else (1e3, " mm" if unit else "")
            own = ("", "")
            if not name.startswith("wearer"):
                own = f"{scale * poses.lengths[0, i]:.0f}{at}", _range(scale * low, scale * high, at)
            shown, limits = f" {unit}" if unit else "", "not asked"
            if bounds.asked:
                limits = _range(float(bounds.lower[0, i]), float(bounds.upper[0, i]), shown)
            rows.append((name, *own, f"{np.round(forces[i], 1) + 0.0:.1f}{shown}", limits))
        return aligned(rows)

    def _footnotes(self) -> list[str]:
        named = bool(self._device.drive_units)
        lines = [] if named else ["Tension is positive; a negative one is a push."]
        if self.answer.clearance >= 0.0:
            what = "The device is {} mm clear of the wearer." if named else _CLEAR_LIMBS
            lines.append(what.format(f"{1e3 * self.answer.clearance:.0f}"))
        if text := self.answer.cuff_text():
            known = self.answer.cuff_pressure is not None
            lines.append(filled(f"{text} Peaks are higher; {PRESSURE_LIMITS}." if known else text))
        if (self.answer.certificate.undetermined > 0).any():
            lines.append(filled(self.answer.certificate.statement))
            lines.append("--compare shows other assumptions, --table all forces.")
        return [*lines, *(filled(text) for text in self.answer.cautions if text.startswith(NOTES))]

    def _near(self) -> str:
        """That the pose is close to a singular one, how close, and about which axis the drives hold least."""
        axis = describe_axis(self.answer.source.poses.weak_axis(0))
        text = "This pose is almost singular, and forces change a lot near it: the "
        text += f"{'drives' if self._device.drive_units else 'limbs'} hardly resist a moment about {axis}."
        if np.isfinite(self.singular_distance):
            text += f" A singular pose is {self.singular_distance:.2g}° away."
        return filled(text)


def report_on_pose(
    exo: ShoulderExo, answer: Reaction, person: Person | None = None, must_have_muscles: bool = False
) -> PoseReport:
    """What stands beside the forces in a pose.

    Parameters
    ----------
    exo : ShoulderExo
        The design, as the wearer carries it.
    answer : Reaction
        Of a single pose at rest.
    person : Person, optional
        Whose muscles are counted.
    must_have_muscles : bool
        Whether a pose in which the bare arm has no result is reported all the same.
    """
    pose: Any = answer.case.poses
    remedy = None
    # A device that cannot hold the arm by itself in any pose has no better pose nearby; a configuration is of its pose.
    if not answer.held and exo.device.holds_alone and isinstance(answer.case.posture, Mapping | None):
        # One search with rigid limbs is over long before its functions would be compiled.
        quick = current_mode() == "auto" and not answer.source.split.moves
        with mode("plain") if quick else nullcontext():
            remedy = exo.remedy(pose, **nearby_query(answer))
    contact = None
    if person is not None:
        contact = exo.joint_contact(pose, person, answer, outside="mark")
        bare = contact.without_device
        if not must_have_muscles and (bare is None or not bare.has_result):
            contact = None
    return PoseReport(answer, remedy, contact)


def nearby_query(answer: Reaction) -> dict[str, Any]:
    """The question of an answer, for poses near its own.

    Of a split that chooses side forces the limits alone count, which do not depend on how these are shared. Others have
    forces of their own there, and a device that gives way other lengths.
    """
    split = next(iter(SPLITS)) if answer.source.split.chooses_sides else answer.assumptions.split
    case = answer.case
    question = {"split": split, "centre_offset": case.centre_offset, "limits": answer.assumptions.limits}
    return question | {"posture": case.posture}


def with_muscles(contact: JointContact) -> str:
    """What the joint carries with the wearer's own muscles, with a device and without, in a single pose."""
    bare = contact.without_device
    assert bare is not None
    text = "With the wearer's own muscles (least effort) the joint carries "
    if not bare.has_result:
        return filled(f"{text}an unknown load without the device: {bare.verdict}")
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
    if not own:
        return f"{words}, without a person's arm"
    # A share of an arm that is rounding is no mass.
    return f"arm {own:.3g} kg, {words if moving > 1e-9 * own else 'massless device'}"


def way_table(angles: FloatArray, answer: Reaction) -> str:
    """Forces in k poses whose clinical angles, degrees, have shape (k, 3)."""
    held = np.where(answer.can_hold, "yes", np.where(answer.unknown, "not known", "no"))
    columns = dict(zip(("flexion, °", "abduction, °", "internal, °"), angles.T, strict=True))
    columns["|F_s|, N"] = answer.magnitude
    if answer.percent_body_weight is not None:
        columns["% of weight"] = answer.percent_body_weight
    names = [f"{name}, {unit}" for name, unit in answer.drive_units]
    names = names or [f"limb {i}, N" for i in range(1, 1 + answer.actuator_forces.shape[-1])]
    columns |= dict(zip(names, answer.actuator_forces.T, strict=True))
    # + 0.0, so that no minus stands before zero.
    cells = [
        [f"{value + 0.0:.1f}" if np.isfinite(value) else "-" for value in np.round(c, 1)] for c in columns.values()
    ]
    return "\n".join(aligned([[*columns, "held"], *zip(*cells, held.tolist(), strict=True)]))


def _range(low: float, high: float, unit: str) -> str:
    """Two ends in words, with a unit after a space where there is one."""
    if np.isnan(low) or (np.isinf(low) and np.isinf(high)):
        return "no end" if unit == " °" else "not known"
    least = f"{low + 0.0:.0f}" if np.isfinite(low) else "?"
    return f"{least} to {high:.0f}{unit}" if np.isfinite(high) else f"from {least}{unit}"
