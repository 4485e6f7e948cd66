"""``exo-pin person``: the wearer, and the force in the shoulder joint with their own muscles."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.conventions import tilt_torsion_angles, tilt_torsion_rotation
from ...core.errors import InvalidInput
from ...core.files import write_figure
from ...exo.shoulder_exo import ShoulderExo, load
from ...load_case.ranges_of_motion import ADL_BOX
from ...person import ContactOptions, Person
from ...view.plots.contact_plots import contact_over_box, contact_over_elevation
from ...view.plots.force_plots import use_file_backend
from .. import add_file, add_flag, add_number
from ..options.query_options import add_design, add_limits, add_pose, limits, pose, pose_angles, pose_words, wearer
from .literature_table import literature_table

__all__ = ["add_commands"]

#: Elevations of a plot, degrees.
_ELEVATIONS = np.arange(5.0, 121.0, 5.0)


def add_commands(commands: Any) -> None:
    """Register the command, and its older name."""
    for name in ("person", "contact"):
        _add_options(commands.add_parser(name))


def _add_options(parser: argparse.ArgumentParser) -> None:
    add_design(parser)
    add_pose(parser)
    parser.add_argument(
        "--person",
        default="1.75,75,male",
        metavar="HEIGHT,MASS,SEX",
        help="the wearer: height in m, mass in kg, male or female (default 1.75,75,male)",
    )
    add_number(parser, "--strength", "PERCENT", "strength of all muscles, percent", 100.0)
    add_number(parser, "--elbow-flexion", "DEG", "bend of the elbow, 0 to 130 degrees", 0.0)
    add_number(parser, "--payload", "KG", "mass in the hand, kg", 0.0)
    add_flag(parser, "--bare", "without a device")
    add_number(
        parser,
        "--share",
        "PERCENT",
        "of the moments of the arm that the device carries (default 100; 0: it carries only itself)",
    )
    parser.add_argument(
        "--least",
        choices=("effort", "contact"),
        help="choose the limb forces for least muscle effort, or for least contact force (a lower bound)",
    )
    add_limits(parser)
    add_number(
        parser,
        "--side-force-limit",
        "N",
        "side forces of UPU limbs up to this size, chosen with the activations (default: none)",
    )
    add_flag(parser, "--moving-centre", "the device's centre stays where the shoulder's is at rest")
    add_flag(parser, "--cubes", "least sum of cubed instead of squared activations")
    add_flag(parser, "--volumes", "weigh the muscles by their volume")
    add_flag(parser, "--passive", "stretched muscles pull without activation")
    add_flag(parser, "--any-direction", "let the force leave the socket's rim")
    add_flag(parser, "--range", "change the assumptions one at a time")
    add_flag(parser, "--map", "over the box of daily activities instead of a pose")
    add_number(parser, "--step", "DEG", "step of the map's grid, degrees", 20.0)
    add_flag(
        parser, "--literature", "without a device at 10 to 120 degrees, without and with 2 kg, beside published values"
    )
    add_flag(parser, "--progress", "show a progress bar")
    add_flag(parser, "--json", "print JSON instead of a table")
    add_file(parser, "--plot", "contact force over the elevation in the plane of the pose; of a map, over the box")
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    exo = load(options.design, side=options.side)
    person = wearer(options, strength=options.strength / 100.0, side=exo.side)
    if sum((options.map, options.range, options.literature)) > 1:
        raise InvalidInput("--map, --range and --literature do not go together: give one of them")
    if options.literature and (options.json or options.plot is not None):
        raise InvalidInput("--literature prints a table: leave out --json and --plot")
    if options.literature:
        print(f"{person}\n\n{literature_table(person, _assumptions(options))}")
        return 0
    if options.map:
        return _map(exo, person, options)
    orientation = pose(options, exo)
    if options.json and options.range:
        raise InvalidInput("--json and --range do not go together: leave one out")
    subject, query = _question(exo, person, options)
    result = (subject.contact_range if options.range else subject.joint_contact)(orientation, **query)
    if options.json:
        print(result.to_json())
    else:
        print(f"{_device(exo, options)}\n{pose_words(options, exo)}\n\n{result}\n\nPerson\n{person}")
    if options.plot is not None:
        _plot(exo, person, orientation, options)
    return 0


def _assumptions(options: argparse.Namespace) -> ContactOptions:
    return ContactOptions(
        power=3 if options.cubes else 2,
        weights="volume" if options.volumes else "equal",
        passive=options.passive,
        cone=None if options.any_direction else ContactOptions().cone,
    )


def _map(exo: ShoulderExo, person: Person, options: argparse.Namespace) -> int:
    """Over the box of daily activities, as far as the person's range of motion goes."""
    if any(pose_angles(options)):
        raise InvalidInput("a map has poses of its own: give no --flexion, --abduction or --internal-rotation")
    box = ADL_BOX.axes(options.step)
    poses = ADL_BOX.poses(options.step, exo.side)
    subject, query = _question(exo, person, options)
    result = subject.joint_contact(poses, **query, outside="mark", progress=options.progress)
    if options.json:
        print(result.to_json())
    else:
        print(f"{_device(exo, options)}\n{exo.side} shoulder over the {ADL_BOX.name}, {options.step:g}° grid\n")
        print(f"{result}\n\nPerson\n{person}")
    if options.plot is not None:
        use_file_backend()
        figure = contact_over_box(box, result)
        figure.suptitle("No device" if options.bare else exo.name)
        write_figure(options.plot, figure)
        if not options.json:
            print(options.plot)
    return 0


def _question(exo: ShoulderExo, person: Person, options: argparse.Namespace) -> tuple[Any, dict[str, Any]]:
    """The bare person or the design, whichever the options mean, and the arguments besides the poses."""
    query: dict[str, Any] = {"options": _assumptions(options)}
    bounds, sides = limits(options), options.side_force_limit
    if options.bare:
        given = (options.share, options.least, None if bounds == "design" else bounds)
        if options.moving_centre or sides or any(value is not None for value in given):
            raise InvalidInput(
                "--bare is without a device: leave out --share, --least, --limits, --side-force-limit, --moving-centre"
            )
        return person, query
    if options.share is not None and options.least is not None:
        raise InvalidInput("--share gives the limb forces and --least chooses them: give one of the two")
    query["limits"] = bounds
    if options.least is not None:
        query["forces"] = f"least_{options.least}"
    else:
        query["forces"] = (100.0 if options.share is None else options.share) / 100.0
    offset = person.centre_path() if options.moving_centre else None
    return exo, query | {"person": person, "centre_offset": offset, "constraint_bounds": sides}


def _device(exo: ShoulderExo, options: argparse.Namespace) -> str:
    return "No device" if options.bare else exo.mechanism.title or exo.name


def _plot(exo: ShoulderExo, person: Person, orientation: Rotation, options: argparse.Namespace) -> None:
    """Over the elevation in the plane of the pose, outwards for a hanging arm."""
    use_file_backend()
    azimuth, tilt, torsion = tilt_torsion_angles(orientation, exo.side, degrees=True)
    azimuth = 90.0 if tilt < 1.0 else azimuth
    poses = tilt_torsion_rotation(azimuth, _ELEVATIONS, torsion, side=exo.side, degrees=True)
    subject, query = _question(exo, person, options)
    axes = contact_over_elevation(_ELEVATIONS, subject.joint_contact(poses, **query, outside="mark"))
    axes.set_title(f"{'No device' if options.bare else exo.name}: plane of elevation {azimuth:.0f}° from forward")
    write_figure(options.plot, axes.figure)
    if not options.json:
        print(options.plot)
