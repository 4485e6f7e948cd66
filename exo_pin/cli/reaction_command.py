"""``exo-pin reaction`` and ``uncertainty``: forces in a pose, over poses on a way, or along a movement."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from ..core.conventions import CLINICAL_ANGLES
from ..core.errors import InvalidInput, MissingExtra, NoisyMovement
from ..core.optional_packages import require_extra
from ..core.results import drawn
from ..core.schema import OnDesign, document
from ..core.tables import aligned, filled, under_verdict
from ..core.validation import FloatArray, as_choice
from ..design import DEFAULT_PRESET
from ..design.parameters.names import assigned
from ..exo.pose_report import PoseReport, moving_mass, report_on_pose, with_muscles
from ..exo.shoulder_exo import ShoulderExo
from ..person.contact.result import JointContact
from ..reaction import SPLITS, ConstraintBounds, Reaction, posture_range, reaction_table
from ..reaction.assumptions import Assumptions, comparable_splits
from . import options
from .command import Files, writes
from .options.recording_options import RecordedMotion


@dataclass(frozen=True)
class PoseDocument(OnDesign):
    """Forces in a pose, a member a split, with what stands beside them.

    Attributes
    ----------
    pose : dict of str to float
        Clinical angles as they were asked for, degrees.
    centre_offset_mm : list of float
        How far the device's centre is off the shoulder's, mm.
    spherical, minimal, elastic, elastic_locked, standalone : Reaction
        The answer under this assumption; absent where it was not asked for.
    report : PoseReport
        What the first answer says besides.
    with_muscles : JointContact
        The load of the joint with the wearer's own muscles.
    """

    pose: dict[str, float]
    report: PoseReport
    centre_offset_mm: list[float] | None = None
    spherical: Reaction | None = None
    minimal: Reaction | None = None
    elastic: Reaction | None = None
    elastic_locked: Reaction | None = None
    standalone: Reaction | None = None
    with_muscles: JointContact | None = None


@writes(".json", ".csv", ".xlsx", ".npz", plot="the pose, the poses of --to, or the movement")
def reaction(
    design: options.Design = DEFAULT_PRESET,
    /,
    *,
    side: options.Side = None,
    pose: options.Pose = options.Pose(),
    way: options.Way = options.Way(),
    worn: options.Worn = options.Worn(),
    offset: options.Offset = None,
    hand_force: options.HandForce = None,
    limits: options.LimitsText = "design",
    recording: RecordedMotion = RecordedMotion(),
    posture: options.Posture = (),
    over_postures: bool = False,
    side_force_limit: Annotated[str | None, options.called("N|actuator")] = None,
    split: options.Split | None = None,
    compare: Annotated[list[str] | None, options.called("SPLIT,...", consume_multiple=(0, 1))] = None,
    require_hold: bool = False,
    explain: bool = False,
    muscles: options.Muscled = None,
    strength: options.Percent | None = None,
    table: bool = False,
    progress: options.Progress = False,
    files: Files = Files(),
) -> int:
    """Compute the force on the shoulder and the forces in the limbs, in one pose of the arm or along a movement.

    Of one pose the answer has ten lines, and one a limb; the first says whether the device can hold it. --explain
    prints all that is known.

    Parameters
    ----------
    over_postures : bool
        Also print the range of |F_s| over all postures of such joints.
    side_force_limit : str, optional
        For --split minimal: greatest side force of a limb, N, or 'actuator': no more than the limb's force.
    compare : list of str, optional
        A table with a column for each of these assumptions (default: all that need no stiffness).
    require_hold : bool
        End with exit status 1 unless the device is known to hold the pose.
    explain : bool
        Print all that is known of the pose: criteria, ranges, what equilibrium leaves undetermined, and sources.
    muscles : bool, optional
        Also print the joint load with the wearer's own muscles, in a single pose (default: with --person, if the extra
        'person' is installed).
    strength : float, optional
        Strength of the wearer's muscles, which then count, percent (default 100; 0 for an arm without muscle force).
    table : bool
        Print all forces of the pose, on limbs, shoulder, cuff and harness, as a table.

    Examples
    --------
    exo-pin reaction four-cables --flexion 60 --abduction 30 --plot forces.png
    exo-pin reaction --person 1.75,75,male --payload 2 --flexion 45
    exo-pin reaction --person 1.75,75,male --flexion 60 --hand-force 0,0,-20
    exo-pin reaction prototype --flexion 45 --explain
    exo-pin reaction examples/device.toml --flexion 60 --compare
    exo-pin reaction four-cables --to 90,0,0 --out forces.csv
    exo-pin reaction four-cables --trajectory examples/lift.csv --out forces.csv --plot forces.png

    Notes
    -----
    columns of --trajectory FILE, a CSV file in any dialect:
      time_s                                              seconds, rising
      and one of
      flexion_deg, abduction_deg, internal_rotation_deg   clinical angles on the design's side (or ..._rad)
      theta_x_deg, theta_y_deg, theta_z_deg               angles of (4-7) in the thesis (or ..._rad)
      plane_of_elevation_deg, elevation_deg, axial_rotation_deg    ISB (or ..._rad)
      qx, qy, qz, qw                                      unit quaternion, arm to base frame
      r11, r12, r13, r21, ..., r33                        matrix, arm to base frame
      such as
      time_s,flexion_deg,abduction_deg,internal_rotation_deg
      0.00,0.0,0.0,0.0
      0.02,0.3,0.0,0.0
    or .mot and .sto of OpenSim, .mvnx, Xsens DOT and Awinda, APDM, .c3d; exo-pin record FILE says what it holds
    """
    exo = worn.load(design, side)
    query = {
        "split": split or Assumptions.split,
        "constraint_bounds": _bounds(side_force_limit),
        "centre_offset": options.metres(offset),
        "load": options.load_on_hand(hand_force, exo),
        "limits": options.limits_of(limits),
        "posture": options.posture_of(posture),
    }
    of_one_pose: dict[str, Any] = {"compare": compare, "muscles": muscles, "table": table, "explain": explain}
    of_one_pose |= {"over_postures": over_postures, "strength": strength}
    if recording:
        options.refuse("for the muscles along a movement use exo-pin person --trajectory", muscles=muscles)
        options.refuse("a movement has poses of its own", **options.given(pose), to=way.to, **of_one_pose)
        answers = [_movement(exo, query, recording, progress, files)]
    elif way.to is not None:
        options.refuse("--to asks for a table of poses", **of_one_pose)
        answers = [_way(exo, query, way.angles(pose), files)]
    else:
        answers = _answers(exo, pose.of(exo), query, compare, split is not None)
        wearer = _wearer(exo, worn, muscles, strength)
        report = report_on_pose(exo, answers[0], wearer, pose.angles, offset)
        parts = [] if compare is None and not table and not explain else [_head(exo, pose, offset)]
        if compare is None and not table:
            parts.append(report.explained() if explain else str(report))
        else:
            parts += [reaction_table(answers), *([] if report.contact is None else [with_muscles(report.contact)])]
        if over_postures:
            options.refuse("--over-postures prints a line", json=files.json)
            parts.append(filled(f"|F_s| {posture_range(exo, answers[0].case, answers[0].assumptions)}."))
        files.deliver(
            "\n\n".join(parts),
            data=lambda: _pose_document(exo, answers, report, pose, offset),
            columns=lambda: _columns(answers, pose.angles),
            notes=lambda: answers[0].notes,
            exo=exo,
            figure=lambda: drawn("angle_maps:overview", exo, answers[0].case.poses, answers[0]),
        )
    # 1 with --require-hold where the device is not known to hold the pose or movement.
    return int(require_hold and not all(answer.can_hold.all() for answer in answers))


def _head(exo: ShoulderExo, pose: options.Pose, offset: options.Offset) -> str:
    """Device, pose, masses and offset."""
    head = [exo.device.title or exo.name, f"{pose.words(exo)}; {moving_mass(exo.device)}"]
    if offset is not None:
        head.append(f"device's centre off the shoulder's by ({', '.join(f'{v:g}' for v in offset)}) mm")
    return "\n".join(head)


def _bounds(limit: str | None) -> ConstraintBounds:
    if limit is None or limit == "actuator":
        return limit
    (newtons,) = options.numbers(limit, '--side-force-limit in N, or "actuator"', 1)
    return (-newtons, newtons)


def _movement(
    exo: ShoulderExo, query: dict[str, Any], recording: RecordedMotion, progress: bool, files: Files
) -> Reaction:
    with warnings.catch_warnings():
        # The answer's cautions say the same.
        warnings.simplefilter("ignore", NoisyMovement)
        answer = exo.follow(recording.movement(exo.side), static=recording.static, progress=progress, **query)
    head = f"{exo.device.title or exo.name}\n{exo.side} shoulder, {len(answer.movement.times)} samples; "
    text = f"{head}{moving_mass(exo.device)}\n\n{answer}"
    files.deliver(text, answer, exo=exo, figure=lambda: answer.plot(side=exo.side))
    return answer.reaction


def _way(exo: ShoulderExo, query: dict[str, Any], angles: Any, files: Files) -> Reaction:
    """Forces in poses on the way from one pose to another."""
    answer = exo.reaction(exo.pose(*angles.T), **query)
    head = f"{exo.device.title or exo.name}\n{exo.side} shoulder, {len(angles)} poses; {moving_mass(exo.device)}"
    parts = [head, under_verdict(answer.verdict, answer.cautions), _way_table(angles, answer)]
    if (answer.has_answer & ~answer.can_hold).any():
        parts.append("In a pose that is not held, the forces are those that the limbs would have to supply.")
    parts += [filled(cuff)] if (cuff := answer.cuff_text()) else []
    most = int(np.ptp(angles, axis=0).argmax())
    along = f"{CLINICAL_ANGLES[most].removesuffix('_deg').replace('_', ' ')}, °"
    files.deliver(
        "\n\n".join([*parts, filled(str(answer.certificate))]),
        answer,
        exo=exo,
        columns=lambda: answer.columns() | dict(zip(CLINICAL_ANGLES, angles.T, strict=True)),
        # A way that goes nowhere is drawn pose by pose.
        figure=lambda: answer.plot(angles[:, most], along) if np.ptp(angles[:, most]) > 0.0 else answer.plot(),
    )
    return answer


def _way_table(angles: FloatArray, answer: Reaction) -> str:
    """Forces in k poses whose clinical angles, degrees, have shape (k, 3)."""
    held = np.where(answer.can_hold, "yes", np.where(answer.unknown, "not known", "no"))
    columns = dict(zip(("flexion, °", "abduction, °", "internal, °"), angles.T, strict=True))
    columns["|F_s|, N"] = answer.magnitude
    if answer.percent_body_weight is not None:
        columns["% of weight"] = answer.percent_body_weight
    names = (f"{name}, {unit}" for name, unit in answer.drive_units)
    columns |= dict(zip(names, answer.actuator_forces.T, strict=True))
    # + 0.0, so that no minus stands before zero.
    cells = [
        [f"{value + 0.0:.1f}" if np.isfinite(value) else "-" for value in np.round(c, 1)] for c in columns.values()
    ]
    return "\n".join(aligned([[*columns, "held"], *zip(*cells, held.tolist(), strict=True)]))


def _wearer(exo: ShoulderExo, worn: options.Worn, muscles: bool | None, strength: float | None) -> Any:
    """The person whose muscles count beside the forces, if they are to be counted."""
    if muscles is False:
        options.refuse("--no-muscles counts none", strength=strength)
    asked = bool(muscles) or strength is not None
    if muscles is False or not (asked or worn.person):
        return None
    own = options.own_wearer(exo)
    if own is None:
        raise InvalidInput(f"--{'muscles' if muscles else 'strength'} needs to know whose: give --person too")
    try:
        require_extra("person")
        return options.with_muscles(own, strength=1.0 if strength is None else strength / 100.0)
    except (InvalidInput, MissingExtra) as error:
        if asked:
            raise
        options.caution(f"the wearer's own muscles are not counted: {error}")
        return None


def _answers(
    exo: ShoulderExo, orientation: Any, query: dict[str, Any], compare: list[str] | None, named: bool
) -> list[Reaction]:
    """One answer a split, in the order given."""
    if compare is not None and named:
        raise InvalidInput("expected either --split or --compare, got both")
    splits = [query["split"]]
    if compare is not None:
        asked = [as_choice("split", name.strip(), SPLITS) for name in ",".join(compare).split(",") if name]
        splits = list(dict.fromkeys(asked)) or comparable_splits(exo.device)
    bounds, bounded = query["constraint_bounds"], [k for k, law in SPLITS.items() if "constraint_bounds" in law.options]
    if bounds is not None and not set(bounded) & set(splits):
        raise InvalidInput(f"--side-force-limit belongs to {', '.join(bounded)}: name it in --split or --compare")
    return [
        exo.reaction(orientation, **query | {"split": split, "constraint_bounds": bounds if split in bounded else None})
        for split in splits
    ]


def _columns(answers: Sequence[Reaction], angles: Sequence[float]) -> dict[str, Any]:
    """A row a split; angles as they were asked for."""
    rows = [answer.columns() | dict(zip(CLINICAL_ANGLES, angles, strict=True)) for answer in answers]
    return {"split": [a.split for a in answers]} | {name: np.array([row[name] for row in rows]) for name in rows[0]}


def _pose_document(
    exo: ShoulderExo, answers: Sequence[Reaction], report: PoseReport, pose: options.Pose, offset: options.Offset
) -> dict[str, Any]:
    """The answers by split, below the pose as it was given."""
    body: dict[str, Any] = {"mechanism": exo.name, "side": exo.side}
    body["pose"] = dict(zip(CLINICAL_ANGLES, pose.angles, strict=True))
    if offset is not None:
        body["centre_offset_mm"] = list(offset)
    body |= {answer.split: answer.as_dict() for answer in answers}
    body["report"] = report.as_dict()
    if report.contact is not None:
        body["with_muscles"] = report.contact.as_dict()
    return document(PoseDocument, body | {"provenance": answers[0].provenance}, "pose")


@writes(".csv", ".xlsx", ".json", plot="shoulder force with each quantity at its ends")
def uncertainty(
    design: options.Design = DEFAULT_PRESET,
    /,
    *,
    side: options.Side = None,
    pose: options.Pose = options.Pose(),
    recording: RecordedMotion = RecordedMotion(),
    worn: options.Worn = options.Worn(),
    limits: options.LimitsText = "design",
    offset: options.Offset = None,
    split: options.Split = str(Assumptions.split),
    uncertain: Annotated[options.Texts, options.called("NAME=SIZE")] = (),
    all: Annotated[int | None, options.called("DRAWS")] = None,
    files: Files = Files(),
) -> None:
    """Change one uncertain quantity of device, fit, pose and masses at a time, and show how the shoulder force changes.

    In a pose or at the peak of a movement. Search the worst offset of the device's centre from the shoulder's.

    Parameters
    ----------
    uncertain : tuple of str
        How uncertain a quantity is, to both sides, such as offset_mm=20, A[1]_mm=5 or cuff_height_mm=10, 0 for certain;
        repeat it for others (default: assumed values).
    all : int
        Change all of them at once, in so many draws, and show what dominates; with --person in the joint, too.

    Examples
    --------
    exo-pin uncertainty four-cables --flexion 60 --abduction 30 --plot uncertainty.png
    exo-pin uncertainty --flexion 60 --abduction 30 --all 200
    exo-pin uncertainty --trajectory examples/lift.csv --uncertain offset_mm=20 --uncertain cuff_height_mm=10

    Notes
    -----
    quantities: offset_mm, pose_deg, A[i]_mm and B[i]_mm (A_mm, B_mm for all), mass_percent, centre_of_mass_mm,
      load_percent, with --split elastic shoulder_stiffness_percent and guides_percent, and dimensions of a design as
      sweep names them
    """
    exo = worn.load(design, side)
    poses, motion = recording.asked(exo, pose)
    stated = {name: options.numbers(text, f"{name}=SIZE", 1)[0] for name, text in assigned(uncertain).items()}
    query: dict[str, Any] = {
        "split": split,
        "centre_offset": options.metres(offset),
        "limits": options.limits_of(limits),
    }
    answer: Any
    if all is None:
        answer = exo.uncertainty(poses, motion, **query, uncertainties=stated)
    else:
        if recording or offset is not None:
            options.refuse("--all is of a pose", trajectory=recording.trajectory, offset=offset)
        person = worn.muscles(side=exo.side) if worn.person else None
        del query["centre_offset"]
        answer = exo.total_uncertainty(poses, person, **query, uncertainties=stated, draws=all, progress=not files.json)
    head = f"{exo.device.title or exo.name}\n{exo.side} shoulder, split {split}"
    files.deliver(f"{head}\n\n{answer}", answer, exo=exo)
