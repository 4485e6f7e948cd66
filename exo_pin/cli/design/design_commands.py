"""``exo-pin presets``, ``check``, ``export``, ``calibrate``, ``sweep`` and ``compare``: designs and their data."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...calibration import calibrate
from ...calibration.calibrate_device import JOINTS
from ...control import read_run
from ...core.errors import InvalidInput
from ...core.files import as_file_stem, write_text
from ...core.progress import processes
from ...core.tables import filled
from ...design import preset, preset_file, presets
from ...design.parameters.names import assigned
from ...exo.loading import load, load_designs
from ...exo.models import EXPORTS
from ...exo.shoulder_exo import ShoulderExo
from ...study import StudyTable, adl_box, compare, sweep
from ...wrist_chain.wrist_urdf import write_published_urdf
from .. import deliver
from ..options.query_options import (
    design,
    limits,
    movement,
    named_numbers,
    numbers,
    person_size,
    pose,
    pose_angles,
    refuse,
    way_angles,
)


def run_presets(options: argparse.Namespace) -> int:
    """Answer ``exo-pin presets`` and return its exit status."""
    if options.name is None:
        refuse(options, "a list of names is not a design", "out")
        width = max(len(name) for name in presets())
        print("\n".join(f"{name:{width}}  {preset(name).title}" for name in presets()))
        return 0
    text = preset_file(options.name)
    deliver(options, text.rstrip("\n"), save=lambda path: write_text(path, text))
    return 0


def run_check(options: argparse.Namespace) -> int:
    """Answer ``exo-pin check`` and return its exit status."""
    report = design(options).check()
    deliver(options, report, json=report.to_json)
    return 0 if report.passed else 1


def run_export(options: argparse.Namespace) -> int:
    """Answer ``exo-pin export`` and return its exit status."""
    if options.folder is not None:
        refuse(options, "--published writes URDF to a folder", "out")
        print("\n".join(map(str, write_published_urdf(options.folder))))
        return 0
    exo = design(options)
    path = options.out or Path(f"{as_file_stem(exo.name)}.urdf")
    written = exo.export(path, options.part)
    said = [EXPORTS[path.suffix.lower()], written.statement]
    print("\n".join([*map(str, written), *(filled(text) for part in said if part for text in part.splitlines())]))
    return int(bool(written.lost))


def run_calibrate(options: argparse.Namespace) -> int:
    """Answer ``exo-pin calibrate`` and return its exit status."""
    if options.design.endswith(".csv"):
        raise InvalidInput(f"expected the design first: exo-pin calibrate DESIGN {options.design}")
    nominal = design(options)
    run = read_run(options.measured, nominal.side)
    if options.length_noise is not None and not options.length_noise > 0.0:
        raise InvalidInput(f"expected --length-noise in mm, above zero, got {options.length_noise:g}")
    if not options.orientation_noise >= 0.0:
        raise InvalidInput(f"expected --orientation-noise in degrees, zero or more, got {options.orientation_noise:g}")
    noise = None if options.length_noise is None else 1e-3 * options.length_noise
    found = calibrate(
        run.poses,
        run.lengths,
        nominal,
        unknowns=[name.strip() for name in options.unknowns.split(",")],
        length_noise=noise,
        orientation_noise=float(np.radians(options.orientation_noise)),
        tolerances=dict(_tolerance(text) for text in options.tolerance),
    )
    beside = [name.replace("_", " ") for name in found.model.unknowns if name not in JOINTS]
    note = f"The design holds the joints. Found besides, and no part of it: {', '.join(beside)}." if beside else ""
    deliver(options, f"{found}\n{note}".rstrip(), save=found.exo.save)
    return 0


def _tolerance(text: str) -> tuple[str, float]:
    """Name and SI value of one --tolerance."""
    name, (value,) = named_numbers(text, "--tolerance NAME=SIZE", 1)
    return name, float(np.radians(value)) if name.endswith("mounting") else 1e-3 * value


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
    return _print(table, options, _as_it_stands(exo, table))


def _as_it_stands(exo: ShoulderExo, table: StudyTable) -> str:
    """The values that the varied dimensions have in the design itself, in their units."""
    found = []
    for name in table:
        try:
            (named,) = exo.device.parameters([name])
            value = exo.device.value_of(named)
        except InvalidInput:
            continue
        if value is not None:
            found.append(f"{named.full_name} {value / named.size:.4g}")
    return f"{exo.name} as it is: {', '.join(found)}" if found else ""


def run_compare(options: argparse.Namespace) -> int:
    """Answer ``exo-pin compare`` and return its exit status."""
    named = [options.design, *options.others]
    designs = [own for name in named for own in _designs(options, name, name is options.design)]
    first, *others = designs
    person = None if options.person is None else person_size(options)
    more = {"person": person, "detailed": options.detailed, "progress": options.progress}
    return _print(compare(first, *others, **_query(first, options), **more), options)


def _designs(options: argparse.Namespace, name: str, is_first: bool) -> Sequence[ShoulderExo]:
    """The design of a name, or those of a table's rows."""
    if name.endswith(".csv"):
        return load_designs(name, options.side)
    return [design(options) if is_first else load(name, side=options.side)]


def _print(table: StudyTable, options: argparse.Namespace, above: str = "") -> int:
    deliver(
        options, f"{above}\n{table}" if above else table, json=table.to_json, columns=lambda: table, figure=table.plot
    )
    return 0
