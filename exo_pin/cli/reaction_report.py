"""What ``exo-pin reaction`` prints on a pose: the verdict first, then one number beside a known one; or JSON."""

from __future__ import annotations

import argparse
import json
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.text_tables import aligned
from ..core.validation import FloatArray
from ..exo.shoulder_exo import ShoulderExo
from ..person.bare_arm import bare_arm_share
from ..reaction import ConstraintBounds, Reaction
from ..reaction.constraints.actuator_limits import LimbLimits, length_limits
from ..reaction.holding.remedy import Remedy
from ..reaction.holding.verdict import describe_axis
from .options.query_options import wearer

if TYPE_CHECKING:
    from ..person import JointContact

__all__ = ["certificates", "joint_load", "json_report", "moving_mass", "pose_report", "with_muscles"]

_WIDTH = 100
#: Where to see more of a singular pose.
_GRAPH = "--approach FILE.png draws the forces on the way into the singular pose."


def pose_report(
    exo: ShoulderExo,
    orientation: Rotation,
    answer: Reaction,
    remedy: Remedy | None,
    contact: JointContact | None = None,
) -> str:
    """The report on a single pose.

    Parameters
    ----------
    exo : ShoulderExo
        The design.
    orientation : Rotation
        The pose.
    answer : Reaction
        Its forces.
    remedy : Remedy or None
        What would make the pose possible; None where it is possible.
    contact : JointContact, optional
        The load of the joint with the wearer's own muscles, where they are counted.
    """
    cautions = [_filled(f"Caution: {text}") for text in answer.cautions if not text.startswith("Not ")]
    parts = ["\n".join([_filled(answer.verdict), *cautions])]
    if remedy is not None:
        parts.append(_filled(str(remedy)))
    if not answer.has_answer:
        parts.append(beside_singular(exo, orientation) if answer.status == "singular" else "")
        parts.append("" if contact is None else with_muscles(contact))
        return "\n\n".join(part for part in parts if part)
    if answer.equilibrium_status == "near_singular":
        parts.append(_near_singular(exo, orientation))
    parts.append("\n".join([*_shoulder(answer), *_yardstick(orientation, contact)]))
    parts.append("\n".join(_limb_table(answer)))
    parts.append("\n".join(_footnotes(answer)))
    return "\n\n".join(parts)


def _shoulder(answer: Reaction) -> list[str]:
    size = float(answer.magnitude)
    share = answer.percent_body_weight
    head = f"Force of the shoulder on the arm: {size:.1f} N"
    if share is not None:
        head += f", {float(share):.1f} % of body weight"
    if not answer.held:
        head += ", if the limbs could supply the forces below"
    names = (("forward", "backward"), ("to the left", "to the right"), ("up", "down"))
    directions = ", ".join(
        f"{abs(value):.1f} N {pair[int(value < 0.0)]}" for value, pair in zip(answer.shoulder_force, names, strict=True)
    )
    allowed = answer.range()
    how = f"({directions}; assumed: {answer.source.split.assumption}; criterion: {answer.criterion})"
    rest = []
    if allowed is not None and not allowed.is_single:
        rest.append(_filled(f"  All forces that these assumptions allow: {allowed}."))
    return [_filled(head), textwrap.fill(how, _WIDTH, initial_indent="  ", subsequent_indent="  "), *rest]


def _yardstick(orientation: Rotation, contact: JointContact | None) -> list[str]:
    """What the joint of the same pose carries without the device."""
    if contact is not None:
        return [with_muscles(contact)]
    low, high = (float(share) for share in bare_arm_share(orientation))
    if np.isnan(high):
        return []
    return [
        _filled(
            f"For comparison: at this elevation a bare arm loads the joint with {low:.0f} to {high:.0f} % of body "
            "weight (computed, least effort, abduction and flexion), mostly by the wearer's own muscles, which are not "
            "part of the number above; --person adds them."
        )
    ]


def with_muscles(contact: JointContact) -> str:
    """What the joint carries with the wearer's own muscles, with the device and without.

    Parameters
    ----------
    contact : JointContact
        Of a single pose, with a device.
    """
    bare = contact.without_device
    assert bare is not None
    text = "With the wearer's own muscles (least effort) the joint carries "
    if not bare.has_result:
        return _filled(f"{text}an unknown load without the device: {bare.verdict}")
    alone = f"{float(bare.magnitude):.0f} N without the device, {float(bare.percent_body_weight):.0f} % of body weight"
    if not contact.has_result:
        return _filled(f"{text}{alone}. With it: {contact.verdict}")
    relief, own = contact.relief_percent, f"{text}{alone}, and {float(contact.magnitude):.0f} N with"
    assert relief is not None
    if np.isnan(relief):
        return _filled(f"{own} the closest forces that it can give: they do not hold this pose.")
    less = f"{abs(float(relief)):.0f} % {'less' if relief >= 0.0 else 'more'}"
    return _filled(f"{own} it, {less}. exo-pin person says more.")


def joint_load(
    exo: ShoulderExo, orientation: Rotation, answer: Reaction, options: argparse.Namespace
) -> JointContact | None:
    """The load of the joint with the wearer's own muscles and the limb forces of the answer, if it is to be shown."""
    if options.muscles and options.person is None:
        raise InvalidInput("--muscles needs to know whose: give --person too")
    plain = options.json or options.table or options.compare is not None
    if options.person is None or options.muscles is False or (plain and not options.muscles):
        return None
    from ..person.limb.myoarm import is_installed

    if not options.muscles and not is_installed():
        return None
    try:
        person = wearer(options)
    except InvalidInput:
        if options.muscles:
            raise
        return None
    contact = exo.joint_contact(orientation, person, answer, outside="mark")
    bare = contact.without_device
    return contact if options.muscles or (bare is not None and bare.has_result) else None


def _limb_table(answer: Reaction) -> list[str]:
    """Length and tension of each limb beside its limits."""
    poses = answer.source.poses
    mechanism = poses.mechanism
    lengths = poses.lengths
    low, high = length_limits(mechanism)
    head = ("limb", "length, mm", "stroke, mm", "tension, N", "actuator, N")
    cells = [
        (
            str(i + 1),
            f"{1e3 * lengths[0, i]:.0f}",
            "not known" if np.isnan(low[i]) else f"{1e3 * low[i]:.0f} to {1e3 * high[i]:.0f}",
            f"{answer.actuator_forces[i] + 0.0:.1f}",
            _force_range(poses.limits, i),
        )
        for i in range(mechanism.limb_count)
    ]
    return aligned([head, *cells])


def _force_range(limits: LimbLimits, limb: int) -> str:
    low, high = float(limits.lower[0, limb]), float(limits.upper[0, limb])
    if not limits.asked:
        return "not asked"
    if not np.isfinite(low) and not np.isfinite(high):
        return "not known"
    least = f"{low + 0.0:.0f}" if np.isfinite(low) else "?"
    return f"{least} to {high:.0f}" if np.isfinite(high) else f"from {least}"


def _footnotes(answer: Reaction) -> list[str]:
    lines = ["Tension is positive; a negative one is a push."]
    if (answer.certificate.undetermined > 0).any():
        lines.append(_filled(answer.certificate.statement))
        lines.append("--compare shows other assumptions, --certificate each component, --table all forces.")
    return [*lines, *(_filled(text) for text in answer.cautions if text.startswith("Not "))]


def _near_singular(exo: ShoulderExo, orientation: Rotation) -> str:
    """That a pose is close to a singular one, how close, and about which axis the limbs hold least."""
    state = exo.singularity(orientation)
    axis = describe_axis(state.lost_direction)
    text = (
        f"This pose is almost singular, and forces change a lot near it: the limbs hardly resist a moment about {axis}."
    )
    if exo.geometry.limb_count == 3:
        text += f" A singular pose is {float(exo.nearest_singularity(orientation).degrees):.2g}° away. {_GRAPH}"
    return _filled(text)


def beside_singular(exo: ShoulderExo, orientation: Rotation) -> str:
    """How limb forces fall with the distance from a singular pose, along the direction that leaves it fastest."""
    lines = ["Limb force (root of sum of squares) for a moment of 1 N m about the weakest axis, beside this pose:"]
    directions = _axes()
    for degrees in (2.0, 5.0, 10.0, 20.0):
        poses = Rotation.from_rotvec(np.radians(degrees) * directions) * orientation
        least = float(exo.singularity(poses).amplification.min())
        if np.isfinite(least):
            lines.append(f"  {degrees:4.0f}° away  {least:7.1f} N")
    return "\n".join([*lines, _GRAPH]) if len(lines) > 1 else ""


def _axes() -> FloatArray:
    """The 26 directions to the corners, edges and faces of a cube, unit vectors."""
    grid = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) != (0, 0, 0)])
    return np.asarray(grid / np.linalg.norm(grid, axis=1, keepdims=True))


def moving_mass(exo: ShoulderExo) -> str:
    """Masses of the arm and of the moving part of the device, in words."""
    arm = exo.mechanism.require_arm("weight")
    own = arm.person
    if own is None:
        return f"moving part of the device {arm.mass:.3g} kg, without a person's arm"
    if own.mass == arm.mass:
        return f"arm {arm.mass:.3g} kg, massless device"
    return f"arm {own.mass:.3g} kg, moving part of the device {arm.mass - own.mass:.3g} kg"


def certificates(answers: Sequence[Reaction], bounds: ConstraintBounds) -> str:
    """A sentence on every answer, with intervals under the bounds that were given."""
    lines = []
    for answer in answers:
        text = f"{answer.split}: {answer.certificate.under(bounds)}"
        lines.append(textwrap.fill(text, _WIDTH, subsequent_indent="  "))
    return "\n".join(lines)


def json_report(
    exo: ShoulderExo,
    angles: tuple[float, float, float],
    answers: Sequence[Reaction],
    bounds: ConstraintBounds,
    options: argparse.Namespace,
    contact: JointContact | None,
) -> str:
    """The answers as JSON.

    Parameters
    ----------
    exo : ShoulderExo
        The design.
    angles : tuple of float
        Flexion, abduction and internal rotation, degrees.
    answers : sequence of Reaction
        One for each split.
    bounds : ConstraintBounds
        Of the side forces, for the certificate.
    options : argparse.Namespace
        Options of the command.
    contact : JointContact or None
        The load of the joint with the wearer's own muscles.
    """
    names = ("flexion_deg", "abduction_deg", "internal_rotation_deg")
    head: dict[str, Any] = {"mechanism": exo.name, "side": exo.side, "pose": dict(zip(names, angles, strict=True))}
    if options.offset is not None:
        head["centre_offset_mm"] = list(options.offset)
    body = {answer.split: json.loads(answer.to_json()) for answer in answers}
    if options.certificate:
        for answer in answers:
            body[answer.split]["certificate"] = f"{answer.certificate.statement} {answer.certificate.under(bounds)}"
    if contact is not None:
        body["with_muscles"] = json.loads(contact.to_json())
    return json.dumps({**head, **body}, indent=2)


def _filled(text: str) -> str:
    return textwrap.fill(text, _WIDTH)
