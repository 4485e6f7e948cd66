"""``exo-pin optimise``: search for a design that reaches and holds as many poses as it can."""

from __future__ import annotations

import argparse
import shlex
from dataclasses import replace
from typing import Any

from ...core.errors import InvalidInput, MissingData
from ...design import ACTUATOR_FAMILIES, Actuator, Arm
from ...design.parameters.names import assigned
from ...exo.shoulder_exo import ShoulderExo, load
from ...load_case import CentreOffset
from ...load_case.centre_path import CentrePath
from ...person import Person
from ...workspace import free_joints, optimise, starting_design
from ...workspace.optimisation import OBJECTIVES
from .. import add_count, add_file, add_flag, add_number, add_repeated
from ..options.centre_options import add_moving_centre, centre_offset
from ..options.option_values import numbers, require_ending
from ..options.query_options import add_offset, add_person, design, wearer
from .workspace_command import add_criteria, criteria

__all__ = ["add_commands"]


def add_commands(commands: Any) -> None:
    """Register the commands of this module."""
    parser = commands.add_parser("optimise")
    parser.add_argument(
        "design", nargs="?", metavar="PRESET|FILE", help="design to start from; without one, --limbs of one --family"
    )
    parser.add_argument(
        "--side", choices=("left", "right"), help="side of the body (default: as in the design, else left)"
    )
    add_count(parser, "--limbs", "number of limbs", 4)
    parser.add_argument(
        "--family", choices=ACTUATOR_FAMILIES, default="cable", help="family of the actuators (default cable)"
    )
    add_number(parser, "--pull", "N", "greatest pull of a limb, N (default 400, or as in the design to start from)")
    add_number(parser, "--push", "N", "greatest push of linear actuators, N (default: as --pull)")
    add_number(parser, "--travel", "MM", "greatest travel of a limb, mm (default: that of its family)")
    parser.add_argument(
        "--force-law",
        metavar="NAME",
        help="force law of pneumatic muscles, instead of --pull; names: exo-pin muscle force --help",
    )
    add_number(parser, "--supply", "BAR", "gauge pressure with --force-law, bar", 4.0)
    parser.add_argument(
        "--device", metavar="PRESET|FILE", help="design whose moving part rides on the person's arm, such as prototype"
    )
    add_repeated(
        parser,
        "--vary",
        "NAME=LOW:HIGH",
        "such as r_A_mm=50:180, A[1].radius_mm=120:250, nominal_length[1]_mm=200:500 (default: all joints free)",
    )
    parser.add_argument(
        "--base-radius",
        metavar="LOW:HIGH",
        help="distance of free joints on the torso from the shoulder, mm (default 120:250)",
    )
    parser.add_argument(
        "--arm-radius", metavar="LOW:HIGH", help="distance of free joints on the arm from its axis, mm (default 50:140)"
    )
    parser.add_argument(
        "--drop", metavar="LOW:HIGH", help="how far free joints on the arm are below the shoulder, mm (default 80:280)"
    )
    add_person(parser)
    add_offset(parser)
    add_moving_centre(parser)
    add_flag(
        parser,
        "--fixed-centre",
        "with --moving-centre: every pose counts twice, with the moving centre and with one that stays",
    )
    add_criteria(parser)
    parser.add_argument(
        "--objective",
        action="append",
        choices=tuple(OBJECTIVES),
        help="what to improve; repeat it for a Pareto front (default index)",
    )
    add_count(parser, "--seed", "seed of the random numbers", 0)
    add_count(parser, "--budget", "number of designs to evaluate", 60_000)
    add_count(parser, "--run-length", "number of designs in a run from one start", 12_000)
    add_flag(parser, "--refine", "start from the design itself, with small steps")
    parser.add_argument("--storage", metavar="FILE|URL", help="SQLite file or database in which the study is stored")
    parser.add_argument(
        "--name", default="study", help="name of the study and of the design that is written (default study)"
    )
    add_flag(parser, "--progress", "show a progress bar")
    add_file(parser, "--out", "write the best design as .toml")
    parser.set_defaults(run=_optimise)


def _optimise(options: argparse.Namespace) -> int:
    require_ending("--out", options.out, ".toml")
    exo = _start(options)
    found = optimise(
        exo,
        _variables(options, exo.mechanism.limb_count),
        objectives=options.objective or ("index",),
        constraints=criteria(options, exo.side),
        person=_wearer(options, exo.side),
        centre_offset=_centres(options, exo.side),
        seed=options.seed,
        budget=options.budget,
        run_length=options.run_length,
        refine=options.refine,
        storage=options.storage,
        name=options.name,
        progress=options.progress,
    )
    print(found)
    if options.out is not None:
        source = {"mechanism": f"found by: {_command(options)}"}
        found.best.replace(name=options.name, sources={**found.best.mechanism.sources, **source}).save(options.out)
        print(options.out)
    return 0


def _command(options: argparse.Namespace) -> str:
    """The command that finds the same design again, whatever the storage."""
    words = ["exo-pin optimise", *([options.design] if options.design else [])]
    left_out = {"run", "design", "storage", "name", "progress", "out"}
    if options.design:
        left_out |= {"limbs", "family", "force_law", "supply", "device"}
    elif options.force_law is None:
        left_out.add("supply")
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


def _start(options: argparse.Namespace) -> ShoulderExo:
    """The design to start from."""
    if options.design is not None:
        return _with_limits(design(options), options)
    if options.person is None:
        raise InvalidInput("without a design give --person HEIGHT,MASS,SEX, whose arm the limbs are to hold")
    side = options.side or "left"
    law, pull = options.force_law, 400.0 if options.pull is None else options.pull
    actuator = Actuator(
        options.family,
        None if law else pull,
        (pull if options.push is None else options.push) if options.family == "linear" else None,
        law,
        1e5 * options.supply if law else None,
        travel_limit=None if options.travel is None else 1e-3 * options.travel,
    )
    # The prototype on this person, of which the person's arm is taken.
    worn = design(argparse.Namespace(**{**vars(options), "design": "prototype"})).mechanism.require_arm("a start")
    arm = worn.person
    assert arm is not None
    for part in () if options.device is None else _moving(options.device):
        arm = arm + part
    return ShoulderExo.from_mechanism(starting_design(actuator, arm, options.limbs, side, options.name))


def _with_limits(exo: ShoulderExo, options: argparse.Namespace) -> ShoulderExo:
    """The design with those limits of its actuators that the options give."""
    given = {"pull_limit": options.pull, "push_limit": options.push}
    given["travel_limit"] = None if options.travel is None else 1e-3 * options.travel
    changes = {name: value for name, value in given.items() if value is not None}
    if not changes:
        return exo
    limbs = []
    for number, limb in enumerate(exo.limbs, start=1):
        if limb.actuator is None:
            raise MissingData([f"actuator of limb {number}"], "the limits of the options", exo.name)
        limbs.append(replace(limb, actuator=replace(limb.actuator, **changes)))
    return exo.replace(limbs=limbs)


def _moving(name: str) -> tuple[Arm, ...]:
    """What a device itself moves."""
    arm = load(name).arm
    parts = () if arm is None else tuple(part for part in arm.parts if part.device)
    if not parts:
        raise InvalidInput(f"{name!r} has no moving part; choose another --device")
    return parts


def _wearer(options: argparse.Namespace, side: str) -> Person | None:
    """The person whose contact force is an objective."""
    if "contact_force" not in (options.objective or ()) or options.person is None:
        return None
    return wearer(options, side=side)


def _centres(options: argparse.Namespace, side: str) -> tuple[CentreOffset | CentrePath | None, ...]:
    """Offsets of the device's centre with which designs are judged."""
    if not options.fixed_centre:
        return (centre_offset(options, side),)
    if not options.moving_centre:
        raise InvalidInput("--fixed-centre belongs to --moving-centre; without it the centre is fixed anyway")
    fixed = centre_offset(argparse.Namespace(**{**vars(options), "moving_centre": False}), side)
    return fixed, centre_offset(options, side)


def _variables(options: argparse.Namespace, limb_count: int) -> dict[str, Any]:
    """Bounds by name: of free joints, unless only others are given, and of single variables."""
    given = {"base_radius": options.base_radius, "platform_radius": options.arm_radius, "drop": options.drop}
    bounds = {name: _interval(name, text) for name, text in given.items() if text is not None}
    single = assigned(options.vary)
    return single if single and not bounds else {**free_joints(limb_count, **bounds), **single}


def _interval(name: str, text: str) -> tuple[float, float]:
    """Bounds in m of LOW:HIGH in mm."""
    low, high = numbers(text, f"{name} LOW:HIGH in mm", 2, separator=":")
    return 1e-3 * low, 1e-3 * high
