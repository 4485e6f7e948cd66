"""``exo-pin workspace``, ``tasks`` and ``optimise``: which poses a design reaches and holds, and a search for more."""

from __future__ import annotations

import argparse
import json
import shlex
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import InvalidInput
from ...core.results import plain
from ...design import DEFAULT_PRESET, Arm, Wearer
from ...design.parameters.names import assigned
from ...exo.loading import load
from ...exo.shoulder_exo import ShoulderExo
from ...load_case import CentreOffset, CentrePath
from ...load_case.ranges_of_motion import DAILY_RANGES
from ...person import Person
from ...reaction import GlenoidCone
from ...workspace import Criteria, limb_loss, limb_sheet, limb_table, optimise, starting_design, task_reach
from ...workspace.limb_table import limb_loss_words
from ...workspace.optimisation.starting_designs import joints_and_variables, starting_actuator
from .. import deliver
from ..options.query_options import (
    centre_offset,
    design,
    numbers,
    own_wearer,
    person_numbers,
    person_size,
    posture,
    refuse,
    wearer,
    with_muscles,
)


def criteria(options: argparse.Namespace, exo: ShoulderExo) -> Criteria:
    """The criteria that the options name; they hold for who wears the design, and for all of ``--fits``."""
    names = None if options.criteria is None else tuple(name.strip() for name in options.criteria.split(","))
    others = [Wearer(*person_numbers(text)) for text in options.fits]
    own = own_wearer(exo)
    bend = options.elbow_range and np.radians(numbers(options.elbow_range, "--elbow-range LOW,HIGH in degrees", 2))
    return Criteria(
        names=names,
        least_margin=options.least_margin,
        stroke_rule=options.stroke_rule,
        least_tension=options.least_tension,
        least_moment=options.least_moment,
        largest_shoulder_force=options.shoulder_force,
        largest_pull_out=options.pull_out,
        socket=None if options.pull_out is None else _socket(options, exo),
        largest_cuff_pull=options.cuff_pull,
        largest_cuff_slip=None if options.cuff_slip is None else 1e-3 * options.cuff_slip,
        least_above_elbow=None if options.above_elbow is None else 1e-3 * options.above_elbow,
        least_moment_without_limb=options.without_limb,
        least_gap=1e-3 * options.gap,
        wearers=(*([own] if others and own is not None else []), *others),
        elbow_range=None if bend is None else (bend[0], bend[1]),
    )


def _socket(options: argparse.Namespace, exo: ShoulderExo) -> GlenoidCone:
    """The socket of who wears the design."""
    own = own_wearer(exo)
    if own is None:
        raise InvalidInput("--pull-out needs to know whose socket it is: give --person too")
    return with_muscles(own).glenoid_cone()


def run_workspace(options: argparse.Namespace) -> int:
    """Answer ``exo-pin workspace`` and return its exit status."""
    exo = design(options)
    offset = centre_offset(options, exo)
    found = exo.workspace(options.step, criteria(options, exo), centre_offset=offset, posture=posture(options))
    parts = [str(found), *([str(found.one_by_one())] if options.one_by_one else [])]
    if options.limb_table:
        refuse(options, "--limb-table prints a table", "json")
        parts.append(limb_sheet(exo.device, limb_table(exo.device, found)))
    if options.limb_loss:
        refuse(options, "--limb-loss prints a table", "json")
        left = limb_loss(exo.device, found)
        parts += [str(left), limb_loss_words(left)]

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
    table = task_reach(exo.device, movements, ranges, criteria(options, exo), options.step)
    deliver(options, table, json=table.to_json, columns=lambda: table)
    return 0


#: In place of a design whose moving part rides on the arm: the cuff that each design's own joints ask for.
_BY_GEOMETRY = "geometry"


def run_optimise(options: argparse.Namespace) -> int:
    """Answer ``exo-pin optimise`` and return its exit status."""
    exo = _start(options)
    found = optimise(
        exo,
        _variables(options, exo),
        objectives=options.objective or ("index",),
        constraints=criteria(options, exo),
        person=_wearer(options, exo.side),
        centre_offset=_centres(options, exo),
        seed=options.seed,
        budget=options.budget,
        run_length=options.run_length,
        cuff_by_geometry=options.device == _BY_GEOMETRY,
        refine=options.refine,
        step=options.step,
        finer_step=0.5 * options.step,
        storage=options.storage,
        name=options.name,
        progress=options.progress,
    )
    source = {"mechanism": f"found by: {_command(options)}"}

    def save(path: Path) -> None:
        # The best first; of several objectives the whole front, numbered in the order in which it is printed.
        others = found.front if len(found.front) > 1 else ()
        for number, candidate in enumerate((found.best_candidate, *others)):
            design, where = candidate.design, path if not number else path.with_stem(f"{path.stem}-{number}")
            design.replace(name=options.name, sources={**design.device.sources, **source}).save(where)

    deliver(options, found, json=found.to_json, save=save, figure=found.plot)
    return 0


def _command(options: argparse.Namespace) -> str:
    """The command that finds the same design again, whatever the storage."""
    new = _is_new(options)
    words = ["exo-pin optimise", *([] if new else [options.design or DEFAULT_PRESET])]
    left_out = {"run", "design", "storage", "name", "progress", "out", "json", "endings", "extras"}
    for name, value in vars(options).items():
        if name in left_out or value in (None, False, [], 0.0):
            continue
        if value is True:
            words.append(f"--{name.replace('_', '-')}")
            continue
        if name == "offset":
            words += ["--offset", *(f"{each:g}" for each in value)]
            continue
        for each in value if isinstance(value, list) else [value]:
            words += [f"--{name.replace('_', '-')}", shlex.quote(f"{each:g}" if isinstance(each, float) else str(each))]
    return " ".join(words)


def _is_new(options: argparse.Namespace) -> bool:
    """Whether the search begins with a new design."""
    return options.design is None and any((options.limbs, options.family, options.force_law, options.device))


def _start(options: argparse.Namespace) -> ShoulderExo:
    """The design to start from."""
    if not _is_new(options):
        refuse(options, "a new design has no file", "limbs", "family", "force_law", "device", "supply")
        exo = design(argparse.Namespace(**{**vars(options), "design": options.design or DEFAULT_PRESET}))
        travel = None if options.travel is None else 1e-3 * options.travel
        given = {"pull_limit": options.pull, "push_limit": options.push, "travel_limit": travel}
        limits = {name: value for name, value in given.items() if value is not None}
        return ShoulderExo.from_device(exo.device.with_dimensions(**limits)) if limits else exo
    if options.person is None:
        raise InvalidInput("without a design give --person HEIGHT,MASS,SEX, whose arm the limbs are to hold")
    actuator = starting_actuator(
        options.family or "cable",
        options.pull,
        options.push,
        options.force_law,
        None if options.supply is None else 1e5 * options.supply,
        None if options.travel is None else 1e-3 * options.travel,
    )
    is_known = options.device not in (None, _BY_GEOMETRY)
    side, device = options.side or "left", load(options.device).mechanism if is_known else None
    arm = Arm.of_wearer(person_size(options))
    arm = arm.mirrored() if device is None and side == "right" else arm
    return ShoulderExo.from_mechanism(starting_design(actuator, arm, options.limbs or 4, side, options.name, device))


def _wearer(options: argparse.Namespace, side: str) -> Person | None:
    """The person whose contact force is an objective."""
    if "contact_force" not in (options.objective or ()) or options.person is None:
        return None
    return wearer(options, side=side)


def _centres(options: argparse.Namespace, exo: ShoulderExo) -> tuple[CentreOffset | CentrePath | None, ...]:
    """Offsets of the device's centre with which designs are judged."""
    if not options.fixed_centre:
        return (centre_offset(options, exo),)
    if not options.moving_centre:
        raise InvalidInput("--fixed-centre belongs to --moving-centre; without it the centre is fixed anyway")
    fixed = centre_offset(argparse.Namespace(**{**vars(options), "moving_centre": False}), exo)
    return fixed, centre_offset(options, exo)


def _variables(options: argparse.Namespace, exo: ShoulderExo) -> dict[str, Any]:
    """Bounds by name."""
    given = {"base_radius": options.base_radius, "platform_radius": options.arm_radius, "drop": options.drop}
    bounds = {name: None if text is None else _interval(name, text) for name, text in given.items()}
    return joints_and_variables(exo.device, assigned(options.vary), options.refine, **bounds)


def _interval(name: str, text: str) -> tuple[float, float]:
    """Bounds in m of LOW:HIGH in mm."""
    low, high = numbers(text, f"{name} LOW:HIGH in mm", 2, separator=":")
    return 1e-3 * low, 1e-3 * high
