"""``exo-pin workspace`` and ``exo-pin tasks``: which poses a design reaches, holds and keeps safe."""

from __future__ import annotations

import argparse
import json
from typing import Any

import numpy as np

from ...core.errors import InvalidInput
from ...core.results import plain
from ...design import Wearer
from ...load_case.ranges_of_motion import DAILY_RANGES
from ...reaction import GlenoidCone
from ...workspace import Criteria, limb_loss, limb_sheet, limb_table, task_reach
from .. import deliver
from ..options.option_values import numbers, refuse
from ..options.query_options import centre_offset, design, person_numbers, person_size, wearer


def criteria(options: argparse.Namespace) -> Criteria:
    """The criteria that the options name."""
    names = None if options.criteria is None else tuple(name.strip() for name in options.criteria.split(","))
    others = [Wearer(*person_numbers(text)) for text in options.fits]
    bend = options.elbow_range and np.radians(numbers(options.elbow_range, "--elbow-range LOW,HIGH in degrees", 2))
    return Criteria(
        names=names,
        independence=options.independence,
        stroke_rule=options.stroke_rule,
        least_tension=options.least_tension,
        least_moment=options.least_moment,
        largest_shoulder_force=options.shoulder_force,
        largest_pull_out=options.pull_out,
        socket=None if options.pull_out is None else _socket(options),
        largest_cuff_pull=options.cuff_pull,
        largest_cuff_slip=None if options.cuff_slip is None else 1e-3 * options.cuff_slip,
        least_moment_without_limb=options.without_limb,
        least_gap=1e-3 * options.gap,
        wearers=(*([] if options.person is None or not others else [person_size(options)]), *others),
        elbow_range=None if bend is None else (bend[0], bend[1]),
    )


def _socket(options: argparse.Namespace) -> GlenoidCone:
    """The socket of ``--person``."""
    if options.person is None:
        raise InvalidInput("--pull-out needs to know whose socket it is: give --person too")
    return wearer(options).glenoid_cone()


def run_workspace(options: argparse.Namespace) -> int:
    """Answer ``exo-pin workspace`` and return its exit status."""
    exo = design(options)
    offset = centre_offset(options, exo.side)
    found = exo.workspace(options.step, criteria(options), centre_offset=offset)
    parts = [str(found), *([str(found.one_by_one())] if options.one_by_one else [])]
    if options.limb_table:
        refuse(options, "--limb-table prints a table", "json")
        parts.append(limb_sheet(exo.mechanism, limb_table(exo.mechanism, found)))
    if options.limb_loss:
        refuse(options, "--limb-loss prints a table", "json")
        parts.append(str(limb_loss(exo.mechanism, found)))

    def figure() -> Any:
        from ...view.plots import rotation_ball, workspace_slices

        return rotation_ball(found) if options.draw == "ball" else workspace_slices(found)

    asked = {"centre_offset_mm": list(options.offset or (0.0, 0.0, 0.0)), "moving_centre": options.moving_centre}
    deliver(
        options,
        "\n\n".join(parts),
        json=lambda: json.dumps(plain(found.summary() | asked), indent=2),
        columns=found.columns,
        figure=figure,
    )
    return 0


def run_tasks(options: argparse.Namespace) -> int:
    """Answer ``exo-pin tasks`` and return its exit status."""
    exo = design(options)
    movements = {}
    for text in options.movement:
        name, equals, path = text.partition("=")
        if not equals or not name or not path:
            raise InvalidInput(f"expected --movement NAME=FILE, got {text!r}")
        movements[name] = path
    ranges = () if options.no_ranges else DAILY_RANGES
    table = task_reach(exo.mechanism, movements, ranges, criteria(options), options.step)
    deliver(options, table, json=table.to_json, columns=lambda: table)
    return 0
