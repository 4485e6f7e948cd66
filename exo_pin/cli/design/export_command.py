"""``exo-pin export``: a design as URDF, MJCF or SDF."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ...core.errors import InvalidInput
from ...exo.shoulder_exo import ShoulderExo
from ...wrist_chain import PARTS, write_published_urdf
from .. import add_flag
from ..options.query_options import add_design, add_person, design

__all__ = ["add_commands"]

#: What each format holds of a closed chain, said after writing.
_NOTES = {
    "urdf": "URDF has no loops: they are in the closures file, which ClosedChain.from_urdf reads. Other programs see "
    "an open tree.",
    "mjcf": "The loops are equality constraints. The keyframe closed is the configuration to start from. Controls are "
    "tensions in N, within what the design's actuators can do: cables and muscles only pull.",
    "sdf": "Every loop is closed by one more joint. All joints read zero at rest.",
}


def add_commands(commands: Any) -> None:
    """Register the commands of this module."""
    parser = commands.add_parser("export")
    add_design(parser)
    add_person(parser)
    parser.add_argument("--format", choices=tuple(_NOTES), default="urdf", help="format of the file (default: urdf)")
    parser.add_argument(
        "--out", type=Path, default=Path(), metavar="FOLDER", help="folder to write to (default: the current one)"
    )
    parser.add_argument(
        "--part",
        choices=PARTS,
        default="whole",
        help="what to write: limbs and shoulder (whole), the limbs alone (wrist), the shoulder alone, or limbs and a "
        "free arm (floating) (default: whole)",
    )
    add_flag(parser, "--published", "write all published designs as URDF instead, as in the folder urdf")
    parser.set_defaults(run=_export)


def _export(options: argparse.Namespace) -> int:
    if options.published:
        if options.format != "urdf":
            raise InvalidInput(f"--published writes URDF, got --format {options.format}")
        for path in write_published_urdf(options.out):
            print(path)
        return 0
    for path in _written(design(options), options):
        print(path)
    print(_NOTES[options.format])
    return 0


def _written(exo: ShoulderExo, options: argparse.Namespace) -> list[Path]:
    """The files that were written."""
    if options.format == "urdf":
        path = exo.to_urdf(options.out, options.part)
        return [path, path.with_suffix(".closures.toml")]
    chain = exo.chain_with_masses(options.part)
    return [chain.to_mjcf(options.out) if options.format == "mjcf" else chain.to_sdf(options.out)]
