"""``exo-pin presets``, ``check`` and ``urdf``: list, check and export designs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ..design import preset, presets
from ..wrist_chain import PARTS, write_published_urdf
from .options.command_list import help_of
from .options.query_options import add_design, design

__all__ = ["add_commands"]


def add_commands(commands: Any) -> None:
    """Register the commands of this module."""
    listing = commands.add_parser("presets", help=help_of("presets"))
    listing.set_defaults(run=_presets)

    check = commands.add_parser("check", help=help_of("check"))
    add_design(check)
    check.set_defaults(run=_check)

    urdf = commands.add_parser("urdf", help=help_of("urdf"))
    add_design(urdf)
    urdf.add_argument("--out", type=Path, default=Path(), metavar="FOLDER", help="folder to write to (default: here)")
    urdf.add_argument("--part", choices=PARTS, default="whole", help="how much of it (default: whole)")
    urdf.add_argument("--published", action="store_true", help="write all published mechanisms, as in urdf/")
    urdf.set_defaults(run=_urdf)


def _presets(_: argparse.Namespace) -> int:
    width = max(len(name) for name in presets())
    for name in presets():
        print(f"{name:{width}}  {preset(name).title}")
    return 0


def _check(options: argparse.Namespace) -> int:
    report = design(options).check()
    print(report)
    return 0 if report.passed else 1


def _urdf(options: argparse.Namespace) -> int:
    if options.published:
        written = write_published_urdf(options.out)
    else:
        path = design(options).to_urdf(options.out, options.part)
        written = [path, path.with_suffix(".closures.toml")]
    for path in written:
        print(path)
    return 0
