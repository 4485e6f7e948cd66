"""``exo-pin presets`` and ``check``: list, print and check designs."""

from __future__ import annotations

import argparse
from typing import Any

from ...design import preset, preset_file, presets
from ..options.query_options import add_design, design

__all__ = ["add_commands"]


def add_commands(commands: Any) -> None:
    """Register the commands of this module."""
    listing = commands.add_parser("presets")
    listing.add_argument("name", nargs="?", metavar="NAME", help="print the file of this design, to begin one's own")
    listing.set_defaults(run=_presets)

    check = commands.add_parser("check")
    add_design(check)
    check.set_defaults(run=_check)


def _presets(options: argparse.Namespace) -> int:
    if options.name is not None:
        print(preset_file(options.name), end="")
        return 0
    width = max(len(name) for name in presets())
    for name in presets():
        print(f"{name:{width}}  {preset(name).title}")
    return 0


def _check(options: argparse.Namespace) -> int:
    report = design(options).check()
    print(report)
    return 0 if report.passed else 1
