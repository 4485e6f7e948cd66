"""``exo-pin uncertainty``: what a shoulder force depends on, and the worst offset of the device."""

from __future__ import annotations

import argparse
from typing import Any

from ..design.parameters.names import assigned
from ..reaction.assumptions import Assumptions
from ..reaction.splits.registry import SPLITS
from . import add_outputs, deliver
from .options.option_values import numbers, refuse
from .options.query_options import (
    add_design,
    add_limits,
    add_movement,
    add_offset,
    add_person,
    add_pose,
    caution_offset,
    design,
    limits,
    movement,
    offset,
    pose,
)


def add_commands(commands: Any) -> None:
    """Register the command of this module."""
    parser = commands.add_parser("uncertainty")
    add_design(parser)
    add_pose(parser)
    add_movement(parser)
    add_person(parser)
    add_limits(parser)
    add_offset(parser)
    parser.add_argument(
        "--split",
        choices=tuple(SPLITS),
        default=Assumptions.split,
        help="assumption on the side forces of the limbs (default: %(default)s)",
    )
    parser.add_argument(
        "--uncertain",
        action="append",
        default=[],
        metavar="NAME=SIZE",
        help="how uncertain a quantity is, to both sides, such as offset_mm=20, A[1]_mm=5 or cuff_height_mm=10, 0 for "
        "certain; repeat it for others (default: assumed values)",
    )
    add_outputs(parser, ".csv", ".json", plot="shoulder force with each quantity at its ends")
    parser.set_defaults(run=_uncertainty)


def _uncertainty(options: argparse.Namespace) -> int:
    caution_offset(options)
    exo, motion = design(options), None
    if options.trajectory is None:
        poses = pose(options, exo)
    else:
        refuse(options, "a movement has poses of its own", "flexion", "abduction", "internal_rotation")
        moved = movement(options, exo.side)
        poses, motion = moved.poses, None if options.static else moved.motion
    stated = {name: numbers(text, f"{name}=SIZE", 1)[0] for name, text in assigned(options.uncertain).items()}
    answer = exo.uncertainty(
        poses,
        motion,
        split=options.split,
        centre_offset=offset(options),
        limits=limits(options),
        uncertainties=stated,
    )
    head = f"{exo.mechanism.title or exo.name}\n{exo.side} shoulder, split {options.split}"
    deliver(options, f"{head}\n\n{answer}", json=answer.to_json, columns=answer.columns, figure=answer.plot)
    return 0
