"""``exo-pin reaction``: forces in a pose."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scipy.spatial.transform import Rotation

from ..core.compile_mode import current_mode, mode
from ..core.errors import InvalidInput
from ..core.files import is_stream, write_figure
from ..exo.shoulder_exo import ShoulderExo
from ..load_case import read_movement
from ..reaction import ConstraintBounds, Reaction, reaction_table
from ..reaction.along_files import write_movement_reaction
from ..reaction.holding.remedy import Remedy
from ..reaction.splits.registry import SPLITS
from ..view.plots.force_plots import overview, use_file_backend
from .options.centre_options import caution_offset, offset_mm
from .options.command_list import help_of
from .options.query_options import (
    add_approach,
    add_design,
    add_limits,
    add_person,
    add_pose,
    design,
    limits,
    person_numbers,
    pose,
    pose_angles,
    print_approach,
)
from .options.split_options import add_splits, answers_of, certificates, chosen_split, fitted
from .reaction_report import pose_report, with_muscles

if TYPE_CHECKING:
    from ..person import JointContact

__all__ = ["add_commands"]


def add_commands(commands: Any) -> None:
    """Register the commands of this module."""
    parser = commands.add_parser("reaction", help=help_of("reaction"))
    add_design(parser)
    add_pose(parser)
    add_person(parser)
    parser.add_argument(
        "--side-force-limit",
        metavar="N|actuator",
        help="for --split minimal: greatest side force of a limb, N, or 'actuator': no more than the limb's force",
    )
    add_splits(parser)
    add_limits(parser)
    parser.add_argument(
        "--trajectory",
        type=Path,
        metavar="FILE",
        help="CSV file of a movement instead of a pose; its columns are listed below",
    )
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help="with --trajectory: write all forces over time as .csv or .npz"
    )
    parser.add_argument(
        "--require-hold", action="store_true", help="end with exit status 1 unless the device is known to hold the pose"
    )
    add_approach(parser)
    parser.add_argument(
        "--muscles",
        action=argparse.BooleanOptionalAction,
        help="with --person: the load of the joint with their own muscles too (default: in the report on a pose, where "
        "the extra person is installed; under a second)",
    )
    parser.add_argument(
        "--table", action="store_true", help="print every force, with those of cuff and harness, as a table"
    )
    parser.add_argument("--static", action="store_true", help="with --trajectory: leave velocity and acceleration out")
    parser.add_argument(
        "--smoothing",
        choices=("gcv", "none"),
        default="gcv",
        help="with --trajectory: smooth the samples by generalised cross-validation (gcv, default), or do not (none)",
    )
    parser.add_argument(
        "--sensor-noise",
        type=float,
        metavar="DEG",
        help="with --trajectory: noise of the measured angles about each axis, degrees (default: from the data)",
    )
    parser.add_argument(
        "--ends",
        choices=("free", "rest"),
        default="free",
        help="of a measured movement: rest if the arm is at rest at its first and last sample; default free",
    )
    parser.add_argument("--progress", action="store_true", help="show a progress bar")
    parser.add_argument("--json", action="store_true", help="print JSON instead of text")
    parser.set_defaults(run=_reaction)

    plot = commands.add_parser("plot", help=help_of("plot"))
    add_design(plot)
    add_pose(plot)
    add_person(plot)
    plot.add_argument(
        "--out",
        type=Path,
        default=Path("exo-pin.png"),
        metavar="FILE",
        help="picture to write: PNG, SVG or PDF (default exo-pin.png)",
    )
    plot.set_defaults(run=_plot)


def _reaction(options: argparse.Namespace) -> int:
    if options.trajectory is not None:
        return _follow(options)
    if options.out is not None:
        raise InvalidInput("--out belongs to a movement: give --trajectory too")
    if options.json and options.approach is not None:
        raise InvalidInput("--approach prints a table: leave --json out")
    exo, angles = fitted(design(options), options), pose_angles(options)
    orientation, bounds = pose(options, exo), _bounds(options.side_force_limit)
    caution_offset(options)
    answers = answers_of(exo, orientation, bounds, options)
    contact = _contact(exo, orientation, answers[0], options)
    if options.json:
        print(_json(exo, angles, answers, bounds, options, contact))
        return _hold_status(answers, options)
    print(
        f"{exo.mechanism.title or exo.name}\n"
        f"{exo.side} shoulder at flexion {angles[0]:g}°, abduction {angles[1]:g}°, internal rotation {angles[2]:g}°; "
        f"{_carried(exo)}"
    )
    if options.offset is not None:
        print(f"device's centre off the shoulder's by ({', '.join(f'{v:g}' for v in offset_mm(options))}) mm")
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


def _contact(
    exo: ShoulderExo, orientation: Rotation, answer: Reaction, options: argparse.Namespace
) -> JointContact | None:
    """The load of the joint with the wearer's own muscles and the limb forces of the answer, if it is to be shown."""
    if options.muscles and options.person is None:
        raise InvalidInput("--muscles needs to know whose: give --person too")
    plain = options.json or options.table or options.compare is not None
    if options.person is None or options.muscles is False or (plain and not options.muscles):
        return None
    from ..person import Person  # here, because few queries need one
    from ..person.limb.myoarm import is_installed

    if not options.muscles and not is_installed():
        return None
    height, mass, sex = person_numbers(options.person)
    bend, load = options.elbow_flexion, options.payload
    try:
        person = Person(height, mass, sex, elbow_flexion=bend, payload=load, degrees=True)
    except InvalidInput:
        if options.muscles:
            raise
        return None
    contact = exo.joint_contact(orientation, person, answer, outside="mark")
    bare = contact.without_device
    return contact if options.muscles or (bare is not None and bare.has_result) else None


def _remedy(exo: ShoulderExo, orientation: Rotation, answer: Reaction, options: argparse.Namespace) -> Remedy | None:
    """What would make the pose possible, where it is not; with given limits the answer itself says what is missing."""
    if (answer.has_answer and not answer.limits.violated) or answer.infeasibility is not None:
        return None
    # One search with rigid limbs is over long before its functions would be compiled.
    quick = current_mode() == "auto" and not SPLITS[answer.split].moves
    with mode("plain") if quick else nullcontext():
        return exo.remedy(orientation, **_nearby(answer, options))


def _nearby(answer: Reaction, options: argparse.Namespace) -> dict[str, Any]:
    """The query for poses near the given one."""
    # A device that gives way has other forces and lengths, and in some poses no equilibrium.
    split = answer.split if SPLITS[answer.split].moves else "spherical"
    offset = None if options.offset is None else [1e-3 * value for value in offset_mm(options)]
    return {"split": split, "centre_offset": offset}


def _hold_status(answers: Sequence[Reaction], options: argparse.Namespace) -> int:
    """Exit status of a query: 1 with --require-hold where the device is not known to hold the pose or movement."""
    return int(options.require_hold and not all(answer.can_hold.all() for answer in answers))


def _follow(options: argparse.Namespace) -> int:
    if any(pose_angles(options)):
        raise InvalidInput("a movement has poses of its own: give no --flexion, --abduction or --internal-rotation")
    if options.approach is not None:
        raise InvalidInput("--approach is for a pose: leave --trajectory out")
    if options.muscles:
        raise InvalidInput("--muscles is for a pose; of a movement: exo.joint_contact(movement.orientations, person)")
    if options.json:
        raise InvalidInput("--json is for a pose; histories go to --out FILE.csv or FILE.npz")
    exo = design(options)
    named = options.out is None or is_stream(options.out) or options.out.suffix.lower() in (".csv", ".npz")
    if not named:
        raise InvalidInput(f"expected --out to end in .csv or .npz, got {options.out}")
    smoothing = None if options.smoothing == "none" else options.smoothing
    known = None if options.sensor_noise is None else math.radians(options.sensor_noise)
    movement = read_movement(options.trajectory, exo.side, smoothing, known, options.ends)
    bounds = _bounds(options.side_force_limit)
    split = chosen_split(exo, bounds, options)
    query = {"static": options.static, "split": split, "constraint_bounds": bounds, "progress": options.progress}
    answer = exo.follow(movement, actuator_bounds=limits(options), **query)
    if limits(options) is None and answer.reaction.has_better_tensions:
        answer = exo.follow(movement, actuator_bounds="design", **query)
    print(f"{exo.mechanism.title or exo.name}\n{exo.side} shoulder, {len(movement.times)} samples; {_carried(exo)}\n")
    print(answer)
    if options.out is not None:
        write_movement_reaction(answer, options.out, exo.side, exo.name)
        print(options.out)
    return _hold_status([answer.reaction], options)


def _plot(options: argparse.Namespace) -> int:
    exo = design(options)
    if not options.out.suffix and not is_stream(options.out):
        raise InvalidInput(f"expected --out with an ending such as .png, got {options.out}")
    use_file_backend()
    figure = overview(exo, pose(options, exo))
    write_figure(options.out, figure, dpi=120)
    print(options.out)
    return 0


def _bounds(limit: str | None) -> ConstraintBounds:
    if limit is None or limit == "actuator":
        return limit
    try:
        newtons = float(limit)
    except ValueError:
        raise InvalidInput(f'expected --side-force-limit in N, or "actuator", got {limit!r}') from None
    return (-newtons, newtons)


def _carried(exo: ShoulderExo) -> str:
    arm = exo.mechanism.require_arm("weight")
    own = arm.person
    if own is None:
        return f"moving part of the device {arm.mass:.3g} kg, without a person's arm"
    if own.mass == arm.mass:
        return f"moving part {arm.mass:.3g} kg"
    return f"arm {own.mass:.3g} kg, moving part of the device {arm.mass - own.mass:.3g} kg"


def _json(
    exo: ShoulderExo,
    angles: tuple[float, float, float],
    answers: Sequence[Reaction],
    bounds: ConstraintBounds,
    options: argparse.Namespace,
    contact: JointContact | None,
) -> str:
    names = ("flexion_deg", "abduction_deg", "internal_rotation_deg")
    head: dict[str, Any] = {"mechanism": exo.name, "side": exo.side, "pose": dict(zip(names, angles, strict=True))}
    if options.offset is not None:
        head["centre_offset_mm"] = list(offset_mm(options))
    body = {answer.split: json.loads(answer.to_json()) for answer in answers}
    if options.certificate:
        for answer in answers:
            body[answer.split]["certificate"] = f"{answer.certificate.statement} {answer.certificate.under(bounds)}"
    if contact is not None:
        body["with_muscles"] = json.loads(contact.to_json())
    return json.dumps({**head, **body}, indent=2)
