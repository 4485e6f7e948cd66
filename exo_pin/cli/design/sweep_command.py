"""``exo-pin sweep`` and ``exo-pin compare``: designs over the same poses, as a table."""

from __future__ import annotations

import argparse
from typing import Any

from ...design.parameters.names import assigned
from ...exo.shoulder_exo import ShoulderExo, load
from ...reaction.splits.registry import SPLITS
from ...study import StudyTable, adl_box, compare, sweep
from .. import add_flag, add_number, add_outputs, deliver
from ..options.option_values import numbers, refuse
from ..options.query_options import (
    add_design,
    add_limits,
    add_movement,
    add_person,
    add_pose,
    add_way,
    design,
    limits,
    movement,
    pose,
    pose_angles,
    way_angles,
)


def add_commands(commands: Any) -> None:
    """Register the commands of this module."""
    parser = commands.add_parser("sweep")
    add_design(parser)
    parser.add_argument(
        "--vary",
        action="append",
        required=True,
        metavar="NAME=VALUES",
        help="a parameter with its unit, and its values: r_A_mm=100:160:4 (low:high:count), cuff_height_mm=180,220, "
        "A[1].radius_mm=150,180, scale=0.9,1, pull_limit_N=100,200, payload_kg=0,2, lean_forward_deg=0,30 or "
        "limb_kind=UPU,SPS; repeat it for every combination",
    )
    parser.add_argument(
        "--payload-at",
        metavar="X,Y,Z",
        help="needed with payload_kg: where it is held, m, in the arm frame, such as 0,0,-0.6",
    )
    parser.add_argument("--jobs", type=int, default=1, choices=(1, 2), help="number of processes (default 1)")
    add_flag(parser, "--progress", "show a progress bar")
    _add_question(parser)
    parser.set_defaults(run=_sweep)

    both = commands.add_parser("compare")
    add_design(both)
    both.add_argument("other", metavar="OTHER", help="the design to compare it with")
    _add_question(both)
    both.set_defaults(run=_compare)


def _add_question(parser: argparse.ArgumentParser) -> None:
    """Add what designs are asked: poses, wearer, limits and split."""
    add_pose(parser)
    add_way(parser)
    add_movement(parser)
    add_number(
        parser, "--step", "DEG", "without poses: step of the grid over the box of daily activities, degrees", 10.0
    )
    add_person(parser)
    add_limits(parser)
    parser.add_argument("--split", choices=tuple(SPLITS), help="assumption on the side forces (default: spherical)")
    add_outputs(parser, ".csv", ".json", plot="peak of the shoulder force of every design")


def _query(exo: ShoulderExo, options: argparse.Namespace) -> dict[str, Any]:
    """Poses, limits and split."""
    query: dict[str, Any] = {"limits": limits(options)}
    if options.split is not None:
        query["split"] = options.split
    if options.trajectory is not None:
        refuse(options, "a movement has poses of its own", "flexion", "abduction", "internal_rotation", "to")
        moved = movement(options, exo.side)
        return query | {"poses": moved.poses, "motion": None if options.static else moved.motion}
    if options.to is not None:
        return query | {"poses": exo.pose(*way_angles(options).T)}
    return query | {"poses": pose(options, exo) if any(pose_angles(options)) else adl_box(options.step, exo.side)}


def _sweep(options: argparse.Namespace) -> int:
    exo = design(options)
    place = None if options.payload_at is None else numbers(options.payload_at, "numbers for --payload-at")
    table = sweep(
        exo,
        assigned(options.vary),
        jobs=options.jobs,
        progress=options.progress,
        payload_at=place,
        **_query(exo, options),
    )
    return _print(table, options)


def _compare(options: argparse.Namespace) -> int:
    first = design(options)
    second = load(options.other, side=first.side)
    if options.person is not None:
        second = design(argparse.Namespace(**{**vars(options), "design": options.other, "side": first.side}))
    return _print(compare(first, second, **_query(first, options)), options)


def _print(table: StudyTable, options: argparse.Namespace) -> int:
    deliver(options, table, json=table.to_json, columns=lambda: table, figure=table.plot)
    return 0
