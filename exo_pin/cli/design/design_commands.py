"""``exo-pin presets`` and ``check``: list and check designs."""

from __future__ import annotations

import argparse
from typing import Any

from ...design import preset, presets
from ..options.query_options import add_design, design

__all__ = ["add_commands"]


def add_commands(commands: Any) -> None:
    """Register the commands of this module."""
    listing = commands.add_parser("presets")
    listing.set_defaults(run=_presets)

    check = commands.add_parser("check")
    add_design(check)
    check.set_defaults(run=_check)


def _presets(_: argparse.Namespace) -> int:
    width = max(len(name) for name in presets())
    for name in presets():
        print(f"{name:{width}}  {preset(name).title}")
    return 0


def _check(options: argparse.Namespace) -> int:
    report = design(options).check()
    print(report)
    return 0 if report.passed else 1
