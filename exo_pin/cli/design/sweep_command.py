"""``exo-pin sweep``: a design with its parameters varied, as a table."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from ...core.errors import InvalidInput
from ...reaction import SPLITS
from ...study import adl_box, sweep
from .. import add_file, add_flag, add_number
from ..options.option_values import in_si, numbers, require_ending
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
        choices=tuple(SPLITS),
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
    exo, limit = design(options), limits(options)
    query: dict[str, Any] = {"limits": limit}
    if options.split is not None:
        query["split"] = options.split
    varied = [_varied(text) for text in options.vary]
    table = sweep(
        exo,
        {name: values for name, values, _ in varied},
        adl_box(options.step, exo.side),
        jobs=options.jobs,
        progress=options.progress,
        payload_at=None if options.payload_at is None else numbers(options.payload_at, "numbers for --payload-at"),
        **query,
    )
    table = table.in_units({name: typed for name, _, typed in varied if typed is not None and name in table})
    print(table)
    crossing = np.flatnonzero(np.asarray(table["one_side"], dtype=float) < 1.0)
    if crossing.size:
        rows = "every row" if len(crossing) == table.row_count else f"rows {', '.join(str(k + 1) for k in crossing)}"
        print(
            f"\nIn {rows} the poses lie on both sides of the singular surface, where the shoulder force has no "
            "bound.\npeak_F_s_N and least_margin then only measure how near a pose of the grid comes to that surface: "
            "compare\nmedian_F_s_N, p95_F_s_N and holdable instead."
        )
    if options.out is not None:
        table.to_csv(options.out)
        print(options.out)
    return 0


def _varied(text: str) -> tuple[str, Any, tuple[str, float] | None]:
    """Name and SI values of one --vary, and its column in the unit that was typed."""
    name, equals, values = text.partition("=")
    if not equals or not values:
        raise InvalidInput(f"expected --vary NAME=VALUES, got {text!r}")
    if name == "limb_kind":
        return name, values.split(","), None
    bare, factor = in_si(name)
    typed = None if bare == name else (name, factor)
    if values.count(":") == 2:
        low, high, count = numbers(values, "finite numbers for --vary", separator=":", finite=True)
        if count != int(count) or not 1 <= count <= 10_000:
            raise InvalidInput(f"expected LOW:HIGH:COUNT with a whole count up to 10000, got {values!r}")
        return bare, factor * np.linspace(low, high, int(count)), typed
    return bare, factor * np.array(numbers(values, "finite numbers for --vary", finite=True)), typed
