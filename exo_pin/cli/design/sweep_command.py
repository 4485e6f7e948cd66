"""``exo-pin sweep`` and ``exo-pin compare``: designs over the same poses, as a table."""

from __future__ import annotations

import argparse
from typing import Any

from ...core.progress import processes
from ...design.parameters.names import assigned
from ...exo.shoulder_exo import ShoulderExo, load
from ...study import StudyTable, adl_box, compare, sweep
from .. import deliver
from ..options.option_values import numbers, refuse
from ..options.query_options import design, limits, movement, pose, pose_angles, way_angles


def _query(exo: ShoulderExo, options: argparse.Namespace) -> dict[str, Any]:
    """Poses, limits and split."""
    query: dict[str, Any] = {"limits": limits(options)}
    if options.split is not None:
        query["split"] = options.split
    if options.trajectory is not None:
        refuse(options, "a movement has poses of its own", "flexion", "abduction", "internal_rotation", "to")
        moved = movement(options, exo.side)
        return query | {"poses": moved.poses, "motion": None if options.static else moved.motion}
    if options.to is not None:
        return query | {"poses": exo.pose(*way_angles(options).T)}
    return query | {"poses": pose(options, exo) if any(pose_angles(options)) else adl_box(options.step, exo.side)}


def run_sweep(options: argparse.Namespace) -> int:
    """Answer ``exo-pin sweep`` and return its exit status."""
    exo = design(options)
    place = None if options.payload_at is None else numbers(options.payload_at, "numbers for --payload-at")
    with processes(options.jobs) as executor:
        table = sweep(
            exo,
            assigned(options.vary),
            executor=executor,
            progress=options.progress,
            payload_at=place,
            **_query(exo, options),
        )
    return _print(table, options)


def run_compare(options: argparse.Namespace) -> int:
    """Answer ``exo-pin compare`` and return its exit status."""
    first = design(options)
    second = load(options.other, side=first.side)
    if options.person is not None:
        second = design(argparse.Namespace(**{**vars(options), "design": options.other, "side": first.side}))
    return _print(compare(first, second, **_query(first, options)), options)


def _print(table: StudyTable, options: argparse.Namespace) -> int:
    deliver(options, table, json=table.to_json, columns=lambda: table, figure=table.plot)
    return 0
