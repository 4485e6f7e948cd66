"""``exo-pin sweep``: a design with its parameters varied, as a table."""

from __future__ import annotations

import argparse
from typing import Any

from ...design.parameters.names import assigned
from ...study import adl_box, sweep
from .. import add_file, add_flag, add_number
from ..options.option_values import numbers, require_ending
from ..options.query_options import add_design, add_limits, add_person, design, limits

__all__ = ["add_commands"]


def add_commands(commands: Any) -> None:
    """Register the commands of this module."""
    parser = commands.add_parser("sweep")
    add_design(parser)
    add_person(parser)
    add_limits(parser)
    parser.add_argument(
        "--vary",
        action="append",
        required=True,
        metavar="NAME=VALUES",
        help="a parameter with its unit, and its values: r_A_mm=100:160:4 (low:high:count), alpha_A[2]_deg=50,60,70, "
        "payload_kg=0,2, lean_forward_deg=0,30 or limb_kind=UPU,SPS; repeat it for every combination",
    )
    parser.add_argument(
        "--split",
        choices=("spherical", "minimal", "standalone"),
        help="assumption on the side forces (default: spherical)",
    )
    add_number(parser, "--step", "DEG", "step of the grid of poses, degrees", 10.0)
    parser.add_argument(
        "--payload-at",
        metavar="X,Y,Z",
        help="needed with payload_kg: where it is held, m, in the arm frame, such as 0,0,-0.6",
    )
    parser.add_argument("--jobs", type=int, default=1, choices=(1, 2), help="number of processes (default 1)")
    add_flag(parser, "--progress", "show a progress bar")
    add_file(parser, "--out", "write the table as CSV, too")
    parser.set_defaults(run=_sweep)


def _sweep(options: argparse.Namespace) -> int:
    require_ending("--out", options.out, ".csv")
    exo = design(options)
    query: dict[str, Any] = {} if options.split is None else {"split": options.split}
    table = sweep(
        exo,
        assigned(options.vary),
        adl_box(options.step, exo.side),
        jobs=options.jobs,
        progress=options.progress,
        payload_at=None if options.payload_at is None else numbers(options.payload_at, "numbers for --payload-at"),
        limits=limits(options),
        **query,
    )
    print(table)
    if options.out is not None:
        table.to_csv(options.out)
        print(options.out)
    return 0
