"""``exo-pin plot``: a picture of the mechanism with its forces."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ..core.errors import InvalidInput
from ..core.files import is_stream, write_figure
from ..view.plots.force_plots import overview, use_file_backend
from .options.query_options import add_design, add_person, add_pose, design, pose

__all__ = ["add_commands"]


def add_commands(commands: Any) -> None:
    """Register the commands of this module."""
    parser = commands.add_parser("plot")
    add_design(parser)
    add_pose(parser)
    add_person(parser)
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("exo-pin.png"),
        metavar="FILE",
        help="picture to write: PNG, SVG or PDF (default exo-pin.png)",
    )
    parser.set_defaults(run=_plot)


def _plot(options: argparse.Namespace) -> int:
    exo = design(options)
    if not options.out.suffix and not is_stream(options.out):
        raise InvalidInput(f"expected --out with an ending such as .png, got {options.out}")
    use_file_backend()
    figure = overview(exo, pose(options, exo))
    write_figure(options.out, figure, dpi=120)
    print(options.out)
    return 0
