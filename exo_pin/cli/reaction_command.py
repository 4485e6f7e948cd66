"""``exo-pin reaction``: forces in a pose, over poses on a way, or along a movement."""

from __future__ import annotations

import argparse
import json
import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..core.conventions import CLINICAL_ANGLES
from ..core.errors import InvalidInput, MissingExtra, NoisyMovement
from ..core.optional_packages import require_extra
from ..core.tables import filled, under_verdict
from ..core.validation import as_choice
from ..design import LimbGuide, Shoulder
from ..design.parameters.names import assigned
from ..exo.pose_report import PoseReport, moving_mass, report_on_pose, way_table, with_muscles
from ..exo.shoulder_exo import ShoulderExo
from ..reaction import SPLITS, ConstraintBounds, Reaction, posture_range, reaction_table
from ..reaction.assumptions import Assumptions, comparable_splits
from . import deliver
from .options.query_options import (
    caution,
    design,
    limits,
    movement,
    numbers,
    offset,
    pose,
    pose_angles,
    pose_words,
    posture,
    refuse,
    way_angles,
    wearer,
)

#: Options that are for a single pose.
_OF_ONE_POSE = ("compare", "muscles", "table", "over_postures")


def run_reaction(options: argparse.Namespace) -> int:
    """Answer ``exo-pin reaction`` and return its exit status."""
    exo, bounds = _fitted(design(options), options), _bounds(options.side_force_limit)
    if options.trajectory is not None:
        answers = [_movement(exo, bounds, options)]
    elif options.to is not None:
        answers = [_way(exo, bounds, options)]
    else:
        answers = _pose(exo, bounds, options)
    # 1 with --require-hold where the device is not known to hold the pose or movement.
    return int(options.require_hold and not all(answer.can_hold.all() for answer in answers))


def _fitted(exo: ShoulderExo, options: argparse.Namespace) -> ShoulderExo:
    """The design with the stiffnesses that the options give."""
    if options.shoulder_stiffness is not None:
        own = exo.device.shoulder
        exo = exo.replace(shoulder=Shoulder(own.abduction_centre, own.half_diagonal, options.shoulder_stiffness))
    if options.guide is not None:
        guide = LimbGuide(*options.guide)
        exo = exo.replace(limbs=tuple(replace(limb, guide=guide) for limb in exo.limbs))
    return exo


def _bounds(limit: str | None) -> ConstraintBounds:
    if limit is None or limit == "actuator":
        return limit
    (newtons,) = numbers(limit, '--side-force-limit in N, or "actuator"', 1)
    return (-newtons, newtons)


def _query(bounds: ConstraintBounds, options: argparse.Namespace) -> dict[str, Any]:
    """The question besides the poses, with one split."""
    split = options.split or Assumptions.split
    query: dict[str, Any] = {"split": split, "constraint_bounds": bounds, "centre_offset": offset(options)}
    return query | {"limits": limits(options), "posture": posture(options)}


def _movement(exo: ShoulderExo, bounds: ConstraintBounds, options: argparse.Namespace) -> Reaction:
    refuse(options, "for the muscles along a movement use exo-pin person --trajectory", "muscles")
    refuse(options, "a movement has poses of its own", "flexion", "abduction", "internal_rotation", "to", *_OF_ONE_POSE)
    query = _query(bounds, options)
    with warnings.catch_warnings():
        # The answer's cautions say the same.
        warnings.simplefilter("ignore", NoisyMovement)
        answer = exo.follow(movement(options, exo.side), static=options.static, progress=options.progress, **query)
    head = f"{exo.device.title or exo.name}\n{exo.side} shoulder, {len(answer.movement.times)} samples; "
    deliver(
        options,
        f"{head}{moving_mass(exo.device)}\n\n{answer}",
        json=answer.to_json,
        columns=answer.columns,
        figure=lambda: answer.plot(side=exo.side),
    )
    return answer.reaction


def _way(exo: ShoulderExo, bounds: ConstraintBounds, options: argparse.Namespace) -> Reaction:
    """Forces in poses on the way from one pose to another."""
    refuse(options, "--to asks for a table of poses", *_OF_ONE_POSE)
    angles = way_angles(options)
    answer = exo.reaction(exo.pose(*angles.T), **_query(bounds, options))
    head = f"{exo.device.title or exo.name}\n{exo.side} shoulder, {len(angles)} poses; {moving_mass(exo.device)}"
    parts = [head, under_verdict(answer.verdict, answer.cautions), way_table(angles, answer)]
    if (answer.has_answer & ~answer.can_hold).any():
        parts.append("In a pose that is not held, the forces are those that the limbs would have to supply.")
    parts += [filled(cuff)] if (cuff := answer.cuff_text()) else []
    most = int(np.ptp(angles, axis=0).argmax())
    along = f"{CLINICAL_ANGLES[most].removesuffix('_deg').replace('_', ' ')}, °"
    deliver(
        options,
        "\n\n".join([*parts, filled(str(answer.certificate))]),
        json=answer.to_json,
        columns=lambda: dict(zip(CLINICAL_ANGLES, angles.T, strict=True)) | answer.columns(),
        # A way that goes nowhere is drawn pose by pose.
        figure=lambda: answer.plot(angles[:, most], along) if np.ptp(angles[:, most]) > 0.0 else answer.plot(),
    )
    return answer


def _pose(exo: ShoulderExo, bounds: ConstraintBounds, options: argparse.Namespace) -> list[Reaction]:
    plain = options.json or options.table or options.compare is not None
    orientation = pose(options, exo)
    answers = _answers(exo, orientation, bounds, options)
    report = report_on_pose(exo, answers[0], _wearer(options, plain), options.muscles is True)
    contact = report.contact
    head = [exo.device.title or exo.name, f"{pose_words(options, exo)}; {moving_mass(exo.device)}"]
    if options.offset is not None:
        head.append(f"device's centre off the shoulder's by ({', '.join(f'{v:g}' for v in options.offset)}) mm")
    parts = ["\n".join(head)]
    if options.compare is None and not options.table:
        parts.append(str(report))
    else:
        parts += [reaction_table(answers), *([] if contact is None else [with_muscles(contact)])]
    if options.over_postures:
        refuse(options, "--over-postures prints a line", "json")
        first = answers[0]
        parts.append(filled(f"|F_s| {posture_range(exo, first.case, first.assumptions)}."))
    deliver(
        options,
        "\n\n".join(parts),
        json=lambda: _pose_json(exo, answers, report, options),
        columns=lambda: (
            {"split": [answer.split for answer in answers]}
            | {name: np.array([answer.columns()[name] for answer in answers]) for name in answers[0].columns()}
        ),
        figure=lambda: _overview(exo, answers[0]),
    )
    return answers


def _overview(exo: ShoulderExo, answer: Reaction) -> Any:
    from ..view.plots.angle_maps import overview

    return overview(exo, answer.case.poses, answer)


def _wearer(options: argparse.Namespace, plain: bool) -> Any:
    """The person whose muscles count beside the forces, if they are to be counted."""
    if options.muscles and options.person is None:
        raise InvalidInput("--muscles needs to know whose: give --person too")
    if options.person is None or options.muscles is False or (plain and not options.muscles):
        return None
    try:
        require_extra("person")
        return wearer(options)
    except (InvalidInput, MissingExtra) as error:
        if options.muscles:
            raise
        caution(f"the wearer's own muscles are not counted: {error}")
        return None


def _answers(
    exo: ShoulderExo, orientation: Any, bounds: ConstraintBounds, options: argparse.Namespace
) -> list[Reaction]:
    """One answer a split, in the order given."""
    if options.compare is not None and options.split is not None:
        raise InvalidInput("expected either --split or --compare, got both")
    query = _query(bounds, options)
    splits = [query["split"]]
    if options.compare is not None:
        named = [as_choice("split", name.strip(), SPLITS) for name in options.compare.split(",") if name]
        splits = list(dict.fromkeys(named)) or comparable_splits(exo.device)
    bounded = [name for name, law in SPLITS.items() if "constraint_bounds" in law.options]
    if bounds is not None and not set(bounded) & set(splits):
        raise InvalidInput(f"--side-force-limit belongs to {', '.join(bounded)}: name it in --split or --compare")
    return [
        exo.reaction(orientation, **query | {"split": split, "constraint_bounds": bounds if split in bounded else None})
        for split in splits
    ]


def _pose_json(exo: ShoulderExo, answers: Sequence[Reaction], report: PoseReport, options: argparse.Namespace) -> str:
    """The answers by split, below the pose as it was given."""
    head: dict[str, Any] = {"mechanism": exo.name, "side": exo.side}
    head["pose"] = dict(zip(CLINICAL_ANGLES, pose_angles(options), strict=True))
    if options.offset is not None:
        head["centre_offset_mm"] = list(options.offset)
    body: dict[str, Any] = {answer.split: json.loads(answer.to_json()) for answer in answers}
    body["report"] = json.loads(report.to_json())
    if report.contact is not None:
        body["with_muscles"] = json.loads(report.contact.to_json())
    return json.dumps({**head, **body}, indent=2)


def run_uncertainty(options: argparse.Namespace) -> int:
    """Answer ``exo-pin uncertainty`` and return its exit status."""
    exo, motion = design(options), None
    if options.trajectory is None:
        poses = pose(options, exo)
    else:
        refuse(options, "a movement has poses of its own", "flexion", "abduction", "internal_rotation")
        moved = movement(options, exo.side)
        poses, motion = moved.poses, None if options.static else moved.motion
    stated = {name: numbers(text, f"{name}=SIZE", 1)[0] for name, text in assigned(options.uncertain).items()}
    answer = exo.uncertainty(
        poses, motion, split=options.split, centre_offset=offset(options), limits=limits(options), uncertainties=stated
    )
    head = f"{exo.device.title or exo.name}\n{exo.side} shoulder, split {options.split}"
    deliver(options, f"{head}\n\n{answer}", json=answer.to_json, columns=answer.columns, figure=answer.plot)
    return 0
