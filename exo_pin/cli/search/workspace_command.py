"""``exo-pin workspace`` and ``exo-pin tasks``: which poses a design reaches, holds and keeps safe."""

from __future__ import annotations

import argparse
import json
from typing import Any

from ...core.errors import InvalidInput
from ...core.results import plain
from ...load_case.ranges_of_motion import DAILY_RANGES
from ...workspace import BodyShape, Criteria, limb_table, task_reach
from .. import add_flag, add_moved, add_number, add_outputs, add_repeated, deliver, needs
from ..options.centre_options import add_moving_centre, centre_offset
from ..options.option_values import refuse
from ..options.query_options import add_design, add_offset, add_person, design


def add_commands(commands: Any) -> None:
    """Register the commands of this module."""
    parser = commands.add_parser("workspace")
    add_design(parser)
    add_person(parser)
    add_offset(parser)
    add_moving_centre(parser)
    add_criteria(parser)
    add_number(parser, "--step", "DEG", "step of the grid of poses, degrees", 4.0)
    add_flag(parser, "--one-by-one", "also what each criterion costs when they are added one by one")
    add_flag(parser, "--limb-table", "also lengths, forces, gaps and joint angles of every limb inside")
    parser.add_argument(
        "--draw", choices=("slices", "ball"), help="what --plot shows: slices (default), or the ball of rotations"
    )
    add_outputs(parser, ".json", ".csv", ".npz", plot="the poses inside and outside")
    add_moved(parser, ball="--draw ball --plot FILE")
    needs(parser, moving_centre="person")
    parser.set_defaults(run=_workspace)

    tasks = commands.add_parser("tasks")
    add_design(tasks)
    add_person(tasks)
    add_criteria(tasks)
    add_repeated(tasks, "--movement", "NAME=FILE", "CSV of a task's movement; may be repeated")
    add_flag(tasks, "--no-ranges", "leave the published ranges out")
    add_number(tasks, "--step", "DEG", "step of the grid over a range, degrees", 8.0)
    add_outputs(tasks, ".csv", ".json")
    tasks.set_defaults(run=_tasks)


def add_criteria(parser: argparse.ArgumentParser) -> None:
    """Add the criteria and their limits."""
    parser.add_argument(
        "--criteria",
        metavar="NAMES",
        help="names of criteria with commas between them (default: all that the data allow)",
    )
    add_number(parser, "--body", "HEIGHT", "stature in m of the body that limbs must keep clear of")
    add_number(parser, "--gap", "MM", "distance that limbs keep from body and arm and from one another, mm", 0.0)
    add_number(parser, "--shoulder-force", "N", "largest shoulder force |F_s|, N (default: no limit)")
    add_number(parser, "--least-tension", "N", "least tension of limbs that only pull, N", 0.0)
    add_number(parser, "--least-moment", "NM", "disturbing moment to hold besides, in any direction, N m", 0.0)
    add_number(parser, "--independence", "X", "least |det X|, dimensionless", 0.05)
    parser.add_argument(
        "--stroke-rule",
        choices=("each", "not all short"),
        default="each",
        help="when lengths put a pose outside: one limb beyond its stroke, or (Appendix C) all limbs too short "
        "(default each)",
    )


def criteria(options: argparse.Namespace, side: str) -> Criteria:
    """The criteria that the options name."""
    names = None if options.criteria is None else tuple(name.strip() for name in options.criteria.split(","))
    return Criteria(
        names=names,
        independence=options.independence,
        stroke_rule=options.stroke_rule,
        least_tension=options.least_tension,
        least_moment=options.least_moment,
        largest_shoulder_force=options.shoulder_force,
        least_gap=1e-3 * options.gap,
        body=None if options.body is None else BodyShape.from_height(options.body, side),
    )


def _workspace(options: argparse.Namespace) -> int:
    exo = design(options)
    offset = centre_offset(options, exo.side)
    found = exo.workspace(options.step, criteria(options, exo.side), centre_offset=offset)
    parts = [str(found), *([str(found.one_by_one())] if options.one_by_one else [])]
    if options.limb_table:
        refuse(options, "--limb-table prints a table", "json")
        parts.append(str(limb_table(exo.mechanism, found)))

    def figure() -> Any:
        from ...view.plots import rotation_ball, workspace_slices

        return rotation_ball(found) if options.draw == "ball" else workspace_slices(found)

    asked = {"centre_offset_mm": list(options.offset or (0.0, 0.0, 0.0)), "moving_centre": options.moving_centre}
    deliver(
        options,
        "\n\n".join(parts),
        json=lambda: json.dumps(plain(found.summary() | asked), indent=2),
        columns=found.columns,
        figure=figure,
    )
    return 0


def _tasks(options: argparse.Namespace) -> int:
    exo = design(options)
    movements = {}
    for text in options.movement:
        name, equals, path = text.partition("=")
        if not equals or not name or not path:
            raise InvalidInput(f"expected --movement NAME=FILE, got {text!r}")
        movements[name] = path
    ranges = () if options.no_ranges else DAILY_RANGES
    table = task_reach(exo.mechanism, movements, ranges, criteria(options, exo.side), options.step)
    deliver(options, table, json=table.to_json, columns=lambda: table)
    return 0
