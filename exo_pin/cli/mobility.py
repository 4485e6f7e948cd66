"""``exo-pin mobility``: freedoms, redundancy and singularity of any robot."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from ..chain import ClosedChain
from ..chain.margins import PARTS_OF_POSE
from ..errors import InvalidInput
from ..validation import FloatArray
from .options import add_design, add_pose, design, pose

__all__ = ["add_commands"]


def add_commands(commands: Any) -> None:
    """Register the commands of this module."""
    parser = commands.add_parser(
        "mobility", help="freedoms, redundant closures, singular kinds and margins of a design or any robot"
    )
    add_design(parser)
    add_pose(parser)
    parser.add_argument("--frame", metavar="NAME", help="the output (default: the arm that the closures file names)")
    parser.add_argument("--part", choices=tuple(PARTS_OF_POSE), help="what of it counts (default: all of its pose)")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="JOINT=VALUE",
        help="hold a hinge (rad) or slide (m) there; may be repeated; for robots from a .urdf",
    )
    parser.set_defaults(run=_mobility)


def _mobility(options: argparse.Namespace) -> int:
    exo = design(options)
    chain = exo.chain
    angles = any((options.flexion, options.abduction, options.internal_rotation))
    q = chain.neutral()
    held = list[str]()
    if chain.roles.limbs and "root_joint" in chain.model.names:
        # The arm hangs on the root: put it into the pose.
        root = chain.configuration_slice("root_joint")
        q[root.stop - 4 : root.stop] = pose(options, exo.side).as_quat()
        held.append("root_joint")
    elif angles:
        raise InvalidInput(f"{exo.name!r} has no arm to put into a pose: --set its joints instead")
    for text in options.set:
        held.append(_set(chain, q, text))
    q = chain.close(q, hold=held)
    answer = chain.mobility(q, frame=options.frame, part=options.part or "pose")
    print(f"{exo.name}\n{answer}")
    beyond = chain.beyond_limits(q)
    if beyond:
        print(f"beyond their limits  {', '.join(beyond)}")
    return 0


def _set(chain: ClosedChain, q: FloatArray, text: str) -> str:
    """Put JOINT=VALUE into q and return the joint's name."""
    joint, _, number = text.partition("=")
    try:
        value = float(number)
    except ValueError:
        raise InvalidInput(f"expected --set JOINT=VALUE with a number, got {text!r}") from None
    part = chain.configuration_slice(joint)
    if not np.isfinite(value):
        raise InvalidInput(f"expected --set with a finite number, got {text!r}")
    if part.stop - part.start == 1:
        q[part] = value
    elif part.stop - part.start == 2:
        q[part] = np.cos(value), np.sin(value)
    else:
        raise InvalidInput(f"expected a hinge or a slide, got {joint!r} with {part.stop - part.start} coordinates")
    return joint
