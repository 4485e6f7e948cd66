"""From a device and a person to the record of a report: each question is asked once, of the rooms that answer it."""

from __future__ import annotations

import hashlib
import io
import re
from collections.abc import Mapping
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.errors import MissingExtra
from ..core.errors.checked import checked
from ..core.optional_packages import require_extra
from ..core.validation import FloatArray, as_positive, require_method
from ..design import Wearer
from ..load_case.ranges_of_motion import ADL_BOX, DAILY_RANGES, RangeOfMotion
from ..person import Person
from ..reaction import Reaction
from ..reaction.constraints.actuator_limits import length_limits
from ..study.detailed_figures import change_of_rigid, change_on_cuff
from ..workspace import Workspace, limb_loss
from .content import worst
from .hazards import SOURCE, hazards_of
from .record import DesignReport, DriveNeed, PersonFit, Posture, Task

if TYPE_CHECKING:
    from ..exo.shoulder_exo import ShoulderExo

#: The three postures of the picture: name, and flexion and abduction, degrees.
_POSTURES = (("arm hanging", 0.0, 0.0), ("arm forward, 60°", 60.0, 0.0), ("arm to the side, 80°", 0.0, 80.0))
#: Largest steps of the grids over the daily range and over the range of each task, degrees; angles a side of a task.
_STEP, _ANGLES = 30.0, 3
#: Share of a drive's rate that 99 % of the poses exceed.
_WORST = 0.01
#: A small and a large person: 5th and 95th percentiles of ANSUR II, women and men.
_SIZES = (("small woman", 1.525, 51.0, "female"), ("large man", 1.87, 111.0, "male"))
_UNKNOWN = float("nan")
_ENDS = [f"{low:.0f} to {high:.0f}°" for low, high in ADL_BOX.intervals]
_DAILY = (
    f"Grid over flexion {_ENDS[0]}, abduction {_ENDS[1]}, internal rotation {_ENDS[2]}: Table 2-1 of Tang's thesis."
)


@checked
def design_report(
    exo: ShoulderExo,
    person: Person | Wearer | None = None,
    arm_speed: float = 30.0,
    file: str | PathLike[str] | None = None,
) -> DesignReport:
    """Report on a device: what it does for a person over the range of daily life, and what was not checked.

    Parameters
    ----------
    exo : ShoulderExo
        The device, with an arm.
    person : Person or Wearer, optional
        Who wears it; who wears the design if left out.
    arm_speed : float
        Speed of the arm for which speed and power of the drives are given, degrees/s.
    file : path-like, optional
        The design's file, whose hash then stands in the report.

    Returns
    -------
    DesignReport

    Raises
    ------
    MissingData
        If the device has no arm, and there is no person.
    MissingExtra
        If the extra ``plot`` is not installed. Without the extra ``person`` the force in the joint is not known.
    """
    require_method("exo", exo, "reaction", "a ShoulderExo")
    speed = np.radians(as_positive("arm_speed", arm_speed))
    require_extra("plot")
    wearer = exo.device.require_arm("a report").wearer if person is None else person
    worn = exo if wearer is None else exo.worn_by(wearer)
    asked = _Asked(worn, _muscled(wearer, worn.side))
    box = _flat(ADL_BOX.poses(_STEP, worn.side))
    answer, found = asked.reaction(box), _workspace(worn)
    rigid = change_of_rigid(worn, box)
    counted, over = _counted(answer, asked.supports)
    has_twins = worn.device.accelerate("rates") is not None
    seen = worn.accuracy(box, twins=has_twins)
    rates = seen.mm_per_degree[np.isfinite(seen.rate)]
    own, pressure = worn.device.require_arm("a report"), answer.cuff_pressure
    is_clear_known = "clearance" not in found.not_checked
    text = None if file is None else Path(file)
    report = DesignReport(
        design=worn.name,
        title=worn.device.title or worn.name,
        summary=worn.device.summary,
        side=worn.side,
        design_hash=worn.device.hash,
        file="" if text is None else text.name,
        file_hash="" if text is None else hashlib.sha256(text.read_bytes()).hexdigest(),
        person="" if own.wearer is None else _person_words(own.wearer),
        height_m=_UNKNOWN if own.wearer is None else own.wearer.height,
        mass_kg=_UNKNOWN if own.wearer is None else own.wearer.mass,
        has_muscles=asked.person is not None,
        arm_speed_deg_s=float(arm_speed),
        postures=_postures(asked),
        tasks=tuple(_task(asked, each) for each in DAILY_RANGES),
        poses=len(box),
        daily_range=_DAILY,
        held_percent=_UNKNOWN if asked.supports else 100.0 * float(answer.held.mean()),
        inside_percent=100.0 * found.index,
        criteria_percent={name: 100.0 * share for name, share in found.fractions.items()},
        drives=_drives(worn, box, answer, found, counted, speed),
        drives_over=over,
        device_on_arm_kg=_UNKNOWN if own.person is None else max(float(own.mass - own.person.mass), 0.0),
        device_links_kg=_UNKNOWN if worn.device.limbs_are_massless else float(worn.device.links_mass),
        weakest_rate=float(np.quantile(rates, _WORST)) if rates.size and not asked.supports else _UNKNOWN,
        weakest_rate_unit=seen.unit,
        twins_percent=100.0 * float(np.mean(seen.has_twin)) if has_twins else _UNKNOWN,
        clear_mm=-1e3 * worst(-found.gaps.reshape(-1, 3)[counted]) if is_clear_known else _UNKNOWN,
        cuff_pull_N=worst(np.abs(answer.cuff_pull[counted])) if answer.is_worn else _UNKNOWN,
        cuff_pressure_kPa=_UNKNOWN if pressure is None else 1e-3 * worst(np.asarray(pressure)[counted]),
        off_by_10_mm_N=rigid,
        off_on_cuff_N=_UNKNOWN if np.isfinite(rigid) else change_on_cuff(worn, box),
        fits=tuple(_fit(worn, box, *size) for size in _SIZES) if own.wearer is not None else (),
        assumed=_assumed(worn, answer, asked),
        not_checked=_not_checked(answer, found, asked),
        hazards=(),
        hazard_source=SOURCE,
        picture=_picture(worn),
    )
    return replace(report, hazards=hazards_of(report))


class _Asked:
    """A device on its wearer, the muscles that count, and the limits that hold for its kind."""

    def __init__(self, exo: ShoulderExo, person: Person | None) -> None:
        self.exo, self.person = exo, person
        self.supports = not exo.device.drives
        self.question: Any = {"limits": "none"} if self.supports else {}

    def reaction(self, poses: Rotation) -> Reaction:
        return self.exo.reaction(poses, **self.question)

    def joint(self, poses: Rotation, answer: Reaction) -> tuple[FloatArray, FloatArray, Any]:
        """Contact force with the device and without, shape (k,), N, NaN where it is not known; and the answer."""
        nothing = np.full(len(poses), np.nan)
        if self.person is None:
            return nothing, nothing, None
        contact = self.exo.joint_contact(poses, self.person, answer, outside="mark")
        bare = contact.without_device
        assert bare is not None
        known = answer.held | self.supports
        return (
            np.where(contact.has_result & known, contact.magnitude, np.nan),
            np.where(bare.has_result, bare.magnitude, np.nan),
            contact,
        )


def _muscled(wearer: Person | Wearer | None, side: str) -> Person | None:
    """The wearer with muscles, where the extra ``person`` is installed."""
    if wearer is None:
        return None
    try:
        require_extra("person")
    except MissingExtra:
        return None
    return Person.of_wearer(wearer).on_side(side)


def _person_words(wearer: Wearer) -> str:
    words = [f"{'man' if wearer.sex == 'male' else 'woman'} of {wearer.height:.4g} m", f"{wearer.mass:.3g} kg"]
    bend = round(float(np.degrees(wearer.elbow_flexion)))
    words += [f"elbow bent by {bend}°" if bend else "elbow straight"]
    words += [f"{wearer.payload:.3g} kg in the hand"] if wearer.payload else []
    words += [f"upper arm of {1e3 * wearer.arm_girth:.3g} mm girth"] if wearer.arm_girth else []
    words += [f"{1e3 * wearer.clothing:.3g} mm of clothing"] if wearer.clothing else []
    strength = getattr(wearer, "strength", 1.0)
    return ", ".join([*words, f"muscles of {100.0 * strength:.3g} % strength"] if strength != 1.0 else words)


def _flat(poses: Rotation) -> Rotation:
    return Rotation.from_quat(poses.as_quat().reshape(-1, 4))


def _median(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else _UNKNOWN


def _three(exo: ShoulderExo) -> Rotation:
    """The three postures of the picture."""
    _, flexion, abduction = zip(*_POSTURES, strict=True)
    return exo.pose(np.array(flexion), np.array(abduction))


def _postures(asked: _Asked) -> tuple[Posture, ...]:
    poses = _three(asked.exo)
    stack = asked.reaction(poses)
    force, bare, contact = asked.joint(poses, stack)
    found = []
    for k, (name, forward, aside) in enumerate(_POSTURES):
        answer = asked.reaction(poses[k])
        push = -answer.shoulder_force
        parts = np.full(3, np.nan) if contact is None else contact.glenoid[k] @ push
        left = asked.exo.device.moment_of_wearer(answer.actuator_forces[None])
        holds = "yes" if answer.can_hold else "not known" if answer.unknown else "no"
        holds = "supports" if asked.supports and answer.has_answer else holds
        reason = "" if holds in ("yes", "supports") else answer.verdict
        found.append(
            Posture(
                name=name,
                flexion_deg=forward,
                abduction_deg=aside,
                internal_rotation_deg=0.0,
                holds=holds,
                reason=reason,
                joint_N=float(force[k]),
                joint_without_N=float(bare[k]),
                push_N=float(np.linalg.norm(push)),
                push_out_N=float(parts[0]),
                push_up_N=float(parts[1]),
                push_forward_N=float(parts[2]),
                left_to_wearer_Nm=float(np.linalg.norm(left)),
            )
        )
    return tuple(found)


def _task(asked: _Asked, task: RangeOfMotion) -> Task:
    axes = [np.linspace(*ends, _ANGLES) for ends in task.intervals]
    poses = asked.exo.pose(*(np.ravel(axis) for axis in np.meshgrid(*axes, indexing="ij")))
    answer = asked.reaction(poses)
    force, bare, _ = asked.joint(poses, answer)
    both = np.isfinite(force) & np.isfinite(bare)
    counted = answer.held | asked.supports
    return Task(
        task.name, task.source, len(poses), _UNKNOWN if asked.supports else 100.0 * float(answer.held.mean()),
        _median(force[both]), worst(force[both]), _median(bare[both]),
        100.0 * _median(1.0 - force[both] / bare[both]), _median(np.asarray(answer.magnitude)[counted]),
    )  # fmt: skip


def _workspace(exo: ShoulderExo) -> Workspace:
    """All criteria that the data allow; of a support without those that ask its drives."""
    poses = ADL_BOX.poses(_STEP, exo.side)
    found = exo.workspace(poses)
    if exo.device.drives:
        return found
    return exo.workspace(poses, [name for name in found.margins if name not in ("forces", "singularity", "connected")])


def _counted(answer: Reaction, supports: bool) -> tuple[Any, str]:
    """Poses over which drives are summed up, and their name."""
    if supports or answer.held.any():
        return answer.held | supports, "held poses"
    # Beside a singular pose forces have no bound.
    clear = np.isfinite(answer.magnitude) & (answer.margin >= 0.05)
    return clear, "poses that are not held: efforts that would be needed"


def _drives(
    exo: ShoulderExo, box: Rotation, answer: Reaction, found: Workspace, counted: Any, speed: float
) -> tuple[DriveNeed, ...]:
    device, count = exo.device, len(exo.device.drives)
    if not count:
        return ()
    effort = np.where(counted[:, None], answer.actuator_forces, np.nan)[:, :count]
    rate = speed * np.linalg.norm(exo.jacobian(box), axis=2)[:, :count]
    limits = answer.source.poses.limits
    upper, lower = (np.broadcast_to(each, answer.actuator_forces.shape) for each in (limits.upper, limits.lower))
    low, high = length_limits(device)
    loss: Mapping[str, Any] = limb_loss(device, found) if found.inside.any() else {}
    drives = []
    for k, (name, unit) in enumerate(device.drive_units[:count]):
        limb, own = device.limbs[k], effort[:, k]
        allowed = np.where(own > 0.0, upper[:, k], -lower[:, k])
        limited = np.isfinite(allowed) & (allowed > 0.0)
        places = found.lengths.reshape(-1, found.lengths.shape[-1])[counted, k]
        actuator, mass = getattr(limb, "actuator", None), getattr(limb, "mass", 0.0)
        drives.append(
            DriveNeed(
                name=name,
                kind="motor" if unit == "N m" else "drive" if actuator is None else actuator.family,
                unit=unit,
                pull=max(worst(own), 0.0),
                push=max(worst(0.0 - own), 0.0),
                limit_pull=worst(upper[counted, k]),
                limit_push=worst(0.0 - lower[counted, k]),
                share_percent=100.0 * worst(np.abs(own[limited]) / allowed[limited]),
                speed=worst(rate[counted, k]),
                power_W=worst(rate[:, k] * np.abs(own)),
                used_from=-worst(-places),
                used_to=worst(places),
                stroke_from=float(low[k]),
                stroke_to=float(high[k]),
                mass_kg=float(mass) if mass else _UNKNOWN,
                held_without_percent=100.0 * float(loss["held"][k]) if loss else _UNKNOWN,
                missing_without_Nm=float(loss["missing_Nm"][k]) if loss else _UNKNOWN,
            )
        )
    return tuple(drives)


def _fit(exo: ShoulderExo, box: Rotation, name: str, height: float, mass: float, sex: str) -> PersonFit:
    """The device on a person of another size, in the posture of its own wearer."""
    own = exo.device.require_arm("a report").wearer
    other = exo.worn_by(Wearer(height, mass, sex, **own.posture))
    held = _UNKNOWN if not other.device.drives else 100.0 * float(other.reaction(box).held.mean())
    return PersonFit(f"{name}, {height:g} m, {mass:g} kg", height, mass, held, 100.0 * _workspace(other).index)


def _assumed(exo: ShoulderExo, answer: Reaction, asked: _Asked) -> tuple[str, ...]:
    split, chosen = answer.source.split.assumed(answer.source.poses.mechanism), answer.criterion
    shared = "Equilibrium alone determines the efforts of the drives."
    if not chosen.startswith("none needed"):
        shared = f"Where several drives can share the load: {chosen}."
    texts = [
        f"Arm at rest; {_plain(split)}.",
        *([] if asked.supports else [_plain(shared)]),
        "Segments of the arm after de Leva 1996.",
    ]
    if asked.person is not None:
        texts.append(
            "Muscles of a healthy shoulder that make the least effort; people keep more tension, so that the relief is "
            "the most that can be. In studies EMG of the shoulder fell by 9 to 64 %."
        )
    if exo.device.estimated:
        texts.append(f"Estimated in the design file: {', '.join(exo.device.estimated)}.")
    return (*texts, *exo.device.doubts)


def _plain(text: str) -> str:
    """A text without brackets, which hold symbols and keys of files."""
    return re.sub(r" ?[(][^()]*[)]", "", text)


def _not_checked(answer: Reaction, found: Workspace, asked: _Asked) -> tuple[str, ...]:
    """What the answers leave out; limits that nobody asked for are no gaps of the check."""
    texts = [_plain(text) for text in answer.cautions if text.startswith("Not ")]
    texts += [
        f"{name.replace('_', ' ').capitalize()}: {_plain(why)}."
        for name, why in found.not_checked.items()
        if not why.startswith(("does not apply", "no limit given", "not chosen"))
    ]
    if asked.person is None:
        texts.append("Force in the joint with the wearer's own muscles: no person, or the extra 'person' is missing.")
    return (
        *texts,
        "Fast movement, impact, falls, friction, wear, heat; software, electrics; skin, pain, donning. Nothing was "
        "measured on a person.",
    )


def _picture(exo: ShoulderExo) -> bytes:
    from ..view.plots import posture_drawing  # here, because few questions draw
    from ..view.plots.plot_style import pyplot

    figure = posture_drawing(exo, _three(exo), [name for name, *_ in _POSTURES])
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=220)
    pyplot().close(figure)
    return stream.getvalue()
