"""``exo-pin mobility``: freedoms, redundancy and singularity of any robot."""

from __future__ import annotations

import argparse
from typing import Any

from ..chain.kinematics.margins import PARTS_OF_POSE
from .options.configuration_options import add_configuration, configuration
from .options.query_options import add_design, design

__all__ = ["add_commands"]


def add_commands(commands: Any) -> None:
    """Register the commands of this module."""
    parser = commands.add_parser("mobility")
    add_design(parser)
    add_configuration(parser)
    parser.add_argument(
        "--frame", metavar="NAME", help="body whose motion counts (default: the arm that the closures file names)"
    )
    parser.add_argument(
        "--part", choices=tuple(PARTS_OF_POSE), help="what of its motion counts (default: pose, that is both)"
    )
    parser.set_defaults(run=_mobility)


def _mobility(options: argparse.Namespace) -> int:
    exo = design(options)
    chain, q = exo.chain, configuration(options, exo)
    answer = chain.mobility(q, frame=options.frame, part=options.part or "pose")
    print(f"{exo.name}\n{answer}")
    beyond = chain.beyond_limits(q)
    if beyond:
        print(f"beyond their limits  {', '.join(beyond)}")
    return 0
