"""``exo-pin reaction``: forces in a pose, or along a movement."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from typing import Any

from scipy.spatial.transform import Rotation

from ..core.compile_mode import current_mode, mode
from ..core.errors import ExoPinError, InvalidInput
from ..core.validation import as_choice
from ..design import LimbGuide, Shoulder
from ..exo.shoulder_exo import ShoulderExo
from ..reaction import ConstraintBounds, Reaction, Split, reaction_table
from ..reaction.holding.remedy import Remedy
from ..reaction.splits.registry import SPLITS
from . import add_file, add_flag, add_number
from .movement_report import follow
from .options.option_values import numbers
from .options.query_options import (
    add_approach,
    add_design,
    add_limits,
    add_offset,
    add_person,
    add_pose,
    caution_offset,
    design,
    limits,
    offset,
    pose,
    pose_angles,
    pose_words,
    print_approach,
)
from .pose_table import report_way
from .reaction_report import certificates, joint_load, json_report, moving_mass, pose_report, with_muscles

__all__ = ["add_commands"]


def add_commands(commands: Any) -> None:
    """Register the commands of this module."""
    parser = commands.add_parser("reaction")
    add_design(parser)
    add_pose(parser)
    parser.add_argument(
        "--to",
        metavar="F,A,I",
        help="a table of poses, at rest in each, from the given one to these angles: flexion, abduction and internal "
        "rotation, degrees",
    )
    parser.add_argument("--poses", type=int, default=10, metavar="N", help="with --to: number of poses (default 10)")
    add_person(parser)
    parser.add_argument(
        "--side-force-limit",
        metavar="N|actuator",
        help="for --split minimal: greatest side force of a limb, N, or 'actuator': no more than the limb's force",
    )
    _add_splits(parser)
    add_limits(parser)
    add_file(parser, "--trajectory", "CSV file of a movement instead of a pose; its columns are listed below")
    add_file(parser, "--out", "with --trajectory: write all forces over time as .csv or .npz")
    add_flag(parser, "--require-hold", "end with exit status 1 unless the device is known to hold the pose")
    add_approach(parser)
    parser.add_argument(
        "--muscles",
        action=argparse.BooleanOptionalAction,
        help="with --person: the load of the joint with their own muscles too (default: in the report on a pose, where "
        "the extra person is installed; under a second)",
    )
    add_flag(parser, "--table", "print every force, with those of cuff and harness, as a table")
    add_flag(parser, "--static", "with --trajectory: leave velocity and acceleration out")
    parser.add_argument(
        "--smoothing",
        choices=("gcv", "none"),
        default="gcv",
        help="with --trajectory: smooth the samples by generalised cross-validation (gcv, default), or do not (none)",
    )
    add_number(
        parser,
        "--sensor-noise",
        "DEG",
        "with --trajectory: noise of the measured angles about each axis, degrees (default: from the data)",
    )
    parser.add_argument(
        "--ends",
        choices=("free", "rest"),
        default="free",
        help="of a measured movement: rest if the arm is at rest at its first and last sample; default free",
    )
    add_flag(parser, "--progress", "show a progress bar")
    add_flag(parser, "--json", "print JSON instead of text")
    parser.set_defaults(run=_reaction)


def _add_splits(parser: argparse.ArgumentParser) -> None:
    """Add what is assumed: which splits, what stiffness, how well the device fits."""
    parser.add_argument(
        "--split",
        choices=tuple(SPLITS),
        help="assumption on the side forces of the limbs (default: elastic where all stiffnesses are known, minimal "
        "with --side-force-limit, else spherical)",
    )
    parser.add_argument(
        "--compare",
        nargs="?",
        const="",
        metavar="SPLIT,...",
        help=f"a table with a column for each of {', '.join(SPLITS)} (default: all that need no stiffness)",
    )
    add_offset(parser)
    add_number(
        parser,
        "--shoulder-stiffness",
        "N_PER_M",
        "for --split elastic: stiffness of the shoulder in every direction, N/m (default: as the design says)",
    )
    parser.add_argument(
        "--guide",
        nargs=2,
        type=float,
        metavar=("EI", "GJ"),
        help="for --split elastic: bending and torsional rigidity of every limb's guide, N m² (default: as designed)",
    )
    add_flag(parser, "--certificate", "print the assumption behind each number, and what would determine it")


def _reaction(options: argparse.Namespace) -> int:
    if options.to is not None:
        exo, bounds = _fitted(design(options), options), _bounds(options.side_force_limit)
        return _hold_status([report_way(exo, _chosen_split(exo, bounds, options), bounds, options)], options)
    if options.trajectory is not None:
        exo, bounds = _fitted(design(options), options), _bounds(options.side_force_limit)
        movement = follow(exo, _chosen_split(exo, bounds, options), bounds, options)
        return _hold_status([movement.reaction], options)
    if options.out is not None:
        raise InvalidInput("--out belongs to a movement: give --trajectory too")
    if options.json and options.approach is not None:
        raise InvalidInput("--approach prints a table: leave --json out")
    exo, angles = _fitted(design(options), options), pose_angles(options)
    orientation, bounds = pose(options, exo), _bounds(options.side_force_limit)
    caution_offset(options)
    answers = _answers_of(exo, orientation, bounds, options)
    contact = joint_load(exo, orientation, answers[0], options)
    if options.json:
        print(json_report(exo, angles, answers, bounds, options, contact))
        return _hold_status(answers, options)
    print(f"{exo.mechanism.title or exo.name}\n{pose_words(options, exo)}; {moving_mass(exo)}")
    if options.offset is not None:
        print(f"device's centre off the shoulder's by ({', '.join(f'{v:g}' for v in options.offset)}) mm")
    if options.compare is None and not options.table:
        remedy = _remedy(exo, orientation, answers[0], options)
        print(f"\n{pose_report(exo, orientation, answers[0], remedy, contact)}")
    else:
        print(f"\n{reaction_table(answers)}")
        if contact is not None:
            print(f"\n{with_muscles(contact)}")
    if options.certificate:
        print(f"\n{certificates(answers, bounds)}")
    if options.approach is not None:
        print_approach(exo, orientation, options.approach, **_nearby(answers[0], options))
    return _hold_status(answers, options)


def _remedy(exo: ShoulderExo, orientation: Rotation, answer: Reaction, options: argparse.Namespace) -> Remedy | None:
    """What would make the pose possible, where it is not."""
    if answer.held:
        return None
    # One search with rigid limbs is over long before its functions would be compiled.
    quick = current_mode() == "auto" and not SPLITS[answer.split].moves
    with mode("plain") if quick else nullcontext():
        return exo.remedy(orientation, **_nearby(answer, options))


def _nearby(answer: Reaction, options: argparse.Namespace) -> dict[str, Any]:
    """The query for poses near the given one."""
    # A device that gives way has other forces and lengths, and in some poses no equilibrium.
    split = answer.split if SPLITS[answer.split].moves else "spherical"
    return {"split": split, "centre_offset": offset(options), "limits": limits(options)}


def _hold_status(answers: Sequence[Reaction], options: argparse.Namespace) -> int:
    """Exit status of a query: 1 with --require-hold where the device is not known to hold the pose or movement."""
    return int(options.require_hold and not all(answer.can_hold.all() for answer in answers))


def _fitted(exo: ShoulderExo, options: argparse.Namespace) -> ShoulderExo:
    """The design with the stiffnesses that the options give."""
    if options.shoulder_stiffness is not None:
        own = exo.mechanism.shoulder
        exo = exo.replace(shoulder=Shoulder(own.abduction_centre, own.half_diagonal, options.shoulder_stiffness))
    if options.guide is not None:
        guide = LimbGuide(*options.guide)
        exo = exo.replace(limbs=tuple(replace(limb, guide=guide) for limb in exo.limbs))
    return exo


def _answers_of(
    exo: ShoulderExo, orientation: Rotation, bounds: ConstraintBounds, options: argparse.Namespace
) -> list[Reaction]:
    """One answer a split, in the order given."""
    if options.compare is not None and options.split is not None:
        raise InvalidInput("expected either --split or --compare, got both")
    splits = [_chosen_split(exo, bounds, options)] if options.compare is None else _splits(exo, options.compare)
    bounded = _bounded()
    if bounds is not None and not set(bounded) & set(splits):
        raise InvalidInput(f"--side-force-limit belongs to {', '.join(bounded)}: name it in --split or --compare")
    return [
        exo.reaction(
            orientation,
            split=split,
            constraint_bounds=bounds if split in bounded else None,
            centre_offset=offset(options),
            limits=limits(options),
        )
        for split in splits
    ]


def _chosen_split(exo: ShoulderExo, bounds: ConstraintBounds, options: argparse.Namespace) -> str:
    """The split of a query with one column: as given, or the one that fits the limbs."""
    if options.split is not None:
        return str(options.split)
    if bounds is not None:
        return _bounded()[0]
    stiff = exo.mechanism.shoulder.stiffness is not None
    return "elastic" if stiff and _fits(SPLITS["elastic"], exo) else "spherical"


def _bounded() -> list[str]:
    """Splits that take bounds of the side forces."""
    return [name for name, law in SPLITS.items() if "constraint_bounds" in law.options]


def _splits(exo: ShoulderExo, wanted: str) -> list[str]:
    if not wanted:
        return [name for name, law in SPLITS.items() if not law.determines_sides and _fits(law, exo)]
    splits = [as_choice("split", name.strip(), SPLITS) for name in wanted.split(",")]
    return list(dict.fromkeys(splits))


def _fits(law: Split, exo: ShoulderExo) -> bool:
    """Whether a design can be split in this way."""
    try:
        law.check(exo.mechanism)
    except ExoPinError:
        return False
    return True


def _bounds(limit: str | None) -> ConstraintBounds:
    if limit is None or limit == "actuator":
        return limit
    (newtons,) = numbers(limit, '--side-force-limit in N, or "actuator"', 1)
    return (-newtons, newtons)
